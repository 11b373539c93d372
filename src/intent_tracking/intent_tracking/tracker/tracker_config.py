"""Parameters of the tracker, the only home of their defaults."""

from dataclasses import dataclass, field
from typing import Literal

from intent_perception.basics.parameters import Checked
from intent_tracking.fit.hand_shape import HandShapeConfig
from intent_tracking.fit.initialisation import InitialisationConfig
from intent_tracking.hands.hand_detection import DetectionConfig
from intent_tracking.hands.hand_reader import HandReaderConfig
from intent_tracking.hands.key_point_start import KeyPointConfig
from intent_tracking.tracker.object_life import ObjectLifeConfig
from intent_tracking.tracker.track_config import TrackConfig


@dataclass(frozen=True, eq=False)
class TrackerConfig(Checked):
    """Parameters of the tracker."""

    method: Literal["hybrid", "pso"] = "hybrid"
    """hybrid: swarm, refinement and finger sweep; pso: the published particle swarm alone."""
    seed: int = 0
    """Seed of everything random, 0..1000000."""
    table: bool = True
    """False: there is no table, anything nearer than the background may be a hand."""
    accept_cost: float = 0.50
    """Cost per hand pixel below which a new hand pose is published, 0..2."""
    lost_cost: float = 0.52
    """Smoothed cost per hand pixel above which the hand is lost, 0..2."""
    good_cost: float = 0.22
    """Smoothed cost below which a young track is not questioned, 0..2."""
    young_trials: tuple[int, ...] = (1, 2, 4, 7, 13, 21)
    """Ages in frames at which other starts of both sides are tried, 0..1000."""
    farthest_rival: float = 0.12
    """Other starts this far from a track that fits are another thing than its hand [m], 0..2."""
    far_better: float = 0.6
    """Share of the present cost below which even those take over, 0..2."""
    better: float = 0.85
    """Share of the present cost that another start must stay below to take over, 0..2."""
    doubt_cost: float = 0.30
    """Smoothed cost above which other starts are tried now and then, 0..2."""
    urgent_cost: float = 0.45
    """Cost of one frame above which they are tried at once, 0..2."""
    doubt_period: int = 5
    """Frames between such trials, 1..1000."""
    vain_period: int = 4
    """Most frames that trials in vain put off the next one, 0..1000."""
    still_frames: int = 4
    """Frames after which, at a table, only what has moved may be a new hand, 0..1000."""
    hand_reach: float = 0.22
    """Nothing within this distance of a wrist that was followed is taken for furniture [m],
    0..2."""
    first_cost: float = 0.25
    """Cost below which a pose is published before that, 0..2."""
    least_area: float = 0.0008
    """Visible surface below which there is no hand [m^2], 0..0.1."""
    decision_frames: int = 12
    """Frames over which a right and a left hand compete, 1..1000."""
    decision_margin: float = 0.12
    """Lead in mean cost that ends the competition, 0..2."""
    side_bias: float = 0.10
    """Cost that the side last seen is ahead at a new start, 0..2."""
    unusual_roll: float = 0.3
    """Cost of a hand turned over, see `hypothesis.unusual_roll`, 0..2."""
    search_period: int = 2
    """Frames between looks for a hand by depth and colour alone while networks look as well and
    nothing moves, 1..100."""
    learn_period: int = 4
    """Frames between updates of the colour models, 1..1000."""
    networks: bool = True
    """Whether two small networks help to find and hold the hand, where their files are."""
    look_period: int = 2
    """Frames between looks of the networks at a hand on which they and the fit agree, 1..100."""
    agreement: float = 0.012
    """Distance of joints from their key points up to which they agree [m], 0.001..0.1."""
    contradiction: float = 0.030
    """Distance of joints from their key points that calls for another start [m], 0.005..0.5."""
    trust_cost: float = 0.22
    """Smoothed cost of one hand below which the networks read it where the fit is, 0..2."""
    careful_cost: float = 0.25
    """Smoothed cost above which the better network reads a hand, 0..2."""
    reader: HandReaderConfig = field(default_factory=HandReaderConfig)
    key_points: KeyPointConfig = field(default_factory=KeyPointConfig)
    track: TrackConfig = field(default_factory=TrackConfig)
    detection: DetectionConfig = field(default_factory=DetectionConfig)
    initialisation: InitialisationConfig = field(default_factory=InitialisationConfig)
    life: ObjectLifeConfig = field(default_factory=ObjectLifeConfig)
    shape: HandShapeConfig = field(default_factory=HandShapeConfig)
