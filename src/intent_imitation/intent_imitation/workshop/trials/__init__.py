"""Random tables, plans carried out in simulated physics, and what they score."""
