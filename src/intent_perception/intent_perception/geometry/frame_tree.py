"""Which frame stands how in which other: fixed transforms, as drivers and robots publish them."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse


class FrameTree:
    """Fixed transforms between named frames."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Array]] = {}

    def add(self, parent: str, child: str, T_parent_child: Array) -> None:
        """Take a transform (4, 4); a later one of the same child replaces it."""
        self._parents[child.lstrip("/")] = parent.lstrip("/"), T_parent_child

    def parent(self, frame: str) -> str | None:
        """Return the frame in which a frame is given, None where it is a root."""
        found = self._parents.get(frame)
        return None if found is None else found[0]

    def between(self, target: str, source: str) -> Array | None:
        """Return T_target_source (4, 4), None where the two are not connected."""
        from_target, from_source = self._chain(target), self._chain(source)
        for frame, T_frame_source in from_source.items():
            if frame in from_target:
                return inverse(from_target[frame]) @ T_frame_source
        return None

    def _chain(self, frame: str) -> dict[str, Array]:
        """Return every frame above one (itself first) and its pose in them."""
        poses = {frame: np.eye(4)}
        while frame in self._parents:
            parent, T_parent_frame = self._parents[frame]
            if parent in poses:  # a ring
                break
            poses[parent] = T_parent_frame @ poses[frame]
            frame = parent
        return poses
