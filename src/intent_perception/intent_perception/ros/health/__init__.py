"""What tells how a node is: its inputs, its steps, how late it is."""
