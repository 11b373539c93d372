"""The report of a demonstration: what was seen, inferred and planned, as pictures and words."""
