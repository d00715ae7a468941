"""What happens where a ray meets a surface? Colour, mirrored rays, glass, points to be lit.

Every ray, by what it meets:
    nothing     weight * backdrop
    Phong       emission + R_a I_a + sum over lights (R_d N·L + R_s (V·R)^f), clamped at 0
                (lights.py), and a mirrored ray with the material's share `mirror`
    Ashikhmin   the same with ashikhmin.py's lighting
    glass       a reflected and a refracted ray (glass.py), weights after Schlick
Inside glass the weight falls by exp(-absorption * path) first.

Glass pieces that overlap count as one body: a ray counts the pieces it is in, and only entering the
first or leaving the last bends it.

A ray whose share of its pixel falls below `cut`, or whose bounces are used up, takes the backdrop's
colour instead of nothing, so that a constant surrounding shows the constant through any glass.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.backdrop import look
from render.glass import reflect, refract
from render.hashing import mix
from render.kernel import kernel
from render.materials import ASHIKHMIN, GLASS, Materials
from render.primitives import Primitives
from render.rays import Hits, Lit, Rays, allocate, allocate_lit, chosen
from render.surfaces import lifted, material_of, outward_normal
from render.texture import BRICK, IMAGE, pattern, picture
from render.triangles import Triangles
from render.uv import coordinates, point_at_rest, tangent
from render.vector import (Three, add_to, along, dot, largest, load, scaled, store, times, unit)

Array = NDArray[np.float64]
WHITE = (1.0, 1.0, 1.0)


class Surroundings(NamedTuple):
    """What is the same for every ray of a frame.

    backdrop    (rows, columns, 3) float32
    ambient     (3,) ambient light I_a
    lift        L, how far rays start off a surface
    cut         share of a sample below which a ray is not followed
    """

    backdrop: NDArray[np.float32]
    ambient: Array
    lift: float
    cut: float


def scatter(triangles: Triangles, primitives: Primitives, materials: Materials,
            surroundings: Surroundings, rays: Rays, hits: Hits, image: Array,
            last: bool) -> tuple[Rays, Lit]:
    """Shade all rays into `image` (pixels, 3); returns the rays that go on and the points to light.

    `last`: no ray may go on.
    """
    children, lit = allocate(2 * len(rays.pixel)), allocate_lit(len(rays.pixel))
    going, lighted = _scatter(triangles, primitives, materials, surroundings, rays, hits, image,
                              last, children, lit)
    return chosen(children, slice(going)), chosen(lit, slice(lighted))


@kernel
def _scatter(triangles: Triangles, primitives: Primitives, materials: Materials,
             around: Surroundings, rays: Rays, hits: Hits, image: Array, last: bool,
             children: Rays, lit: Lit) -> tuple[int, int]:
    going, lighted = 0, 0
    for ray in range(rays.pixel.size):
        surface, d = hits.surface[ray], load(rays.direction, ray)
        weight, pixel = load(rays.weight, ray), rays.pixel[ray]
        if surface < 0:
            add_to(image, pixel, times(weight, look(around.backdrop, d)))
            continue
        if rays.inside[ray] > 0 and rays.medium[ray] >= 0:
            weight = times(weight, passed(materials, rays.medium[ray], hits.distance[ray]))
            store(rays.weight, ray, weight)
        p = along(load(rays.origin, ray), hits.distance[ray], d)
        n = outward_normal(triangles, primitives, surface, p)
        material = material_of(triangles, primitives, surface)
        if materials.kind[material] == GLASS:
            if rays.inside[ray] == 0 and materials.specular[material] > 0.0:
                _light_later(lit, lighted, materials, material, (0.0, 0.0, 0.0), ray, rays, p, n,
                             around.lift, n)
                lighted += 1
            going = _split(materials, material, around, rays, ray, p, n, image, last, children,
                           going)
            continue
        colour = _colour(triangles, primitives, materials, material, surface, hits, ray, p, n)
        add_to(image, pixel, times(weight, load(materials.emission, material)))
        if surface < triangles.material.size:
            add_to(image, pixel, times(weight, load(triangles.glow, surface)))
        ambient = times(colour, (around.ambient[0], around.ambient[1], around.ambient[2]))
        add_to(image, pixel, times(weight, scaled(ambient, materials.ambient[material])))
        n = _shading_normal(triangles, hits, ray, n, d)
        _light_later(lit, lighted, materials, material, colour, ray, rays, p, n, around.lift,
                     tangent(triangles, primitives, surface, n)
                     if materials.kind[material] == ASHIKHMIN else n)
        lighted += 1
        if materials.mirror[material] > 0.0:
            mirrored = scaled(load(materials.tint, material), materials.mirror[material])
            going = _send(children, going, around, rays, ray, p, n, reflect(d, n), mirrored,
                          rays.inside[ray], rays.medium[ray], image, last)
    return going, lighted


@kernel
def passed(materials: Materials, medium: int, path: float) -> Three:
    """Beer-Lambert: the share of light that a path through glass leaves."""
    return (np.exp(-materials.absorption[medium, 0] * path),
            np.exp(-materials.absorption[medium, 1] * path),
            np.exp(-materials.absorption[medium, 2] * path))


@kernel
def _shading_normal(triangles: Triangles, hits: Hits, ray: int, n: Three, d: Three) -> Three:
    """The interpolated normal of a mesh, turned against the ray; the geometric one elsewhere."""
    surface = hits.surface[ray]
    if surface < triangles.material.size:
        a, b = hits.u[ray], hits.v[ray]
        corners = triangles.smooth[surface]
        s = unit((
            (1.0 - a - b) * corners[0, 0] + a * corners[1, 0] + b * corners[2, 0],
            (1.0 - a - b) * corners[0, 1] + a * corners[1, 1] + b * corners[2, 1],
            (1.0 - a - b) * corners[0, 2] + a * corners[1, 2] + b * corners[2, 2]))
        if dot(s, d) * dot(n, d) > 0.0:
            n = s
    return n if dot(n, d) <= 0.0 else scaled(n, -1.0)


@kernel
def _colour(triangles: Triangles, primitives: Primitives, materials: Materials, material: int,
            surface: int, hits: Hits, ray: int, p: Three, n: Three) -> Three:
    """The material's colour at a point, from its texture at rest."""
    colour = load(materials.colour, material)
    kind = materials.texture[material]
    if kind < 0:
        return colour
    a, b = float(hits.u[ray]), float(hits.v[ray])
    if kind == IMAGE:
        u, v = coordinates(triangles, primitives, surface, a, b, p, n)
        where, repeat = materials.picture, materials.picture_repeat[material]
        return times(colour, picture(materials.pixels, where[material, 0], where[material, 1],
                                     where[material, 2], where[material, 3], repeat * u,
                                     repeat * v))
    if surface < triangles.material.size:
        p = point_at_rest(triangles, surface, a, b)
    share, shade = pattern(kind, scaled(p, 1.0 / materials.texture_scale[material]), n)
    second = load(materials.texture_colour, material)
    if kind == BRICK and share == 0.0:
        return scaled(second, max(shade, 0.0))
    return along(scaled(colour, max(shade, 0.0) * share), 1.0 - share, second)


