"""Soft-quantised Bayesian networks: structure, tables, inference, model (Secs. II, IV-B)."""
