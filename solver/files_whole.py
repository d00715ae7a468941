"""How does a file appear whole or not at all?

It is written as `NAME.tmp` and renamed, so that a killed run leaves finished files intact. `sync`
brings files to the disk itself, so that they outlive the machine: at once, or later together, when
a checkpoint is about to count on them.
"""

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import h5py

from solver.files import Attributes, WriteError, seal
from solver.files_fast import put_attributes

MEMORY_BLOCK = 1 << 22   # bytes by which a file in memory grows
SPARE = 1 << 28          # bytes free beyond what a file may take: the disk will not fill meanwhile

_abandoned: list[h5py.File] = []   # to close one that the other ranks still hold would hang


@contextmanager
def finished_file(path: Path, comm: Any = None, size: int = 0, durable: bool = True,
                  sealed: bool = False) -> Iterator[h5py.File]:
    """Open `path`.tmp for writing (collectively with `comm`); rename it once it is complete, and
    `sealed` with its checksum if it has none in a table beside it.

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
        put_attributes(file.id, {"complete": 1})
        if in_memory:
            file.flush()
            temporary.write_bytes(file.id.get_file_image())
        file.close()
        if comm is None or comm.rank == 0:
            if sealed:
                with open(temporary, "rb+") as content:
                    content.write(seal(content.read()))
            if durable:
                sync(temporary)
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


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name to write to, whose file then takes the place of `path`; what was there before stays
    where the writing fails. Makes the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


def sync(path: Path) -> None:
    """Wait until the content of a file, if it is still there, is on the disk."""
    with suppress(FileNotFoundError), open(path, "rb+") as file:
        os.fsync(file.fileno())


def _reason(error: Exception, path: Path) -> str:
    """What the system said, without HDF5's account of it."""
    number = getattr(error, "errno", None)
    if number:
        return os.strerror(number)
    free = shutil.disk_usage(path.parent).free if path.parent.is_dir() else 0
    return f"{str(error).splitlines()[0][:80]}; {free / 1e6:.1f} MB are free"


def write_tree(path: str | Path, form: str, tree: Mapping[str, Any],
               attributes: Attributes | None = None) -> None:
    """Write arrays under their slash-separated names, serially, and the checksum behind them;
    `form` becomes attribute format."""
    with finished_file(Path(path), sealed=True) as file:
        file.attrs.update({"format": form, **(attributes or {})})
        for name, values in tree.items():
            file[name] = values
