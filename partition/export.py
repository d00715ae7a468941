"""How do pieces reach other programs: one mesh file each, in a format that they read?"""

from pathlib import Path

from partition.fragments import Fragments

FORMATS = ("obj", "ply", "stl", "vtu")


def export(directory: Path, kind: str, pieces: Fragments) -> int:
    """Write BODY_NNNN.kind for every piece, numbered as in fragments.h5; returns how many."""
    import meshio

    directory.mkdir(parents=True, exist_ok=True)
    for index in range(pieces.count):
        vertices, faces = pieces.piece(index)
        name = pieces.names[pieces.body[index]].replace("/", "_")
        meshio.write(directory / f"{name}_{index:04d}.{kind}",
                     meshio.Mesh(vertices, {"triangle": faces}), kind)
    return pieces.count
