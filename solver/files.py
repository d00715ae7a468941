"""What is stored, where, and how is it read back? With `files_*`, all that knows HDF5.

A file appears under its name only when it is complete (`files_whole`). Every file carries `format`
and `complete` in its root attributes. The checksums of a run's files stand beside them in
SHA256SUMS (`files_checksum`); a file that travels alone carries its own, as a last line behind what
HDF5 reads. Where there is one it is checked before HDF5 reads the file, which may crash on damage.
Nothing here needs PETSc or MPI: a parallel writer (`files_write`) is handed its communicator.

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

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

SNAPSHOT = "brisance-snapshot"
CHECKPOINT = "brisance-checkpoint"
CHECKSUMS = "SHA256SUMS"
SEAL = b"\nSHA-256 of the above: "   # and 64 digits: the end of a file that travels alone
MOST_COMPRESSED = 1100   # gzip makes at most 1032 bytes out of one
WIDTHS = {"position": 3, "velocity": 3, "orientation": 4, "angular_velocity": 3, "rest_centre": 3,
          "vertices": 3}   # columns of columns
# What h5py and numpy raise where a file holds something else than it should.
DAMAGE = (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError, RuntimeError,
          MemoryError)

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


def chosen_frames(directory: Path, choice: str | None = None) -> list[int]:
    """Of a run's stored frames those that A:B:C names, as in Python's slices of their numbers, or
    a single number; None: all. Raises `FileError`."""
    stored = snapshot_frames(directory)
    if not stored:
        raise FileError(f"{directory}: holds no snapshots; fix: python -m solver SCENE -o "
                        f"{directory}")
    if choice is None:
        return stored
    try:
        parts = [int(part) if part else None for part in choice.split(":")]
        wanted = {parts[0]} if len(parts) == 1 else set(range(*slice(*parts).indices(
            stored[-1] + 1)))
    except (ValueError, TypeError):
        raise FileError(f"--frames {choice}: not a range; fix: as in 10, 0:60 or 0:60:2") from None
    found = [frame for frame in stored if frame in wanted]
    if not found:
        raise FileError(f"--frames {choice}: none of these is stored; fix: between {stored[0]} and "
                        f"{stored[-1]}")
    return found


def read_steps(directory: Path) -> list[dict[str, Any]]:
    """The records of run.log.jsonl, one per step; none if there is no such file. A last line that
    a killed run has not finished does not count. Raises `FileError`."""
    path = directory / "run.log.jsonl"
    if not path.is_file():
        return []
    try:
        *lines, _ = path.read_text(encoding="utf-8").split("\n")
        records = [json.loads(line) for line in lines]
    except (OSError, ValueError) as error:
        raise FileError(f"{path}: not one JSON record per line ({error}); fix: run the solver "
                        "again") from None
    if not all(isinstance(record, dict) and "step" in record for record in records):
        raise FileError(f"{path}: not one record per step; fix: run the solver again")
    return records


def checkpoint_path(directory: str | Path, step: int) -> Path:
    """Where the full state after a step is stored."""
    return Path(directory) / "checkpoints" / f"chk_{step:08d}.h5"


def checkpoint_paths(directory: str | Path) -> list[Path]:
    """The checkpoints of a run, oldest first; `check` (files_checksum) says which are good."""
    return sorted((Path(directory) / "checkpoints").glob("chk_*.h5"))


def checksum(path: Path) -> str:
    """SHA-256 of a file's content."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def checksums(directory: Path) -> dict[str, str]:
    """Name and checksum of the files of a folder, as far as they were recorded."""
    try:
        lines = (directory / CHECKSUMS).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return {}
    pairs = [line.split("  ", 1) for line in lines]
    return {pair[1]: pair[0] for pair in pairs if len(pair) == 2}


@lru_cache(maxsize=4096)
def _checksum_of_version(path: Path, _version: tuple[int, ...]) -> str:
    """Of a file that has not changed since: it may be opened many times."""
    return checksum(path)


def seal(content: bytes | memoryview) -> bytes:
    """The end that tells whether what comes before it is still what was written."""
    return SEAL + hashlib.sha256(content).hexdigest().encode()


SEAL_LENGTH = len(seal(b""))


def is_sealed(path: Path) -> bool:
    """Whether a file carries its own checksum."""
    with open(path, "rb") as file:
        file.seek(-min(SEAL_LENGTH, path.stat().st_size), os.SEEK_END)
        return file.read().startswith(SEAL)


def _check_bytes(path: Path) -> None:
    """Refuse a file whose bytes are not those that were written: HDF5 may crash on them."""
    recorded = checksums(path.parent).get(path.name)
    status = path.stat()
    version = (status.st_size, status.st_mtime_ns, status.st_ino)
    if recorded is not None and recorded != _checksum_of_version(path.absolute(), version):
        raise FileError(f"{path}: damaged, its checksum is not the one in {CHECKSUMS}; fix: make "
                        "it again")
    if is_sealed(path):
        content = memoryview(path.read_bytes())
        if seal(content[:-SEAL_LENGTH]) != content[-SEAL_LENGTH:]:
            raise FileError(f"{path}: damaged, its checksum is not the one at its end; fix: make "
                            "it again")


