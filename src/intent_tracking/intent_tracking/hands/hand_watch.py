"""The networks' view of the hand that is followed: when they are asked, and which hand it is.

A person has two hands, a bystander others. The one that acts is followed: it has moved from where
it was first seen, or has come in front of what stands still. Until one has, one that arrives while
others rest is looked at, else the one nearest to the objects; but while something else moves, no
hand at rest is the one that acts.
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, ColorImage, RgbdFrame
from intent_tracking.hands.expectation import Expectation
from intent_tracking.hands.hand_place import at_place, beside, distance_of, has_depth, middle_of
from intent_tracking.hands.hand_reader import HandReader, HandReaderConfig, Hints
from intent_tracking.hands.hand_square import square_of_key_points
from intent_tracking.hands.key_point_start import KeyPointConfig, key_evidence
from intent_tracking.hands.moving_arm import ends_of, turns_of, view_of
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.hands.side_odds import SideOdds, Tell
from intent_tracking.image.frame_evidence import NO_KEYS, KeyEvidence
from intent_tracking.image.moving_depth import MovingDepth, MovingThing
from intent_tracking.scene.hand_model import SIDES, Side

MISSED = 2
"""Looks in a row without the followed hand after which it is taken to be elsewhere."""
GONE = 6
"""Looks in a row after which a hand that fits badly is taken to be gone."""
_ACTS = 0.15
"""A hand that has moved this far from its resting place acts [sides of its square, about 25 cm]."""
_COMING = 3
"""First looks at a hand in which it comes if something moves where it is."""
_DRIFT = 0.03
"""Share by which a hand's resting place follows it from look to look: people sway."""
_PATIENCE = 15
"""Looks for which a hidden hand that acts is waited for before another one that acts counts."""
_FIRST_LOOKS = 6
"""A hand that is first seen later than this has come from somewhere: it may be about to act."""
_GLANCE = 6
"""Looks between two at all hands while one acts."""
_MOVES = 0.25
"""A hand acts if something has come nearer at this share of its key points: fingers are thin."""
_ARM_AREA, _BARE_AREA = 0.0008, (0.0015, 0.015)
"""Visible surface of a thing that moves from which it may be an arm with a hand, and within which
it may be a hand alone [m^2]."""
_SECOND = 4
"""Looks between two at a hand in doubt where an arm ends and where the fit is."""
_REGIONS, _ARMS = 3, 3
"""Most places in a frame that are looked at for a missed hand; while none is followed at all, when
there is time: how many things are looked at in all ways."""
_HURRIED = 2
"""Times as many frames lie between looks at a hand on which all agree when newer ones wait."""
_DENIED = 0.09
"""Presence below which what depth alone takes for the lost hand is none."""
_OVERLOOKED = 3
"""Looks in a row at something that moves in which no hand is seen, from which it is overlooked."""


