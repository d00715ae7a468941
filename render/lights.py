"""Which light reaches a point? Lamps with shadows, and the fire's own light.

    radiance = sum over lights E (R_d max(0, N·L) + R_s max(0, V·R)^f) * transmittance
E is the lamp's intensity, for a point light divided by distance^falloff. Where N·L <= 0 there is no
highlight. One shadow ray goes to each lamp; glass on the way colours and weakens the light.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render import ashikhmin
from render.kernel import kernel
from render.rays import Lit, Rays, allocate, chosen
from render.surfaces import Surfaces
from render.vector import Three, add_to, along, dot, largest, load, scaled, store, times
from solver.scene_render import Light

POINT, DIRECTIONAL = 0, 1
DARK = 2e-5     # radiance that is not worth a shadow ray
Array = NDArray[np.float64]


class Lights(NamedTuple):
    """kind (m,); place (m, 3): position, or direction towards a directional light; colour (m, 3)
    times intensity; falloff (m,)"""

    kind: NDArray[np.int64]
    place: Array
    colour: Array
    falloff: NDArray[np.int64]


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
                            for light, far in zip(lights, directional, strict=True)], np.int64))


def joined(a: Lights, b: Lights) -> Lights:
    """The lights of both tables."""
    return Lights(*(np.concatenate(columns) for columns in zip(a, b, strict=True)))


def illuminate(points: Lit, lights: Lights, surfaces: Surfaces, image: Array,
               weaken: Callable[[Rays, Array], None] | None = None) -> None:
    """Add the light of all lamps at the points to `image` (pixels, 3).

    `weaken` may take light from the shadow rays, given with their lengths, before surfaces do; the
    seed of a shadow ray is the number of its lamp.
    """
    most = len(points.pixel) * len(lights.kind)
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
    """A shadow ray from every point to every lamp it faces; its weight is the light there would be.

    Returns how many there are.
    """
    count = 0
    for k in range(points.pixel.size):
        p, n, viewer = load(points.position, k), load(points.normal, k), load(points.viewer, k)
        r_d, r_s = load(points.diffuse, k), load(points.specular, k)
        weight = load(points.weight, k)
        for lamp in range(lights.kind.size):
            light, strength, distance = load(lights.place, lamp), 1.0, np.inf
            if lights.kind[lamp] == POINT:
                light = (light[0] - p[0], light[1] - p[1], light[2] - p[2])
                distance = np.sqrt(dot(light, light))
                if distance == 0.0:
                    continue
                light = scaled(light, 1.0 / distance)
                if lights.falloff[lamp] > 0:
                    strength = 1.0 / distance
                if lights.falloff[lamp] > 1:
                    strength *= strength
            if dot(n, light) <= 0.0:
                continue
            if points.metal[k] == 1:
                share = ashikhmin.lighting(n, load(points.tangent, k), light, viewer, r_d, r_s,
                                           points.exponents[k, 0], points.exponents[k, 1])
            else:
                share = phong(n, light, viewer, r_d, r_s, points.exponents[k, 0])
            value = scaled(times(times(share, load(lights.colour, lamp)), weight), strength)
            if largest(value) < DARK:
                continue
            store(shadow.weight, count, value)
            store(shadow.origin, count, p)
            store(shadow.direction, count, light)
            shadow.pixel[count] = points.pixel[k]
            shadow.seed[count] = lamp
            shadow.inside[count] = 0
            shadow.medium[count] = -1
            reach[count] = distance
            count += 1
    return count


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
