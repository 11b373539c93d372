"""The recogniser's figures: scenes, scores, peers, and the fit of its confidence."""
