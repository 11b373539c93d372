"""The two pre-trained networks, and where their files are."""
