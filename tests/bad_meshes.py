"""Files that are wrong in some way, and what the reader is to say about each."""

import gzip
import struct

import numpy as np
from numpy.typing import NDArray

from partition.shapes import box, sphere

CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
SQUARES = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
CUBE_FACES = "".join(f"f {square}\n" for square in SQUARES)


def obj(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> str:
    """The text of an OBJ file."""
    return "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist()) \
        + "".join(f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist())


def stl(count: int, triangles: int) -> bytes:
    """A binary STL that announces `count` triangles and holds some."""
    one = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    return b"solid in name only".ljust(80) + struct.pack("<I", count) + one * triangles


def ply(vertices: int, faces: int, body: bytes, kind: str = "ascii") -> bytes:
    """A PLY file with a header and any body."""
    return (f"ply\nformat {kind} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y"
            f"\nproperty float z\nelement face {faces}\nproperty list uchar int vertex_indices\n"
            "end_header\n").encode() + body


def moebius(count: int = 12) -> str:
    """A closed band with half a turn."""
    angle = np.arange(count) * 2 * np.pi / count
    rim = [np.stack([(2 + s * np.cos(angle / 2)) * np.cos(angle),
                     (2 + s * np.cos(angle / 2)) * np.sin(angle), s * np.sin(angle / 2)], axis=1)
           for s in (-0.5, 0.5)]
    faces = []
    for i in range(count):
        j = (i + 1) % count
        a, b, c, d = i, i + count, j + count, j
        if j == 0:
            c, d = d, c
        faces += [(a, b, c), (a, c, d)]
    return obj(np.concatenate(rim), np.array(faces))


def two(shift: tuple[float, float, float]) -> str:
    """Two unit cubes in one file."""
    vertices, faces = box((1, 1, 1), 0)
    return obj(np.concatenate([vertices, vertices + shift]), np.concatenate([faces, faces + 8]))


def cube(**change: object) -> str:
    """A triangulated cube, times `scale`, with the first `flipped` triangles turned over."""
    vertices, faces = box((1, 1, 1), 0)
    flipped = int(str(change.get("flipped", 0)))
    faces[:flipped] = faces[:flipped, ::-1]
    return obj(vertices * float(str(change.get("scale", 1.0))), faces)


def loose() -> str:
    """A cube of twelve triangles that share no vertex."""
    vertices, faces = box((1, 1, 1), 0)
    return obj(vertices[faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))


def ascii_stl() -> str:
    """A sphere, as text."""
    vertices, faces = sphere(1.0, 1)
    facets = ["".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
              for corners in vertices[faces].tolist()]
    return "solid x\n" + "".join(f"facet normal 0 0 0\nouter loop\n{facet}endloop\nendfacet\n"
                                 for facet in facets) + "endsolid x\n"


def t_junction() -> str:
    """A closed tetrahedron with a flat triangle between an edge and two halves of it."""
    vertices = np.array([(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 0, 0)], dtype=float)
    faces = np.array([(0, 2, 1), (0, 4, 3), (4, 1, 3), (1, 2, 3), (0, 3, 2), (0, 1, 4)])
    return obj(vertices, faces)


# (file name, content, what the error says)
ERRORS: dict[str, tuple[str, str | bytes, str]] = {
    "no file at all": ("", "", "no suffix"),
    "empty": ("a.obj", "", "holds no triangles"),
    "only vertices": ("a.obj", CUBE, "holds no triangles"),
    "NaN": ("a.obj", CUBE.replace("v 1 1 1", "v nan 1 1") + CUBE_FACES, "not finite"),
    "infinite": ("a.obj", CUBE.replace("v 1 1 1", "v 1e999 1 1") + CUBE_FACES, "not finite"),
    "index past the end": ("a.obj", CUBE + "f 1 2 9\n", "vertex 8 of 8"),
    "index 0": ("a.obj", CUBE + "f 0 1 2\n", "vertex -1 of 8"),
    "negative index before the start": ("a.obj", CUBE + "f -9 -1 -2\n", "vertex -1 of 8"),
    "polygon past the end": ("a.obj", CUBE + "f 1 2 3 4 9\n", "outside 1 ... 8"),
    "quad past the end": ("a.obj", CUBE + "f 1 2 3 9\n", "outside 1 ... 8"),
    "huge index": ("a.obj", CUBE + f"f 1 2 {10**30}\n", "cannot be read"),
    "words for numbers": ("a.obj", "v one two three\n", "could not convert"),
    "two coordinates": ("a.obj", "v 1 2\n", "not three coordinates"),
    "two corners": ("a.obj", CUBE + "f 1 2\n", "not three corners"),
    "broken corner": ("a.obj", CUBE + "f 1/ /2 3\n", "cannot be read"),
    "points on a line": ("a.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", "no triangle has an"),
    "all vertices one": ("a.obj", "v 1 1 1\n" * 3 + "f 1 2 3\n", "no triangle has an area"),
    "large as 1e150": ("a.obj", cube(scale=1e150), "extent"),
    "small as 1e-150": ("a.obj", cube(scale=1e-150), "extent"),
    "Moebius strip": ("a.obj", moebius(), "one-sided"),
    "three triangles on an edge": ("a.obj", CUBE + "f 1 2 3\nf 2 1 5\nf 1 2 8\n",
                                   "3 triangles share the edge"),
    "binary noise as OBJ": ("a.obj", bytes(range(256)) * 40, "holds no triangles"),
    "unknown suffix": ("a.xyz", CUBE, "not a kind of mesh"),
    "gzip bomb": ("a.obj.gz", gzip.compress(b"v 0 0 0\n" * 10**6), ".gz is not a kind of mesh"),
    "gzip called OBJ": ("a.obj", gzip.compress(b"v 0 0 0\n" * 10**6), "holds no triangles"),
    "OBJ called STL": ("a.stl", CUBE + CUBE_FACES, "cannot be read as .stl"),
    "STL called PLY": ("a.ply", stl(1, 1), "cannot be read as .ply"),
    "empty STL": ("a.stl", "", "cannot be read as .stl"),
    "STL cut short": ("a.stl", stl(100, 3)[:-20], "cannot be read as .stl"),
    "STL with a false count": ("a.stl", stl(4 * 10**9, 3), "cannot be read as .stl"),
    "PLY with 10^7 vertices and no data": ("a.ply", ply(10**7, 1, b""), "cannot be read as .ply"),
    "binary PLY with no data": ("a.ply", ply(10**7, 10**5, b"", "binary_little_endian"),
                                "holds no triangles"),
    "PLY header cut short": ("a.ply", ply(3, 1, b"")[:60], "cannot be read as .ply"),
    "PLY with false index": ("a.ply", ply(3, 1, b"0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"),
                             "vertex 7 of 3"),
    "OFF of one line": ("a.off", "OFF\n# 12 20 0\n", "it ends too early"),
    "PLY header without an end": ("a.ply", ply(3, 1, b"").replace(b"end_header", b""),
                                  "cannot be read as .ply"),
    "OFF with 10^7 vertices and no data": ("a.off", "OFF\n10000000 10 0\n", "cannot be read"),
    "VTK cut short": ("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n"
                               "POINTS 10000000 float\n0 0 0\n", "cannot be read as .vtk"),
    "Gmsh cut short": ("a.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 10000000",
                       "cannot be read as .msh"),
}

# (file name, content, what is reported, parts, closed)
REPAIRS: dict[str, tuple[str, str, str, int, bool]] = {
    "loose triangles": ("a.obj", loose(), "28 vertices welded", 1, True),
    "one triangle": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "", 1, False),
    "unused vertices, one NaN": ("a.obj", CUBE + "v nan 0 0\nv 7 7 7\n" + CUBE_FACES, "", 1, True),
    "given twice": ("a.obj", CUBE + CUBE_FACES + "f 1 2 4\n", "1 triangles given twice", 1, True),
    "repeated corner": ("a.obj", CUBE + CUBE_FACES + "f 1 1 2\n", "1 triangles with a repeated", 1,
                        True),
    "flat triangle in a closed surface": ("a.obj", t_junction(), "1 flat triangles flipped", 1,
                                          True),
    "flat triangle at a border": ("a.obj", "v 0 0 0\nv 2 0 0\nv 1 0 0\nv 1 1 0\n"
                                           "f 1 3 4\nf 3 2 4\nf 1 2 3\n", "1 flat", 1, False),
    "one triangle turned over": ("a.obj", cube(flipped=1), "1 triangles turned over", 1, True),
    "inside out": ("a.obj", cube(flipped=12), "1 parts turned outside out", 1, True),
    "two cubes touching in a corner": ("a.obj", two((1, 1, 1)), "1 vertices split", 2, True),
    "two cubes touching along an edge": ("a.obj", two((1, 1, 0)), "1 edges with more than two", 2,
                                         True),
    "minus zero": ("a.obj", CUBE.replace("v 0 0 0", "v -0.0 0 0") + "v 0 -0.0 0\n"
                   + CUBE_FACES.replace("f 1 5 6 2", "f 9 5 6 2"), "1 vertices welded", 1, True),
    "texture, normals, negative, colours, continued, grouped": (
        "a.obj", "mtllib x.mtl\r\no it\r\n" + CUBE.replace("\n", " 0.5 0.5 0.5\r\n")
        + "vt 0 0\r\nvn 0 0 1\r\ng side\r\nusemtl red\r\ns 1\r\n"
        + "f -8/1/1 -7/1/1 -5/1/1 -6/1/1 # a comment\r\nf 5/1 7/1 8/1 6/1\r\nf 1//1 5//1 \\\r\n"
        "6//1 2//1\r\nf 3 4 8 7\r\nf 1 3 7 5\r\nf 2 6 8 4\r\nl 1 2\r\np 1\r\n", "", 1, True),
    "polygon with a notch": ("a.obj", "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n",
                             "", 1, False),
    "quad with a notch": ("a.obj", "v 0 0 0\nv 2 1 0\nv 4 0 0\nv 2 4 0\nf 1 2 3 4\n", "", 1, False),
    "sphere in an ASCII STL": ("a.stl", ascii_stl(), "", 1, True),
}
