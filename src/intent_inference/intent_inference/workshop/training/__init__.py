"""Soft-quantised Bayesian networks: quantisation (Sec. II-B), structure, parameters (IV-B)."""
