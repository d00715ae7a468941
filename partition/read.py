"""How does a file become vertices and triangles?

OBJ files are read by `partition.obj`, binary PLY files of triangles by `partition.ply`, the others
by meshio. Whatever is wrong with a file ends in one `MeshError`; what is wrong with the surface in
it is for `partition.repair`.
"""

import contextlib
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints
from partition.mesh import MeshError
from partition.obj import read_obj
from partition.ply import read_triangles
from partition.polygon import ears, halves

Floats = NDArray[np.float64]
# by meshio; its readers of compressed files are left out, whose size on disk bounds nothing
FORMATS = {".ply": "ply", ".stl": "stl", ".off": "off", ".vtk": "vtk", ".msh": "gmsh"}


class Ending(io.BufferedReader):
    """A file that says when it is over: meshio looks for the end of a PLY header for ever."""

    over = 0

    def readline(self, size: int | None = -1, /) -> bytes:
        """One line; raises ValueError when there is none again and again."""
        line = super().readline(size)
        self.over = 0 if line else self.over + 1
        if self.over > 100:
            raise ValueError("it ends too early")
        return line


def read_surface(path: Path) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and triangles (f, 3) of a file, unchecked; raises MeshError."""
    kind = path.suffix.lower()
    if kind != ".obj" and kind not in FORMATS:
        raise MeshError(f"{path}: {kind or 'no suffix'} is not a kind of mesh that is read; fix: "
                        f"convert it to .obj, {', '.join(FORMATS)}")
    if not path.is_file():
        raise MeshError(f"{path}: no such mesh; fix: give the path of a mesh file")
    try:
        if kind == ".obj":
            return read_obj(path)
        plain = read_triangles(path) if kind == ".ply" else None
        return plain or _by_meshio(path, FORMATS[kind])
    except MeshError:
        raise
    # a damaged file may trip a reader anywhere, and meshio ends the process on some
    except (Exception, SystemExit) as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise MeshError(f"{path}: cannot be read as {kind} ({reason}); fix: export it again, with "
                        "the suffix of its format") from None


def _check_counts(path: Path) -> None:
    """In an OFF file something must follow the first line: meshio looks for it for ever."""
    with open(path, "rb") as file:
        file.readline()
        if not any(line.strip() and not line.strip().startswith(b"#") for line in file):
            raise ValueError("it ends too early")


def _by_meshio(path: Path, kind: str) -> tuple[Floats, Ints]:
    import meshio

    complaints = io.StringIO()
    with contextlib.redirect_stdout(complaints), contextlib.redirect_stderr(complaints):
        try:
            if kind == "ply":
                with Ending(io.FileIO(path)) as file:
                    data = meshio.read(file, kind)
            else:
                if kind == "off":
                    _check_counts(path)
                data = meshio.read(path, kind)
        except SystemExit:
            raise ValueError(complaints.getvalue() or "meshio gave up") from None
    vertices = np.asarray(data.points, dtype=np.float64)
    if vertices.ndim == 2 and vertices.shape[1] == 2:
        vertices = np.column_stack([vertices, np.zeros(len(vertices))])
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError("its vertices have not three coordinates")
    faces = [np.zeros((0, 3), dtype=np.int64)]
    for block in data.cells:
        corners = np.asarray(block.data)
        if block.type == "triangle":
            faces.append(corners.astype(np.int64))
        elif block.type in ("quad", "polygon"):
            polygons = corners.astype(np.int64)
            if polygons.size and (polygons.min() < 0 or polygons.max() >= len(vertices)):
                raise ValueError("a face refers to a vertex that does not exist")
            if block.type == "quad":
                faces.append(halves(vertices, polygons))
            else:
                faces.extend(polygon[ears(vertices[polygon])] for polygon in polygons)
    return vertices, np.concatenate(faces)
