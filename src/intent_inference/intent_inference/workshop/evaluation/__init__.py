"""How good the networks are: splits, scores, baselines and the paper's protocol (Sec. IV-C)."""
