"""How does VTK open all times of a run as one? VTKHDF 2.0 files with a group "Steps".

    image       the cells: fields stay in the snapshots, the file shows them (virtual datasets; a
                snapshot that is gone reads as NaN)
    surfaces    points, or points joined to triangles, whose number may differ from time to time

Layout: "VTKHDF file format", docs.vtk.org; offsets of step s say where its values start.
"""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from solver.files import SNAPSHOT, FileError, open_file, snapshot_path
from solver.files_whole import finished_file

VERSION = np.array([2, 0])
TOPOLOGIES = ("Vertices", "Lines", "Polygons", "Strips")   # the order of VTK's offsets


def write_image(path: Path, run: Path, frames: Sequence[int], names: Sequence[str],
                times: Sequence[float]) -> None:
    """The fields `names` (of the cells) of the snapshots, over time; raises `FileError`."""
    with open_file(snapshot_path(run, frames[0]), SNAPSHOT) as file:
        kinds = {name: (file[f"fields/{name}"].shape, file[f"fields/{name}"].dtype)
                 for name in names}
        spacing = np.array(file[f"fields/{names[0]}"].attrs["spacing"], float)
    nz, ny, nx = kinds[names[0]][0]
    with finished_file(path, durable=False) as file:
        root = file.create_group("VTKHDF")
        root.attrs.update({"Version": VERSION, "Type": np.bytes_("ImageData"),
                           "WholeExtent": np.array([0, nx, 0, ny, 0, nz]), "Origin": np.zeros(3),
                           "Spacing": spacing, "Direction": np.eye(3).ravel()})
        steps = _steps(root, times)
        offsets = steps.create_group("CellDataOffsets")
        for name, (shape, dtype) in kinds.items():
            layout = h5py.VirtualLayout((len(frames), *shape), dtype)
            for step, frame in enumerate(frames):
                source = os.path.relpath(snapshot_path(run, frame), path.parent)
                layout[step] = h5py.VirtualSource(source, f"fields/{name}", shape, dtype)
            root.create_virtual_dataset(f"CellData/{name}", layout, fillvalue=np.nan)
            offsets[name] = np.arange(len(frames))


def write_surfaces(path: Path, times: Sequence[float], points: Sequence[NDArray[Any]],
                   triangles: NDArray[Any] | None, values: Sequence[Mapping[str, NDArray[Any]]],
                   cell_values: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Points (n, 3) of each time with values per point; with `triangles` (m, 3), the same at all
    times, they are joined to faces with `cell_values`, else each is a cell of its own."""
    counts = np.array([len(p) for p in points])
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    steps_number = len(times)
    with finished_file(path, durable=False) as file:
        root = file.create_group("VTKHDF")
        root.attrs.update({"Version": VERSION, "Type": np.bytes_("PolyData")})
        steps = _steps(root, times)
        root["Points"] = np.concatenate(points).astype(np.float32)
        root["NumberOfPoints"] = counts
        steps["PartOffsets"], steps["PointOffsets"] = np.arange(steps_number), starts
        steps["NumberOfParts"] = np.ones(steps_number, int)
        cell_starts = np.zeros((steps_number, len(TOPOLOGIES)), int)
        id_starts = np.zeros_like(cell_starts)
        for column, topology in enumerate(TOPOLOGIES):
            group = root.create_group(topology)
            if topology == "Vertices" and triangles is None:
                cells, width, rows = counts, 1, [np.arange(n) for n in counts]
            elif topology == "Polygons" and triangles is not None:
                cells, width = np.full(steps_number, len(triangles)), 3
                rows = [triangles.ravel()] * steps_number
            else:
                cells, width, rows = np.zeros(steps_number, int), 1, [np.zeros(0, int)]
            group["NumberOfCells"], group["NumberOfConnectivityIds"] = cells, cells * width
            group["Connectivity"] = np.concatenate(rows).astype(np.int64)
            group["Offsets"] = np.concatenate([width * np.arange(n + 1) for n in cells])
            cell_starts[1:, column] = np.cumsum(cells)[:-1]
            id_starts[1:, column] = np.cumsum(cells * width)[:-1]
        steps["CellOffsets"], steps["ConnectivityIdOffsets"] = cell_starts, id_starts
        for name in values[0]:
            root[f"PointData/{name}"] = np.concatenate([found[name] for found in values])
            steps[f"PointDataOffsets/{name}"] = starts
        for name, column_values in (cell_values or {}).items():
            root[f"CellData/{name}"] = column_values
            steps[f"CellDataOffsets/{name}"] = np.zeros(steps_number, int)


def _steps(root: h5py.Group, times: Sequence[float]) -> h5py.Group:
    if not len(times):
        raise FileError("no frames to write; fix: choose at least one")
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = len(times)
    steps["Values"] = np.asarray(times, float)
    return steps
