"""Pieces of a mesh wear their picture as the mesh's file says."""

import numpy as np
import pytest

from partition.build import build as break_up
from render.materials import all_materials
from render.pieces import Pieces
from solver import scene

# A tetrahedron; one corner has another u, v in each of its faces
OBJ = """
v 0 0 0
v 2 0 0
v 0 1 0
v 0 0 3
vt 0 0
vt 1 0
vt 0 1
vt 0.25 0.5
f 1/1 3/2 2/3
f 1/2 2/1 4/4
f 1/3 4/2 3/1
f 2/4 3/3 4/1
"""
UV = {(0, 2, 1): (0, 1, 2), (0, 1, 3): (1, 0, 3), (0, 3, 2): (2, 1, 0), (1, 2, 3): (3, 2, 0)}


@pytest.mark.serial
def test_pieces_keep_the_coordinates_of_the_file(tmp_path):
    (tmp_path / "tetrahedron.obj").write_text(OBJ)
    found = scene.build({
        "time": {"end": 1.0, "frame": 1.0}, "body": [{
            "name": "t", "shape": "mesh", "mesh": "tetrahedron.obj", "scale": 0.2,
            "rotate": [20, 40, 70], "place": [0.5, 0.4, 0.6], "areal_density": 1.0,
            "fracture": {"pieces": 2}}]}, tmp_path / "scene.toml")
    fragments = break_up(found)
    pieces = Pieces.of(fragments, found.body, all_materials({}), 0.05, tmp_path)
    outer = pieces.neighbour < 0
    uv = pieces.rest.uv[outer]
    vt = np.array([(0, 0), (1, 0), (0, 1), (0.25, 0.5)]) * (1, -1) + (0, 1)
    expected = sorted(sorted(map(tuple, vt[list(corners)])) for corners in UV.values())
    assert sorted(sorted(map(tuple, triangle)) for triangle in uv) == expected
    # and each corner its own: the tip is the corner farthest from the others
    apex = {tuple(np.round(vt[i], 6)) for i in (3, 1, 0)}
    shape = pieces.rest.corner[outer]
    places = shape.reshape(-1, 3)
    tip = places[np.linalg.norm(places - places[:, None], axis=2).sum(axis=1).argmax()]
    at_tip = np.linalg.norm(shape - tip, axis=2) < 1e-9
    assert {tuple(np.round(value, 6)) for value in uv[at_tip]} == apex
    boxed = Pieces.of(fragments, found.body, all_materials({}), 0.05)
    assert not np.allclose(boxed.rest.uv[outer], uv)
