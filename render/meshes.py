"""Which triangles do mesh objects add? Files read once, placed where the scene says."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from render.triangles import (Array, Triangles, box_coordinates, joined, no_triangles, normals,
                              smooth_normals)
from solver.files import FileError
from solver.scene_render import Material, Thing


def mesh_objects(things: Sequence[Thing], folder: Path,
                 materials: Mapping[str, Material]) -> Triangles:
    """The triangles of all objects of shape "mesh"; paths start at `folder`."""
    order = list(materials)
    parts = [_mesh(thing, folder, materials[thing.material], order.index(thing.material))
             for thing in things if thing.shape == "mesh"]
    return joined(parts) if parts else no_triangles()


def _mesh(thing: Thing, folder: Path, material: Material, index: int) -> Triangles:
    path = folder / thing.mesh
    if not path.is_file():
        raise FileError(f"{path}: no such mesh; fix: correct mesh of the [[render.object]]")
    corner, uv = file_triangles(path)
    middle = (corner.min(axis=(0, 1)) + corner.max(axis=(0, 1))) / 2
    corner = (corner - middle) * thing.scale + np.array(thing.place)
    one = np.zeros(len(corner), np.int64)
    if uv is None:
        uv = box_coordinates(corner, one)
    crease = 0.0 if material.kind == "glass" else material.crease
    return Triangles(corner, normals(corner), smooth_normals(corner, one, one + crease), corner,
                     uv, np.zeros((len(one), 3)), one + index, one - 1)


def file_triangles(path: Path) -> tuple[Array, Array | None]:
    """(corners (n, 3, 3), their u and v (n, 3, 2), v downwards, or None) of a mesh file."""
    import trimesh
    try:
        mesh = trimesh.load_mesh(path, process=False)
    except Exception as error:   # trimesh's readers raise whatever they meet
        raise FileError(f"{path}: not a readable mesh ({error}); fix: OBJ, PLY or STL") from None
    faces = np.asarray(mesh.faces)
    corner = np.asarray(mesh.vertices, np.float64)[faces]
    if not len(corner) or not np.isfinite(corner).all():
        raise FileError(f"{path}: has no triangles, or corners that are not finite; fix: repair it")
    uv = getattr(mesh.visual, "uv", None)
    return corner, None if uv is None else np.asarray(uv, np.float64)[faces] * (1, -1) + (0, 1)
