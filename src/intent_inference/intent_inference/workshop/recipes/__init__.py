"""The shipped and generated bags: what each shows, and how it is made from its seed."""
