"""How does a program look at a run? Fields as xarray, particles and budgets as pandas, pieces as
meshes. Needs neither PETSc nor MPI.

    from solver.results.reading import Run
    run = Run("out/window")
    run.fields()["T"].sel(time=0.02, method="nearest").max()      # read when it is needed
    run.particles(40)              # one row per particle
    run.budgets()                  # one row per step
    run.pieces(40).plot()          # pyvista

Positions are those of the box; u, v, w have coordinates of their own axis (x_u, y_v, z_w), because
they stand on faces. Needs xarray, pandas, pyvista (`runs/setup_ecosystem.sh`), each only where it
is asked for.
"""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition import fragments
from solver.files import (FileError, chosen_frames, read_part, read_shapes, read_snapshot,
                          read_steps)
from solver.results.pose import posed

FACES = {"u": "x", "v": "y", "w": "z"}


class Run:
    """The folder of a run. Raises `FileError` where it holds none."""

    def __init__(self, directory: str | Path):
        self.directory = Path(directory)
        self.frames = chosen_frames(self.directory)

    @cached_property
    def times(self) -> NDArray[np.float64]:
        """(frames,) s."""
        return np.array([read_shapes(self.directory, frame)[0] for frame in self.frames])

    @cached_property
    def fragments(self) -> fragments.Fragments:
        """The pieces at rest."""
        return fragments.read(self.directory / "fragments.h5")

    def fields(self, names: Sequence[str] | None = None) -> Any:
        """xarray.Dataset of fields over (time, z, y, x); nothing is read until it is used."""
        import xarray

        _, shapes = read_shapes(self.directory, self.frames[0])
        arrays = {}
        for path, (shape, kind, size, origin, spacing) in shapes.items():
            group, name = path.split("/", 1)
            if group != "fields" or names is not None and name not in names:
                continue
            axes = [f"{axis}_{name}" if FACES.get(name) == axis else axis for axis in "zyx"]
            places = {axis: start + step * np.arange(count) for axis, start, step, count in
                      zip(axes, origin[::-1], spacing[::-1], shape, strict=True)}
            lazy = _lazy(self, path, shape, np.dtype(f"{kind}{size}"))
            arrays[name] = xarray.DataArray(
                xarray.Variable(("time", *axes), lazy), {"time": self.times, **places})
        return xarray.Dataset(arrays, attrs={"run": str(self.directory)})

    def particles(self, frame: int, species: str = "fuel") -> Any:
        """pandas.DataFrame of a frame, by id: x, y, z and every stored column."""
        import pandas

        columns = read_snapshot(self.directory, frame, ()).particles
        if species not in columns:
            raise FileError(f"{self.directory}: frame {frame} holds no particles of {species}; "
                            f"fix: one of {', '.join(columns) or 'another run'}")
        return pandas.DataFrame(flat(columns[species])).set_index("id").sort_index()

    def bodies(self) -> Any:
        """pandas.DataFrame of the pieces over time, by (frame, piece)."""
        import pandas

        tables = []
        for frame, time in zip(self.frames, self.times, strict=True):
            stored = read_snapshot(self.directory, frame, ()).bodies
            table = flat({name: column for name, column in stored.items() if name != "vertices"})
            tables.append(pandas.DataFrame({"frame": frame, "time": time, **table}))
        return pandas.concat(tables).rename_axis("piece").set_index("frame", append=True)

    def budgets(self) -> Any:
        """pandas.DataFrame of the steps: time, dt, energy, divergence, burnt mass, gas, ..."""
        import pandas

        records = read_steps(self.directory)
        if not records:
            raise FileError(f"{self.directory}/run.log.jsonl: holds no steps; fix: run the solver "
                            "again")
        return pandas.DataFrame(records).set_index("step")

    def pieces(self, frame: int) -> Any:
        """pyvista.MultiBlock: the pieces where they are in a frame, by name of body and number."""
        import pyvista

        found, blocks = self.fragments, pyvista.MultiBlock()
        places = posed(found, read_snapshot(self.directory, frame, ()).bodies)
        for index in range(found.count):
            first, last = found.vertex_start[index:index + 2]
            _, faces = found.piece(index)
            cells = np.column_stack([np.full(len(faces), 3), faces])
            blocks[f"{found.names[found.body[index]]} {index}"] = pyvista.PolyData(
                places[first:last], cells.ravel())
        return blocks


def flat(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of one number each: position becomes x, y, z, velocity velocity_x, ..."""
    result = {}
    for name, values in columns.items():
        if values.ndim == 1:
            result[name] = values
            continue
        letters = "wxyz" if values.shape[1] == 4 else "xyz"
        for column, letter in enumerate(letters):
            result[letter if name == "position" else f"{name}_{letter}"] = values[:, column]
    return result


def _lazy(run: Run, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Any:
    """An array over (time, *shape) of which xarray reads the frames and regions that it needs."""
    from xarray.backends import BackendArray
    from xarray.core import indexing

    class Frames(BackendArray):   # type: ignore[misc, unused-ignore]
        def __init__(self) -> None:
            self.shape, self.dtype = (len(run.frames), *shape), dtype

        def __getitem__(self, key: Any) -> Any:
            return indexing.explicit_indexing_adapter(
                key, self.shape, indexing.IndexingSupport.BASIC, self.read)

        def read(self, key: tuple[Any, ...]) -> NDArray[Any]:
            frames = run.frames[key[0]]
            if isinstance(frames, int):
                return read_part(run.directory, frames, name, key[1:])
            return np.stack([read_part(run.directory, frame, name, key[1:]) for frame in frames])

    return indexing.LazilyIndexedArray(Frames())
