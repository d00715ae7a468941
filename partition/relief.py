"""How do the inner faces of a fracture look: as they are, smooth, or rough?

Both sides of an inner face have the same vertices, so whatever moves these moves both sides alike
and no gap opens. Vertices on the surface of the body stay where they are, and with them the body's
shape and volume.

smooth   each vertex goes towards the mean of those it shares an edge of an inner face with
rough    each is moved at random, by a part of the shortest edge it belongs to

A vertex goes back where it would turn a tetrahedron over or squash it, so pieces never overlap.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints
from partition.recover import EDGES, FACES
from partition.tetrahedra import Tetrahedra

Floats = NDArray[np.float64]
SMOOTHINGS = 20
ROUGHNESS = 0.35        # of the shortest edge
SQUASHED = 0.05         # of the volume before


def smooth(body: Tetrahedra, label: Ints) -> Tetrahedra:
    """The body with even inner faces; `label` (t,) is the piece of each tetrahedron."""
    faces, movable = _inner(body, label)
    a, b = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    start, end = np.concatenate([a, b]), np.concatenate([b, a])
    count = np.maximum(np.bincount(start, minlength=len(body.vertices)), 1)[:, None]
    for _ in range(SMOOTHINGS):
        total = np.stack([np.bincount(start, column[end], len(body.vertices))
                          for column in body.vertices.T], axis=1)
        halfway = (body.vertices + total / count) / 2
        body = _moved(body, np.where(movable[:, None], halfway, body.vertices))
    return body


def rough(body: Tetrahedra, label: Ints, rng: np.random.Generator) -> Tetrahedra:
    """The body with its inner faces strewn with noise."""
    _, movable = _inner(body, label)
    a, b = body.cells[:, EDGES].reshape(-1, 2).T
    length = np.linalg.norm(body.vertices[a] - body.vertices[b], axis=1)
    shortest = np.full(len(body.vertices), np.inf)
    np.minimum.at(shortest, a, length)
    np.minimum.at(shortest, b, length)
    noise = rng.uniform(-1, 1, body.vertices.shape)
    far = np.where(movable, ROUGHNESS * shortest, 0.0)
    return _moved(body, body.vertices + far[:, None] * noise)


def _inner(body: Tetrahedra, label: Ints) -> tuple[Ints, NDArray[np.bool_]]:
    """Triangles (f, 3) between pieces, and which vertices (v,) of them may move."""
    outside = body.neighbour == NO_TWIN
    cell, side = np.nonzero(~outside & (label[body.neighbour] != label[:, None]))
    faces = body.cells[cell[:, None], FACES[side]]
    movable = np.zeros(len(body.vertices), dtype=bool)
    movable[faces] = True
    movable[body.surface()[0]] = False
    return faces, movable


def _moved(body: Tetrahedra, vertices: Floats) -> Tetrahedra:
    """The body with new vertices, except where they would spoil a tetrahedron."""
    while True:
        new = replace(body, vertices=vertices)
        spoilt = new.volumes < SQUASHED * body.volumes
        back = np.zeros(len(vertices), dtype=bool)
        back[body.cells[spoilt]] = True
        back &= np.any(vertices != body.vertices, axis=1)
        if not np.any(back):
            return new
        vertices = np.where(back[:, None], body.vertices, vertices)
