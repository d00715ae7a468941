"""How do all ranks write one file? Through rank 0 when it is small, together when it is large."""

import math
import os
import shutil
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from solver.files import SNAPSHOT, Array, Attributes, WriteError, snapshot_path
from solver.files_checksum import forget_checksum, record_checksum
from solver.files_fast import make_dataset, put_attributes
from solver.files_whole import finished_file, sync

CHUNK_EDGE = 32
POLITE = 10              # nice value of the thread that computes checksums
ALIGNMENT = 8            # bytes, of an array in a message
PARALLEL_FROM = 1 << 25  # bytes of a file; below, agreeing costs the ranks more than gathering

Dress = Callable[[Any, Mapping[str, "Block"]], None]


@dataclass(frozen=True)
class Block:
    """This rank's part of a dataset: `values` belong at `offset` of an array of `shape`."""

    values: Array
    offset: tuple[int, ...]
    shape: tuple[int, ...]
    attributes: Attributes = field(default_factory=dict)


class SnapshotWriter:
    """Writes snapshots: large ones by every rank at once where HDF5 can, others by rank 0.

    directory    the run's folder
    comm         mpi4py communicator, or None for one process
    precision    "float32" or "float64" of floating-point datasets
    compression  "gzip" or "none"
    gather       force the gathered path (the fall-back where h5py was built without MPI)
    durable      each file waits for the disk and for its checksum; otherwise `sync` does, for all
                 since the last time, and a thread finds the checksum while the run goes on
    """

    def __init__(self, directory: Path, comm: Any = None, precision: str = "float32",
                 compression: str = "gzip", gather: bool = False,
                 durable: bool = True):
        self.directory = directory
        self.comm = comm if comm is not None and comm.size > 1 else None
        self.rank = self.comm.rank if self.comm is not None else 0
        self.parallel = self.comm is not None and not gather and bool(h5py.get_config().mpi)
        self.precision = np.dtype(precision)
        self.durable = durable
        self.unsynced: list[Path] = []
        self.helper = ThreadPoolExecutor(1, initializer=_give_way)
        self.pending: list[Future[None]] = []
        self.compressed = compression == "gzip"

    def write(self, frame: int, blocks: Mapping[str, Block], attributes: Attributes,
              dress: Dress | None = None) -> Path:
        """Write one snapshot; every rank passes the same names, in the same order. `dress` adds
        what other programs want to find in it, given the file and the shapes of the blocks."""
        path = snapshot_path(self.directory, frame)
        self.write_file(path, blocks, {"format": SNAPSHOT, "frame": frame, **attributes}, dress)
        return path

    def write_file(self, path: Path, blocks: Mapping[str, Block], root: Attributes,
                   dress: Dress | None = None) -> None:
        """Write any file of blocks, and its checksum; raises `WriteError`."""
        kinds = {name: self._kind(block.values) for name, block in blocks.items()}
        size = sum(math.prod(block.shape) * kinds[name].itemsize for name, block in blocks.items())
        problem = None
        if self.parallel and size >= PARALLEL_FROM:
            blocks = {name: _cast(block, kinds[name]) for name, block in blocks.items()}
            self._agree(self._prepare(path, size) if self.rank == 0 else None)
            self._write(path, blocks, size, root, self.comm, dress)
        else:
            blocks = _gathered(self.comm, blocks, kinds)
            if self.rank == 0:
                problem = self._prepare(path, size)
                if problem is None:
                    try:
                        self._write(path, blocks, size, root, None, dress)
                    except WriteError as error:
                        problem = str(error)
        if self.durable and self.rank == 0 and problem is None:
            problem = _record(path)
        self._agree(problem)
        if not self.durable and self.rank == 0:
            self.later(record_checksum, path)
            self.unsynced.append(path)

    def later(self, work: Callable[..., None], *arguments: Any) -> None:
        """Have it done in a thread while the run goes on; its `WriteError` comes from the next
        `write` or `sync`."""
        self.pending.append(self.helper.submit(work, *arguments))

    def sync(self) -> None:
        """Wait until all that was written is on the disk; raises `WriteError`."""
        problem = None
        try:
            while self.pending:
                self.pending.pop().result()
            while self.unsynced:
                sync(self.unsynced.pop())
        except WriteError as error:
            problem = str(error)
        except OSError as error:
            problem = (f"{error.filename or self.directory}: {error.strerror}; fix: make room or "
                       "choose another disk, then --restart")
        self._agree(problem)

    def _agree(self, problem: str | None) -> None:
        """Raise what rank 0 found, on every rank."""
        if self.comm is not None:
            problem = self.comm.bcast(problem)
        if problem:
            raise WriteError(problem)

    def _prepare(self, path: Path, size: int) -> str | None:
        """What is in the way. Asked before all ranks write: a full disk would stop only some."""
        try:
            while self.pending:
                self.pending.pop().result()
            forget_checksum(path)
        except WriteError as error:
            return str(error)
        place = next(p for p in (path.parent, *path.absolute().parents) if p.exists())
        free = shutil.disk_usage(place).free
        if free < size * (0.25 if self.compressed else 1.0):
            return (f"{path}: cannot be written (it may need {size / 1e6:.1f} MB, {free / 1e6:.1f} "
                    "MB are free); fix: make room or choose another disk; finished files are "
                    "intact")
        return None

    def rows(self, values: Array) -> Block:
        """Rows that are spread over the ranks (particles), stacked in rank order."""
        return self.table({"": values})[""]

    def table(self, columns: Mapping[str, Array]) -> dict[str, Block]:
        """Columns of which every rank has the same rows, stacked like `rows`."""
        count = len(next(iter(columns.values())))
        counts = [count] if self.comm is None else self.comm.allgather(count)
        first, total = sum(counts[:self.rank]), sum(counts)
        return {name: Block(values, (first,) + (0,) * (values.ndim - 1),
                            (total, *values.shape[1:])) for name, values in columns.items()}

    def replicated(self, values: Array) -> Block:
        """Values that every rank holds: rank 0 writes them."""
        mine = values if self.rank == 0 else values[:0]
        return Block(mine, (0,) * values.ndim, values.shape)

    def _kind(self, values: Array) -> np.dtype[Any]:
        """What values are stored as."""
        return self.precision if values.dtype.kind == "f" else values.dtype

    def _write(self, path: Path, blocks: Mapping[str, Block], size: int, root: Attributes,
               comm: Any, dress: Dress | None) -> None:
        with finished_file(path, comm, size, self.durable) as file:
            put_attributes(file.id, root)
            for name, block in blocks.items():
                self._write_block(file, name, block, collective=comm is not None)
            if dress is not None:
                dress(file.id, blocks)

    def _write_block(self, file: h5py.File, name: str, block: Block, collective: bool) -> None:
        values = block.values
        chunks: tuple[int, ...] = ()
        if self.compressed and len(block.shape) == 3 and 0 not in block.shape:
            chunks = tuple(min(CHUNK_EDGE, n) for n in block.shape)
        dataset = make_dataset(file.id, name, block.shape, values.dtype, chunks)
        put_attributes(dataset, block.attributes)
        _put(dataset, values, block.offset, collective)


