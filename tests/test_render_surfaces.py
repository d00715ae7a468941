"""What a ray meets first: against the plain formulas, 100 000 rays a shape, shared edges once."""

import numpy as np
import pytest
import trimesh

from render.materials import all_materials, material_table
from render.primitives import primitives
from render.rays import allocate
from render.surfaces import Surfaces, lifted, outward_normal
from render.triangles import (Triangles, box_coordinates, no_triangles, normals,
                              smooth_normals)
from solver.scene_render import Thing
from tests.render_run import still

N = 100_000
MATERIALS = all_materials({})
INDEX = {name: i for i, name in enumerate(MATERIALS)}


def triangles(mesh, material="matt"):
    corner = np.asarray(mesh.vertices, float)[mesh.faces]
    one = np.zeros(len(corner), np.int64)
    return Triangles(corner, normals(corner), smooth_normals(corner, one, one * 1.0), corner,
                     box_coordinates(corner, one), np.zeros((len(one), 3)),
                     one + INDEX[material], one - 1)


def surfaces(things=(), mesh=None, material="matt"):
    return Surfaces(no_triangles() if mesh is None else triangles(mesh, material),
                    primitives(things, INDEX), material_table(MATERIALS, None), 1e-5)


def random_rays(count=N, seed=0):
    random = np.random.default_rng(seed)
    rays = allocate(count)
    rays.origin[:] = random.uniform(-2, 2, (count, 3))
    target = random.normal(size=(count, 3)) * 0.6
    direction = target - rays.origin
    rays.direction[:] = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    rays.weight[:], rays.pixel[:], rays.seed[:] = 1, 0, 0
    rays.inside[:], rays.medium[:] = 0, -1
    return rays


def nearest_triangle(corner, rays):
    """Moeller and Trumbore's test of every ray with every triangle; inf for none."""
    best = np.full(len(rays.pixel), np.inf)
    for a, b, c in corner:
        p = np.cross(rays.direction, c - a)
        det = p @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = rays.origin - a
            u = np.einsum("nk,nk->n", s, p) / det
            q = np.cross(s, b - a)
            v = np.einsum("nk,nk->n", rays.direction, q) / det
            t = q @ (c - a) / det
        hit = (det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        best = np.where(hit & (t < best), t, best)
    return best


def test_mesh_against_every_triangle():
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.9)
    rays = random_rays()
    found, expected = surfaces(mesh=mesh).closest(rays), nearest_triangle(
        np.asarray(mesh.vertices)[mesh.faces], rays)
    same = np.isfinite(found.distance) == np.isfinite(expected)
    assert same.mean() >= 1 - 2e-5    # float32: a ray that just grazes the outline
    both = np.isfinite(found.distance) & np.isfinite(expected)
    assert both.sum() > 0.3 * N
    error = abs(found.distance[both] - expected[both])
    assert error.max() < 2e-5 and np.median(error) < 1e-14


def test_sphere_against_its_equation():
    rays = random_rays()
    found = surfaces([Thing(shape="sphere", place=(0.1, -0.2, 0.3), radius=0.8)]).closest(rays)
    o = rays.origin - (0.1, -0.2, 0.3)
    b, c = np.einsum("nk,nk->n", o, rays.direction), np.einsum("nk,nk->n", o, o) - 0.64
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - c)
    expected = np.where(-b - root > 0, -b - root, np.where(-b + root > 0, -b + root, np.inf))
    assert found.distance == pytest.approx(np.where(np.isnan(expected), np.inf, expected), abs=1e-9)


def test_box_and_frame_against_triangles():
    """A frame with its hole shut is a box; both are the twelve triangles of a box."""
    low, high = (-0.5, -0.7, -0.2), (0.8, 0.4, 0.3)
    mesh = trimesh.creation.box(bounds=(low, high))
    rays = random_rays(20_000)
    expected = nearest_triangle(np.asarray(mesh.vertices)[mesh.faces], rays)
    box = Thing(shape="box", low=low, high=high)
    hole = Thing(shape="box", low=(-0.1, -0.3, -0.2), high=(0.2, 0.1, 0.3))
    frame = Thing(shape="frame", low=low, high=high, hole_low=(-0.1, -0.3, -9.0),
                  hole_high=(0.2, 0.1, 9.0))
    assert surfaces([box]).closest(rays).distance == pytest.approx(expected, abs=1e-9)
    outside = rays.origin[np.any((rays.origin < low) | (rays.origin > high), axis=1)]
    assert len(outside) > 1000
    shut = surfaces([frame, hole]).closest(rays).distance
    beyond = np.any((rays.origin < low) | (rays.origin > high), axis=1)
    assert shut[beyond] == pytest.approx(expected[beyond], abs=1e-9)
    through = surfaces([frame]).closest(rays).distance
    assert (through[beyond] > expected[beyond] + 1e-3).mean() > 0.02


def test_plane():
    rays = random_rays(1000)
    found = surfaces([Thing(shape="plane", place=(0, -0.5, 0), normal=(0, 3, 0))]).closest(rays)
    t = (-0.5 - rays.origin[:, 1]) / rays.direction[:, 1]
    assert found.distance == pytest.approx(np.where(t > 0, t, np.inf), rel=1e-12)


