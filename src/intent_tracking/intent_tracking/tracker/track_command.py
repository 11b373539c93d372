"""Command: hand and objects through a whole bag.

python -m intent_tracking.track BAG [--models DB] [--objects ID,...] [--method hybrid|pso]
    [--topics COLOR DEPTH INFO] [--depth-scale M] [--seed S] [--shape F.npz]
    [--save-shape F.npz] --out F.npz
"""

import argparse
import sys
from pathlib import Path

from intent_perception.bags.bag_topics import add_image_options, bag_input
from intent_perception.basics.safe_files import output_file, write_arrays
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.fit.hand_shape import HandShapeConfig, save_shape
from intent_tracking.tracker.recording import track_bag
from intent_tracking.tracker.tracker_config import TrackerConfig


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_tracking.track",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, help="rosbag2 folder with RGB-D images")
    parser.add_argument("--models", help="object database: YAML file or folder (shipped: 48)")
    parser.add_argument(
        "--objects",
        default="",
        help="names of the only objects, comma separated; none: the hand alone",
    )
    parser.add_argument("--method", choices=("hybrid", "pso"), default="hybrid")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shape", default="", help="NPZ with the hand shape to start from")
    parser.add_argument("--save-shape", type=output_file, help="NPZ for the calibrated shape")
    parser.add_argument("--out", type=output_file, required=True, help="NPZ file of the result")
    add_image_options(parser)
    options = parser.parse_args(arguments)
    chosen: tuple[str, ...] | None = tuple(name for name in options.objects.split(",") if name)
    if chosen == ("none",):
        chosen = None
    said: list[str] = []

    def warn(text: str) -> None:
        if text not in said:  # a camera without a clock says it for every frame
            print(f"track: {text}", file=sys.stderr)
        said.append(text)

    try:
        database = ObjectDatabase.load(options.models)
        for note in database.notes:
            warn(note)
        shape = HandShapeConfig(file=options.shape)
        config = TrackerConfig(method=options.method, seed=options.seed, shape=shape)
        recording = track_bag(options.bag, database, config, chosen, warn, bag_input(options))
        if options.save_shape:
            last = recording.states[-1]
            save_shape(options.save_shape, last.hand_side, last.hand_shape)
        write_arrays(options.out, recording.arrays)
    except ValueError as error:
        print(f"track: {error}", file=sys.stderr)
        return 2
    lost = sum(state.hand_lost for state in recording.states)
    without = sum(not state.hand_tracked for state in recording.states)
    bad = sum(text.startswith("left out") for text in said)
    print(
        f"{len(recording.states)} frames, {bad} times something was left out, "
        f"{without} without a hand's pose ({lost} of them with one in view), "
        f"{1e3 * recording.seconds.mean():.1f} ms CPU per frame: {options.out}"
    )
    return 0
