"""Where a hand may be when no track follows one, or when the one that does is in doubt."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.fit.hand_shape import shaped_hand
from intent_tracking.fit.initialisation import HandStart, candidates, region_evidence
from intent_tracking.hands.hand_detection import (
    background_pixels,
    coarse_tile,
    find_hand,
    hand_pixels,
)
from intent_tracking.image.appearance import BACKGROUND, FIRST_OBJECT, color_bins
from intent_tracking.image.tile import Tile, covering_square, cut_tile
from intent_tracking.scene.hand_model import HandModel, Side
from intent_tracking.tracker.problem import Surroundings
from intent_tracking.tracker.scene_track import SceneTrack
from intent_tracking.tracker.tracker_config import TrackerConfig


@dataclass(frozen=True, eq=False)
class Search:
    """What a search for a hand starts from."""

    number: int
    """Of the frame."""
    hands: dict[Side, HandModel]
    """The sides to look for."""
    track: SceneTrack
    """Of the objects, which are no hand."""
    place: Floats | None
    """(3,) where a hand was last, in the camera's frame [m]."""


class HandFinder:
    """Looks for a hand by depth and colour: what moved, looks like skin and hangs together."""

    def __init__(self, config: TrackerConfig, around: Surroundings) -> None:
        self._config = config
        self._take(around)

    def _take(self, around: Surroundings) -> None:
        self._around = around
        self._everything = list(range(len(around.objects.geometries)))

    def join(
        self, around: Surroundings, frame: RgbdFrame, track: SceneTrack, new: Sequence[int]
    ) -> None:
        """Know other objects from now on; what stood still at the beginning still does."""
        self._take(around)
        self._learn_objects(coarse_tile(frame, self._config.detection.size), track, new)

    def begin(self, frame: RgbdFrame, track: SceneTrack) -> None:
        """Take the first frame for what stands still, and learn the objects' colours from it."""
        tile = coarse_tile(frame, self._config.detection.size)
        self._still = tile.depth
        appearance = self._around.appearance
        appearance.blind = not np.any(np.ptp(frame.color[::4, ::4], axis=2) > 4)
        self._learn_objects(tile, track, self._everything)

    def _learn_objects(self, tile: Tile, track: SceneTrack, chosen: Sequence[int]) -> None:
        """Learn the colours of objects at rest."""
        bins = color_bins(tile.color)
        for k in chosen:
            depth = track.drawn([k], track.state, tile)
            agrees = np.abs(tile.depth - depth) < self._config.track.labelling.rest_tolerance
            self._around.appearance.learn(FIRST_OBJECT + k, bins[agrees])

    def learn_background(self, frame: RgbdFrame, track: SceneTrack) -> None:
        """Learn the colours of everything that may be taken for a hand but is none."""
        config = self._config.detection
        tile = coarse_tile(frame, config.size // 2)
        depth = track.drawn(self._everything, track.state, tile)
        other = background_pixels(tile, depth, self._around.table, config)
        self._around.appearance.learn(BACKGROUND, color_bins(tile.color)[other])

    def starts(self, frame: RgbdFrame, search: Search) -> list[HandStart]:
        """Return refined starts of the given sides in a frame, best first."""
        config, around, track = self._config, self._around, search.track
        tile = coarse_tile(frame, config.detection.size)
        depth = track.drawn(self._everything, track.state, tile)
        found: list[HandStart] = []
        hands = {side: shaped_hand(side, hand.shape) for side, hand in search.hands.items()}
        rng = np.random.default_rng([config.seed, search.number])
        moves = around.table is not None and search.number >= config.still_frames
        still = self._furniture(tile, search.place) if moves else None
        for region in find_hand(
            tile, depth, around.table, around.appearance, still, config.detection
        ):
            points = region.points.T.astype(np.float64)
            square = covering_square(frame.camera, points, 30.0, 80.0)
            part = cut_tile(frame, square, config.initialisation.tile_size)
            part_depth = track.drawn(self._everything, track.state, part)
            body, skin = hand_pixels(
                part, part_depth, around.table, around.appearance, config.detection
            )
            evidence, seen = region_evidence(part, body, skin, region, config.initialisation)
            found += candidates(
                evidence, seen, region, hands, config.track.weights, config.initialisation, rng
            )
        return sorted(found, key=lambda candidate: candidate.cost)

    def _furniture(self, tile: Tile, place: Floats | None) -> Floats:
        """Return the first depth (S, S), 0 around a hand that may have been there from then on."""
        if place is None:
            return self._still
        reach = self._config.hand_reach
        near = np.linalg.norm(tile.points - place[:, None, None], axis=0) < reach
        return np.where(near, np.float32(0.0), self._still)
