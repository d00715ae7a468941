"""Two hundred random scenes: light is finite, never negative, and none outshines its sources."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from render.materials import BUILT_IN
from tests.test_render_scene import film_of, snapshot

places = st.floats(-1.0, 2.0)
points = st.tuples(places, places, places)
shares = st.floats(0.0, 1.0)
colours = st.tuples(shares, shares, shares)
names = st.sampled_from([*BUILT_IN, "own"])


def ordered(low: tuple[float, ...], size: tuple[float, ...]) -> list[float]:
    return [a + 0.01 + b for a, b in zip(low, size, strict=True)]


boxes = st.builds(lambda low, size, name, shape: {
    "shape": shape, "low": low, "high": ordered(low, size), "hole_low": [x + 0.004 for x in low],
    "hole_high": [x + 0.006 for x in low], "material": name},
    points, colours, names, st.sampled_from(["box", "frame"]))
spheres = st.builds(lambda place, radius, name: {
    "shape": "sphere", "place": place, "radius": 0.01 + radius, "material": name},
    points, shares, names)
planes = st.builds(lambda place, normal, name: {
    "shape": "plane", "place": place, "normal": [normal[0] + 0.01, *normal[1:]],
    "material": name}, points, points, names)
textures = st.none() | st.builds(lambda kind, scale: {"kind": kind, "scale": 0.01 + scale},
                                 st.sampled_from(["checker", "brick", "noise", "wood", "marble"]),
                                 shares)
materials = st.builds(lambda kind, colour, specular, exponent, mirror, ior, texture: {
    "kind": kind, "colour": colour, "specular": specular, "exponent": exponent, "mirror": mirror,
    "ior": 1.0 + ior, "absorption": colour, **({"texture": texture} if texture else {})},
    st.sampled_from(["phong", "ashikhmin", "glass"]), colours, shares, st.floats(1.0, 500.0),
    shares, shares, textures)
lamps = st.builds(lambda kind, place, colour, falloff: {
    "kind": kind, "position": place, "direction": [place[0] + 0.01, *place[1:]],
    "colour": colour, "falloff": falloff},
    st.sampled_from(["point", "directional"]), points, colours, st.sampled_from([0, 1, 2]))
fires = st.none() | st.builds(lambda opacity, smoke, source: {
    "opacity": 100 * opacity, "smoke": 100 * smoke, "source": source,
    "splat": {"cells": [20, 30, 25]}}, shares, shares, st.sampled_from(["grid", "particles"]))


@settings(max_examples=200)
@given(objects=st.lists(boxes | spheres | planes, max_size=5), own=materials,
       lights=st.lists(lamps, max_size=3), fire=fires, eye=points, target=points,
       depth=st.integers(0, 6), pane=st.booleans(), flight=shares)
def test_random_scenes(objects, own, lights, fire, eye, target, depth, pane, flight):
    look: dict[str, Any] = {
        "width": 6, "height": 5, "samples": 1, "depth": depth, "light": lights,
        "backdrop": {"kind": "uniform", "colour": [0.3, 0.6, 0.9]},
        "material": {"own": own}, "object": objects,
        "camera": {"position": eye, "target": [target[0] + 0.001, *target[1:]], "fov": 70,
                   "up": [0.1, 1, 0.2]}, **({"volume": fire} if fire else {})}
    if np.allclose(eye, look["camera"]["target"]):
        look["camera"]["target"] = [eye[0] + 1, eye[1], eye[2]]
    body = [{"name": "pane", "shape": "pane", "size": [0.6, 0.5, 0.01], "points": 12,
             "place": [0.5, 0.5, 0.6], "areal_density": 20.0, "fracture": {"pieces": 4}}]
    film = film_of({"time": {"end": 1.0, "frame": 0.1}, "domain": {"cells": [12, 10, 11]},
                    "fuel": {}, "soot": {}, "body": body if pane else [], "render": look},
                   fire=fire is not None)
    light = film.frame(snapshot(film, 0.1 * flight, 0.5 if fire else None)).light
    assert np.isfinite(light).all() and light.min() >= 0
    # Lamps near a surface shine without bound; without them nothing exceeds fire and surroundings
    near = [lamp for lamp in lights if lamp["kind"] == "point" and lamp["falloff"] > 0]
    if not near and fire is None and own["kind"] != "ashikhmin":
        assert light.max() < 0.9 + 4.0 * (len(lights) + 1)
