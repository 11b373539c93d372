"""Command: tables of labelled grasps to one, as training BN^R asks for.

python -m intent_imitation.build_table schunk.csv.gz tabletop.csv.gz --out robot.csv.gz
python -m intent_inference.train --data robot.csv.gz --out schunk.npz
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from intent_inference.quantisation.grasp_cells import Row
from intent_inference.workshop.simulation.grasp_table import read_rows, write_rows
from intent_perception.basics.safe_files import output_file


def join_tables(paths: Sequence[Path], out: Path) -> int:
    """Write the rows of several data sets to one file and return how many there are."""
    rows: list[Row] = [dict(row) for path in paths for row in read_rows(path)]
    write_rows(out, rows)
    return len(rows)


def main() -> None:
    """Join tables and print the number of rows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("tables", type=Path, nargs="+", help="tables of `simulate` or `practise`")
    parser.add_argument("--out", type=output_file, required=True, help="table, .csv or .csv.gz")
    options = parser.parse_args()
    print(f"{options.out}: {join_tables(options.tables, options.out)} grasps")
