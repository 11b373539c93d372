"""Where the robot's grasps come from: practice on a table, the library, BN^R's data."""
