"""What is stored and how it is read back: the only module that knows HDF5.

A file appears under its name only when it is complete: it is written as `NAME.tmp`, flushed to disk
and renamed, so a killed run leaves finished files intact. Every file carries `format` and
`complete` in its root attributes; the checksums of a run's files stand beside them in SHA256SUMS,
for `check` and for `sha256sum -c`. It needs no PETSc and no MPI: a parallel writer is handed its
communicator.

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
import math
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

SNAPSHOT = "brisance-snapshot"
CHECKPOINT = "brisance-checkpoint"
CHECKSUMS = "SHA256SUMS"
CHUNK_EDGE = 32
MEMORY_BLOCK = 1 << 22   # bytes by which a file in memory grows
PARALLEL_FROM = 1 << 25  # bytes of a file; below, agreeing costs the ranks more than gathering
SPARE = 1 << 28          # bytes free beyond what a file may take: the disk will not fill meanwhile

Array = NDArray[Any]
Attributes = Mapping[str, Any]


class FileError(Exception):
    """A file that cannot be used; the message is one line for the user."""


class WriteError(FileError):
    """A file that cannot be written, a full disk most often; what was there before is intact."""


@dataclass(frozen=True)
class Block:
    """This rank's part of a dataset: `values` belong at `offset` of an array of `shape`."""

    values: Array
    offset: tuple[int, ...]
    shape: tuple[int, ...]
    attributes: Attributes = field(default_factory=dict)


_abandoned: list[h5py.File] = []   # to close one that the other ranks still hold would hang


@contextmanager
def _finished_file(path: Path, comm: Any = None, size: int = 0) -> Iterator[h5py.File]:
    """Open `path`.tmp for writing (collectively with `comm`); rename it once it is complete.

    Where there may not be room for `size` bytes, one process alone makes the file in memory first:
    HDF5 crashes when it closes a file on a full disk. Raises `WriteError`; with `comm` perhaps on
    some ranks only, which must then end the others.
    """
    temporary = path.with_name(path.name + ".tmp")
    file, in_memory = None, False
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        in_memory = comm is None and shutil.disk_usage(path.parent).free < 2 * size + SPARE
        if comm is None and not in_memory:
            file = h5py.File(temporary, "w")
        elif comm is None:
            file = h5py.File(temporary, "w", driver="core", backing_store=False,
                             block_size=MEMORY_BLOCK)
        else:
            file = h5py.File(temporary, "w", driver="mpio", comm=comm)
        yield file
        file.attrs["complete"] = 1
        if in_memory:
            file.flush()
            temporary.write_bytes(file.id.get_file_image())
        file.close()
        if comm is None or comm.rank == 0:
            with open(temporary, "rb+") as flushed:
                os.fsync(flushed.fileno())
            os.replace(temporary, path)
    except Exception as error:
        if comm is None and file is not None:
            file.close()
        elif comm is not None:
            _abandoned.append(file)
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError | RuntimeError):   # h5py raises either
            raise WriteError(f"{path}: cannot be written ({_reason(error, path)}); fix: make room "
                             "or choose another disk; finished files are intact") from None
        raise
    if comm is not None:
        comm.Barrier()


def _reason(error: Exception, path: Path) -> str:
    """What the system said, without HDF5's account of it."""
    number = getattr(error, "errno", None)
    if number:
        return os.strerror(number)
    free = shutil.disk_usage(path.parent).free if path.parent.is_dir() else 0
    return f"{str(error).splitlines()[0][:80]}; {free / 1e6:.1f} MB are free"


def write_tree(path: str | Path, form: str, tree: Mapping[str, Any],
               attributes: Attributes | None = None) -> None:
    """Write arrays under their slash-separated names, serially; `form` becomes attribute format."""
    with _finished_file(Path(path)) as file:
        file.attrs.update({"format": form, **(attributes or {})})
        for name, values in tree.items():
            file[name] = values


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
    """The checkpoints of a run, oldest first; `check` says which of them are good."""
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


