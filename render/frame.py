"""How is one frame made? Pose the pieces, fill the volume, trace the pixels in batches.

    rays from the camera -> nearest surfaces -> fire and smoke up to them -> shading, which returns
    reflected and refracted rays and points to be lit -> lamps -> the next bounce of those rays
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partition.fragments import Fragments
from render import lights as lamps
from render.backdrop import backdrop
from render.camera import camera_rays, pinhole, sample_weights
from render.hashing import mix
from render.layers import Layers, layers
from render.materials import all_materials, material_table
from render.meshes import mesh_objects
from render.pieces import Pieces, advanced
from render.primitives import primitives
from render.rays import Integers, Rays, chosen
from render.shade import Surroundings, scatter
from render.smoke import shade
from render.surfaces import Surfaces
from render.triangles import Triangles, joined, no_triangles
from render.volume import Volume, march
from solver.files import Snapshot
from solver.scene import Scene
from solver.scene_body import Obstacle
from solver.scene_render import Render, Thing

if TYPE_CHECKING:
    from render.fire import Fire

Array = NDArray[np.float64]
SMALLEST_SHARE = 1 / 256    # of a sample's light: a ray that carries less is not followed
BLUR_INSTANTS = 16          # at most, at which moving pieces are seen during one frame
BATCH = 1 << 15             # samples traced together
TILE = 8                    # pixels, edge of the tiles in which a picture is made


@dataclass(frozen=True)
class Picture:
    """A rendered frame: linear light (height, width, 3), the number of rays it took, layers."""

    light: Array
    rays: int
    layers: Layers | None = None


@dataclass(frozen=True)
class Moment:
    """What all rays of a frame share: surfaces at each instant of the shutter, fire, lights, the
    number of glass pieces around the eye and their material, the key of its random numbers."""

    surfaces: list[Surfaces]
    volume: Volume | None
    lights: lamps.Lights
    inside: int
    medium: int
    key: int


class Film:
    """Everything that is the same for all frames of a sequence."""

    def __init__(self, scene: Scene, render: Render, fragments: Fragments | None,
                 fire: Fire | None):
        self.scene, self.render, self.fire = scene, render, fire
        materials = all_materials(render.material)
        index = {name: i for i, name in enumerate(materials)}
        self.materials = material_table(materials, scene.path.parent)
        self.primitives = primitives((*render.object, *drawn(scene.obstacle)), index)
        self.objects = mesh_objects(render.object, scene.path.parent, materials)
        self.pieces = (Pieces.of(fragments, scene.body, materials, render.crack_gap,
                                 scene.path.parent)
                       if fragments is not None and fragments.count else None)
        self.lights = lamps.light_table(lamps.default_lights(scene.domain.size)
                                        if render.light is None else render.light)
        size = max(scene.domain.size)
        self.surroundings = Surroundings(
            backdrop(render.backdrop, scene.path.parent, scene.seed), np.array(render.ambient),
            1e-5 * size, SMALLEST_SHARE / render.samples ** 2)
        self.camera = pinhole(render.camera, scene.domain.size, render.width, render.height)

    def frame(self, snapshot: Snapshot, rows: range | None = None) -> Picture:
        """Render one frame, or only some of its rows."""
        moment = self._moment(snapshot)
        width, height = self.render.width, self.render.height
        chosen_rows = range(height) if rows is None else rows
        pixels = (np.array(chosen_rows)[:, None] * width + np.arange(width)).ravel()
        # tile by tile: neighbours in both directions meet the same surfaces and cells of the volume
        order = np.lexsort((pixels % width // TILE, np.arange(len(pixels)) // width // TILE))
        light = np.empty((len(pixels), 3))
        light[order] = self._developed(moment, pixels[order])
        light = light.reshape(len(chosen_rows), width, 3)
        extra = (self._layers(moment.surfaces[0], moment.volume)
                 if self.render.exr and chosen_rows[0] == 0 else None)
        return Picture(light, sum(surfaces.traced for surfaces in moment.surfaces), extra)

    def _moment(self, snapshot: Snapshot) -> Moment:
        burning = (self.fire.volume(snapshot, self.lights)
                   if self.fire and "T" in snapshot.fields else None)
        volume, lights = ((None, self.lights) if burning is None
                          else (burning[0], lamps.joined(self.lights, burning[1])))
        surfaces = self._instants(snapshot)
        return Moment(surfaces, volume, lights,
                      *surfaces[0].glass_at(self.camera.eye, self.camera.forward),
                      mix(self.scene.seed & 0xFFFFFFFF, snapshot.frame))

    def _developed(self, moment: Moment, pixels: Integers) -> Array:
        """(n, 3) light of n pixels; where a pixel's samples differ much it is sampled again."""
        n = self.render.samples
        light, contrast = self._sampled(moment, pixels, n, moment.key)
        rough = contrast > self.render.adaptive
        if self.render.adaptive > 0 and rough.any():
            finer, _ = self._sampled(moment, pixels[rough], 2 * n, mix(moment.key, 1))
            light[rough] += 0.8 * (finer - light[rough])     # by numbers of samples
        return light

    def _sampled(self, moment: Moment, pixels: Integers, n: int, key: int) -> tuple[Array, Array]:
        """(light (m, 3), contrast (m,)) of m pixels with n x n samples each.

        The contrast is the largest difference between samples, each x as x / (1 + x), an eye's or
        a film's idea of it.
        """
        light, contrast = np.empty((len(pixels), 3)), np.zeros(len(pixels))
        batch, weights = max(1, BATCH // (n * n)), sample_weights(n)[:, None]
        for first in range(0, len(pixels), batch):
            some = slice(first, first + batch)
            rays = camera_rays(self.camera, (self.render.width, self.render.height), pixels[some],
                               n, key)
            rays.inside[:], rays.medium[:] = moment.inside, moment.medium
            rays.pixel[:] = np.arange(len(rays.pixel))
            samples = np.zeros((len(rays.pixel), 3))
            for surfaces, group in zip(moment.surfaces, _spread(rays, n * n, len(moment.surfaces)),
                                       strict=True):
                self._trace(group, surfaces, moment, 1.0 / n ** 2, samples)
            samples = samples.reshape(-1, n * n, 3)
            light[some] = samples.sum(axis=1)
            if self.render.adaptive > 0:
                seen = samples / weights
                contrast[some] = np.ptp(seen / (1 + seen), axis=1).max(axis=1)
        return light, contrast

    def _instants(self, snapshot: Snapshot) -> list[Surfaces]:
        """The surfaces at the instants at which the shutter is open: one, unless things blur."""
        open_for = self.render.camera.shutter * self.scene.time.frame
        count = min(BLUR_INSTANTS, self.render.samples ** 2) if open_for > 0 else 1
        return [Surfaces(self._triangles(snapshot, open_for * i / count), self.primitives,
                         self.materials, self.surroundings.lift) for i in range(count)]

    def _triangles(self, snapshot: Snapshot, later: float) -> Triangles:
        """All triangles, some time after the snapshot."""
        parts = [self.objects] if len(self.objects.material) else []
        if self.pieces is not None and len(snapshot.bodies.get("position", ())):
            poses = advanced(snapshot.bodies, later) if later > 0 else snapshot.bodies
            parts.append(self._glowing(self.pieces.posed(poses), snapshot))
        return joined(parts) if parts else no_triangles()

    def _glowing(self, pieces: Triangles, snapshot: Snapshot) -> Triangles:
        """The pieces with the light of those that are hot."""
        hot = self.materials.incandescent[pieces.material]
        if self.fire is not None and "T" in snapshot.fields and hot.any():
            pieces.glow[hot] = self.fire.incandescence(pieces.corner, pieces.piece,
                                                       snapshot.fields["T"])[hot]
        return pieces

    def _layers(self, surfaces: Surfaces, volume: Volume | None) -> Layers:
        low, high = ((self.fire.low, self.fire.high) if self.fire
                     else (self.scene.fluid.ambient_temperature,) * 2)
        return layers(self.camera, (self.render.width, self.render.height), surfaces, volume, low,
                      high)

    def _trace(self, rays: Rays, surfaces: Surfaces, moment: Moment, sample_weight: float,
               image: Array) -> None:
        """Follow a batch of rays through all their bounces."""
        volume, weaken = moment.volume, None
        if volume is not None and self.render.volume.shadows:
            # the fire's own lights stand for what has left the haze already
            weaken = partial(shade, volume.haze, lamps=self.lights.lamps)
        for bounce in range(self.render.depth + 1):
            hits = surfaces.closest(rays)
            if volume is not None:
                march(volume, rays, hits, image, sample_weight)
            rays, lit = scatter(surfaces.triangles, surfaces.primitives, self.materials,
                                self.surroundings, rays, hits, image,
                                bounce == self.render.depth)
            lamps.illuminate(lit, moment.lights, surfaces, image, weaken)
            if not len(rays.pixel):
                break


def drawn(obstacles: tuple[Obstacle, ...]) -> Iterator[Thing]:
    """The obstacles that are to be seen, as objects."""
    for plane in obstacles:
        if plane.material:
            yield Thing(shape="plane", place=plane.place, normal=plane.normal,
                        material=plane.material)


def _spread(rays: Rays, per_pixel: int, instants: int) -> list[Rays]:
    """The samples of each pixel dealt out to the instants in turn, from a random one on."""
    if instants == 1:
        return [rays]
    start = np.repeat(rays.seed[::per_pixel], per_pixel)
    turn = (np.arange(len(start)) % per_pixel + start) % instants
    return [chosen(rays, turn == instant) for instant in range(instants)]
