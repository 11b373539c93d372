"""Soft quantisation of Table I's variables: coordinates, mixtures, evidence (Sec. II-B)."""
