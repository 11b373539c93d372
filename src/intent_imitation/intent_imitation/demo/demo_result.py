"""What the demo makes of a run: result.json, a few printed lines, and the report."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TextIO

from intent_imitation.demo.collected import Collected
from intent_imitation.demo.known_truth import truth_of
from intent_imitation.demo.report import write_report
from intent_imitation.demo.result_files import RESULT
from intent_imitation.demo.run_progress import check_answers
from intent_imitation.demo.run_record import DemoRecord, moments, result
from intent_imitation.planner.grasp_library import GraspLibrary
from intent_imitation.planner.plan import GraspPlan
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.bags.bag_files import read_frames
from intent_perception.bags.bag_topics import add_image_options, bag_input
from intent_perception.bags.playback import bundles
from intent_perception.basics.own_folder import OwnFolder
from intent_perception.basics.safe_files import write_json
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObjects


def parse_options(arguments: Sequence[str]) -> argparse.Namespace:
    """Return bag, robot_bag, models, out and patience of the command line."""
    parser = argparse.ArgumentParser(
        prog="demo", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bag")
    parser.add_argument("--robot-bag", default="")
    parser.add_argument("--models", default="")
    parser.add_argument("--library", default="", help="grasp library of a hand of one's own")
    add_image_options(parser)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument(
        "--patience", type=float, default=480.0, help="give up after so long without news [s]"
    )
    return parser.parse_args(arguments)


def stamps_of(bag: str, topics: Sequence[str] = ()) -> tuple[int, ...]:
    """Return the stamps [ns] of a bag's frames, those that cannot be decoded included.

    Args:
        bag: rosbag2 folder.
        topics: of its colour, depth and camera_info; empty: they are found.

    Raises:
        ValueError: if the bag cannot be read.
    """
    return tuple(bundle.stamp for bundle in bundles(bag, named=topics))


def record_of(options: argparse.Namespace, collected: Collected) -> DemoRecord:
    """Return the record of a run, with the images that the report draws on.

    Raises:
        ValueError: if the tracker has answered too few of the bag's frames.
    """
    given = bag_input(options)
    stamps = stamps_of(options.bag, given.topics)
    shown = set(moments(stamps, collected.grasps)) | {stamps[0]}
    frames, readable = [], []
    for frame in read_frames(options.bag, on_bad_frame=_ignore, given=given):
        readable.append(frame.stamp)
        if frame.stamp in shown:
            frames.append(frame)
    check_answers(readable, collected)
    states = {state.stamp: state for state in collected.states}
    lost = sum(stamp not in states or states[stamp].hand_lost for stamp in stamps)
    seconds = (collected.planned or 0.0) - (collected.started or collected.planned or 0.0)
    return DemoRecord(
        bag=Path(options.bag).resolve().name,
        frames=tuple(frames),
        objects=_started_from(collected),
        states=tuple(collected.states),
        grasps=tuple(collected.grasps),
        posteriors=tuple(collected.posteriors),
        plan=collected.plans[0] if collected.plans else None,
        robot_frame=_robot_frame(options.robot_bag, collected.robot_objects),
        robot_objects=collected.robot_objects[-1] if collected.robot_objects else None,
        database=_database(options.models, collected),
        frames_total=len(stamps),
        frames_lost=lost,
        frames_left_out=len(stamps) - len(readable),
        seconds=round(seconds, 3),
        written=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"),
        version=version("intent_imitation"),
        robot_hand=_robot_hand(options.library, collected),
    )


def _robot_hand(library: str, collected: Collected) -> GraspingHand | None:
    """Return the hand of the plan: the library's, else a shipped one of its name."""
    if not collected.plans:
        return None
    name = collected.plans[0].hand
    source = GraspLibrary.load(Path(library)).hand if library else name
    try:
        hand = GraspingHand.load(source)
    except ValueError:
        return None
    return hand if hand.name == name else None


def _database(models: str, collected: Collected) -> ObjectDatabase:
    """Return the known objects, and the shapes that were estimated of others."""
    database = ObjectDatabase.load(models or None)
    for answer in collected.objects:
        for item in answer.objects:
            if item.shape is not None and item.model not in database:
                database.learn(item.shape)
    return database


def write_all(record: DemoRecord, bag: str, folder: OwnFolder, stream: TextIO = sys.stdout) -> None:
    """Write and print what came of a run: first the result, then its comparison with the truth.

    Raises:
        ValueError: if the folder cannot be written.
    """
    folder.path.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".part-", dir=folder.path) as name:
        part = Path(name)
        folder.put(write_result(record, part), RESULT)
        try:
            record = replace(record, truth=truth_of(bag, record.states))
        except ValueError as error:
            stream.write(f"warning: {error}\n")
        folder.put(write_result(record, part), RESULT)
        print_result(record, stream)
        write_report(record, part)
        for file in sorted(part.iterdir()):
            folder.put(file, file.name)


def write_result(record: DemoRecord, folder: Path) -> Path:
    """Write result.json (CONTRACT: its keys) into a folder, made if missing; return its path."""
    path = folder / RESULT
    write_json(path, result(record), indent=2)
    return path


def print_result(record: DemoRecord, stream: TextIO = sys.stdout) -> None:
    """Print posterior, chosen object and grasp."""
    lines = [f"bag             {record.bag}: {record.frames_total} frames"]
    lines += [f"frames lost     {record.frames_lost}"]
    if record.frames_left_out:
        lines += [f"damaged         {record.frames_left_out} frames, left out"]
    if record.final is None:
        lines += ["stable grasp    none: nothing to conclude"]
    else:
        grasp, final = record.grasps[0], record.final
        lines += [f"stable grasp    of {grasp.object_id} at {grasp.stamp * 1e-9:.3f} s"]
        for task, probability in sorted(
            zip(final.tasks, final.probability, strict=True), key=lambda item: -item[1]
        ):
            lines += [f"  p({task:12s}) {probability:.3f}  {'#' * round(30 * probability)}"]
        lines += [f"task            {final.best or 'none of these'}"]
    if record.truth is not None:
        lines += [f"true task       {record.truth.task or 'none'}"]
    lines += _answer(record.plan)
    stream.write("\n".join(lines) + "\n")


def _answer(plan: GraspPlan | None) -> list[str]:
    if plan is None:
        return ["robot           no task to imitate, or one that BN^R does not know"]
    if not plan.grasps:
        return [f"robot           {plan.refusal}"]
    best = plan.grasps[0]
    x, y, z = best.T_table_hand[:3, 3]
    return [
        f"robot takes     {best.object_id}",
        f"robot grasp     {plan.hand} hand at ({x:.3f}, {y:.3f}, {z:.3f}) m, "
        f"score {best.score:.3f}, {'shaken' if best.shaken else 'not shaken'}",
    ]


def _started_from(collected: Collected) -> RecognizedObjects | None:
    """Return the answer that held when the hand came into view."""
    seen = next((state.stamp for state in collected.states if state.hand_visible), None)
    before = [o for o in collected.objects if seen is None or o.stamp < seen]
    if before:
        return before[-1]
    return collected.objects[0] if collected.objects else None


def _robot_frame(bag: str, objects: Sequence[RecognizedObjects]) -> RgbdFrame | None:
    if not bag or not objects:
        return None
    frames = read_frames(bag, on_bad_frame=_ignore)
    return next((frame for frame in frames if frame.stamp == objects[-1].stamp), None)


def _ignore(_: str) -> None:
    """Leave out a damaged frame: the nodes have warned about it."""