def record_checksum(path: Path, known: str | None = None) -> None:
    """Note the checksum of a file (computed here unless given); forget files that are gone."""
    lines = checksums(path.parent) | {path.name: known or checksum(path)}
    table = path.with_name(CHECKSUMS)
    temporary = path.with_name(CHECKSUMS + ".tmp")
    try:
        temporary.write_text("".join(f"{digest}  {name}\n" for name, digest in sorted(lines.items())
                                     if path.with_name(name).exists()), encoding="utf-8")
        os.replace(temporary, table)
    except OSError as error:
        raise WriteError(f"{table}: cannot be written ({error.strerror}); fix: make room or choose "
                         "another disk; finished files are intact") from None


def check(path: Path, form: str) -> str:
    """What is wrong with a file, or ""; its bytes are compared with its recorded checksum."""
    try:
        with open_file(path, form):
            pass
    except FileError as error:
        return str(error)
    recorded = checksums(path.parent).get(path.name)
    if recorded is not None and recorded != checksum(path):
        return f"{path}: damaged, its checksum is not the one in {CHECKSUMS}; fix: make it again"
    return ""


class SnapshotWriter:
    """Writes snapshots: large ones by every rank at once where HDF5 can, others by rank 0.

    directory    the run's folder
    comm         mpi4py communicator, or None for one process
    precision    "float32" or "float64" of floating-point datasets
    compression  "gzip" or "none"
    gather       force the gathered path (the fall-back where h5py was built without MPI)
    """

    def __init__(self, directory: Path, comm: Any = None, precision: str = "float32",
                 compression: str = "gzip", gather: bool = False):
        self.directory = directory
        self.comm = comm if comm is not None and comm.size > 1 else None
        self.parallel = self.comm is not None and not gather and bool(h5py.get_config().mpi)
        self.precision = np.dtype(precision)
        self.filters = ({"compression": "gzip", "compression_opts": 1, "shuffle": True}
                        if compression == "gzip" else {})

    def write(self, frame: int, blocks: Mapping[str, Block], attributes: Attributes,
              dress: Callable[[h5py.File], None] | None = None) -> Path:
        """Write one snapshot; every rank passes the same names, in the same order. `dress` adds
        what other programs want to find in it."""
        path = snapshot_path(self.directory, frame)
        self.write_file(path, blocks, {"format": SNAPSHOT, "frame": frame, **attributes}, dress)
        return path

    def write_file(self, path: Path, blocks: Mapping[str, Block], root: Attributes,
                   dress: Callable[[h5py.File], None] | None = None) -> None:
        """Write any file of blocks, and its checksum; raises `WriteError`."""
        together = self.parallel and _bytes(blocks) >= PARALLEL_FROM
        if self.comm is not None and not together:
            blocks = _gathered(self.comm, blocks)
        writes = self.comm is None or self.comm.rank == 0
        self._agree(self._room_for(path, blocks) if writes else None)
        if together:
            self._write(path, blocks, root, self.comm, dress)
        problem = None
        if writes:
            try:
                if not together:
                    self._write(path, blocks, root, None, dress)
                record_checksum(path)
            except WriteError as error:
                problem = str(error)
        self._agree(problem)

    def _agree(self, problem: str | None) -> None:
        """Raise what rank 0 found, on every rank."""
        if self.comm is not None:
            problem = self.comm.bcast(problem)
        if problem:
            raise WriteError(problem)

    def _room_for(self, path: Path, blocks: Mapping[str, Block]) -> str | None:
        """Ask before all ranks write: a full disk would stop only some of them."""
        size = _bytes(blocks)
        free = shutil.disk_usage(next(p for p in path.absolute().parents if p.exists())).free
        if free < size * (0.25 if self.filters else 1.0):
            return (f"{path}: cannot be written (it may need {size / 1e6:.1f} MB, {free / 1e6:.1f} "
                    "MB are free); fix: make room or choose another disk; finished files are "
                    "intact")
        return None

    def rows(self, values: Array) -> Block:
        """Rows that are spread over the ranks (particles), stacked in rank order."""
        count = len(values)
        if self.comm is None:
            return Block(values, (0,) * values.ndim, values.shape)
        counts = self.comm.allgather(count)
        offset = (sum(counts[:self.comm.rank]),) + (0,) * (values.ndim - 1)
        return Block(values, offset, (sum(counts), *values.shape[1:]))

    def replicated(self, values: Array) -> Block:
        """Values that every rank holds: rank 0 writes them."""
        mine = values if self.comm is None or self.comm.rank == 0 else values[:0]
        return Block(mine, (0,) * values.ndim, values.shape)

    def _write(self, path: Path, blocks: Mapping[str, Block], root: Attributes, comm: Any,
               dress: Callable[[h5py.File], None] | None) -> None:
        with _finished_file(path, comm, _bytes(blocks)) as file:
            file.attrs.update(root)
            for name, block in blocks.items():
                self._write_block(file, name, block, collective=comm is not None)
            if dress is not None:
                dress(file)

    def _write_block(self, file: h5py.File, name: str, block: Block, collective: bool) -> None:
        values = block.values
        if values.dtype.kind == "f":
            values = values.astype(self.precision, copy=False)
        filters = dict(self.filters) if len(block.shape) == 3 and 0 not in block.shape else {}
        if filters:
            filters["chunks"] = tuple(min(CHUNK_EDGE, n) for n in block.shape)
        dataset = file.create_dataset(name, block.shape, values.dtype, **filters)
        dataset.attrs.update(block.attributes)
        _put(dataset, values, block.offset, collective)


