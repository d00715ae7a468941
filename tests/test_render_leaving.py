"""A ray that leaves a surface does not meet it again; one that goes inside meets the far side.

20 000 random points on a ball, a box, a mesh, of sizes from 1e-6 to 1e6, away from the origin; half
of those on the box are near an edge, down to 2e-6 of its size. A tenth of the lift, 1e-6, goes
along the ray, so that it gets off the second face of an edge; nearer than that, a ray that enters
one face and would leave by the other at once starts behind both. No start is right for all rays
there without asking for the second face. On a box as large as the scene one sample in 500 000 meets
it; it counts as in the box, is not bent where it enters glass next, and is no brighter for it.
"""

import numpy as np
import pytest
import trimesh
from numba import njit

from render.materials import all_materials, material_table
from render.primitives import primitives
from render.rays import allocate
from render.surfaces import Surfaces, lifted, outward_normal
from render.triangles import Triangles, box_coordinates, no_triangles, normals
from render.vector import load, store
from solver.scene_render import Thing

N = 20_000
MATERIALS = all_materials({})
NEAREST = 2e-6      # to an edge of the box, in boxes
INDEX = {name: i for i, name in enumerate(MATERIALS)}
CENTRE = np.array((0.5, -0.3, 0.8))     # times the size


def ball(size):
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    corner = (np.asarray(mesh.vertices)[mesh.faces] + CENTRE) * size
    one = np.zeros(len(corner), np.int64)
    flat = normals(corner)
    return Triangles(corner, flat, np.repeat(flat[:, None], 3, axis=1), corner,
                     box_coordinates(corner, one), np.zeros((len(one), 3)), one, one - 1)


def on_mesh(random, size):
    """(surfaces, points, normals)"""
    mesh = ball(size)
    face = random.integers(0, len(mesh.normal), N)
    share = random.dirichlet((1, 1, 1), N)
    return (Surfaces(mesh, primitives((), INDEX), material_table(MATERIALS, None), 1e-5 * size),
            np.einsum("nc,nca->na", share, mesh.corner[face]), mesh.normal[face])


def on_sphere(random, size):
    thing = Thing(shape="sphere", place=tuple(CENTRE * size), radius=0.5 * size)
    normal = random.normal(size=(N, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return alone(thing, size), (CENTRE + 0.5 * normal) * size, normal


def on_box(random, size):
    low, high = CENTRE - 0.5, CENTRE + 0.5
    thing = Thing(shape="box", low=tuple(low * size), high=tuple(high * size))
    axis, side = random.integers(0, 3, N), random.integers(0, 2, N)
    place = random.uniform(low + NEAREST, high - NEAREST, (N, 3))
    normal, row = np.zeros((N, 3)), np.arange(N)
    near, other = row[::2], (axis[::2] + random.integers(1, 3, N // 2)) % 3
    gap = 10 ** random.uniform(np.log10(NEAREST), -3, N // 2)
    place[near, other] = np.where(random.integers(0, 2, N // 2) == 1, high[other] - gap,
                                  low[other] + gap)
    place[row, axis] = np.where(side == 1, high[axis], low[axis])
    normal[row, axis] = 2.0 * side - 1
    return alone(thing, size), place * size, normal


def alone(thing, size):
    return Surfaces(no_triangles(), primitives([thing], INDEX), material_table(MATERIALS, None),
                    1e-5 * size)


@njit
def start(place, normal, direction, lift, origin):
    for ray in range(len(place)):
        store(origin, ray, lifted(load(place, ray), load(normal, ray), load(direction, ray), lift))


@njit
def normals_at(triangles, primitives, surface, place, normal):
    for ray in range(len(place)):
        if surface[ray] >= 0:
            store(normal, ray, outward_normal(triangles, primitives, surface[ray],
                                              load(place, ray)))


@pytest.mark.parametrize("shape", [on_sphere, on_box, on_mesh])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_leaving_and_entering(shape, size):
    random = np.random.default_rng(11)
    surfaces, place, normal = shape(random, size)
    direction = random.normal(size=(N, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    slope = np.einsum("na,na->n", direction, normal)
    outward = direction * np.sign(slope)[:, None]
    for d in (outward, -outward):
        rays = allocate(N)
        rays.direction[:], rays.weight[:], rays.inside[:] = d, 1, 0
        start(place, normal, d, surfaces.lift, rays.origin)
        hits = surfaces.closest(rays)
        if d is outward:
            assert not (hits.surface >= 0).any()
            continue
        # At a grazing angle the lift may already be beyond the far side
        inside = np.flatnonzero(abs(slope) > 1e-3)
        assert (hits.surface[inside] >= 0).all()
        far = rays.origin + hits.distance[:, None] * d
        there = np.zeros((N, 3))
        normals_at(surfaces.triangles, surfaces.primitives, hits.surface, far, there)
        assert (np.einsum("na,na->n", there, d)[inside] > 0).all()
