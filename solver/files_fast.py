"""How are attributes, datasets and links made where thousands are made? By HDF5's own calls.

h5py's dictionaries look before they write, convert and look again: a snapshot of a few megabytes
would spend most of its time there. All of it is for files in the making, where no name exists yet.
"""

from collections.abc import Mapping
from functools import cache, lru_cache
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5o, h5p, h5s, h5t

GZIP_LEVEL = 1
TEXT = h5py.string_dtype()


@cache
def _type(dtype: np.dtype[Any]) -> Any:
    return h5t.py_create(dtype, logical=True)


@lru_cache(maxsize=64)
def _space(shape: tuple[int, ...]) -> Any:
    return h5s.create_simple(shape) if shape else h5s.create(h5s.SCALAR)


Ready = list[tuple[bytes, Any, Any, Any]]   # name, type, space, values


def ready(attributes: Mapping[str, Any]) -> Ready:
    """Attributes as HDF5 takes them: to be made once, where many objects get the same."""
    result = []
    for name, value in attributes.items():
        array = np.array(value, TEXT if isinstance(value, str) else None, order="C")
        kind = _text() if isinstance(value, str) else _type(array.dtype)
        result.append((name.encode(), kind, _space(array.shape), array))
    return result


def put_attributes(place: Any, attributes: Mapping[str, Any] | Ready) -> None:
    """Attributes of a new object, given by its low-level identifier."""
    for name, kind, space, array in (attributes if isinstance(attributes, list)
                                     else ready(attributes)):
        h5a.create(place, name, kind, space).write(array)


@cache
def _text() -> Any:
    return h5t.py_create(TEXT, logical=True)   # not by `_type`: equal to any other dtype "O"


def make_group(place: Any, name: str) -> Any:
    """A new group, with the groups on the way to it."""
    return h5g.create(place, name.encode(), _parents())


def make_dataset(place: Any, name: str, shape: tuple[int, ...], dtype: np.dtype[Any],
                 chunks: tuple[int, ...] = ()) -> Any:
    """A new dataset without values; compressed where it has chunks."""
    return h5d.create(place, name.encode(), _type(dtype), _space(shape), _creation(chunks),
                      _parents())


@cache
def _creation(chunks: tuple[int, ...]) -> Any:
    properties = h5p.create(h5p.DATASET_CREATE)
    if chunks:
        properties.set_chunk(chunks)
        properties.set_shuffle()
        properties.set_deflate(GZIP_LEVEL)
    properties.set_fill_time(h5d.FILL_TIME_NEVER)
    properties.set_obj_track_times(False)   # the same values make the same bytes
    return properties


def link(place: Any, name: str, target: Any, old: str) -> None:
    """A second name (a hard link) for what is called `old` in `target`."""
    place.links.create_hard(name.encode(), target, old.encode(), _parents())


def existing(place: Any, name: str) -> Any:
    """The identifier of an object by its name."""
    return h5o.open(place, name.encode())


def link_column(place: Any, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], path: str,
                column: int) -> Any:
    """A dataset that is one column of the (n, m) dataset at `path` of the same file, no copy."""
    rows, columns = shape
    if rows == 0:
        return make_dataset(place, name, (0,), dtype)
    whole, properties = _space((rows,)), _view(dtype).copy()
    properties.set_virtual(whole, b".", path.encode(), _column(rows, columns, column))
    return h5d.create(place, name.encode(), _type(dtype), whole, properties, _parents())


@cache
def _view(dtype: np.dtype[Any]) -> Any:
    properties = h5p.create(h5p.DATASET_CREATE)
    properties.set_obj_track_times(False)
    properties.set_fill_value(np.full((), np.nan, dtype))
    return properties


@lru_cache(maxsize=16)
def _column(rows: int, columns: int, column: int) -> Any:
    chosen = h5s.create_simple((rows, columns))
    chosen.select_hyperslab((0, column), (rows, 1))
    return chosen


@cache
def _parents() -> Any:
    properties = h5p.create(h5p.LINK_CREATE)
    properties.set_create_intermediate_group(True)
    return properties
