"""The forward filter of motions against pgmpy, on sequences of hard cells."""

from dataclasses import replace

import numpy as np
from pgmpy.factors.discrete import TabularCPD
from pgmpy.inference import VariableElimination
from pgmpy.models import DiscreteBayesianNetwork

from intent_inference.motion.measures import CELLS, CENTERS, MEASURES
from intent_inference.motion.motion_network import (
    NOTHING,
    PHASES,
    RATE,
    STEPS,
    MotionFilter,
    MotionNetwork,
    shipped_motion,
)
from intent_perception.basics.arrays import Array

FRAMES = 4
TASKS = ("hand-over", "pouring", "tool-use", "dish-washing")


def unrolled(network: MotionNetwork) -> DiscreteBayesianNetwork:
    """Return kind -> step of each frame -> cell of each measure, a prior alike for all tasks."""
    kinds, steps = len(network.kinds), len(STEPS)
    prior = network.priors / network.priors.sum()
    nodes = [TabularCPD("kind", kinds, prior[:, None])]
    for frame in range(FRAMES):
        before = [] if frame == 0 else [f"step_{frame - 1}"]
        table = network.transitions[:, 0] if frame == 0 else network.transitions.reshape(-1, steps)
        sizes = [kinds, *(steps for _ in before)]
        nodes.append(TabularCPD(f"step_{frame}", steps, table.T, ["kind", *before], sizes))
        for row, name in enumerate(MEASURES):
            cells = network.emissions[row].reshape(kinds * steps, -1)[:, : CELLS[row]]
            shares = (cells / cells.sum(axis=1, keepdims=True)).T
            above = ["kind", f"step_{frame}"]
            nodes.append(TabularCPD(f"{name}_{frame}", CELLS[row], shares, above, [kinds, steps]))
    edges = [(parent, node.variable) for node in nodes for parent in node.variables[1:]]
    model = DiscreteBayesianNetwork(edges)
    model.add_cpds(*nodes)
    return model


def answers(network: MotionNetwork, cells: Array) -> tuple[Array, Array]:
    """Return pgmpy's p(kind) and p(step of the last frame) after cells (FRAMES, M)."""
    evidence = {
        f"{name}_{frame}": int(cells[frame, row])
        for frame in range(FRAMES)
        for row, name in enumerate(MEASURES)
    }
    asked = VariableElimination(unrolled(network))
    last = f"step_{FRAMES - 1}"
    kind = asked.query(["kind"], evidence, show_progress=False).values
    return kind, asked.query([last], evidence, show_progress=False).values


def test_filter_gives_the_tasks_and_phases_that_pgmpy_gives() -> None:
    rng = np.random.default_rng(5)
    network = replace(shipped_motion(), weight=RATE)  # each frame a full look, as pgmpy counts
    own = MotionFilter(network, TASKS)
    cells = np.array([rng.integers(CELLS) for _ in range(FRAMES)])
    for frame, row in enumerate(cells):
        values = np.array([CENTERS[n][c] for n, c in zip(MEASURES, row, strict=True)])
        own.step(frame / RATE, values)
    kind, step = answers(network, cells)
    meanings = (*TASKS, NOTHING)
    members = np.array([[task == meaning for task in network.tasks] for meaning in meanings])
    task = members @ kind
    found = np.exp(own.log_evidence - own.log_evidence.max())
    found = found / found.sum()
    np.testing.assert_allclose(found, task / task.sum(), atol=1e-5)
    parts = np.array([[own == phase for own in STEPS.values()] for phase in PHASES])
    np.testing.assert_allclose(own.phases(found), parts @ step, atol=1e-5)
