"""What films people and measures the tracker; no robot runs it."""