@kernel
def _light_later(lit: Lit, k: int, materials: Materials, material: int, colour: Three, ray: int,
                 rays: Rays, p: Three, n: Three, lift: float, u: Three) -> None:
    """Note a point for the lights; u is its tangent."""
    d = load(rays.direction, ray)
    if dot(n, d) > 0.0:
        n = scaled(n, -1.0)
    store(lit.position, k, along(p, lift, n))
    store(lit.normal, k, n)
    store(lit.viewer, k, scaled(d, -1.0))
    store(lit.tangent, k, u)
    store(lit.weight, k, load(rays.weight, ray))
    store(lit.diffuse, k, scaled(colour, materials.diffuse[material]))
    store(lit.specular, k, scaled(load(materials.tint, material), materials.specular[material]))
    lit.exponents[k, 0] = materials.exponents[material, 0]
    lit.exponents[k, 1] = materials.exponents[material, 1]
    lit.metal[k] = materials.kind[material] == ASHIKHMIN
    lit.pixel[k] = rays.pixel[ray]
    lit.seed[k] = rays.seed[ray]


@kernel
def _split(materials: Materials, material: int, around: Surroundings, rays: Rays, ray: int,
           p: Three, n: Three, image: Array, last: bool, children: Rays, going: int) -> int:
    """Glass: send the reflected and the refracted ray on; returns the number of children."""
    d = load(rays.direction, ray)
    entering = dot(n, d) < 0.0
    before, medium = rays.inside[ray], rays.medium[ray]
    after = before + 1 if entering else max(before - 1, 0)
    if min(before, after) > 0:   # between overlapping pieces nothing bends
        return _send(children, going, around, rays, ray, p, n, d, WHITE, after, medium, image,
                     last)
    ior = materials.ior[material]
    against = n if entering else scaled(n, -1.0)
    share, through = refract(d, against, 1.0 / ior if entering else ior)
    going = _send(children, going, around, rays, ray, p, n, reflect(d, n), scaled(WHITE, share),
                  before, medium, image, last)
    if share < 1.0:
        going = _send(children, going, around, rays, ray, p, n, through, scaled(WHITE, 1.0 - share),
                      after, material if entering else -1, image, last)
    return going


@kernel
def _send(children: Rays, going: int, around: Surroundings, rays: Rays, ray: int, p: Three,
          n: Three, d: Three, share: Three, inside: int, medium: int, image: Array,
          last: bool) -> int:
    """Append a ray, or give it the backdrop's colour if it is not to be followed."""
    weight = times(load(rays.weight, ray), share)
    if last or largest(weight) < around.cut:
        add_to(image, rays.pixel[ray], times(weight, look(around.backdrop, d)))
        return going
    d = unit(d)
    store(children.origin, going, lifted(p, n, d, around.lift))
    store(children.direction, going, d)
    store(children.weight, going, weight)
    children.pixel[going] = rays.pixel[ray]
    children.seed[going] = mix(rays.seed[ray], 2 * inside + (1 if share[0] > 0.5 else 0))
    children.inside[going] = inside
    children.medium[going] = medium
    return going + 1
