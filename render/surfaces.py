"""What does a ray meet first? All surfaces of a frame: triangles by Embree, primitives by formula.

Primitives come first; only rays that can meet the box around all triangles before that go to
Embree. It works in float32: it picks the triangle, the distance is then taken again in float64 from
the triangle's plane. Rays start `lift` off the surface they leave, 1e-5 of the scene's size:
without it most would meet that surface again. A scene without triangles never loads Embree.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.glass import schlick
from render.kernel import kernel
from render.materials import GLASS, Materials
from render.primitives import Primitives, meet, normal_at, slabs
from render.rays import Hits, Integers, Rays, allocate, chosen
from render.triangles import Triangles
from render.vector import Three, along, dot, load, store

Array = NDArray[np.float64]
Single = NDArray[np.float32]
ROUNDED = 1e-4          # the box around the triangles grows by this share: Embree rounds to float32
NOWHERE = np.empty(0)
SHADOW_CROSSINGS = 32   # glass surfaces that a shadow ray may cross before it counts as blocked
GLASS_AROUND = 1024     # surfaces looked through to find out what the eye is in


@dataclass
class Surfaces:
    """Triangles and primitives of a frame with their materials; `lift` in L."""

    triangles: Triangles
    primitives: Primitives
    materials: Materials
    lift: float
    traced: int = 0     # rays traced so far
    _embree: Any = field(default=None, repr=False)
    _box: Array = field(default_factory=lambda: np.zeros((2, 3)), repr=False)

    def __post_init__(self) -> None:
        if len(self.triangles.material):
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
            self._embree = EmbreeScene(robust=True)
            corner = self.triangles.corner
            TriangleMesh(self._embree, corner.astype(np.float32))
            low, high = corner.min(axis=(0, 1)), corner.max(axis=(0, 1))
            margin = ROUNDED * max(abs(low).max(), abs(high).max())
            self._box = np.array((low - margin, high + margin))

    def closest(self, rays: Rays, reach: Array | None = None) -> Hits:
        """The nearest surface along every ray.

        For shadow rays, with their `reach` (n,), it is only sure to be the nearest if none before
        `reach` is an opaque primitive.
        """
        count, first = len(rays.pixel), len(self.triangles.material)
        self.traced += count
        hits = Hits(np.full(count, np.inf), np.full(count, -1), np.zeros(count, np.float32),
                    np.zeros(count, np.float32))
        if len(self.primitives.kind):
            meet(self.primitives, first, rays, hits)
        if self._embree is not None:
            which = np.empty(count, np.int64)
            origin, direction = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
            near = _approaching(self._box, rays, hits, which, origin, direction, self.primitives,
                                self.materials, first, NOWHERE if reach is None else reach)
            if near:
                found = self._embree.run(origin[:near], direction[:near], output=True)
                _refine(self.triangles, rays, which[:near], found["tfar"], found["primID"],
                        found["u"], found["v"], hits)
        return hits

    def glass_at(self, point: Array, direction: Array) -> tuple[int, int]:
        """(number of glass pieces around a point, their material or -1).

        On the way out along any direction each of them is left once more than it is entered.
        """
        if not np.any(self.materials.kind == GLASS):
            return 0, -1
        ray = allocate(1)
        ray.origin[0], ray.direction[0], ray.inside[0] = point, direction, 0
        depth, medium = 0, -1
        for _ in range(GLASS_AROUND):
            hits = self.closest(ray)
            k = int(hits.surface[0])
            if k < 0:
                break
            p = ray.origin[0] + hits.distance[0] * direction
            normal = np.array(outward_normal(self.triangles, self.primitives, k, tuple(p)))
            material = material_of(self.triangles, self.primitives, k)
            if self.materials.kind[material] == GLASS:
                leaving = normal @ direction > 0
                depth += 1 if leaving else -1
                medium = material if leaving and medium < 0 else medium
            ray.origin[0] = lifted(tuple(p), tuple(normal), tuple(direction), self.lift)
        return (depth, medium) if depth > 0 else (0, -1)

    def transmittance(self, shadow: Rays, reach: Array) -> None:
        """Turn the weights of shadow rays into what passes from their origin over `reach` (n,).

        Opaque surfaces block; each glass surface lets 1 - Schlick pass, glass absorbs on the way.
        The rays are moved and spent.
        """
        rays, left, rows = shadow, reach, np.arange(len(shadow.pixel))
        for _ in range(SHADOW_CROSSINGS):
            hits = self.closest(rays, left)
            going = np.zeros(len(rows), bool)
            _cross(self.triangles, self.primitives, self.materials, self.lift, rays, hits, left,
                   going)
            if rays is not shadow:
                shadow.weight[rows] = rays.weight
            if not going.any():
                return
            rays, left, rows = chosen(rays, going), left[going], rows[going]
        shadow.weight[rows] = 0.0


@kernel
def _approaching(box: Array, rays: Rays, hits: Hits, which: Integers, origin: Single,
                 direction: Single, primitives: Primitives, materials: Materials, first: int,
                 reach: Array) -> int:
    """The rays that may meet a triangle before their hit, in float32; returns how many they are.

    A shadow ray, one with a reach, is left out if something opaque blocks it anyway.
    """
    low, high = (box[0, 0], box[0, 1], box[0, 2]), (box[1, 0], box[1, 1], box[1, 2])
    count = 0
    for ray in range(rays.pixel.size):
        limit, surface = hits.distance[ray], hits.surface[ray]
        if reach.size > 0:
            if (surface >= 0 and limit < reach[ray]
                    and materials.kind[primitives.material[surface - first]] != GLASS):
                continue
            limit = min(limit, reach[ray])
        enter, leave = slabs(low, high, load(rays.origin, ray), load(rays.direction, ray))
        if enter <= leave and leave >= 0.0 and enter <= limit:
            which[count] = ray
            for axis in range(3):
                origin[count, axis] = rays.origin[ray, axis]
                direction[count, axis] = rays.direction[ray, axis]
            count += 1
    return count


@kernel
def _refine(triangles: Triangles, rays: Rays, which: Integers, far: Single,
            triangle: NDArray[np.int32], u: Single, v: Single, hits: Hits) -> None:
    """Replace hits by triangles that are nearer, at distances in float64 from their planes."""
    for found in range(which.size):
        k, ray = triangle[found], which[found]
        if k < 0:
            continue
        n, o = load(triangles.normal, k), load(rays.origin, ray)
        height = dot(n, along(load(triangles.corner[k], 0), -1.0, o))
        slope = dot(n, load(rays.direction, ray))
        t = float(far[found])
        if abs(slope) > 1e-9:   # edge on, the plane says less than Embree
            t = max(height / slope, 0.0)
        if t <= hits.distance[ray]:
            hits.distance[ray], hits.surface[ray] = t, k
            hits.u[ray], hits.v[ray] = u[found], v[found]


@kernel
def outward_normal(triangles: Triangles, primitives: Primitives, surface: int, p: Three) -> Three:
    """The geometric normal of a surface at its point p."""
    first = triangles.material.size
    if surface < first:
        return load(triangles.normal, surface)
    return normal_at(primitives, surface - first, p)


@kernel
def lifted(p: Three, n: Three, d: Three, lift: float) -> Three:
    """Where a ray of direction d starts that leaves the surface point p with normal n.

    Along n it gets off the surface even at grazing angles; along d, a tenth as far, it gets off the
    face that meets this one, if p is on their edge. A ray that cuts an edge off within that tenth
    starts behind both faces, and is taken to be inside still.
    """
    return along(along(p, 0.1 * lift, d), lift if dot(n, d) >= 0.0 else -lift, n)


@kernel
def material_of(triangles: Triangles, primitives: Primitives, surface: int) -> int:
    """The material of a surface."""
    first = triangles.material.size
    return (triangles.material[surface] if surface < first
            else primitives.material[surface - first])


@kernel
def _cross(triangles: Triangles, primitives: Primitives, materials: Materials, lift: float,
           rays: Rays, hits: Hits, reach: Array, going: NDArray[np.bool_]) -> None:
    """One surface of every shadow ray: weights fall, rays that go on move behind the surface."""
    for ray in range(rays.pixel.size):
        t, surface = hits.distance[ray], hits.surface[ray]
        medium = rays.medium[ray]
        if rays.inside[ray] > 0 and medium >= 0:
            path = min(t, reach[ray])
            for c in range(3):
                rays.weight[ray, c] *= np.exp(-materials.absorption[medium, c] * path)
        if surface < 0 or t >= reach[ray]:
            continue
        material = material_of(triangles, primitives, surface)
        if materials.kind[material] != GLASS:
            store(rays.weight, ray, (0.0, 0.0, 0.0))
            continue
        o, d = load(rays.origin, ray), load(rays.direction, ray)
        n = outward_normal(triangles, primitives, surface, along(o, t, d))
        cosine = dot(n, d)
        before = rays.inside[ray]
        after = before + 1 if cosine < 0.0 else max(before - 1, 0)
        if min(before, after) == 0:   # the ray enters or leaves the glass as a whole
            share = 1.0 - schlick(abs(cosine), materials.ior[material])
            for c in range(3):
                rays.weight[ray, c] *= share
        rays.inside[ray] = after
        rays.medium[ray] = material
        store(rays.origin, ray, lifted(along(o, t, d), n, d, lift))
        reach[ray] -= t
        going[ray] = True
