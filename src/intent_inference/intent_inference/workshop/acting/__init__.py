"""Simulated motions of held objects, of many people, and the network learned from them."""
