"""Hypotheses from oriented point pairs: surfaces, the one hash table, the draw (Sec. III-A)."""
