"""Command: learn the motion network from simulated motions.

python -m intent_inference.train_motion --out motion.npz [--per-kind 720] [--seed 0]
"""

import argparse

import numpy as np

from intent_inference.workshop.acting.motion_training import learned_motion
from intent_perception.basics.safe_files import output_file


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_inference.train_motion",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=output_file, required=True, help="NPZ to write")
    parser.add_argument("--per-kind", type=int, default=720, help="motions of each kind")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    learned_motion(options.per_kind, np.random.default_rng(options.seed)).save(options.out)
    return 0
