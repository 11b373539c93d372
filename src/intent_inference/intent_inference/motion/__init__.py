"""What the motion after the grasp says: soft-quantised measures, a network task -> phase, a filter."""
