"""What tells how a node is: its inputs and its steps."""
