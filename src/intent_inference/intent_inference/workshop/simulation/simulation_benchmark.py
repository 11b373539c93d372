"""Figures of the simulated grasps: rates measured now, counts from the shipped tables."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference import SHARE
from intent_inference.grasping.autograsp import Fate
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.campaign import settings
from intent_inference.workshop.simulation.generation import GraspGenerator
from intent_inference.workshop.simulation.grasp_table import read_rows
from intent_inference.workshop.simulation.labels import TASKS
from intent_perception.objects.database import ObjectDatabase

DATA = SHARE / "data"
SHAPES = ("bottle", "glass", "mug", "knife", "hammer", "screwdriver")
CELLS = (
    *(("hand-over", kind) for kind in SHAPES),
    *(("pouring", kind) for kind in ("bottle", "glass", "mug")),
    *(("tool-use", kind) for kind in ("knife", "hammer", "screwdriver")),
    *(("dish-washing", kind) for kind in ("glass", "mug", "knife")),
)
_CELL_SIZE = 50


def simulation_figures(quick: bool = False, seed: int = 1000) -> dict[str, Any]:
    """Return the figures of both hands, see CONTRACT.md.

    Args:
        quick: fewer objects and fewer shakes.
        seed: of the grasps that are tried for the rates.
    """
    return {hand: hand_figures(hand, quick, seed) for hand in ("human", "schunk")}


def hand_figures(hand: str, quick: bool, seed: int) -> dict[str, Any]:
    """Return the figures of one hand."""
    table = DATA / f"{hand}.csv.gz"
    counts = table_figures(table) if table.is_file() else dict.fromkeys(_TABLE_KEYS)
    return {**rate_figures(hand, quick, seed), **counts}


def rate_figures(hand_name: str, quick: bool, seed: int) -> dict[str, Any]:
    """Try, filter and shake grasps without any choice; one object of each class.

    Preparing an object (distance field, boxes) and the engine's start are not counted; a try
    counts with its static filter; everything that follows counts for the accepted grasps.
    """
    database, hand = ObjectDatabase.load(), GraspingHand.load(hand_name)
    index = seed % 8
    kinds = SHAPES[::2] if quick else SHAPES
    fates: Counter[Fate] = Counter()
    seconds: Counter[str] = Counter()
    depths: list[float] = []
    coupling: list[float] = []
    generation = settings()
    if quick:
        generation = replace(generation, per_round=12, shaken_per_round=12, tries_per_round=400)
    for number, kind in enumerate(kinds):
        target = TaskObject(database[f"{kind}_{(index + number) % 8}"])
        rng = np.random.default_rng([seed, number])
        with GraspGenerator(target, hand, rng, generation) as generator:
            generator.warm_up()
            grasps = generator.round(shake_all=True)
            fates.update(generator.fates)
            seconds.update(generator.seconds)
        depths += [1e3 * grasp.penetration for grasp in grasps if grasp.held]
        coupling += [_coupling(grasp.joints) for grasp in grasps if grasp.held]
    tried, accepted = sum(fates.values()), fates[Fate.ACCEPTED]
    shaken = accepted + fates[Fate.SHAKEN_OFF]
    return {
        "tried": tried,
        "tried_per_cpu_s": tried / seconds["try"],
        "accepted_per_cpu_s": accepted / (seconds["try"] + seconds["shake"]),
        "accepted_per_tried": accepted / tried,
        "shaken": shaken,
        "shake_pass": accepted / shaken if shaken else None,
        "penetration_mm_median": float(np.median(depths)) if depths else None,
        "penetration_mm_p90": float(np.percentile(depths, 90)) if depths else None,
        "dip_coupling_deg_p90": float(np.percentile(coupling, 90)) if hand.is_human else None,
        "fates": {fate.name.lower(): count for fate, count in sorted(fates.items()) if count},
    }


_TABLE_KEYS = ("rows", "positives", "cells_short", "preshape_share", "handle_share")


def table_figures(path: Path) -> dict[str, Any]:
    """Return the counts of a table of grasps.

    `cells_short` lists the class x task cells without 50 positives and 50 negatives;
    `preshape_share` is the share of grasps other than power; `handle_share` that of mug grasps
    with more than half of the contact force on the handle.
    """
    rows = read_rows(path)
    cells = {
        cell: [
            sum(row["object_class"] == cell[1] and row[cell[0]] == value for row in rows)
            for value in ("1", "0")
        ]
        for cell in CELLS
    }
    mugs = [row for row in rows if row["object_class"] == "mug"]
    return {
        "rows": len(rows),
        "positives": {task: sum(row[task] == "1" for row in rows) for task in TASKS},
        "cells": {f"{task} {kind}": count for (task, kind), count in cells.items()},
        "cells_short": [
            f"{task} {kind}" for (task, kind), count in cells.items() if min(count) < _CELL_SIZE
        ],
        "preshape_share": float(np.mean([row["preshape"] != "power" for row in rows])),
        "handle_share": float(np.mean([row["on_handle"] == "1" for row in mugs])),
    }


def _coupling(joints: np.ndarray) -> float:
    """Return the mean deviation of the distal joints from 2/3 of the middle ones [deg]."""
    fingers = np.reshape(joints, (-1, 4))[1:] if len(joints) == 20 else np.zeros((1, 4))
    return float(np.degrees(np.abs(fingers[:, 3] - fingers[:, 2] * 2.0 / 3.0).mean()))
