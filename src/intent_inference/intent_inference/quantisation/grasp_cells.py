"""Features of one grasp as the cells of a row, in the columns that `train` reads."""

import csv
import gzip
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_bytes
from intent_tracking.grasp.grasp_features import GraspFeatures

Row = dict[str, str | float | int]
"""One grasp: column to value; a column that is not there is unknown."""


def feature_cells(features: GraspFeatures) -> Row:
    """Return Table I as cells; a variable that was not observed gives no cell."""
    row: Row = {"object_class": features.object_class or ""}
    for name in ("size", "conv", "dir", "npos", "fcon", "fvol", "coc", "gbvl"):
        values = getattr(features, name)
        if values is None:
            continue
        if name in ("conv", "fvol"):
            row[name] = float(values[0])
        elif name == "dir":
            row.update({f"dir_{axis}": float(v) for axis, v in zip("xyzw", values, strict=True)})
        else:
            row.update(vector_cells(name, values))
    return row


def vector_cells(name: str, values: Array) -> Row:
    """Return the numbers of a vector as numbered cells."""
    return {f"{name}_{index}": float(value) for index, value in enumerate(values)}


def write_cells(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> None:
    """Write rows to a CSV file, compressed if its name ends in .gz; equal rows give equal bytes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_text(row.get(name, "")) for name in columns] for row in rows)
    content = text.getvalue().encode()
    write_bytes(path, gzip.compress(content, mtime=0) if path.suffix == ".gz" else content)


def _text(value: str | float | int) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
