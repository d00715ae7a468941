"""How does ParaView open a run? By OUT/run.xdmf, an index of the snapshots that grows with them.

XDMF 3: one temporal collection; a frame is the cells with their fields, the faces that carry u, v
and w, and the particles of each species. The index names datasets of the snapshots and holds no
values. What is already there when a session starts is read from the snapshots once; then each frame
costs one block of text, written over the closing tags.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from solver.files import FileError, WriteError, read_shapes, snapshot_frames, snapshot_path
from solver.files_whole import replacing

NAME = "run.xdmf"
HEAD = """<?xml version="1.0"?>
<Xdmf Version="3.0"><Domain>
<Grid Name="run" GridType="Collection" CollectionType="Temporal">
"""
TAIL = "</Grid>\n</Domain></Xdmf>\n"
FACES = "uvw"


class Dataset(NamedTuple):
    """What the index has to know of a dataset; origin and spacing (x, y, z) of a field."""

    shape: tuple[int, ...]
    kind: str       # numpy's: "f" or "i"
    bytes: int
    origin: tuple[float, ...] = ()
    spacing: tuple[float, ...] = ()


class Index:
    """Writes OUT/run.xdmf; on one rank."""

    def __init__(self, directory: Path):
        self.directory = directory
        self.started = False

    def add(self, frame: int, time: float, datasets: Mapping[str, Dataset]) -> None:
        """One more frame, given by the datasets of its snapshot. Raises `WriteError`."""
        path = self.directory / NAME
        try:
            if not self.started:
                self.rebuild(frame)
            with open(path, "rb+") as file:
                file.seek(-len(TAIL), os.SEEK_END)
                file.write((grids(frame, time, datasets) + TAIL).encode())
        except OSError as error:
            raise WriteError(f"{path}: cannot be written ({error.strerror}); fix: make room or "
                             "choose another disk; the snapshots are intact") from None

    def rebuild(self, before: float = float("inf")) -> int:
        """Write the index anew from the good snapshots of frames below `before`; how many."""
        texts = []
        for frame in snapshot_frames(self.directory):
            if frame < before:
                try:
                    time, shapes = read_shapes(self.directory, frame)
                except FileError:
                    continue
                texts.append(grids(frame, time, {name: Dataset(*values)
                                                 for name, values in shapes.items()}))
        with replacing(self.directory / NAME) as temporary:
            temporary.write_text(HEAD + "".join(texts) + TAIL, encoding="utf-8")
        self.started = True
        return len(texts)


def grids(frame: int, time: float, datasets: Mapping[str, Dataset]) -> str:
    """All grids of one frame."""
    datasets = dict(sorted(datasets.items()))
    fields = {name[7:]: d for name, d in datasets.items() if name.startswith("fields/")}
    cells = {name: d for name, d in fields.items() if name not in FACES}
    parts = [f'<Grid Name="frame {frame}" GridType="Collection" CollectionType="Spatial">\n'
             f'<Time Value="{time!r}"/>\n']
    if cells:
        first = next(iter(cells.values()))
        corners = tuple(n + 1 for n in first.shape)
        parts.append(_box("cells", corners, (0.0, 0.0, 0.0), first.spacing)
                     + "".join(_values(frame, f"fields/{name}", d, "Cell")
                               for name, d in cells.items()) + "</Grid>\n")
    for name, d in fields.items():
        if name in FACES:
            parts.append(_box(f"faces of {name}", d.shape, d.origin, d.spacing)
                         + _values(frame, f"fields/{name}", d, "Node") + "</Grid>\n")
    for kind in sorted({name.split("/")[1] for name in datasets if name.startswith("particles/")}):
        prefix = f"particles/{kind}/"
        parts.append(_points(frame, kind, {name: d for name, d in datasets.items()
                                           if name.startswith(prefix)}))
    return "".join(parts) + "</Grid>\n"


def _box(name: str, points: tuple[int, ...], origin: tuple[float, ...],
         spacing: tuple[float, ...]) -> str:
    def row(values: tuple[float, ...]) -> str:
        return (f'<DataItem Dimensions="3" Format="XML">'
                f'{" ".join(repr(float(x)) for x in reversed(values))}</DataItem>')
    return (f'<Grid Name="{name}" GridType="Uniform">\n'
            f'<Topology TopologyType="3DCoRectMesh" Dimensions="{_numbers(points)}"/>\n'
            f'<Geometry GeometryType="ORIGIN_DXDYDZ">{row(origin)}{row(spacing)}</Geometry>\n')


def _points(frame: int, kind: str, columns: Mapping[str, Dataset]) -> str:
    """Particles; none where there are none, which readers do not take."""
    place = columns[f"particles/{kind}/position"]
    if place.shape[0] == 0:
        return ""
    rest = "".join(_values(frame, name, d, "Node") for name, d in columns.items()
                   if not name.endswith("/position"))
    return (f'<Grid Name="{kind}" GridType="Uniform">\n'
            f'<Topology TopologyType="Polyvertex" NumberOfElements="{place.shape[0]}" '
            'NodesPerElement="1"/>\n<Geometry GeometryType="XYZ">'
            f'{_item(frame, f"particles/{kind}/position", place)}</Geometry>\n{rest}</Grid>\n')


def _values(frame: int, path: str, dataset: Dataset, centre: str) -> str:
    kind = "Vector" if dataset.shape[1:] == (3,) else "Scalar"
    return (f'<Attribute Name="{path.rsplit("/", 1)[1]}" AttributeType="{kind}" Center="{centre}">'
            f"{_item(frame, path, dataset)}</Attribute>\n")


def _item(frame: int, path: str, dataset: Dataset) -> str:
    number = "Float" if dataset.kind == "f" else "Int"
    return (f'<DataItem Dimensions="{_numbers(dataset.shape)}" NumberType="{number}" '
            f'Precision="{dataset.bytes}" Format="HDF">snapshots/{snapshot_path("", frame).name}:'
            f"/{path}</DataItem>")


def _numbers(values: tuple[int, ...]) -> str:
    return " ".join(str(int(n)) for n in values)


def described(blocks: Mapping[str, Any], precision: int) -> dict[str, Dataset]:
    """The blocks of a snapshot as the index wants them; `precision`: bytes of stored floats."""
    return {name: Dataset(block.shape, block.values.dtype.kind,
                          precision if block.values.dtype.kind == "f"
                          else block.values.dtype.itemsize,
                          tuple(block.attributes.get("origin", ())),
                          tuple(block.attributes.get("spacing", ())))
            for name, block in blocks.items() if name.startswith(("fields/", "particles/"))}
