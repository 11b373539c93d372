"""Intention and the robot's own table to the object and the grasp that serve it (Sec. IV-D)."""

from pathlib import Path

SHARE = Path(__file__).parent / "share"
"""Folder of the artefacts that this package ships."""
