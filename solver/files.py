"""What is stored, where, and how is it read back? With `files_*`, all that knows HDF5.

A file appears under its name only when it is complete (`files_whole`). Every file carries `format`
and `complete` in its root attributes; the checksums of a run's files stand beside them in
SHA256SUMS (`files_checksum`). Nothing here needs PETSc or MPI: a parallel writer (`files_write`) is
handed its communicator.

A snapshot (one file per frame) holds
    /                       format, complete, time [s], frame, step, dt [s], title
    /fields/NAME            (nz, ny, nx), indexed [k, j, i]; attributes spacing and origin in
                            x, y, z order: the value [k, j, i] sits at origin + (i, j, k) * spacing;
                            u, v, w sit on faces and have one more value along their own axis
    /particles/SPECIES/NAME (n,) or (n, 3): position, velocity, temperature, mass, id, ...
    /bodies/NAME            one row per piece: position, orientation (w, x, y, z), velocity,
                            angular_velocity, rest_centre, mass, temperature (where there is T);
                            a vertex at rest X stands at position + R(orientation) (X - rest_centre)
    /bodies/vertices        (nv, 3) where a body is soft: X, in place of the fragments' vertices
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
from numpy.typing import NDArray

SNAPSHOT = "brisance-snapshot"
CHECKPOINT = "brisance-checkpoint"

Array = NDArray[Any]
Attributes = Mapping[str, Any]


class FileError(Exception):
    """A file that cannot be used; the message is one line for the user."""


class WriteError(FileError):
    """A file that cannot be written, a full disk most often; what was there before is intact."""


def snapshot_path(directory: str | Path, frame: int) -> Path:
    """Where the snapshot of a frame is stored."""
    return Path(directory) / "snapshots" / f"snap_{frame:06d}.h5"


def snapshot_frames(directory: str | Path) -> list[int]:
    """The frames that have a finished snapshot, in order."""
    return sorted(int(path.stem[5:]) for path in (Path(directory) / "snapshots").glob("snap_*.h5"))


def checkpoint_path(directory: str | Path, step: int) -> Path:
    """Where the full state after a step is stored."""
    return Path(directory) / "checkpoints" / f"chk_{step:08d}.h5"


def checkpoint_paths(directory: str | Path) -> list[Path]:
    """The checkpoints of a run, oldest first; `check` (files_checksum) says which are good."""
    return sorted((Path(directory) / "checkpoints").glob("chk_*.h5"))


def read_tree(path: str | Path, form: str) -> tuple[dict[str, Array], dict[str, Any]]:
    """All datasets and root attributes of a file of kind `form`; raises `FileError`."""
    with open_file(path, form) as file:
        tree: dict[str, Array] = {}

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                tree[name] = item.asstr()[()] if item.dtype.kind == "O" else item[()]

        file.visititems(visit)
        return tree, dict(file.attrs)


@contextmanager
def open_file(path: str | Path, form: str) -> Iterator[h5py.File]:
    """Open a finished file of kind `form` for reading; raises `FileError`."""
    path = Path(path)
    if not path.is_file():
        raise FileError(f"{path}: no such file; fix: run the command that makes it first")
    try:
        with h5py.File(path, "r") as file:
            found = file.attrs.get("format", "none")
            if found != form:
                raise FileError(f"{path}: format = {found!r}; fix: give a {form!r} file")
            if "complete" not in file.attrs:
                raise FileError(f"{path}: was never finished; fix: make it again")
            yield file
    except OSError as error:
        raise FileError(f"{path}: not a readable HDF5 file ({error}); fix: make it again") from None


@dataclass(frozen=True)
class Field:
    """A stored field: values (nz, ny, nx) at origin + (i, j, k) * spacing."""

    values: Array
    origin: Array
    spacing: Array


@dataclass(frozen=True)
class Snapshot:
    """One frame of a run, as read back."""

    frame: int
    time: float
    step: int
    fields: dict[str, Field]
    particles: dict[str, dict[str, Array]]
    bodies: dict[str, Array]


def read_snapshot(directory: str | Path, frame: int,
                  fields: tuple[str, ...] | None = None) -> Snapshot:
    """Read a frame; `fields` limits which fields are loaded (None: all that are stored)."""
    with open_file(snapshot_path(directory, frame), SNAPSHOT) as file:
        names = file["fields"].keys() if "fields" in file else ()
        species = file["particles"].keys() if "particles" in file else ()
        bodies = file["bodies"] if "bodies" in file else {}
        return Snapshot(
            frame, float(file.attrs["time"]), int(file.attrs["step"]),
            {name: _read_field(file[f"fields/{name}"]) for name in names
             if fields is None or name in fields},
            {kind: {name: data[()] for name, data in file[f"particles/{kind}"].items()}
             for kind in species},
            {name: data[()] for name, data in bodies.items()})


def read_shapes(directory: str | Path, frame: int) -> tuple[float, dict[str, tuple[Any, ...]]]:
    """The time of a frame, and (shape, kind, bytes per number, origin, spacing) of its fields and
    columns of particles by name; nothing of the values is read."""
    with open_file(snapshot_path(directory, frame), SNAPSHOT) as file:
        found = {}
        for group in ("fields", *(f"particles/{kind}" for kind in file.get("particles", ()))):
            for name, data in file.get(group, {}).items():
                found[f"{group}/{name}"] = (
                    data.shape, data.dtype.kind, data.dtype.itemsize,
                    tuple(data.attrs.get("origin", ())), tuple(data.attrs.get("spacing", ())))
        return float(file.attrs["time"]), found


def _read_field(dataset: h5py.Dataset) -> Field:
    return Field(dataset[()], dataset.attrs["origin"], dataset.attrs["spacing"])