@pytest.mark.parametrize("shape", ["box", "icosphere"])
def test_shared_edges_and_corners_are_crossed_once(shape):
    """Rays aimed at edges and corners of a closed body enter it once and leave it once."""
    mesh = (trimesh.creation.box(extents=(1, 1, 1)) if shape == "box"
            else trimesh.creation.icosphere(subdivisions=1, radius=0.7))
    scene = surfaces(mesh=mesh)
    random = np.random.default_rng(1)
    ends = np.asarray(mesh.vertices)[mesh.edges_unique]
    share = np.concatenate([random.random(20), [0.0, 0.5, 1.0]])[None, :, None]
    aims = (ends[:, :1] * share + ends[:, 1:] * (1 - share)).reshape(-1, 3)
    inward = random.uniform(-0.25, 0.25, aims.shape) - aims
    rays = random_rays(len(aims), seed=2)
    rays.origin[:] = aims - random.uniform(1, 4, (len(aims), 1)) * inward
    rays.direction[:] = inward / np.linalg.norm(inward, axis=1, keepdims=True)
    count = np.zeros(len(aims), int)
    depth = np.zeros(len(aims), int)
    for _ in range(4):
        hits = scene.closest(rays)
        hit = hits.surface >= 0
        n = scene.triangles.normal[np.maximum(hits.surface, 0)]
        side = np.sign(np.einsum("nk,nk->n", n, rays.direction))
        count += hit
        depth += np.where(hit, -side, 0).astype(int)
        for ray in np.flatnonzero(hit):
            d = tuple(rays.direction[ray])
            p = tuple(rays.origin[ray] + hits.distance[ray] * rays.direction[ray])
            rays.origin[ray] = lifted(p, tuple(n[ray]), d, 1e-5)
    assert np.array_equal(count, np.full(len(aims), 2)) and not depth.any()


def test_normals_point_outward():
    scene = surfaces([Thing(shape="sphere", place=(1, 2, 3), radius=0.5), Thing(shape="box")])
    first = 0
    assert outward_normal(scene.triangles, scene.primitives, first, (1.0, 2.5, 3.0)) == (0, 1, 0)
    for p, n in (((0.5, 1.0, 0.2), (0, 1, 0)), ((0.0, 0.4, 0.2), (-1, 0, 0)),
                 ((0.5, 0.4, 0.0), (0, 0, -1))):
        assert outward_normal(scene.triangles, scene.primitives, first + 1, p) == n


def test_smooth_normals_of_a_sphere_and_flat_ones_of_a_box():
    sphere = trimesh.creation.icosphere(subdivisions=3)
    corner = np.asarray(sphere.vertices)[sphere.faces]
    one = np.zeros(len(corner), np.int64)
    smooth = smooth_normals(corner, one, one + 35.0)
    assert np.einsum("nck,nck->nc", smooth, corner).min() > 0.999
    box = trimesh.creation.box()
    corner = np.asarray(box.vertices)[box.faces]
    one = np.zeros(len(corner), np.int64)
    assert np.array_equal(smooth_normals(corner, one, one + 35.0),
                          np.repeat(normals(corner)[:, None], 3, axis=1))


def lit(material, light, **more):
    """One pixel of a plane seen from above under one light."""
    return still({"width": 1, "height": 1, "samples": 1, "ambient": [0, 0, 0], "light": [light],
                  "camera": {"position": [0, 2, 0], "target": [0, 0, 0], "up": [0, 0, -1],
                             "fov": 1e-3},
                  "material": {"m": material}, "object": [
                      {"shape": "plane", "material": "m"}, *more.get("object", ())]})[0, 0]


def test_phong_formula():
    """R_d N·L + R_s (V·R)^f for a light at 60 degrees and a viewer on the normal."""
    light = {"kind": "directional", "direction": [np.sqrt(3), -1, 0], "intensity": 2.0}
    seen = lit({"colour": [0.5, 0.25, 1], "diffuse": 0.8, "specular": 0.3, "exponent": 3}, light)
    expected = 2 * (np.array((0.5, 0.25, 1)) * 0.8 * 0.5 + 0.3 * 0.5 ** 3)
    assert seen == pytest.approx(expected, rel=1e-4)


def test_light_behind_a_surface_gives_nothing():
    for kind in ("phong", "ashikhmin"):
        seen = lit({"kind": kind, "specular": 0.5, "exponent": 2},
                   {"position": [0.1, -1, 0.1]})
        assert np.array_equal(seen, (0, 0, 0))


@pytest.mark.parametrize(("falloff", "share"), [(0, 1), (1, 1 / 4), (2, 1 / 16)])
def test_falloff(falloff, share):
    seen = lit({"colour": [1, 1, 1], "diffuse": 1}, {"position": [0, 4, 0], "falloff": falloff})
    assert seen == pytest.approx((share,) * 3, rel=1e-4)


def test_shadows_are_black_behind_matter_and_coloured_behind_glass():
    light = {"position": [0, 4, 0.001], "falloff": 0}
    white = {"colour": [1, 1, 1], "diffuse": 1}

    def under(thing_material):
        slab = {"shape": "box", "low": [-1, 3.0, -1], "high": [1, 3.2, 1],
                "material": thing_material}
        return lit(white, light, object=[slab])

    assert np.array_equal(under("matt"), (0, 0, 0))
    glass = np.exp(-0.2 * np.array((6.0, 1.6, 3.4))) * 0.96 ** 2
    assert under("glass") == pytest.approx(glass, rel=1e-3)


def test_mirror_shows_the_backdrop_in_its_tint():
    seen = still({"width": 1, "height": 1, "samples": 1, "ambient": [0, 0, 0], "light": [],
                  "backdrop": {"kind": "uniform", "colour": [1, 1, 1]},
                  "camera": {"position": [0, 2, 1], "target": [0, 0, 0], "fov": 1e-3},
                  "material": {"m": {"mirror": 0.5, "tint": [1, 0.5, 0.25]}},
                  "object": [{"shape": "plane", "material": "m"}]})[0, 0]
    assert seen == pytest.approx((0.5, 0.25, 0.125), rel=1e-6)
