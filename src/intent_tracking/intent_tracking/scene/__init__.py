"""The scene's model: kinematics of the hand, objects, the state of both, and how they are drawn."""