class HandWatch:
    """Reads the frames for the tracker; without the networks' files it sees nothing."""

    def __init__(
        self, config: HandReaderConfig | None, key_points: KeyPointConfig, period: int
    ) -> None:
        self._period, self._key_points = period, key_points
        self.trouble = ""
        """Why no network looks, and what to do about it; empty where they do."""
        self._reader: HandReader | None = None
        try:
            self._reader = HandReader(config) if config is not None else None
        except ValueError as error:
            self.trouble = str(error)
        self.reset()

    def reset(self) -> None:
        """Forget all hands."""
        if self._reader is not None:
            self._reader.reset()
        self.hand: SeenHand | None = None
        """The hand that acts, as seen in this frame; None: none is seen, or nobody looked."""
        self.elsewhere: SeenHand | None = None
        """It, where it is not where the followed hand is expected."""
        self.idle: list[SeenHand] = []
        """Hands that do nothing, while there is one that acts."""
        self.ever = False
        """Whether they have seen the hand that is followed."""
        self.missed = 0
        """Looks in a row that did not find it."""
        self._keys: dict[Side, KeyEvidence] = {}
        self._sides = SideOdds()
        self._identity = -1
        self._acted: set[int] = set()
        self._arrived: set[int] = set()
        self._paths: dict[int, tuple[Array, int]] = {}
        self._skipped = self._looks = self._vain = 0
        self._motion = MovingDepth()
        self._things: list[MovingThing] = []
        self._shares: dict[int, float] = {}
        self._leader_acts = self._doubted = False
        self.resting = False
        """Whether the followed hand has done nothing yet while something else moves or acts."""

    @property
    def moving(self) -> bool:
        """Whether something moves in front of what stands still."""
        return bool(self._things)

    @property
    def overlooked(self) -> bool:
        """Whether what moves may be a hand that the networks do not see."""
        return self.moving and self._vain >= _OVERLOOKED

    def comes(self, pixels: Array) -> bool:
        """Return whether something has come where a hand's joints (21, 2) are in the image.

        What has stood there from the first frame on is no hand if the networks see none.
        """
        return bool(self.trouble) or self._reader is None or self._motion.share(pixels) > _MOVES

    def rests(self, pixels: Array) -> bool:
        """Return whether something moves, but not a hand with joints (21, 2) in the image."""
        if not self._things or self._motion.share(pixels) > _MOVES:
            return False
        around = square_of_key_points(pixels)
        return all(beside(thing, around) for thing in self._things)

    def denies(self, color: ColorImage, pixels: Array) -> bool:
        """Return whether the network sees no hand where joints (21, 2) are said to be in an image.

        It speaks of the hand that it has seen: another one may wear what it cannot read. Of what
        depth alone found on thirty films it sees less than .09 in all that was none or 6 cm off,
        and more in nine of ten of those that were less than 5 cm off.
        """
        if self._reader is None or not self.ever:
            return False
        return self._reader.presence(color, square_of_key_points(pixels)) < _DENIED

    @property
    def seen(self) -> SeenHand | None:
        """The hand that acts, wherever it is seen."""
        return self.hand or (self.elsewhere if self.missed >= MISSED else None)

    @property
    def told(self) -> SeenHand | None:
        """The hand seen, unless this look takes it for the other one: see `SeenHand.mirrored`."""
        seen = self.seen
        return None if seen is None or seen.mirrored else seen

    def keys_of(self, side: Side) -> KeyEvidence:
        """Return what is seen of it as evidence for a hand of a side."""
        return self._keys.get(side, NO_KEYS)

    def look(
        self,
        frame: RgbdFrame,
        expectation: Expectation,
        tell: Tell,
    ) -> None:
        """Look for the hand in the next frame.

        Args:
            frame: the next one.
            expectation: what is known of it.
            tell: which side a look at it speaks for.
        """
        self.hand = self.elsewhere = None
        if self._reader is not None:
            self._motion.note(frame)
        reader = self._reader
        self._doubted = not expectation.settled
        if reader is not None and not self._may_skip(expectation):
            self._things = self._motion.things() if self._searches() else []
            hands = self._read(reader, frame, expectation)
            self._look(self._real(reader, hands, frame), expectation)
            unseen = self.moving and self.hand is None and self.elsewhere is None
            self._vain = self._vain + 1 if unseen else 0
            self._note_side(tell, hands)
            self._note_rest(expectation)
        self._note_keys(frame.camera)

    def pretend(self, hand: SeenHand, camera: Camera) -> None:
        """Take a hand for the one that is seen, until the next look."""
        self.hand = hand
        self._note_keys(camera)

    def _note_keys(self, camera: Camera) -> None:
        told = self.told
        self._keys = {}
        if told is not None:
            points = self._key_points
            self._keys = {side: key_evidence(told, camera, side, points) for side in SIDES}

    def _note_side(self, tell: Tell, hands: tuple[SeenHand, ...]) -> None:
        """Let the looks at the seen hand, and others beside it, tell its side."""
        seen = self.seen
        if seen is not None:
            others = [hand.identity for hand in hands]
            sided = self._sides.noted(seen, self._doubted, tell, others)
            self.hand, self.elsewhere = (sided, None) if self.hand else (None, sided)

    def _may_skip(self, expectation: Expectation) -> bool:
        """Return whether this frame need not be read."""
        self._skipped += 1
        settled = expectation.settled and self._identity in self._acted
        period = self._period * (_HURRIED if settled and expectation.hurried else 1)
        if (settled or expectation.hurried) and self._skipped < period:
            return True
        self._skipped, self._looks = 0, self._looks + 1
        return False

    def _look(self, hands: list[SeenHand], expectation: Expectation) -> None:
        """Take note of the hands of a frame, of the one that acts above all."""
        for hand in hands:
            if self._looks > _FIRST_LOOKS and hand.identity not in self._paths:
                self._arrived.add(hand.identity)
            self._note_motion(hand)
        chosen = self._chosen(hands, expectation)
        self.idle = self._resting(hands) if self._acted else []
        if chosen is None:
            self.missed += 1
            return
        self._identity = chosen.identity
        if expectation.middle is None or at_place(chosen, expectation.middle):
            self.hand, self.missed, self.ever = chosen, 0, True
            return
        self.elsewhere = chosen
        self.missed += MISSED if chosen.identity in self._acted | self._arrived else 1

    def _real(
        self, reader: HandReader, hands: tuple[SeenHand, ...], frame: RgbdFrame
    ) -> list[SeenHand]:
        """Return the hands that are where there is something: neither pictures nor shadows.

        Key points sometimes slip from a hand to its shadow, where nothing is in front of the table.
        """
        real = []
        for hand in hands:
            before = self._shares.get(hand.identity, 0.0)
            share = self._motion.share(hand.pixels)
            self._shares[hand.identity] = share
            if before > 2.0 * _MOVES and share < 0.5 * _MOVES:
                reader.forget(hand.identity)
            elif has_depth(hand, frame):
                real.append(hand)
        return real

    def _searches(self) -> bool:
        """Return whether the hand that acts is unknown, missed or in doubt."""
        unknown = self._identity not in self._acted or self.missed > 0
        return unknown or (self._doubted and self._looks % _SECOND == 0)

    def _read(
        self, reader: HandReader, frame: RgbdFrame, expectation: Expectation
    ) -> tuple[SeenHand, ...]:
        """Return the hands of a frame; only the one that acts where that will do.

        While it is unknown or missed it is looked for where something moves, and where the fit is.
        Key points of a hand that fits well are read there, for its own last ones drift; those of
        one that fits badly are read by the better network.
        """
        joints = expectation.joints
        near = square_of_key_points(joints) if joints is not None else None
        squares = {self._identity: near} if near is not None and expectation.trusted else {}
        care = expectation.doubted and not expectation.hurried
        careful = frozenset([self._identity] if care else [])
        if not self._searches():
            every = self._looks % _GLANCE == 0
            hints = Hints(squares=squares, careful=careful)
            return reader.read(frame.color, only=None if every else self._identity, hints=hints)
        regions = [near] if near is not None and self.missed > 0 else []
        spared = expectation.hurried and self.missed == 0 and self._identity in self._acted
        large = [thing for thing in self._things if thing.area > _ARM_AREA]
        arms = [] if spared else large[:_ARMS]
        regions += [end for arm in arms for end in ends_of(arm, frame.camera)]
        rests = joints is not None and not self._leader_acts and self.rests(joints)
        due = self._vain < _OVERLOOKED or self._looks % 2 == 0
        free = not expectation.hurried and (joints is None or rests) and due
        most = 1 if expectation.hurried else _REGIONS
        if free:
            bare = [arm for arm in arms if _BARE_AREA[0] < arm.area < _BARE_AREA[1]]
            regions += [square for thing in bare for square in turns_of(thing, frame.camera)]
            most = len(regions)
        view = view_of(arms[0], frame.camera) if arms else None
        hints = Hints(tuple(regions[:most]), view, squares, careful, lost=free)
        period = 4 if expectation.hurried else 3  # both sources in every frame take too long
        turn = not regions or self._looks % period == 0
        missed = self.missed > 0 and (self.ever or bool(self._things))
        return reader.read(frame.color, search=missed and turn, hints=hints)

    def _note_rest(self, expectation: Expectation) -> None:
        """Take note of whether the followed hand rests while something else moves."""
        joints = expectation.joints
        if joints is None:
            self._leader_acts = self.resting = False
            return
        acts = self.hand is not None and self.hand.identity in self._acted
        self._leader_acts |= acts or self._motion.share(joints) > _MOVES
        other = self.elsewhere is not None and self.elsewhere.identity in self._acted
        self.resting = not self._leader_acts and (other or self.rests(joints))

    def _note_motion(self, hand: SeenHand) -> None:
        """Take note of whether a hand came moving, or has left its resting place.

        Readings of a hand at rest jump while it is in doubt, and the arm of another one may pass in
        front of it: only both together are a movement of its own.
        """
        middle = middle_of(hand)
        rest, looks = self._paths.get(hand.identity, (middle, 0))
        left = float(np.linalg.norm(middle - rest)) > _ACTS * hand.square.side
        if (left or looks < _COMING) and self._motion.share(hand.pixels) > _MOVES:
            self._acted.add(hand.identity)
        self._paths[hand.identity] = rest + _DRIFT * (middle - rest), looks + 1

    def _resting(self, hands: list[SeenHand]) -> list[SeenHand]:
        """Return those that have been seen for a while and have done nothing."""
        return [
            hand for hand in hands
            if hand.identity not in self._acted and self._paths[hand.identity][1] > _COMING
        ]  # fmt: skip

    def _chosen(self, hands: list[SeenHand], expectation: Expectation) -> SeenHand | None:
        """Return the hand to follow; None where it is not seen."""
        if self._things:  # something moves: no hand at rest is what acts
            hands = [h for h in hands if h.identity in self._acted or not self.rests(h.pixels)]
        same = [hand for hand in hands if hand.identity == self._identity]
        if expectation.middle is not None:
            near = [hand for hand in hands if at_place(hand, expectation.middle)]
            same = same or near
        acted = [hand for hand in hands if hand.identity in self._acted]
        if self._identity in self._acted:
            same = [hand for hand in same if hand not in self._resting(same)]
            if same:
                self._acted.add(same[0].identity)  # the same hand under a new number
                return same[0]
            return acted[0] if acted and self.missed >= _PATIENCE else None
        if self._identity not in self._arrived:
            acted = acted or [hand for hand in hands if hand.identity in self._arrived]
        if acted or same:
            return (acted or same)[0]
        return min(hands, key=lambda hand: distance_of(hand, expectation.objects), default=None)
