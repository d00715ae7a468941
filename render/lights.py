"""Which light reaches a point? Lamps with shadows, and the fire's own light.

    radiance = sum over lights E (R_d max(0, N·L) + R_s max(0, V·R)^f) * transmittance
E is the lamp's intensity, for a point light divided by distance^falloff. Where N·L <= 0 there is no
highlight. One shadow ray goes to each lamp; glass on the way colours and weakens the light.

Fire is one light in many parts. Its light on a point is the sum of what the parts would send, times
the transmittance to one of them, drawn in proportion to what it would send: no grain in full light
or full shadow, a soft edge between them, and one shadow ray however many parts there are.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render import ashikhmin
from render.hashing import uniform
from render.kernel import kernel
from render.rays import Lit, Rays, allocate, chosen
from render.surfaces import Surfaces
from render.vector import Three, add_to, along, dot, largest, load, scaled, store, times
from solver.scene_render import Light

POINT, DIRECTIONAL = 0, 1
DARK = 2e-5     # radiance that is not worth a shadow ray
Array = NDArray[np.float64]


class Lights(NamedTuple):
    """m lights.

    kind        (m,) POINT or DIRECTIONAL
    place       (m, 3) position, or direction towards a directional light
    colour      (m, 3) times intensity
    falloff     (m,) power of the distance
    spread      (m,) L², mean squared size of a light that is not quite a point: with falloff 2
                it sends E / (distance² + spread)
    lamps       how many cast a shadow each; the others are parts of one, the fire
    """

    kind: NDArray[np.int64]
    place: Array
    colour: Array
    falloff: NDArray[np.int64]
    spread: Array
    lamps: int


def default_lights(box: tuple[float, float, float]) -> tuple[Light, ...]:
    """A low sun from the upper left behind the viewer and a weak bluish light from the right."""
    size = max(box)
    return (Light(kind="directional", direction=(0.5, -0.75, -0.65), colour=(1.0, 0.9, 0.75),
                  intensity=0.75),
            Light(position=(2.2 * size, 1.4 * size, 2.2 * size), colour=(0.6, 0.75, 1.0),
                  intensity=0.35 * size ** 2))


def light_table(lights: Sequence[Light]) -> Lights:
    """The kernels' table of the scene's lights."""
    directional = [light.kind == "directional" for light in lights]
    towards = [-np.array(light.direction) / np.linalg.norm(light.direction) if far
               else np.array(light.position)
               for light, far in zip(lights, directional, strict=True)]
    return Lights(np.array(directional, np.int64), np.array(towards).reshape(-1, 3),
                  np.array([np.array(light.colour) * light.intensity for light in lights]
                           ).reshape(-1, 3),
                  np.array([0 if far else light.falloff
                            for light, far in zip(lights, directional, strict=True)], np.int64),
                  np.zeros(len(lights)), len(lights))


def parts(place: Array, colour: Array, spread: Array) -> Lights:
    """The parts of a fire."""
    count = len(place)
    return Lights(np.full(count, POINT), place, colour, np.full(count, 2), spread, 0)


def joined(lamps: Lights, fire: Lights) -> Lights:
    """Lamps, and the parts of the fire after them."""
    columns = (np.concatenate(pair) for pair in zip(lamps[:5], fire[:5], strict=True))
    return Lights._make((*columns, lamps.lamps))


def illuminate(points: Lit, lights: Lights, surfaces: Surfaces, image: Array,
               weaken: Callable[[Rays, Array], None] | None = None) -> None:
    """Add the light of all lamps at the points to `image` (pixels, 3).

    `weaken` may take light from the shadow rays, given with their lengths, before surfaces do; the
    seed of a shadow ray is the number of its light.
    """
    most = len(points.pixel) * (lights.lamps + min(1, len(lights.kind) - lights.lamps))
    shadow, reach = allocate(most), np.empty(most)
    count = _aim(points, lights, shadow, reach)
    if count:
        shadow = chosen(shadow, slice(count))
        if weaken is not None:
            weaken(shadow, reach[:count])
        surfaces.transmittance(shadow, reach[:count])
        _collect(shadow, image)


@kernel
def _aim(points: Lit, lights: Lights, shadow: Rays, reach: Array) -> int:
    """Shadow rays from every point to every lamp it faces and to a part of the fire.

    The weight of a ray is the light there would be. Returns how many there are.
    """
    count = 0
    for k in range(points.pixel.size):
        place, normal, viewer = (load(points.position, k), load(points.normal, k),
                                 load(points.viewer, k))
        colours = load(points.diffuse, k), load(points.specular, k), load(points.weight, k)
        for lamp in range(lights.lamps):
            value, towards, distance = _arriving(points, k, place, normal, viewer, colours, lights,
                                                 lamp)
            if largest(value) >= DARK:
                _send(shadow, reach, count, points, k, lamp, value, towards, distance)
                count += 1
        total, share = (0.0, 0.0, 0.0), 0.0
        drawn, way, far = -1, (0.0, 0.0, 0.0), 0.0
        chance = uniform(points.seed[k], 100)
        for part in range(lights.lamps, lights.kind.size):
            value, towards, distance = _arriving(points, k, place, normal, viewer, colours, lights,
                                                 part)
            light = largest(value)
            if light <= 0.0:
                continue
            total, share = along(total, 1.0, value), share + light
            odds = light / share    # of this part against those before it
            if chance < odds:
                drawn, way, far, chance = part, towards, distance, chance / odds
            else:
                chance = (chance - odds) / (1.0 - odds)
        if drawn >= 0 and largest(total) >= DARK:
            _send(shadow, reach, count, points, k, drawn, total, way, far)
            count += 1
    return count


@kernel
def _arriving(points: Lit, k: int, p: Three, n: Three, viewer: Three,
              colours: tuple[Three, Three, Three], lights: Lights,
              lamp: int) -> tuple[Three, Three, float]:
    """(radiance that point k would get from a light, direction to it, distance).

    p, n, viewer, colours (diffuse, specular, weight): the point's, read once for all lights.
    """
    nothing = (0.0, 0.0, 0.0)
    towards, strength, distance = load(lights.place, lamp), 1.0, np.inf
    if lights.kind[lamp] == POINT:
        towards = (towards[0] - p[0], towards[1] - p[1], towards[2] - p[2])
        if dot(n, towards) <= 0.0:
            return nothing, towards, distance
        square = dot(towards, towards)
        distance = np.sqrt(square)
        towards = scaled(towards, 1.0 / distance)
        if lights.falloff[lamp] == 1:
            strength = 1.0 / distance
        elif lights.falloff[lamp] == 2:
            strength = 1.0 / (square + lights.spread[lamp])
    elif dot(n, towards) <= 0.0:
        return nothing, towards, distance
    r_d, r_s, weight = colours
    if points.metal[k] == 1:
        share = ashikhmin.lighting(n, load(points.tangent, k), towards, viewer, r_d, r_s,
                                   points.exponents[k, 0], points.exponents[k, 1])
    else:
        share = phong(n, towards, viewer, r_d, r_s, points.exponents[k, 0])
    light = times(times(share, weight), load(lights.colour, lamp))
    return scaled(light, strength), towards, distance


@kernel
def _send(shadow: Rays, reach: Array, ray: int, points: Lit, k: int, lamp: int, value: Three,
          towards: Three, distance: float) -> None:
    """Fill in a shadow ray from point k to a light."""
    store(shadow.weight, ray, value)
    store(shadow.origin, ray, load(points.position, k))
    store(shadow.direction, ray, towards)
    shadow.pixel[ray] = points.pixel[k]
    shadow.seed[ray] = lamp
    shadow.inside[ray] = 0
    shadow.medium[ray] = -1
    reach[ray] = distance


@kernel
def phong(n: Three, light: Three, viewer: Three, r_d: Three, r_s: Three,
          exponent: float) -> Three:
    """R_d N·L + R_s (V·R)^f for N·L > 0."""
    facing = dot(n, light)
    shine = 2.0 * facing * dot(n, viewer) - dot(light, viewer)
    glint = shine ** exponent if shine > 0.0 and largest(r_s) > 0.0 else 0.0
    return along(scaled(r_d, facing), glint, r_s)


@kernel
def _collect(shadow: Rays, image: Array) -> None:
    for ray in range(shadow.pixel.size):
        add_to(image, shadow.pixel[ray], load(shadow.weight, ray))