def read_tree(path: str | Path, form: str) -> tuple[dict[str, Array], dict[str, Any]]:
    """All datasets and root attributes of a file of kind `form`; raises `FileError`."""
    with open_file(path, form) as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset)
                        else None)
        return {name: read_array(file, name) for name in names}, dict(file.attrs)


@contextmanager
def open_file(path: str | Path, form: str) -> Iterator[h5py.File]:
    """Open a finished file of kind `form` for reading; raises `FileError`, also for what is found
    inside to be other than expected."""
    path = Path(path)
    if not path.is_file():
        raise FileError(f"{path}: no such file; fix: run the command that makes it first")
    try:
        _check_bytes(path)
        with h5py.File(path, "r") as file:
            found = file.attrs.get("format", "none")
            if not isinstance(found, str) or found != form:
                raise FileError(f"{path}: format = {found!r:.40}; fix: give a {form!r} file")
            if "complete" not in file.attrs:
                raise FileError(f"{path}: was never finished; fix: make it again")
            yield file
    except OSError as error:
        raise FileError(f"{path}: not a readable HDF5 file ({_line(error)}); fix: make it "
                        "again") from None
    except DAMAGE as error:
        raise FileError(f"{path}: damaged ({_line(error)}); fix: make it again") from None


def _line(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 120 else text[:117] + "..."


def read_array(file: h5py.File, name: str, region: tuple[Any, ...] = ()) -> Array:
    """The values of a dataset, or of a region of it. Raises ValueError for one that leads out of
    the file, or claims to be larger than the file can hold."""
    place = file
    for part in name.strip("/").split("/"):
        if not isinstance(place, h5py.Group) or part not in place:
            raise ValueError(f"{name} is missing")
        if not isinstance(place.get(part, getlink=True), h5py.HardLink):
            raise ValueError(f"{name} is a link to elsewhere")
        place = place[part]
    if not isinstance(place, h5py.Dataset) or place.is_virtual or place.external:
        raise ValueError(f"{name} is not an array stored in this file")
    stored = place.id.get_storage_size() * (MOST_COMPRESSED if place.chunks else 1)
    if place.nbytes > stored:
        raise ValueError(f"{name} claims {place.nbytes} bytes and holds fewer")
    return np.asarray(place.asstr()[()] if place.dtype.kind == "O" else place[region])


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
    """Read a frame; `fields` limits which fields are loaded (None: all that are stored). Raises
    `FileError`."""
    with open_file(snapshot_path(directory, frame), SNAPSHOT) as file:
        return Snapshot(
            frame, float(file.attrs["time"]), int(file.attrs["step"]),
            {name: _read_field(file, name) for name in file.get("fields", ())
             if fields is None or name in fields},
            {kind: _read_table(file, f"particles/{kind}") for kind in file.get("particles", ())},
            _read_table(file, "bodies") if "bodies" in file else {})


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


def read_part(directory: str | Path, frame: int, name: str, region: tuple[Any, ...]) -> Array:
    """A region (integers and slices) of one dataset of a frame."""
    with open_file(snapshot_path(directory, frame), SNAPSHOT) as file:
        return read_array(file, name, region)


def _read_field(file: h5py.File, name: str) -> Field:
    values = read_array(file, f"fields/{name}")
    attributes = file[f"fields/{name}"].attrs
    origin, spacing = (np.asarray(attributes[key], np.float64) for key in ("origin", "spacing"))
    if values.ndim != 3 or values.dtype.kind != "f" or 0 in values.shape:
        raise ValueError(f"fields/{name} holds {values.dtype} of shape {values.shape}")
    if (origin.shape != (3,) or spacing.shape != (3,) or not np.isfinite(origin).all()
            or not (np.isfinite(spacing) & (spacing > 0)).all()):
        raise ValueError(f"fields/{name} has origin {origin} and spacing {spacing}")
    return Field(values, origin, spacing)


def _read_table(file: h5py.File, group: str) -> dict[str, Array]:
    """The columns of a group, all with as many rows; `vertices` apart."""
    columns = {name: read_array(file, f"{group}/{name}") for name in file[group]}
    rows = {len(values) for name, values in columns.items() if name != "vertices"}
    if len(rows) > 1:
        raise ValueError(f"the columns of {group} have {sorted(rows)} rows")
    for name, values in columns.items():
        width = WIDTHS.get(name, 0)
        if values.shape[1:] != ((width,) if width else ()) or values.dtype.kind not in "fiu":
            raise ValueError(f"{group}/{name} holds {values.dtype} of shape {values.shape}")
    return columns
