"""Generation over many objects: one archive per object, in parallel, resumed where it stopped."""

import re
import time
import zlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference import SHARE
from intent_inference.grasping.autograsp import Fate
from intent_inference.grasping.grasp_candidates import FilterConfig
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.quantisation.grasp_cells import Row
from intent_inference.workshop.simulation.generation import GenerationConfig, GraspGenerator
from intent_inference.workshop.simulation.grasp_table import (
    balanced,
    read_rows,
    row_of_grasp,
    without_duplicates,
    write_rows,
)
from intent_inference.workshop.simulation.labels import RULES, TASKS
from intent_inference.workshop.simulation.simulated_grasp import (
    SimulatedGrasp,
    load_grasps,
    save_grasps,
)
from intent_inference.workshop.simulation.stability import ShakeConfig
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_yaml
from intent_perception.basics.parameters import Checked
from intent_perception.objects.database import ObjectDatabase, ObjectModel

SETTINGS = SHARE / "simulation.yaml"
BACKENDS = ("loky", "threading", "dask", "ray")
_SAVE_EVERY = 3
"""Rounds between two saves of an unfinished object."""


@dataclass(frozen=True)
class CampaignConfig(Checked):
    """What to generate and where."""

    hand: str
    """Name or file of the hand."""
    archive: Path
    """Folder of the archives; each hand has its own folder in it."""
    models: str | None = None
    """Object database; None = the shipped one."""
    held_per_object: int = 100
    """Grasps that hold, per object, 1..100000."""
    most_rounds: int = 400
    """An object that gives fewer is left after this many rounds, 1..100000."""
    seed: int = 0
    """Seed of the hypotheses, together with hand, object and round, 0..2147483647."""
    generation: GenerationConfig = field(default_factory=GenerationConfig)
    """How the grasps of one object are generated."""

    def path_of(self, name: str) -> Path:
        """Return the archive of an object."""
        return self.archive / Path(self.hand).stem / f"{name}.npz"


@dataclass(frozen=True)
class Progress:
    """What a worker reports about an object."""

    name: str
    held: int
    seconds: float
    """CPU time spent in this run."""
    problem: str = ""
    """Why the object was refused."""


def settings(path: Path = SETTINGS) -> GenerationConfig:
    """Return the generation settings of a YAML file, by default those of the shipped data."""
    values = read_yaml(path) or {}
    try:
        return GenerationConfig(
            **values.get("generation", {}),
            shake=ShakeConfig(**values.get("shake", {})),
            filter=FilterConfig(**values.get("filter", {})),
        )
    except TypeError as error:
        raise ValueError(f"{path}: {error}") from error


def generate_all(
    config: CampaignConfig,
    names: Sequence[str],
    jobs: int = 1,
    backend: str = "loky",
    report: Callable[[Progress], None] | None = None,
) -> list[Progress]:
    """Generate grasps of the named objects in parallel; finished objects are skipped.

    Args:
        config: what to generate.
        names: objects of the database.
        jobs: number of workers (local backends).
        backend: one of `BACKENDS`; for dask and ray a client must be connected.
        report: called after each object.

    Returns:
        One progress per object, in the order of `names`.
    """
    from joblib import Parallel, delayed

    with _backend(backend, jobs):
        parallel = Parallel(n_jobs=jobs, return_as="generator")
        done = []
        for progress in parallel(delayed(generate_object)(config, name) for name in names):
            done.append(progress)
            if report is not None:
                report(progress)
    return done


def generate_object(config: CampaignConfig, name: str) -> Progress:
    """Bring one object's archive to the wanted number of grasps that hold."""
    start = time.process_time()
    path = config.path_of(name)
    grasps, rounds, fates, seconds = _resumed(path)
    held = sum(grasp.held for grasp in grasps)
    if held >= config.held_per_object or rounds >= config.most_rounds:
        return Progress(name, held, 0.0)
    try:
        target = _target(config.models, name)
    except ValueError as error:
        return Progress(name, 0, 0.0, str(error))
    hand = GraspingHand.load(config.hand)
    rng = np.random.default_rng([config.seed, zlib.crc32(f"{hand.name}/{name}".encode()), rounds])
    wishes = replace(config.generation, wanted=config.held_per_object)
    with GraspGenerator(target, hand, rng, wishes) as generator:
        generator.remember(grasps)
        while held < config.held_per_object and rounds < config.most_rounds:
            fresh = generator.round()
            grasps += fresh
            rounds += 1
            held += sum(grasp.held for grasp in fresh)
            if rounds % _SAVE_EVERY == 0 or held >= config.held_per_object or not fresh:
                _save(path, grasps, rounds, fates, seconds, generator)
            if not fresh and rounds >= 5 and held == 0:
                break
        _save(path, grasps, rounds, fates, seconds, generator)
    rows_of_object(config, name)  # while distance field and receivers are at hand
    return Progress(name, held, time.process_time() - start)


