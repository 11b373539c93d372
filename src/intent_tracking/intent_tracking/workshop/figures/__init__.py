"""The tracker's figures: synthetic views, bags, real motions, speed."""
