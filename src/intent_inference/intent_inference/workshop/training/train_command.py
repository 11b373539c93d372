"""Command: a table of labelled grasps to a model, or more demonstrations into one.

python -m intent_inference.train --data D.csv.gz --out MODEL.npz [--figures DIR]
python -m intent_inference.train add --model MODEL.npz --data MORE.csv.gz [--out NEW.npz]
python -m intent_inference.train add --model MODEL.npz --data R.npz R.json … --shown TASK
    [--person-priors PERSON.yaml] --out PERSON.npz

Recordings are timelines (.npz) as `observe` reads them or what it wrote (.json). With
`--person-priors` the file, new or there, takes in what this person was seen to mean.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from intent_inference.intention.class_priors import ClassPriors
from intent_inference.network.model_file import load_model, save_model
from intent_inference.network.structure import TASK
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.training.fitting import (
    DEFAULT_RECIPES,
    NetworkRecipe,
    TrainingConfig,
    train,
)
from intent_inference.workshop.training.labelled_table import GraspTable, read_grasps
from intent_inference.workshop.training.shown_grasps import shown_grasps
from intent_inference.workshop.training.updating import add_demonstrations
from intent_perception.basics.safe_files import check_place, output_file

_RECORDINGS = (".npz", ".json")


def recipes_of(text: str) -> tuple[NetworkRecipe, ...]:
    """Return the recipes of a list such as "paper/paper,tan/information"; empty: the default."""
    if not text:
        return DEFAULT_RECIPES
    recipes = []
    for item in text.split(","):
        structure, _, states = item.partition("/")
        recipes.append(NetworkRecipe(structure, states or "information"))
    return tuple(recipes)


def left_out(table: GraspTable, model: TaskModel) -> list[str]:
    """Return a sentence about everything in a table that does not count in a model."""
    said = []
    for task, labels in table.labels.items():
        if task not in model.tasks:
            yes, no = int((labels == 1.0).sum()), int((labels == 0.0).sum())
            said.append(f"task {task}: {yes} grasps afford it and {no} do not; both are needed")
    if table.unused:
        said.append(f"columns {', '.join(table.unused)}: neither features nor labels")
    for name in table.features:
        if name not in model.variables:
            said.append(f"variable {name}: it has no ten known values")
    names = set(np.asarray(table.features.get(OBJECT_CLASS, []), dtype=str).tolist()) - {""}
    if strange := sorted(names - set(model.classes)):
        said.append(f"object classes {', '.join(strange)}: the model does not know them")
    return said


def _tell(table: GraspTable, model: TaskModel) -> None:
    for sentence in left_out(table, model):
        print(f"left out: {sentence}", file=sys.stderr)


def _train(arguments: argparse.Namespace) -> TaskModel:
    table = read_grasps(arguments.data, _asked(arguments))
    config = TrainingConfig(recipes=recipes_of(arguments.structure))
    rng = np.random.default_rng(arguments.seed)
    model = train(table, rng, config)
    _tell(table, model)
    if arguments.figures:
        _draw(table, model, Path(arguments.figures), arguments.seed)
    return model


def _draw(table: GraspTable, model: TaskModel, folder: Path, seed: int) -> None:
    """Draw Fig. 2 of every variable, and Fig. 4: the paper's graphs and the first of ours."""
    from intent_inference.workshop.training.learning_figures import draw_structures, draw_training

    draw_training(table, np.random.default_rng(seed), folder)
    draw_structures(model, folder / "fig4_ours.png")
    greedy = TrainingConfig(recipes=(NetworkRecipe("paper", "information"),), masks=())
    paper = train(table, np.random.default_rng(seed), greedy)
    draw_structures(paper, folder / "fig4_paper_recipe.png")
    for networks in paper.networks:
        parents = networks.members[0].parents
        children = ", ".join(v for v, chosen in parents.items() if TASK in chosen) or "none"
        above = ", ".join(parents[TASK]) or "none"
        print(f"  greedy BIC, {networks.task}: children of the task: {children}; parents: {above}")


def _add(arguments: argparse.Namespace) -> TaskModel:
    model = load_model(arguments.model)
    if all(path.suffix in _RECORDINGS for path in arguments.data):
        table = shown_grasps(arguments.data, arguments.shown, arguments.models)
    elif len(arguments.data) == 1:
        table = read_grasps(arguments.data[0], _asked(arguments))
    else:
        raise ValueError(f"expected one table or recordings {_RECORDINGS}, got {arguments.data}")
    _tell(table, model)
    taught = add_demonstrations(model, table, arguments.weight)
    if arguments.person_priors is not None:
        _save_habits(table, model.tasks, arguments.person_priors)
    return taught


def _asked(arguments: argparse.Namespace) -> list[str] | None:
    return arguments.tasks.split(",") if arguments.tasks else None


def _save_habits(table: GraspTable, tasks: tuple[str, ...], path: Path) -> None:
    """Count what a person meant with which class into the priors of a file, new or there."""
    priors = ClassPriors.load(path) if path.is_file() else ClassPriors({})
    kinds = np.asarray(table.features.get(OBJECT_CLASS, np.full(table.rows, "")), dtype=str)
    shown = [
        (str(kind), task)
        for task in tasks
        for kind in kinds[table.labels.get(task, np.zeros(table.rows)) == 1.0]
        if kind
    ]
    priors.after(shown, tasks).save(path)


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_inference.train",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=output_file, help="model file to write")
    parser.add_argument("--tasks", default="", help="label columns, by commas; default: all found")
    arguments_list = sys.argv[1:] if argv is None else argv
    adding = arguments_list[:1] == ["add"]
    if adding:
        parser.add_argument(
            "--data", type=Path, nargs="+", required=True,
            help="CSV of grasps, columns as of `simulate`, or recordings",
        )  # fmt: skip
        parser.add_argument("--shown", default="", help="task that the recordings show")
        parser.add_argument("--models", default="", help="object database of the recordings")
        parser.add_argument("--person-priors", type=Path, help="priors file to count habits into")
        parser.add_argument("--model", required=True, help="model file to add to")
        parser.add_argument("--weight", type=float, default=1.0, help="how much a grasp counts")
    else:
        parser.add_argument("--data", required=True, help="CSV of grasps, columns of `simulate`")
        parser.add_argument("--seed", type=int, default=1)
        parser.add_argument(
            "--structure", default="",
            help="networks to average, e.g. paper/paper,tan/information,class-tan/8",
        )  # fmt: skip
        parser.add_argument("--figures", help="folder for Figs. 2 and 4")
    arguments = parser.parse_args(arguments_list[1:] if adding else arguments_list)
    out = arguments.out or (arguments.model if adding else None)
    if out is None:
        parser.error("expected --out MODEL")
    started = time.process_time()
    try:
        check_place(out)  # the model itself, where no other is named
        model = _add(arguments) if adding else _train(arguments)
        save_model(model, out)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    seconds = time.process_time() - started
    print(f"{out}: {len(model.tasks)} tasks {', '.join(model.tasks)}; {seconds:.1f} s CPU")
    for networks in model.networks:
        print(f"  {networks.task}: {', '.join(member.recipe for member in networks.members)}")
    return 0
