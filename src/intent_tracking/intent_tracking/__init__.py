"""Frames and objects to the state of hand and objects, and stable grasps (Sec. III-B, Table I)."""

from pathlib import Path

SHARE = Path(__file__).parent / "share"
"""Folder of the artefacts that this package ships."""
