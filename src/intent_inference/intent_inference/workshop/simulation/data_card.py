"""The data card of a table of simulated grasps: what is in it, how it came about, how it looks."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from intent_inference.grasping.autograsp import Fate
from intent_inference.quantisation.grasp_cells import Row
from intent_inference.workshop.simulation.labels import TASKS, load_rules
from intent_inference.workshop.simulation.simulated_grasp import load_grasps
from intent_inference.workshop.simulation.simulation_benchmark import CELLS, SHAPES
from intent_perception.basics.safe_files import write_text

_TABLE_II = {"hand-over": 996, "pouring": 860, "tool-use": 986, "dish-washing": 457}
"""Simulated positives of the paper's Table II; it has as many negatives."""
_BINS = np.array([-5.01, -2.0, -1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 2.0, 5.01])


def write_data_card(
    folder: Path, hand: str, rows: Sequence[Row], archives: Sequence[Path], command: str
) -> None:
    """Write `HAND.md` with the counts of a table, beside the table's pictures.

    Args:
        folder: where the card and, in `sheets/`, the pictures are.
        hand: name of the hand.
        rows: the table.
        archives: archives of all grasps that were tried for it.
        command: what rebuilds the table.
    """
    lines = [
        f"# Simulated grasps: {hand} hand",
        "",
        f"{len(rows)} grasps that survived the shake test, label rules version "
        f"{load_rules()['version']}. Rebuilt by `{command}`.",
        "All of it is synthetic: parametric objects, a kinematic hand, rigid bodies. No person "
        "labelled anything; labels follow share/label_rules.yaml.",
        "",
        *_task_table(rows),
        "",
        *_cell_table(rows),
        "",
        *_count_table("pre-shape", Counter(str(row["preshape"]) for row in rows)),
        "",
        *_fate_table(archives),
        "",
        *_margin_table(rows),
        *_pictures(folder, hand),
    ]
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / f"{hand}.md", "\n".join(lines) + "\n")


def _pictures(folder: Path, hand: str) -> list[str]:
    """Return links to the sheets that lie beside the card."""
    links = [
        f"![{task} with a {kind}](sheets/{hand}_{kind}_{task}.jpg)"
        for task, kind in CELLS
        if (folder / "sheets" / f"{hand}_{kind}_{task}.jpg").is_file()
    ]
    title = "## Pictures: positives (green) and nearest or typical negatives (red)"
    return ["", title, "", *links] if links else []


def _task_table(rows: Sequence[Row]) -> list[str]:
    lines = [
        "| task | positives | negatives | base rate | Table II (positives = negatives) |",
        "| --- | --- | --- | --- | --- |",
    ]
    for task in TASKS:
        positives, negatives = _counts(rows, task)
        rate = positives / max(positives + negatives, 1)
        lines.append(f"| {task} | {positives} | {negatives} | {rate:.2f} | {_TABLE_II[task]} |")
    return lines


def _cell_table(rows: Sequence[Row]) -> list[str]:
    lines = [
        "Positives / negatives per class and task:",
        "",
        "| class | " + " | ".join(TASKS) + " |",
        "| --- " * (len(TASKS) + 1) + "|",
    ]
    kinds = [*SHAPES, *sorted({str(row["object_class"]) for row in rows} - set(SHAPES))]
    for kind in kinds:
        members = [row for row in rows if row["object_class"] == kind]
        cells = (" / ".join(map(str, _counts(members, task))) for task in TASKS)
        lines.append(f"| {kind} | " + " | ".join(cells) + " |")
    return lines


def _fate_table(archives: Sequence[Path]) -> list[str]:
    fates = np.zeros(len(Fate))
    for path in archives:
        if path.is_file():
            fates += load_grasps(path)[1]["fates"]
    return _count_table(
        "what became of a try",
        Counter({fate.name.lower(): int(fates[fate]) for fate in Fate if fates[fate]}),
    )


def _count_table(title: str, counts: Counter[str]) -> list[str]:
    total = max(counts.total(), 1)
    lines = [f"| {title} | count | share |", "| --- | --- | --- |"]
    for name, count in counts.most_common():
        lines.append(f"| {name} | {count} | {count / total:.3f} |")
    return lines


def _margin_table(rows: Sequence[Row]) -> list[str]:
    """Return histograms of the tasks' margins where the class can afford the task at all."""
    edges = [f"{low:.1f}" for low in _BINS[:-1]]
    lines = [
        "Margins (value − threshold, scaled; from 0 on the task is afforded), grasps per bin that "
        "starts at:",
        "",
        "| task | " + " | ".join(edges) + " |",
        "| --- " * (len(edges) + 1) + "|",
    ]
    for task in TASKS:
        kinds = {kind for name, kind in CELLS if name == task}
        cells = [
            row.get(f"margin_{task.replace('-', '_')}", "")
            for row in rows
            if row["object_class"] in kinds
        ]
        values = np.array([float(cell) for cell in cells if cell != ""])
        counts = np.histogram(values, _BINS)[0]
        lines.append(f"| {task} | " + " | ".join(map(str, counts)) + " |")
    return lines


def _counts(rows: Sequence[Row], task: str) -> tuple[int, int]:
    return sum(row[task] == 1 for row in rows), sum(row[task] == 0 for row in rows)
