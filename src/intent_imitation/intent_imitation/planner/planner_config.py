"""Parameters of the planner."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from intent_imitation.planner.collision import Clearances
from intent_perception.basics.parameters import Checked


@dataclass(frozen=True)
class PlannerConfig(Checked):
    """What counts as fit for a task, and how much room the hand needs."""

    minimum_object: float = 0.1
    """Least p(t* | o) of an object that may be chosen, 0..1."""
    minimum_grasp: float = 0.6
    """Least p(t* | o, a) of its best reachable grasp; below, the object is unfit. Chosen on objects
    that BN^R was not trained on, where 0.5 accepts tools with no fitting grasp in reach; 0..1."""
    acts_on: Literal["grasp", "motion"] = "grasp"
    """grasp: one plan for the task that is best at the stable grasp; motion: plans that follow what
    the person means while the object moves, and are cancelled with it."""
    intention: float = 0.1
    """Least probability, of what the person means (`intends`), of a task that is planned for where
    it acts on the motion, 0..1."""
    overtake: float = 0.1
    """Another task must be meant by so much more before its plan takes the place of one, 0..1."""
    table_gap: float = 0.001
    """Least gap between hand and table on the way [m], -0.05..0.1."""
    neighbour_gap: float = 0.005
    """Least gap between hand and other objects on the way [m], -0.05..0.1."""
    target_gap: float = -0.008
    """Least gap between open hand and its object; below 0: fingers may push in that far [m];
    -0.05..0.1."""
    grasps: int = 10
    """Number of grasps in a plan, 1..1000."""
    batch: int = 24
    """Number of grasps checked for collision at a time, most promising first, 1..1000."""
    stability_weight: float = 0.5
    """Exponent of the stability in the score; 0: p(t* | o, a) alone; 0..10."""
    unshaken: int = 300
    """Number of grasps tried on the fly for an object without a library, 1..100000."""
    library: str = ""
    """File of preplanned grasps, which names the robot's hand; empty: the shipped Schunk hand's."""
    network: str = ""
    """File of BN^R; empty: the shipped one of the library's hand."""

    def leaves_room(self, gaps: Clearances) -> NDArray[np.bool_]:
        """Return whether each grasp (G,) keeps the least gaps on its way."""
        free = (gaps.table >= self.table_gap) & (gaps.target >= self.target_gap)
        return np.asarray(free & (gaps.neighbours >= self.neighbour_gap))
