"""A rendered person who takes things from a table: the demonstrator of films and bags."""
