"""Other programs open a snapshot: one file is ours, openPMD 1.1 and VTKHDF at once, with no copies.

    /data/FRAME/fields             a second name (hard link) of /fields, whose datasets carry
                                   openPMD's attributes; u, v, w are scalar records on their faces
    /data/FRAME/particles/SPECIES  openPMD's x, y, z, as views of the columns of our (n, 3) arrays
    /VTKHDF                        an image of the box; its CellData are second names of our fields

openPMD standard 1.1.0 (Huebl et al. 2018), axes in the order z, y, x of the arrays, file based;
VTK's file format "VTKHDF" 1.0. Units are those of the scene (unitSI = 1).
"""

from typing import Any

import numpy as np

from solver.files_write import link_column

# Powers of L, M, T, I, Θ, N, J.
DIMENSIONS = {"u": (1, 0, -1), "v": (1, 0, -1), "w": (1, 0, -1), "p": (2, 0, -2),
              "T": (0, 0, 0, 0, 1), "phi": (0, 0, -1), "position": (1,), "velocity": (1, 0, -1),
              "temperature": (0, 0, 0, 0, 1), "mass": (0, 1), "soot": (0, 1)}
FACES = "uvw"
# Texts are of fixed length: openPMD's own tools expect that.
ROOT = {"openPMD": "1.1.0", "basePath": "/data/%T/", "meshesPath": "fields/",
        "particlesPath": "particles/", "iterationEncoding": "fileBased",
        "iterationFormat": "snap_%06T.h5", "software": "brisance"}


def dress(file: Any, frame: int, time: float, dt: float) -> None:
    """Add the attributes and links to a snapshot under way; every rank that writes it calls it."""
    file.attrs.update({name: np.bytes_(text) for name, text in ROOT.items()})
    file.attrs["openPMDextension"] = np.uint32(0)
    base = file.require_group(f"data/{frame}")
    base.attrs.update({"time": float(time), "dt": float(dt), "timeUnitSI": 1.0})
    fields = file.get("fields")
    if fields is not None:
        base["fields"] = fields
        for name, dataset in fields.items():
            _describe_mesh(dataset, name)
        _add_image(file, fields)
    for species, columns in file.get("particles", {}).items():
        _add_species(base.require_group(f"particles/{species}"), columns)


def _record(name: str, **more: Any) -> dict[str, Any]:
    dimension = np.zeros(7)
    known = DIMENSIONS.get(name, ())
    dimension[:len(known)] = known
    return {"unitDimension": dimension, "timeOffset": 0.0, **more}


def _describe_mesh(dataset: Any, name: str) -> None:
    spacing = np.array(dataset.attrs["spacing"], float)
    position = np.array(dataset.attrs["origin"], float) / spacing
    dataset.attrs.update(_record(
        name, geometry=np.bytes_("cartesian"), dataOrder=np.bytes_("C"),
        axisLabels=np.array([b"z", b"y", b"x"]),
        gridSpacing=spacing[::-1], gridGlobalOffset=np.zeros(3), gridUnitSI=1.0,
        position=position[::-1], unitSI=1.0))


def _add_image(file: Any, fields: Any) -> None:
    """VTK's image of the cells."""
    cells = {name: dataset for name, dataset in fields.items() if name not in FACES}
    if not cells:
        return
    first = next(iter(cells.values()))
    nz, ny, nx = first.shape
    group = file.create_group("VTKHDF")
    group.attrs.update({
        "Version": np.array([1, 0]), "Type": np.bytes_("ImageData"),
        "WholeExtent": np.array([0, nx, 0, ny, 0, nz]), "Origin": np.zeros(3),
        "Spacing": np.array(first.attrs["spacing"], float), "Direction": np.eye(3).ravel()})
    data = group.create_group("CellData")
    for name, dataset in cells.items():
        data[name] = dataset


def _add_species(group: Any, columns: Any) -> None:
    for name, dataset in columns.items():
        if name not in DIMENSIONS:
            continue
        attributes = _record(name, macroWeighted=np.uint32(0), weightingPower=float(name == "mass"))
        if dataset.ndim == 1:
            group[name] = dataset
            dataset.attrs.update({**attributes, "unitSI": 1.0})
            continue
        record = group.create_group(name)
        record.attrs.update(attributes)
        for column, axis in enumerate("xyz"):
            link_column(record, axis, dataset, column).attrs["unitSI"] = 1.0
    offset = group.create_group("positionOffset")
    offset.attrs.update(_record("position", macroWeighted=np.uint32(0), weightingPower=0.0))
    for axis in "xyz":
        constant = offset.create_group(axis)
        constant.attrs.update({"value": 0.0, "unitSI": 1.0,
                               "shape": np.array([len(columns["position"])], np.uint64)})
