"""Command: learn how human fingers are bent from a table of simulated grasps.

python -m intent_tracking.posture D.csv.gz [--out F.npz]
with the table of `intent_inference.simulate --hand human`; without --out the shipped file.
"""

import argparse
import csv
import io
import sys
from pathlib import Path

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_text
from intent_perception.basics.safe_files import output_file, write_arrays
from intent_tracking.scene.posture_prior import SHIPPED, Posture

OPEN: Array = np.radians(
    [20, -15, 10, 10, 5, 10, 15, 10, 0, 10, 15, 10, -5, 10, 15, 10, -8, 10, 15, 10]
)
"""(20,) relaxed open hand [rad]."""
_SLACK = np.radians(10.0)
"""Deviation of every angle beside the Gaussian: people differ, and tasks from grasps [rad]."""


def posture_of(grasps: Array, rng: np.random.Generator) -> Posture:
    """Return the Gaussian of grasps (G, 20) [rad] and the ways to them."""
    share = rng.uniform(0.0, 1.0, (len(grasps), 1))
    postures = np.concatenate([grasps, OPEN + share * (grasps - OPEN)])
    covariance = np.cov(postures.T) + _SLACK**2 * np.eye(20)
    precision = np.linalg.inv(covariance)
    return Posture(postures.mean(axis=0).astype(np.float32), precision.astype(np.float32))


def main(arguments: list[str] | None = None) -> int:
    """Learn the prior from a table of simulated grasps; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_tracking.posture",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("data", type=Path, help="table of simulated human grasps (CSV, gzip)")
    parser.add_argument("--out", type=output_file, default=SHIPPED)
    options = parser.parse_args(arguments)
    table = csv.DictReader(io.StringIO(read_text(options.data, 256 << 20)))
    rows = [[float(row[f"fcon_{n}"]) for n in range(20)] for row in table]
    posture = posture_of(np.array(rows), np.random.default_rng(0))
    write_arrays(options.out, posture._asdict(), compressed=False)
    sys.stdout.write(f"{len(rows)} grasps: {options.out}\n")
    return 0
