"""Shapes of things that no database holds, estimated from what is seen of them (Sec. IV-D)."""
