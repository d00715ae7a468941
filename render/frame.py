"""How is one frame made? Pose the pieces, fill the volume, trace bands of the picture.

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
from render.camera import camera_rays, pinhole
from render.hashing import mix
from render.layers import Layers, layers
from render.materials import all_materials, material_table
from render.meshes import mesh_objects
from render.pieces import Pieces, Triangles, advanced, joined, no_triangles
from render.primitives import primitives
from render.rays import Rays, chosen
from render.shade import Surroundings, scatter
from render.smoke import shade
from render.surfaces import Surfaces
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
BAND = 1 << 15              # samples traced together


@dataclass(frozen=True)
class Picture:
    """A rendered frame: linear light (height, width, 3), the number of rays it took, layers."""

    light: Array
    rays: int
    layers: Layers | None = None


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
        self.pieces = (Pieces.of(fragments, scene.body, materials, render.crack_gap)
                       if fragments is not None and fragments.count else None)
        self.lights = lamps.light_table(lamps.default_lights(scene.domain.size)
                                        if render.light is None else render.light)
        size = max(scene.domain.size)
        self.surroundings = Surroundings(
            backdrop(render.backdrop, scene.path.parent, scene.seed), np.array(render.ambient),
            1e-5 * size, SMALLEST_SHARE / render.samples ** 2)
        self.camera = pinhole(render.camera, scene.domain.size, render.width, render.height)

    def frame(self, snapshot: Snapshot, rows: tuple[int, int] | None = None) -> Picture:
        """Render one frame, or only some of its rows."""
        burning = (self.fire.volume(snapshot, self.lights)
                   if self.fire and "T" in snapshot.fields else None)
        volume, light = ((None, self.lights) if burning is None
                         else (burning[0], lamps.joined(self.lights, burning[1])))
        instants = self._instants(snapshot)
        inside, medium = instants[0].glass_at(self.camera.eye, self.camera.forward)
        width, height, n = self.render.width, self.render.height, self.render.samples
        first, end = rows or (0, height)
        image = np.zeros(((end - first) * width, 3))
        band = max(1, BAND // (width * n * n))
        key = mix(self.scene.seed & 0xFFFFFFFF, snapshot.frame)
        for top in range(first, end, band):
            bottom = min(top + band, end)
            rays = camera_rays(self.camera, (width, height), (top, bottom), n, key)
            rays.inside[:], rays.medium[:] = inside, medium
            part = image[(top - first) * width:(bottom - first) * width]
            for surfaces, group in zip(instants, _spread(rays, n * n, len(instants)),
                                       strict=True):
                self._trace(group, surfaces, volume, light, part)
        extra = self._layers(instants[0], volume) if self.render.exr and rows is None else None
        return Picture(image.reshape(end - first, width, 3),
                       sum(surfaces.traced for surfaces in instants), extra)

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

    def _trace(self, rays: Rays, surfaces: Surfaces, volume: Volume | None, light: lamps.Lights,
               image: Array) -> None:
        """Follow a batch of rays through all their bounces."""
        weaken = None
        if volume is not None and self.render.volume.shadows:
            # the fire's own lights stand for what has left the haze already
            weaken = partial(shade, volume.haze, lamps=self.lights.lamps)
        for bounce in range(self.render.depth + 1):
            hits = surfaces.closest(rays)
            if volume is not None:
                march(volume, rays, hits, image, 1.0 / self.render.samples ** 2)
            rays, lit = scatter(surfaces.triangles, surfaces.primitives, self.materials,
                                self.surroundings, rays, hits, image,
                                bounce == self.render.depth)
            lamps.illuminate(lit, light, surfaces, image, weaken)
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
