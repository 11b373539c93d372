"""How one hypothesis of the scene follows a frame."""

from dataclasses import dataclass, field

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.parameters import Checked
from intent_tracking.image.frame_evidence import Weights
from intent_tracking.image.labelling import LabellingConfig

_SWARM_SPREAD = [0.012] * 3 + [0.2] * 3 + [0.25] * 20
"""Of the swarm's hand positions [m], rotations and joint angles [rad]."""
_WEIGHTS = Weights(
    scale=np.float32(0.0),
    silhouette=np.float32(1.0),
    front=np.float32(1.0),
    penetration=np.float32(2.0),
    touch=np.float32(0.3),
    limit=np.float32(1.0),
    angle=np.float32(2e-4),
    dip=np.float32(2e-4),
    synergy=np.float32(5e-4),
    posture=np.float32(1.5e-5),
    key=np.float32(8.0),
    hand_place=np.float32(0.0),
)
"""Tuned together on films; the scale changes from one refinement to the next."""


@dataclass(frozen=True, eq=False)
class TrackConfig(Checked):
    """How one hypothesis follows a frame."""

    swarm_only: bool = False
    """True: the published particle swarm over hand and objects, and nothing else."""
    pso_particles: int = 64
    """Particles of the published swarm, 1..4096."""
    pso_generations: int = 25
    """Generations of the published swarm in a frame, 1..1000."""

    tile_size: int = 128
    """Side of the tile [pixels], 32..256, a multiple of 16."""
    margin: float = 22.0
    """Border of the tile around the predicted bodies [image pixels], 0..200."""
    damping: float = 0.8
    """Share of the last velocity that the prediction keeps, 0..1."""
    iterations: int = 10
    """Levenberg-Marquardt steps from the prediction, 0..100."""
    polish_iterations: int = 6
    """Levenberg-Marquardt steps after the finger sweep, 0..100."""
    sweep_trials: int = 64
    """Trial poses per finger, 0 = no sweep, 0..1000."""
    sweep_spread: float = 0.3
    """Standard deviation of local trials [rad], 0..3.1."""
    sweep_pull: float = 4.0
    """Weight of the prediction in the sweep [pixels / rad^2], 0..1000."""
    clear_gain: float = 12.0
    """Pixels that a second opinion on an object's pose must explain better, 0..10000."""
    sweep_unusual: float = 1.0
    """Weight of the posture prior in the sweep, per squared Mahalanobis distance [pixels],
    0..100."""
    slides: tuple[float, ...] = (-0.03, -0.015, 0.015)
    """Offsets along a hand that fits badly from which it is fitted again [m], -0.2..0.2."""
    swarm_particles: int = 32
    """Particles of the swarm, 0 = no swarm, 0..4096."""
    swarm_generations: int = 10
    """Generations of the swarm in a frame, 1..1000."""
    swarm_size: int = 64
    """Side of the tile on which the swarm is rated [pixels], 16..256, a multiple of 16."""
    swarm_cost: float = 0.22
    """Cost per hand pixel above which the swarm looks for another basin, 0..2."""
    scale: float = 0.008
    """Residual beyond which a point counts as an outlier [m], 0.0005..0.1."""
    fine_scale: float = 0.004
    """The same once the fit is near: parts that are shaped differently must not pull [m];
    0.0005..0.1."""
    labelling: LabellingConfig = field(default_factory=LabellingConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tile_size % self.swarm_size:
            sizes = f"{self.tile_size} and {self.swarm_size}"
            raise ValueError(f"expected tile_size a multiple of swarm_size, got {sizes}")

    @property
    def swarm_spread(self) -> Floats:
        """(26,) spread of the swarm's hand states."""
        return np.array(_SWARM_SPREAD, dtype=np.float32)

    @property
    def weights(self) -> Weights:
        """The weights for compiled code."""
        return _WEIGHTS._replace(scale=np.float32(self.scale))