def rows_of_object(config: CampaignConfig, name: str) -> list[Row]:
    """Return the distinct grasps of an archive that hold, with features and labels.

    Rows are kept beside the archive until grasps or label rules change.
    """
    path = config.path_of(name)
    if not path.is_file():
        return []
    grasps = distinct_held(path)
    kept = path.with_name(f"{name}.{_fingerprint(grasps)}.csv.gz")
    if not kept.is_file():
        target, hand = _target(config.models, name), GraspingHand.load(config.hand)
        _write_kept(kept, name, [row_of_grasp(target, hand, grasp) for grasp in grasps])
    return [_with_numbers(row) for row in read_rows(kept)]


def _write_kept(kept: Path, name: str, rows: list[Row]) -> None:
    """Write the rows of an object in place of older ones."""
    write_rows(kept, rows)
    for old in kept.parent.iterdir():
        if old != kept and re.fullmatch(rf"{re.escape(name)}\.[0-9a-f]{{8}}\.csv\.gz", old.name):
            old.unlink()


def _fingerprint(grasps: Sequence[SimulatedGrasp]) -> str:
    """Return a name for what the rows depend on: label rules and grasps."""
    poses = np.array([grasp.T_object_hand for grasp in grasps])
    return f"{zlib.crc32(RULES.read_bytes() + poses.tobytes()):08x}"


def _with_numbers(row: dict[str, str]) -> Row:
    """Return a row of a table with its labels as 0, 1 or empty."""
    labels: Row = {task: int(row[task]) if row[task] else "" for task in TASKS}
    return {**row, **labels}


def distinct_held(path: Path) -> list[SimulatedGrasp]:
    """Return the grasps of an archive that hold, without near-duplicates."""
    held = [grasp for grasp in load_grasps(path)[0] if grasp.held]
    if not held:
        return []
    kept = without_duplicates(
        np.array([grasp.T_object_hand for grasp in held]),
        np.array([grasp.joints for grasp in held]),
    )
    return [held[index] for index in kept]


def all_rows(config: CampaignConfig, names: Sequence[str], jobs: int = 1) -> list[Row]:
    """Return the rows of all objects, balanced so that no object gives most of a task."""
    from joblib import Parallel, delayed

    parts = Parallel(n_jobs=jobs)(delayed(rows_of_object)(config, name) for name in names)
    return balanced([row for part in parts for row in part])


def _database(source: str | None) -> ObjectDatabase:
    if source not in _DATABASES:
        _DATABASES[source] = ObjectDatabase.load(source, alone=True)
    return _DATABASES[source]


@lru_cache(maxsize=1)
def _target(source: str | None, name: str) -> TaskObject:
    return TaskObject(_database(source)[name])


_DATABASES: dict[str | None, ObjectDatabase] = {}
"""One per worker: a database takes longer to load than a grasp to simulate."""


def object_models(source: str | None) -> tuple[ObjectModel, ...]:
    """Return the objects of a database."""
    return _database(source).models


def _resumed(path: Path) -> tuple[list[SimulatedGrasp], int, Array, Array]:
    if not path.is_file():
        return [], 0, np.zeros(len(Fate)), np.zeros(3)
    grasps, arrays = load_grasps(path)
    return grasps, int(arrays["rounds"]), arrays["fates"], arrays["seconds"]


def _save(
    path: Path,
    grasps: list[SimulatedGrasp],
    rounds: int,
    fates: Array,
    seconds: Array,
    generator: GraspGenerator,
) -> None:
    now = np.array([generator.fates[fate] for fate in Fate], dtype=np.float64)
    spent = np.array([generator.seconds[stage] for stage in ("try", "choose", "shake")])
    save_grasps(path, grasps, rounds=np.array(rounds), fates=fates + now, seconds=seconds + spent)


def _backend(name: str, jobs: int) -> AbstractContextManager[Any]:
    """Return joblib's context for a backend; dask and ray reach other machines."""
    from joblib import parallel_config

    if name not in BACKENDS:
        raise ValueError(f"expected a backend of {BACKENDS}, got {name!r}")
    if name == "ray":
        from ray.util.joblib import register_ray

        register_ray()
    return nullcontext() if jobs == 1 and name == "loky" else parallel_config(name)
