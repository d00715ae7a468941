"""How is a binary PLY file read that holds nothing but triangles?

Most large scans are such files: vertices and triangles are records of one size each, which are
taken as they lie in the file. Any other PLY file (text, other polygons, more elements, cut short)
is for a reader that looks at every face.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints

Floats = NDArray[np.float64]
LONGEST = 1 << 16       # bytes of a header
END = b"end_header\n"
REMARK = re.compile(rb"^(?:comment|obj_info)\b.*\n", re.MULTILINE)
HEADER = re.compile(rb"ply\nformat binary_(little|big)_endian 1\.0\n"
                    rb"element vertex (\d{1,18})\n((?:property \w+ \w+\n)+)"
                    rb"element face (\d{1,18})\n"
                    rb"property list (u\w+) (u?int\w*) vertex_ind(?:ices|ex)\n"
                    rb"((?:property \w+ \w+\n)*)end_header\n")
NUMBERS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
           "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2",
           "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}


def read_triangles(path: Path) -> tuple[Floats, Ints] | None:
    """Vertices (v, 3) and triangles (f, 3), unchecked; None for a file that is not like that."""
    with open(path, "rb") as file:
        head = file.read(LONGEST)
    data = head.find(END) + len(END)
    found = HEADER.fullmatch(REMARK.sub(b"", head[:data]))
    if found is None:
        return None
    order, points, coordinates, triangles, size, corner, others = (
        group.decode("latin-1") for group in found.groups())
    sign = "<" if order == "little" else ">"
    try:
        vertex = np.dtype(_fields(coordinates, sign))
        face = np.dtype([("", sign + NUMBERS[size]), ("corners", sign + NUMBERS[corner], 3),
                         *_fields(others, sign)])
        faces_at = data + int(points) * vertex.itemsize
        if path.stat().st_size < faces_at + int(triangles) * face.itemsize:
            return None
        vertices = np.fromfile(path, vertex, int(points), offset=data)
        faces = np.fromfile(path, face, int(triangles), offset=faces_at)
        places = np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float64, copy=False)
    except (KeyError, ValueError):      # a number that PLY does not know, twice the same name
        return None
    return (places, faces["corners"].astype(np.int64)) if np.all(faces["f0"] == 3) else None


def _fields(properties: str, sign: str) -> list[tuple[str, str]]:
    """The fields of a record from lines `property TYPE NAME`."""
    words = properties.split()
    return [(name, sign + NUMBERS[kind]) for kind, name in zip(words[1::3], words[2::3],
                                                               strict=True)]
