"""How do all ranks write one file? Through rank 0 when it is small, together when it is large."""

import math
import shutil
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from solver.files import SNAPSHOT, Array, Attributes, WriteError, snapshot_path
from solver.files_checksum import forget_checksum, record_checksum
from solver.files_fast import make_dataset, put_attributes
from solver.files_whole import finished_file, sync

CHUNK_EDGE = 32
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
        self.parallel = self.comm is not None and not gather and bool(h5py.get_config().mpi)
        self.precision = np.dtype(precision)
        self.durable = durable
        self.unsynced: list[Path] = []
        self.helper = ThreadPoolExecutor(1)
        self.summing: list[Future[None]] = []
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
        blocks = {name: self._as_stored(block) for name, block in blocks.items()}
        together = self.parallel and _bytes(blocks) >= PARALLEL_FROM
        if self.comm is not None and not together:
            blocks = _gathered(self.comm, blocks)
        writes = self.comm is None or self.comm.rank == 0
        self._agree(self._prepare(path, blocks) if writes else None)
        if together:
            self._write(path, blocks, root, self.comm, dress)
        problem = None
        if writes:
            try:
                if not together:
                    self._write(path, blocks, root, None, dress)
                self._record(path)
            except WriteError as error:
                problem = str(error)
        self._agree(problem)

    def _record(self, path: Path) -> None:
        """Note the checksum, or have it noted before the next file is written."""
        if self.durable:
            record_checksum(path)
        else:
            self.summing.append(self.helper.submit(record_checksum, path))
            self.unsynced.append(path)

    def sync(self) -> None:
        """Wait until all that was written is on the disk; raises `WriteError`."""
        problem = None
        try:
            while self.summing:
                self.summing.pop().result()
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

    def _prepare(self, path: Path, blocks: Mapping[str, Block]) -> str | None:
        """What is in the way. Asked before all ranks write: a full disk would stop only some."""
        try:
            while self.summing:
                self.summing.pop().result()
            forget_checksum(path)
        except WriteError as error:
            return str(error)
        size = _bytes(blocks)
        free = shutil.disk_usage(next(p for p in path.absolute().parents if p.exists())).free
        if free < size * (0.25 if self.compressed else 1.0):
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

    def _as_stored(self, block: Block) -> Block:
        if block.values.dtype.kind != "f":
            return block
        return replace(block, values=block.values.astype(self.precision, copy=False))

    def _write(self, path: Path, blocks: Mapping[str, Block], root: Attributes, comm: Any,
               dress: Dress | None) -> None:
        with finished_file(path, comm, _bytes(blocks), self.durable) as file:
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


def _bytes(blocks: Mapping[str, Block]) -> int:
    """What the blocks take on disk without compression, at most."""
    return sum(math.prod(b.shape) * b.values.dtype.itemsize for b in blocks.values())


def _gathered(comm: Any, blocks: Mapping[str, Block]) -> dict[str, Block]:
    """The whole of each dataset, on rank 0; one message from each of the others."""
    parts = comm.gather([(block.values, block.offset) for block in blocks.values()])
    if comm.rank > 0:
        return {}
    whole: dict[str, Block] = {}
    for number, (name, block) in enumerate(blocks.items()):
        values = np.empty(block.shape, block.values.dtype)
        for of_rank in parts:
            part, offset = of_rank[number]
            values[_region(part, offset)] = part
        whole[name] = Block(values, (0,) * values.ndim, block.shape, block.attributes)
    return whole


def _region(values: Array, offset: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(o, o + n) for o, n in zip(offset, values.shape, strict=True))


def _put(dataset: Any, values: Array, offset: tuple[int, ...], collective: bool) -> None:
    """Write a block. Below h5py's slicing, which returns early on an empty block and so would hang
    the other ranks of a collective write."""
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
    if collective:
        transfer.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
    dataset.write(source, target, values, dxpl=transfer)
