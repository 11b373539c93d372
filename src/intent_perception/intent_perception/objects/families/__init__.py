"""Families of shapes: solids from cross-sections, and drafts of vessels and tools made of them."""
