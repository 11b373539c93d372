"""How one hypothesis of the scene follows a frame."""

from dataclasses import dataclass, field

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_tracking.image.frame_evidence import Weights
from intent_tracking.image.labelling import LabellingConfig


@dataclass(frozen=True, eq=False)
class TrackConfig:
    """How one hypothesis follows a frame."""

    swarm_only: bool = False
    """True: the published particle swarm over hand and objects, and nothing else."""
    pso_particles: int = 64
    """Particles of the published swarm."""
    pso_generations: int = 25

    tile_size: int = 128
    """Side of the tile [pixels], a multiple of 16."""
    margin: float = 22.0
    """Border of the tile around the predicted bodies [image pixels]."""
    damping: float = 0.8
    """Share of the last velocity that the prediction keeps."""
    iterations: int = 10
    """Levenberg-Marquardt steps from the prediction."""
    polish_iterations: int = 6
    """Levenberg-Marquardt steps after the finger sweep."""
    sweep_trials: int = 64
    """Trial poses per finger, 0 = no sweep."""
    sweep_spread: float = 0.3
    """Standard deviation of local trials [rad]."""
    sweep_pull: float = 4.0
    """Weight of the prediction in the sweep [pixels / rad^2]."""
    clear_gain: float = 12.0
    """Pixels that a second opinion on an object's pose must explain better."""
    sweep_unusual: float = 1.0
    """Weight of the posture prior in the sweep, per squared Mahalanobis distance [pixels]."""
    slides: tuple[float, ...] = (-0.03, -0.015, 0.015)
    """Offsets along a hand that fits badly from which it is fitted again [m]."""
    swarm_particles: int = 32
    """Particles of the swarm, 0 = no swarm."""
    swarm_generations: int = 10
    swarm_size: int = 64
    """Side of the tile on which the swarm is rated [pixels]."""
    swarm_cost: float = 0.22
    """Cost per hand pixel above which the swarm looks for another basin."""
    swarm_place: float = 0.012
    """Spread of the swarm's hand positions [m]."""
    swarm_turn: float = 0.2
    """Spread of its hand rotations [rad]."""
    swarm_angle: float = 0.25
    """Spread of its joint angles [rad]."""
    scale: float = 0.008
    """Residual beyond which a point counts as an outlier [m]."""
    fine_scale: float = 0.004
    """The same once the fit is near: parts that are shaped differently must not pull [m]."""
    weight_silhouette: float = 1.0
    weight_front: float = 1.0
    weight_penetration: float = 2.0
    weight_touch: float = 0.3
    weight_angle: float = 2e-4
    weight_dip: float = 2e-4
    weight_synergy: float = 5e-4
    weight_posture: float = 1.5e-5
    weight_hand_place: float = 0.0
    labelling: LabellingConfig = field(default_factory=LabellingConfig)

    @property
    def swarm_spread(self) -> Floats:
        """(26,) spread of the swarm's hand states."""
        spread = [self.swarm_place] * 3 + [self.swarm_turn] * 3 + [self.swarm_angle] * 20
        return np.array(spread, dtype=np.float32)

    @property
    def weights(self) -> Weights:
        """The weights for compiled code."""
        values = (
            self.scale,
            self.weight_silhouette,
            self.weight_front,
            self.weight_penetration,
            self.weight_touch,
            1.0,
            self.weight_angle,
            self.weight_dip,
            self.weight_synergy,
            self.weight_posture,
            self.weight_hand_place,
        )
        return Weights(*(np.float32(value) for value in values))
