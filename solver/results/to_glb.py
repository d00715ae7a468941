"""A run as glTF: the pieces of each frame as one binary file.

glTF is y-up like our scenes, so nothing is turned. Each piece keeps its name.
"""

from collections.abc import Sequence
from pathlib import Path

from partition import fragments
from solver.files import read_snapshot
from solver.results.pose import posed


def write(run: Path, output: Path, frames: Sequence[int]) -> list[Path]:
    """Write pieces_NNNNNN.glb; returns the files. Raises `FileError` for a run without bodies."""
    import trimesh

    pieces = fragments.read(run / "fragments.h5")
    made = []
    for frame in frames:
        places = posed(pieces, read_snapshot(run, frame, ()).bodies)
        scene = trimesh.Scene()
        for index in range(pieces.count):
            first, last = pieces.vertex_start[index:index + 2]
            name = f"{pieces.names[pieces.body[index]]}_{index:04d}"
            scene.add_geometry(trimesh.Trimesh(places[first:last], pieces.piece(index)[1],
                                               process=False), node_name=name, geom_name=name)
        made.append(output / f"pieces_{frame:06d}.glb")
        made[-1].write_bytes(scene.export(file_type="glb"))
    return made
