"""RGB-D frame to recognised objects on the table (Sec. III, III-A)."""

from pathlib import Path

SHARE = Path(__file__).parent / "share"
"""Folder of the artefacts that this package ships."""
