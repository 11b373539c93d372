"""What the motion after the grasp says: measures, a network task -> phase, a filter."""
