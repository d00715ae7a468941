"""A run as tables of text: particles and pieces frame by frame, and the budgets of its steps."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solver.files import read_snapshot, read_steps
from solver.results.reading import flat


def write(run: Path, output: Path, frames: Sequence[int]) -> list[Path]:
    """Write SPECIES_NNNNNN.csv, pieces_NNNNNN.csv and budgets.csv; returns the files."""
    made = []
    for frame in frames:
        snapshot = read_snapshot(run, frame, ())
        tables = dict(snapshot.particles)
        if snapshot.bodies:
            tables["pieces"] = {name: column for name, column in snapshot.bodies.items()
                                if name != "vertices"}
        for kind, columns in tables.items():
            made.append(_table(output / f"{kind}_{frame:06d}.csv", flat(columns)))
    if records := read_steps(run):
        names = list(dict.fromkeys(name for record in records for name in record))
        made.append(output / "budgets.csv")
        with open(made[-1], "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, names)
            writer.writeheader()
            writer.writerows(records)
    return made


def _table(path: Path, columns: Mapping[str, Any]) -> Path:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(np.asarray(column).tolist() for column in columns.values()),
                             strict=True))
    return path