def _give_way() -> None:
    """The steps of the run go before what this thread does (where threads have priorities)."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), POLITE)


def _record(path: Path) -> str | None:
    """Note the checksum; what is wrong."""
    try:
        record_checksum(path)
    except WriteError as error:
        return str(error)
    return None


def _cast(block: Block, kind: np.dtype[Any]) -> Block:
    return Block(block.values.astype(kind, "C", copy=False), block.offset, block.shape,
                 block.attributes)


def _gathered(comm: Any, blocks: Mapping[str, Block],
              kinds: Mapping[str, np.dtype[Any]]) -> dict[str, Block]:
    """The whole of each dataset as it is stored, on rank 0 (or where `comm` is None): converted on
    the way into one buffer, one message from each of the others."""
    if comm is None:
        return {name: _cast(block, kinds[name]) for name, block in blocks.items()}
    mine = [(block.values.shape, block.offset) for block in blocks.values()]
    of_rank = comm.gather(mine)
    if comm.rank > 0:
        buffer, parts = _buffer([shape for shape, _ in mine], kinds.values())
        for block, part in zip(blocks.values(), parts, strict=True):
            part[...] = block.values
        comm.Send(buffer, dest=0)
        return {}
    whole = {name: Block(np.empty(block.shape, kinds[name]), (0,) * len(block.shape), block.shape,
                         block.attributes) for name, block in blocks.items()}
    for rank, places in enumerate(of_rank):
        parts = [block.values for block in blocks.values()]
        if rank > 0:
            buffer, parts = _buffer([shape for shape, _ in places], kinds.values())
            comm.Recv(buffer, source=rank)
        for block, part, (_, offset) in zip(whole.values(), parts, places, strict=True):
            block.values[_region(part, offset)] = part
    return whole


def _buffer(shapes: Sequence[tuple[int, ...]],
            kinds: Iterable[np.dtype[Any]]) -> tuple[Array, list[Array]]:
    """Bytes for arrays of these shapes and kinds one after the other, and the arrays in them."""
    starts, end = [], 0
    pairs = list(zip(shapes, kinds, strict=True))
    for shape, kind in pairs:
        starts.append(end)
        end += -(-math.prod(shape) * kind.itemsize // ALIGNMENT) * ALIGNMENT
    buffer = np.empty(end, np.uint8)
    return buffer, [np.ndarray(shape, kind, buffer, start)
                    for start, (shape, kind) in zip(starts, pairs, strict=True)]


def _region(values: Array, offset: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(o, o + n) for o, n in zip(offset, values.shape, strict=True))


def _put(dataset: Any, values: Array, offset: tuple[int, ...], collective: bool) -> None:
    """Write a block. Below h5py's slicing, which returns early on an empty block and so would hang
    the other ranks of a collective write."""
    if not collective:   # then it is the whole
        if values.size:
            dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, np.ascontiguousarray(values))
        return
    target = dataset.get_space()
    if target.get_simple_extent_npoints() == 0:
        return
    values = np.ascontiguousarray(values)
    source = h5py.h5s.create_simple(values.shape)
    if values.size:
        target.select_hyperslab(offset, values.shape)
    else:
        source.select_none()
        target.select_none()
    transfer = h5py.h5p.create(h5py.h5p.DATASET_XFER)
    transfer.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
    dataset.write(source, target, values, dxpl=transfer)
