"""Which rays does a picture send out? A pinhole camera with stochastic jittered supersampling.

A pixel (column c, row r) is divided into n x n sub-pixels; sub-pixel (i, j) looks through
    s = c + (i + xi_1) / n,   t = r + (j + xi_2) / n,      xi in [0, 1)
in the image plane. Its weight is 1 at the pixel's edge and 1.5 inside, divided by the sum of all:
the thesis' weights, normalised, so that a constant scene returns the constant for every n.

With an aperture the ray starts at a random point of a disc of that radius around the eye and meets
the straight ray at the distance of focus: what is nearer or farther blurs.

The random numbers are a hash of seed, frame, pixel and sub-pixel: a pixel is the same whatever
tile or rank computes it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from render.hashing import mix, uniform
from render.kernel import kernel
from render.rays import Integers, Rays, allocate
from render.vector import along, load, scaled, store, unit
from solver.scene_render import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pinhole:
    """An eye and the plane it looks through, at distance 1.

    eye             (3,) position, L
    forward         (3,) unit direction of view
    right, down     (3,) from the middle of the image plane to its right and its lower edge
    aperture        L, radius of the lens
    focus           L, distance along `forward` of what is sharp
    """

    eye: Array
    forward: Array
    right: Array
    down: Array
    aperture: float
    focus: float


def pinhole(camera: Camera, box: tuple[float, float, float], width: int, height: int) -> Pinhole:
    """The camera of a scene in a box; `fov` spans the shorter edge of the picture."""
    middle = np.array(box) / 2
    target = middle if camera.target is None else np.array(camera.target)
    if camera.position is None:
        eye = middle + np.array((0.45, 0.2, 1.9)) * max(box)
    else:
        eye = np.array(camera.position)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    half = np.tan(np.radians(camera.fov) / 2) / min(width, height)
    focus = camera.focus or float(np.linalg.norm(target - eye))
    return Pinhole(eye, forward, right * half * width, np.cross(forward, right) * half * height,
                   camera.aperture, focus)


def sample_weights(n: int) -> Array:
    """(n * n,) weights of the sub-pixels: 1 at the edge of the pixel, 1.5 inside, of sum 1."""
    weights = np.full((n, n), 1.5)
    weights[[0, -1], :] = 1.0
    weights[:, [0, -1]] = 1.0
    return (weights / weights.sum()).ravel()


def camera_rays(view: Pinhole, size: tuple[int, int], pixels: Integers, n: int, key: int) -> Rays:
    """The rays of some pixels of a picture of `size` (width, height), n x n per pixel.

    Pixels count row by row; rays of one follow each other, and a ray's `pixel` is its place among
    `pixels`. `key` is the hash of seed and frame.
    """
    rays = allocate(len(pixels) * n * n)
    _fill(rays, view.eye, view.forward, view.right, view.down, size, pixels, n, sample_weights(n),
          key)
    if view.aperture > 0:
        across = view.right / np.linalg.norm(view.right) * view.aperture
        down = view.down / np.linalg.norm(view.down) * view.aperture
        _through_lens(rays, view.forward, across, down, view.focus)
    return rays


def middle_rays(view: Pinhole, size: tuple[int, int]) -> Rays:
    """One ray through the middle of every pixel, row by row, of weight 1."""
    width, height = size
    a = 2 * (np.arange(width) + 0.5) / width - 1
    b = 2 * (np.arange(height) + 0.5) / height - 1
    direction = (view.forward + b[:, None, None] * view.down + a[:, None] * view.right
                 ).reshape(-1, 3)
    rays = allocate(width * height)
    rays.origin[:], rays.weight[:] = view.eye, 1.0
    rays.direction[:] = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    rays.pixel[:], rays.seed[:] = np.arange(width * height), 0
    rays.inside[:], rays.medium[:] = 0, -1
    return rays


@kernel
def _fill(rays: Rays, eye: Array, forward: Array, right: Array, down: Array,
          size: tuple[int, int], pixels: Integers, n: int, weights: Array, key: int) -> None:
    width, height = size
    ray = 0
    for place in range(pixels.size):
        row, column = pixels[place] // width, pixels[place] % width
        pixel_key = mix(mix(key, row), column)
        for sub in range(n * n):
            seed = mix(pixel_key, sub)
            s = column + (sub % n + uniform(seed, 1)) / n
            t = row + (sub // n + uniform(seed, 2)) / n
            a, b = 2.0 * s / width - 1.0, 2.0 * t / height - 1.0
            direction = unit((forward[0] + a * right[0] + b * down[0],
                              forward[1] + a * right[1] + b * down[1],
                              forward[2] + a * right[2] + b * down[2]))
            for axis in range(3):
                rays.origin[ray, axis] = eye[axis]
                rays.direction[ray, axis] = direction[axis]
                rays.weight[ray, axis] = weights[sub]
            rays.pixel[ray] = place
            rays.seed[ray] = seed
            rays.inside[ray] = 0
            rays.medium[ray] = -1
            ray += 1


@kernel
def _through_lens(rays: Rays, forward: Array, across: Array, down: Array, focus: float) -> None:
    """Move the origins over the lens, and aim at what the straight rays meet in focus."""
    for ray in range(rays.pixel.size):
        radius = np.sqrt(uniform(rays.seed[ray], 3))
        angle = 2.0 * np.pi * uniform(rays.seed[ray], 4)
        a, b = radius * np.cos(angle), radius * np.sin(angle)
        d = load(rays.direction, ray)
        t = focus / (d[0] * forward[0] + d[1] * forward[1] + d[2] * forward[2])
        offset = (a * across[0] + b * down[0], a * across[1] + b * down[1],
                  a * across[2] + b * down[2])
        store(rays.origin, ray, along(load(rays.origin, ray), 1.0, offset))
        store(rays.direction, ray, unit(along(scaled(d, t), -1.0, offset)))
