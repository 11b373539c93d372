"""What makes the shipped objects and measures the recogniser; no robot runs it."""
