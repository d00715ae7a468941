"""Other programs open a snapshot: one file is ours, openPMD 1.1 and VTKHDF at once, with no copies.

    /data/FRAME/fields             a second name (hard link) of /fields, whose datasets carry
                                   openPMD's attributes; u, v, w are scalar records on their faces
    /data/FRAME/particles/SPECIES  openPMD's x, y, z, as views of the columns of our (n, 3) arrays
    /VTKHDF                        an image of the box; its CellData are second names of our fields

openPMD standard 1.1.0 (Huebl et al. 2018), axes in the order z, y, x of the arrays, file based;
VTK's file format "VTKHDF" 1.0. Units are those of the scene (unitSI = 1).
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from solver.files_fast import (Ready, existing, link, link_column, make_group, put_attributes,
                               ready)
from solver.files_write import Block

# Powers of L, M, T, I, Θ, N, J.
DIMENSIONS = {"u": (1, 0, -1), "v": (1, 0, -1), "w": (1, 0, -1), "p": (2, 0, -2),
              "T": (0, 0, 0, 0, 1), "phi": (0, 0, -1), "position": (1,), "velocity": (1, 0, -1),
              "temperature": (0, 0, 0, 0, 1), "mass": (0, 1), "soot": (0, 1)}
FACES = "uvw"
# Texts are of fixed length: openPMD's own tools expect that.
ROOT = {"openPMD": "1.1.0", "basePath": "/data/%T/", "meshesPath": "fields/",
        "particlesPath": "particles/", "iterationEncoding": "fileBased",
        "iterationFormat": "snap_%06T.h5", "software": "brisance"}


def dress(file: Any, blocks: Mapping[str, Block], frame: int, time: float, dt: float) -> None:
    """Add the attributes and links to a snapshot under way; every rank that writes it calls it.

    file    low-level identifier of the file, which holds the datasets of `blocks` already
    """
    put_attributes(file, _root())
    base = make_group(file, f"data/{frame}")
    put_attributes(base, {"time": float(time), "dt": float(dt), "timeUnitSI": 1.0})
    fields = {name[7:]: block for name, block in blocks.items() if name.startswith("fields/")}
    if fields:
        link(base, "fields", file, "fields")
        for name, block in fields.items():
            places = (tuple(block.attributes[key]) for key in ("origin", "spacing"))
            put_attributes(existing(file, f"fields/{name}"), _mesh(name, *places))
        _add_image(file, fields)
    species: dict[str, dict[str, Block]] = {}
    for name, block in blocks.items():
        if name.startswith("particles/"):
            _, kind, column = name.split("/")
            species.setdefault(kind, {})[column] = block
    for kind, columns in species.items():
        _add_species(file, base, kind, columns)


@cache
def _root() -> Ready:
    return ready({name: np.bytes_(text) for name, text in ROOT.items()}
                 | {"openPMDextension": np.uint32(0)})


@cache
def _record(name: str) -> Ready:
    dimension = np.zeros(7)
    known = DIMENSIONS.get(name, ())
    dimension[:len(known)] = known
    return ready({"unitDimension": dimension, "timeOffset": 0.0})


@cache
def _unit() -> Ready:
    return ready({"unitSI": 1.0})


@cache
def _mesh(name: str, origin: tuple[float, ...], spacing: tuple[float, ...]) -> Ready:
    """What openPMD wants to know of a field."""
    return _record(name) + _unit() + ready({
        "geometry": np.bytes_("cartesian"), "dataOrder": np.bytes_("C"),
        "axisLabels": np.array([b"z", b"y", b"x"]), "gridSpacing": np.array(spacing)[::-1],
        "gridGlobalOffset": np.zeros(3), "gridUnitSI": 1.0,
        "position": (np.array(origin) / spacing)[::-1]})


def _add_image(file: Any, fields: Mapping[str, Block]) -> None:
    """VTK's image of the cells."""
    cells = {name: block for name, block in fields.items() if name not in FACES}
    if not cells:
        return
    first = next(iter(cells.values()))
    group = make_group(file, "VTKHDF")
    put_attributes(group, _image(first.shape, tuple(first.attributes["spacing"])))
    data = make_group(group, "CellData")
    for name in cells:
        link(data, name, file, f"fields/{name}")


@cache
def _image(shape: tuple[int, ...], spacing: tuple[float, ...]) -> Ready:
    nz, ny, nx = shape
    return ready({
        "Version": np.array([1, 0]), "Type": np.bytes_("ImageData"),
        "WholeExtent": np.array([0, nx, 0, ny, 0, nz]), "Origin": np.zeros(3),
        "Spacing": np.array(spacing, float), "Direction": np.eye(3).ravel()})


def _add_species(file: Any, base: Any, kind: str, columns: Mapping[str, Block]) -> None:
    group = make_group(base, f"particles/{kind}")
    for name, block in columns.items():
        if name not in DIMENSIONS:
            continue
        path = f"/particles/{kind}/{name}"
        if len(block.shape) == 1:
            link(group, name, file, path)
            put_attributes(existing(file, path), _record(name) + _unit())
            continue
        record = make_group(group, name)
        put_attributes(record, _record(name))
        for column, axis in enumerate("xyz"):
            view = link_column(record, axis, block.shape, block.values.dtype, path, column)
            put_attributes(view, _unit())
    offset = make_group(group, "positionOffset")
    put_attributes(offset, _record("position"))
    constant = _unit() + ready({"value": 0.0, "shape": np.array([columns["position"].shape[0]],
                                                                np.uint64)})
    put_attributes(make_group(offset, "x"), constant)
    for axis in "yz":
        link(offset, axis, offset, "x")
