"""Films of people of all kinds: who, how dressed, in which light, seen from where."""
