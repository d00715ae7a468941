"""Is our renderer fast beside others? Mitsuba 3 on equal scenes, seconds against error.

mesh    the animal, a mirror, a slab of clear glass and a checkered ground under two lamps, nothing
        behind; Mitsuba's integrator `path` adds the light that surfaces send each other
smoke   a 300³ volume, a quarter of it filled, that only absorbs, in front of white: the picture is
        the transparency, the same in both; Mitsuba's `volpath` draws collisions (delta tracking)

The error is the root mean square difference to the same program's own picture with many samples,
so that it measures noise and not opinion. Seconds are CPU seconds after set-up.
"""

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.fire import Fire
from render.frame import Film
from render.lights import POINT
from solver import files, scene

Array = NDArray[Any]
Shot = Callable[[int], Array]       # samples per pixel and axis -> light
SIDE, OPACITY = 300, 12.0
RUNGS = (1, 2, 4)
FINEST = {"mesh": 12, "smoke": 6}   # samples per axis of the picture that counts as exact
WHITE = {"kind": "uniform"}
SMOKE: dict[str, Any] = {
    "time": {"end": 1.0, "frame": 0.01}, "fuel": {},
    "render": {"light": [], "backdrop": WHITE, "volume": {
        "exposure": 0.0, "albedo": [0, 0, 0], "opacity": OPACITY, "onset": 0.0, "lights": 0}}}


def ladders(mesh: dict[str, Any], prepared: Callable[..., tuple[Film, files.Snapshot]],
            heat: Array) -> Iterator[tuple[str, str, int, float, float]]:
    """(scene, program, samples per pixel, seconds, error); Mitsuba's only if it is installed."""
    for name, shots in (("mesh", _mesh_shots(mesh, prepared)), ("smoke", _smoke_shots(heat))):
        for program, shot in shots:
            exact = shot(FINEST[name])
            shot(1)
            for n in RUNGS:
                start = time.process_time()
                light = shot(n)
                seconds = time.process_time() - start
                yield name, program, n * n, seconds, float(np.sqrt(np.mean((light - exact) ** 2)))


def _mesh_shots(mesh: dict[str, Any], prepared: Callable[..., tuple[Film, files.Snapshot]]
                ) -> Iterator[tuple[str, Shot]]:
    look = {"backdrop": {"kind": "uniform", "colour": [0, 0, 0]}, "ambient": [0, 0, 0]}
    films = {n: prepared(mesh, **look, samples=n) for n in (*RUNGS, FINEST["mesh"])}
    yield "ours", lambda n: films[n][0].frame(films[n][1]).light
    film, snapshot = films[1]
    assert film.pieces is not None
    mitsuba = _mitsuba()
    if mitsuba:
        corner = film.pieces.posed(snapshot.bodies).corner
        yield "mitsuba", _rendered(mitsuba, _mesh_scene(mitsuba, film, corner), "path")


def _smoke_shots(heat: Array) -> Iterator[tuple[str, Shot]]:
    films = {}
    for n in (*RUNGS, FINEST["smoke"]):
        found = scene.build({**SMOKE, "render": {**SMOKE["render"], "samples": n}})
        assert found.render is not None
        films[n] = Film(found, found.render, None, Fire(found, found.render, 65.0))
    spacing = np.full(3, 1.0 / len(heat))
    snapshot = files.Snapshot(0, 0.0, 0, {"T": files.Field(heat, spacing / 2, spacing)}, {}, {})
    yield "ours", lambda n: films[n].frame(snapshot).light
    mitsuba = _mitsuba()
    if mitsuba:
        density = np.clip((heat - 5.0) / 60.0, 0, 1).astype(np.float32)
        yield "mitsuba", _rendered(mitsuba, _smoke_scene(mitsuba, films[1], density), "volpath")


def _mitsuba() -> Any:
    """The module, scalar and on one thread; None where it is not installed."""
    try:
        import drjit
        import mitsuba
    except ImportError:
        return None
    mitsuba.set_variant("scalar_rgb")
    drjit.set_thread_count(1)
    return mitsuba


def _rendered(mi: Any, things: dict[str, Any], integrator: str) -> Shot:
    world = mi.load_dict({"type": "scene", **things,
                          "integrator": {"type": integrator, "max_depth": 9}})
    return lambda n: np.array(mi.render(world, spp=n * n, seed=n))[..., :3]


def _sensor(mi: Any, film: Film) -> dict[str, Any]:
    camera, eye = film.camera, film.camera.eye
    half = float(np.linalg.norm(camera.right))
    return {"type": "perspective", "fov": float(np.degrees(2 * np.arctan(half))),
            "to_world": mi.ScalarTransform4f().look_at(
                origin=eye.tolist(), target=(eye + camera.forward).tolist(), up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}}}


def _box(mi: Any, low: Any, high: Any) -> Any:
    low, high = np.array(low, float), np.array(high, float)
    transform = mi.ScalarTransform4f()
    return transform.translate(((low + high) / 2).tolist()).scale(((high - low) / 2).tolist())


def _mesh_scene(mi: Any, film: Film, corner: Array) -> dict[str, Any]:
    import trimesh
    folder = Path(tempfile.mkdtemp())
    trimesh.Trimesh(corner.reshape(-1, 3), np.arange(3 * len(corner)).reshape(-1, 3),
                    process=False).export(folder / "animal.ply")
    mirror, slab = film.primitives.data[0], film.primitives.data[1]
    dull = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.56, 0.54, 0.51]}}
    checker = {"type": "diffuse", "reflectance": {
        "type": "checkerboard", "color0": 0.63, "color1": 0.09,
        "to_uv": mi.ScalarTransform4f().scale([50, 50, 1])}}
    ground = mi.ScalarTransform4f().translate([0.5, -0.1, 0.5]).rotate([1, 0, 0], -90).scale(10)
    things = {
        "animal": {"type": "ply", "filename": str(folder / "animal.ply"), "bsdf": dull},
        "mirror": {"type": "cube", "to_world": _box(mi, mirror[:3], mirror[3:]),
                   "bsdf": {"type": "conductor", "material": "none"}},
        "slab": {"type": "cube", "to_world": _box(mi, slab[:3], slab[3:]),
                 "bsdf": {"type": "dielectric", "int_ior": 1.5}},
        "ground": {"type": "rectangle", "to_world": ground, "bsdf": checker},
        "sensor": _sensor(mi, film)}
    for k, (place, colour) in enumerate(zip(film.lights.place, film.lights.colour, strict=True)):
        shine = {"type": "rgb", "value": (np.pi * colour).tolist()}
        things[f"lamp{k}"] = (
            {"type": "point", "position": place.tolist(), "intensity": shine}
            if film.lights.kind[k] == POINT else
            {"type": "directional", "direction": (-place).tolist(), "irradiance": shine})
    return things


def _smoke_scene(mi: Any, film: Film, density: Array) -> dict[str, Any]:
    medium = {"type": "heterogeneous", "albedo": 0.0, "scale": OPACITY,
              "sigma_t": {"type": "gridvolume", "grid": mi.VolumeGrid(density[..., None])}}
    return {"sky": {"type": "constant", "radiance": 1.0}, "sensor": _sensor(mi, film),
            "cloud": {"type": "cube", "to_world": _box(mi, (0, 0, 0), (1, 1, 1)),
                      "bsdf": {"type": "null"}, "interior": medium}}
