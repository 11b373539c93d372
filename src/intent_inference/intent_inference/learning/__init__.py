"""Soft-quantised Bayesian networks: quantisation (Sec. II-B), structure and parameters (Sec. IV-B)."""
