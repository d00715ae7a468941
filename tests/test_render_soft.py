"""A soft body is drawn in the shape that its frame stores."""

import numpy as np

from partition.build import build as build_fragments
from render.materials import all_materials
from render.pieces import Pieces
from render.triangles import normals
from solver.scene import build


def test_carried_vertices_take_the_place_of_those_at_rest():
    scene = build({"time": {"end": 1.0, "frame": 1.0}, "body": [
        {"name": "a", "shape": "sphere", "radius": 0.2, "density": 1.0,
         "fracture": {"pieces": 3}}]})
    fragments = build_fragments(scene)
    pieces = Pieces.of(fragments, scene.body, all_materials({}), 0.05)
    count = fragments.count
    poses = {"position": np.zeros((count, 3)), "rest_centre": np.zeros((count, 3)),
             "orientation": np.tile([1.0, 0, 0, 0], (count, 1))}
    stiff = pieces.posed(poses)
    soft = pieces.posed({**poses, "vertices": fragments.vertices * [2.0, 1.0, 1.0]})
    np.testing.assert_allclose(soft.corner, stiff.corner * [2.0, 1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(soft.normal, normals(soft.corner), atol=1e-12)
    np.testing.assert_array_equal(soft.rest, stiff.rest)   # textures stay where they were
