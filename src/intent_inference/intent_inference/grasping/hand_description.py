"""A first description of how a hand grasps, guessed from its kinematics alone.

Which way it approaches, which joints close it and how wide it opens are read off the places of its
finger tips. It is meant to be looked at and corrected: nobody else knows which grips are good.
"""

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.scene.joint_table import JointTable, landmark_positions

_NEAR_AXIS = 0.94
"""Cosine from which on a direction is taken for an axis of the base."""
_STEP = 1e-3
_USEFUL = 0.15
"""A joint closes if it moves tips together at least this share of the fastest one's speed."""
_SLIDE = 0.1
"""Closing speed of sliding joints [m] where others turn one radian."""
_FURTHER = 0.5
"""Each joint further out closes at this share of the speed of the one before it."""
_EFFORT = {"turns": 2.0, "slides": 30.0}
"""Torque [N m] and force [N] where nothing better is known."""
_WIDEST_BEND = np.radians(50.0)
"""Open fingers bend back no farther than so much."""


def guessed_description(table: JointTable, urdf: Path, base: str = "") -> dict[str, Any]:
    """Return a description as share/hands holds it, with one precision and one power grip.

    Args:
        table: the hand.
        urdf: its file.
        base: link that the hand begins with, see `table_from_urdf`.

    Raises:
        ValueError: if no joint brings finger tips together.
    """
    middle = table.limits.mean(axis=1)
    tips = landmark_positions(table, middle)[0]
    if len(tips) < 2:
        raise ValueError(f"{urdf}: expected at least two fingers, got {len(tips)} tips")
    approach = _snapped(tips.mean(axis=0))
    closing = _spread_axis(tips, approach)
    speed = _closing_speeds(table, middle, closing)
    fastest = np.abs(speed / _units(table)).max()
    if fastest < _STEP:
        raise ValueError(f"{urdf}: no joint brings its finger tips together")
    rates, opened = _rates_and_posture(table, speed, fastest)
    tips = landmark_positions(table, opened)[0]
    width = float(np.ptp(tips @ closing))
    center = tips.mean(axis=0)
    grip = {
        "approach": _rounded(approach),
        "closing": _rounded(closing),
        "widest": round(max(0.9 * width, 0.02), 3),
        "open": _by_joint(table, np.where(table.sliding_joints, opened, np.degrees(opened))),
        "rates": _by_joint(table, rates),
    }
    reach = float(center @ approach)
    slides = bool(table.sliding_joints[np.abs(rates) > 0].all())
    return {
        "table": str(urdf),
        **({"base": base} if base else {}),
        "effort": {"others": [_EFFORT["slides" if slides else "turns"]]},
        "preshapes": [
            {
                "name": "precision",
                **deepcopy(grip),
                "center": _rounded(center - 0.01 * approach),
                "stop": "center",
                "depth": [0.005, 0.025],
                "offset": [0.05, 0.6],
                "near_mass": True,
            },
            {
                "name": "power",
                **deepcopy(grip),
                "center": _rounded(center - min(0.4 * reach, 0.04) * approach),
                "stop": "contact",
                "offset": [0.1, 0.6],
            },
        ],
    }


def _units(table: JointTable) -> Array:
    """Return what counts as one step of each joint (J,): a radian, or a tenth of a metre."""
    return np.where(table.sliding_joints, 1.0 / _SLIDE, 1.0)


def _spread_axis(tips: Array, approach: Array) -> Array:
    """Return the direction across the approach in which the tips lie farthest apart."""
    away = tips - tips.mean(axis=0)
    flat = away - np.outer(away @ approach, approach)
    axis = np.linalg.svd(flat, full_matrices=False)[2][0]
    return _snapped(axis - approach * (axis @ approach))


def _closing_speeds(table: JointTable, posture: Array, closing: Array) -> Array:
    """Return how fast each joint (J,) spreads the tips along the closing direction."""

    def spread(joints: Array) -> float:
        along = landmark_positions(table, joints)[0] @ closing
        return float(np.abs(along - along.mean()).sum())

    count = len(table.joint_names)
    steps = _STEP * np.eye(count)
    return np.array(
        [(spread(posture + step) - spread(posture - step)) / (2.0 * _STEP) for step in steps]
    )


def _rates_and_posture(table: JointTable, speed: Array, fastest: float) -> tuple[Array, Array]:
    """Return closing speeds and the open posture, (J,) each."""
    rates, opened = np.zeros(len(speed)), np.zeros(len(speed))
    depth = _depths(table)
    for joint, (low, high) in enumerate(table.limits):
        slides = bool(table.sliding_joints[joint])
        if abs(speed[joint] * (_SLIDE if slides else 1.0)) >= _USEFUL * fastest:
            rates[joint] = -np.sign(speed[joint]) * (_SLIDE if slides else _FURTHER ** depth[joint])
            end = high if speed[joint] > 0.0 else low
            opened[joint] = end if slides else np.clip(end, -_WIDEST_BEND, _WIDEST_BEND)
        opened[joint] = np.clip(opened[joint], low, high)
    return rates, opened


def _depths(table: JointTable) -> list[int]:
    """Return for each joint how many others move its link, from the base on."""
    depths = []
    for joint in range(len(table.joint_names)):
        link = int(np.flatnonzero(table.drivers == joint)[0])
        above = set[int]()
        while table.parents[link] > 0:
            link = int(table.parents[link])
            above.add(int(table.drivers[link]))
        depths.append(len(above - {-1, joint}))
    return depths


def _by_joint(table: JointTable, values: Array) -> dict[str, list[float]]:
    return {
        name: [round(float(value), 3)]
        for name, value in zip(table.joint_names, values, strict=True)
    }


def _snapped(direction: Array) -> Array:
    """Return the unit vector, or the axis of the base that it is near to."""
    unit = direction / np.linalg.norm(direction)
    axis = int(np.argmax(np.abs(unit)))
    return np.sign(unit[axis]) * np.eye(3)[axis] if abs(unit[axis]) > _NEAR_AXIS else unit


def _rounded(values: Array) -> list[float]:
    return [round(float(value), 4) for value in values]