def link_column(group: h5py.Group, name: str, dataset: h5py.Dataset, column: int) -> h5py.Dataset:
    """A dataset that is one column of an (n, m) dataset of the same file, without a copy."""
    rows = len(dataset)
    if rows == 0:
        return group.create_dataset(name, (0,), dataset.dtype)
    layout = h5py.VirtualLayout((rows,), dataset.dtype)
    source = h5py.VirtualSource(".", dataset.name, dataset.shape, dataset.dtype)
    layout[:] = source[:, column]
    return group.create_virtual_dataset(name, layout, fillvalue=np.nan)


def _bytes(blocks: Mapping[str, Block]) -> int:
    """What the blocks take on disk without compression, at most."""
    return sum(math.prod(b.shape) * b.values.dtype.itemsize for b in blocks.values())


def _gathered(comm: Any, blocks: Mapping[str, Block]) -> dict[str, Block]:
    """The whole of each dataset, on rank 0."""
    whole: dict[str, Block] = {}
    for name, block in blocks.items():
        parts = comm.gather((block.values, block.offset), root=0)
        if comm.rank == 0:
            values = np.empty(block.shape, block.values.dtype)
            for part, offset in parts:
                values[_region(part, offset)] = part
            whole[name] = Block(values, (0,) * values.ndim, block.shape, block.attributes)
    return whole


def _region(values: Array, offset: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(o, o + n) for o, n in zip(offset, values.shape, strict=True))


def _put(dataset: h5py.Dataset, values: Array, offset: tuple[int, ...], collective: bool) -> None:
    """Write a block. Below h5py's slicing, which returns early on an empty block and so would hang
    the other ranks of a collective write."""
    if dataset.size == 0:
        return
    values = np.ascontiguousarray(values)
    target = dataset.id.get_space()
    source = h5py.h5s.create_simple(values.shape)
    if values.size:
        target.select_hyperslab(offset, values.shape)
    else:
        source.select_none()
        target.select_none()
    transfer = h5py.h5p.create(h5py.h5p.DATASET_XFER)
    if collective:
        transfer.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
    dataset.id.write(source, target, values, dxpl=transfer)


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


def _read_field(dataset: h5py.Dataset) -> Field:
    return Field(dataset[()], dataset.attrs["origin"], dataset.attrs["spacing"])
