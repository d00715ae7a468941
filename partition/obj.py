"""How is a Wavefront OBJ file read?

Only its surface is: `v x y z ...` (a weight or a colour behind the coordinates is ignored) and
`f a b c ...` with three or more corners `a`, `a/t`, `a//n` or `a/t/n`, counted from 1 or, if
negative, back from the last vertex given so far. A backslash continues a line. Groups, materials,
lines and points are skipped. Faces with more than three corners are cut into triangles.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints
from partition.polygon import ears, halves

Floats = NDArray[np.float64]


def read_obj(path: Path) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and triangles (f, 3); raises ValueError naming the line's content."""
    lines = path.read_bytes().replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    points: list[bytes] = []
    corners: list[list[bytes]] = []
    known: list[int] = []       # vertices given before each face
    for line in lines:
        words = line.split(b"#", 1)[0].split() if b"#" in line else line.split()
        if not words:
            continue
        if words[0] == b"v":
            if len(words) < 4:
                raise ValueError(f"vertex {_text(line)} has not three coordinates")
            points.extend(words[1:4])
        elif words[0] == b"f":
            if len(words) < 4:
                raise ValueError(f"face {_text(line)} has not three corners")
            corners.append(words[1:])
            known.append(len(points) // 3)
    vertices = np.fromiter(map(float, points), np.float64, len(points)).reshape(-1, 3)
    return vertices, _triangles(vertices, corners, np.array(known, dtype=np.int64))


def _triangles(vertices: Floats, corners: list[list[bytes]], known: Ints) -> Ints:
    size = np.array([len(face) for face in corners], dtype=np.int64)
    flat = [int(word.split(b"/", 1)[0]) for face in corners for word in face]
    index = np.array(flat, dtype=np.int64)
    index = np.where(index < 0, index + np.repeat(known, size), index - 1)
    start = np.cumsum(size) - size
    faces = [np.stack([index[start[size == 3] + corner] for corner in range(3)], axis=1)]
    if np.any(size > 3):
        if index.min() < 0 or index.max() >= len(vertices):
            raise ValueError(f"a face refers to a vertex outside 1 ... {len(vertices)}")
        fours = np.stack([index[start[size == 4] + corner] for corner in range(4)], axis=1)
        faces.append(halves(vertices, fours))
        for first, count in zip(start[size > 4], size[size > 4], strict=True):
            polygon = index[first:first + count]
            faces.append(polygon[ears(vertices[polygon])])
    return np.concatenate(faces)


def _text(line: bytes) -> str:
    return repr(line[:40].decode("ascii", "replace"))
