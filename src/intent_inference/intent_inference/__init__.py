"""Grasp features to the probability of each task (Sec. II, IV-A to IV-C)."""

from pathlib import Path

SHARE = Path(__file__).parent / "share"
"""Folder of the artefacts that this package ships."""
