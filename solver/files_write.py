"""How do all ranks write one file? Through rank 0 when it is small, together when it is large."""

import math
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from solver.files import SNAPSHOT, Array, Attributes, WriteError, snapshot_path
from solver.files_checksum import record_checksum
from solver.files_whole import finished_file

CHUNK_EDGE = 32
PARALLEL_FROM = 1 << 25  # bytes of a file; below, agreeing costs the ranks more than gathering


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
        with finished_file(path, comm, _bytes(blocks)) as file:
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
