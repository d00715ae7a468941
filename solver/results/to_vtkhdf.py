"""A run as VTKHDF with all times: cells, particles of each species, pieces in their places."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from partition import fragments
from solver.files import Snapshot, read_shapes
from solver.files_vtkhdf import write_image, write_surfaces
from solver.results.pose import moments, posed

FACES = "uvw"


def write(run: Path, output: Path, frames: Sequence[int]) -> list[Path]:
    """Write cells.vtkhdf, SPECIES.vtkhdf and pieces.vtkhdf; returns the files."""
    _, shapes = read_shapes(run, frames[0])
    snapshots = moments(run, frames)
    times = [snapshot.time for snapshot in snapshots]
    made = []
    cells = [name[7:] for name in shapes if name.startswith("fields/") and name[7:] not in FACES]
    if cells:
        made.append(output / "cells.vtkhdf")
        write_image(made[-1], run.resolve(), frames, cells, times)
    for species in snapshots[0].particles:
        made.append(output / f"{species}.vtkhdf")
        columns = [snapshot.particles[species] for snapshot in snapshots]
        write_surfaces(made[-1], times, [c["position"] for c in columns], None,
                       [{name: values for name, values in c.items() if name != "position"}
                        for c in columns])
    if snapshots[0].bodies:
        made.append(output / "pieces.vtkhdf")
        _pieces(run, made[-1], times, snapshots)
    return made


def _pieces(run: Path, path: Path, times: Sequence[float], snapshots: Sequence[Snapshot]) -> None:
    found = fragments.read(run / "fragments.h5")
    owner = found.piece_of_vertex
    velocities = [{"velocity": np.asarray(snapshot.bodies["velocity"], np.float32)[owner]}
                  for snapshot in snapshots]
    write_surfaces(path, times, [posed(found, snapshot.bodies) for snapshot in snapshots],
                   found.faces, velocities, {"piece": found.piece_of_face})
