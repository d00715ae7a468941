"""Scenes that are valid and that nobody would write: every key drawn from what the schema allows.

Drawn again until the schema accepts it. A run takes some ten steps; some scenes are 2-D, some have
bodies, soft or broken, fire, soot, moving walls, prescribed sources, forces of any direction, cells
of any shape.

The air is never quite still (`initial.noise`): at an open face the sign of the normal velocity
decides between air that leaves and air that enters from rest, and where that velocity is zero but
for round-off, two rank counts may decide differently (up to 6e-5 of the speed four frames later).
"""

from typing import Any

import numpy as np

from solver import scene as scenes

Tree = dict[str, Any]
INTEGRATORS = ("euler", "rk2", "rk3")
SCHEMES = ("donor", "central", "central4", "tvd")
SPEEDS = ("0", "sin(2*pi*x)*cos(2*pi*y)", "-cos(2*pi*x)*sin(2*pi*z)", "0.3", "y*(1-y)", "x-0.5")
FORCES = ("0", "sin(2*pi*z)*cos(3*t)", "0.5-y", "-1", "where(x > 0.5, 1.0, -1.0)")
SOURCES = ("sin(2*pi*x)*cos(2*pi*y)", "exp(-((x-0.5)**2+(y-0.5)**2)/0.02)*cos(t)")


class Draw:
    """Random choices."""

    def __init__(self, seed: int):
        self.random = np.random.default_rng(seed)

    def chance(self, share: float) -> bool:
        """True in this share of cases."""
        return bool(self.random.random() < share)

    def one(self, *things: Any) -> Any:
        """One of them."""
        return things[int(self.random.integers(len(things)))]

    def number(self, low: float, high: float) -> float:
        """Between two positive numbers, as likely in each power of ten."""
        return float(np.exp(self.random.uniform(np.log(low), np.log(high))))

    def whole(self, low: int, high: int) -> int:
        """low, ..., high."""
        return int(self.random.integers(low, high + 1))


def valid_scene(seed: int) -> Tree:
    """A scene, as TOML holds it; the same for the same seed."""
    draw = Draw(seed)
    while True:
        tree = _draw_scene(draw, seed)
        try:
            scenes.build(tree)
        except scenes.SceneError:
            continue
        return tree


def _draw_scene(draw: Draw, seed: int) -> Tree:
    flat = draw.chance(0.15)
    cells = [draw.whole(5, 18), draw.whole(8, 18), 1 if flat else draw.whole(8, 16)]
    frame = draw.number(0.003, 0.02)
    tree: Tree = {
        "seed": seed,
        "domain": {"cells": cells, "size": [draw.number(0.5, 3.0) for _ in range(3)],
                   "boundary": _boundary(draw, flat), "expansion": "spread"},
        "time": {"end": 4 * frame, "frame": frame, "integrator": draw.one(*INTEGRATORS),
                 "dt_max": frame / draw.whole(1, 4)},
        "fluid": {"advection": draw.one(*SCHEMES), "temperature_advection": draw.one(*SCHEMES),
                  "donor_blend": draw.one(1.0, 0.5), "reynolds": draw.one(np.inf, 10.0, 1000.0),
                  "conductivity": draw.one(0.0, 0.01), "cooling": draw.one(0.0, 500.0),
                  "buoyancy": draw.one(0.0, 0.05),
                  "gravity": [draw.one(0.0, -9.8, 3.0) for _ in range(3)],
                  "vorticity_confinement": draw.one(0.0, 0.2),
                  "force": [draw.one(*FORCES) for _ in range(3)]},
        "initial": {"noise": draw.one(0.01, 0.5, 5.0),
                    **{name: draw.one(*SPEEDS) for name in "uvw"}},
        "output": {"precision": "float64", "compression": draw.one("gzip", "none"),
                   "checkpoint_every": draw.one(0.0, 0.05)}}
    if draw.chance(0.4):
        tree["initial"]["T"] = draw.one("5 + 90*exp(-((x-0.5)**2+(y-0.5)**2)/0.02)", "5 + x")
    if draw.chance(0.6):
        tree |= _fire(draw, tree["domain"]["size"])
    elif draw.chance(0.5):
        tree["fluid"]["source"] = draw.one(*SOURCES)
    if draw.chance(0.5):
        tree["body"] = [_body(draw, number, tree["domain"]["size"], 4 * frame)
                        for number in range(draw.whole(1, 2))]
    return tree


def _boundary(draw: Draw, flat: bool) -> Tree:
    faces: Tree = {}
    for axis, letter in enumerate("xyz"):
        sides = [f"{letter}_{side}" for side in ("min", "max")]
        if draw.chance(0.25) or flat and axis == 2:
            faces |= dict.fromkeys(sides, "periodic")
            continue
        wall = [0.0 if a == axis else draw.one(-1.0, 0.0, 2.0) for a in range(3)]
        faces |= {side: draw.one("open", "wall", "slip", {"wall": wall}) for side in sides}
    return faces


def _fire(draw: Draw, size: list[float]) -> Tree:
    particles = draw.whole(0, 400)
    result: Tree = {
        "detonation": {"position": [edge * draw.random.uniform(0.1, 0.9) for edge in size],
                       "radius": draw.number(0.01, 0.5), "fill": draw.one("sphere", "ball")},
        "fuel": {"particles": particles, "ignited": draw.whole(0, particles),
                 "rate": draw.one(0.0, 2000.0), "mass": 1e-3, "burn_rate": draw.number(1e-3, 1.0),
                 "heat": draw.number(0.1, 100.0), "gas": draw.one(0.0, 0.5, 5.0),
                 "deposit": draw.one("trilinear", "nearest"),
                 "exchange": draw.one("one_way", "two_way"),
                 "drag": draw.one(0.0, 10.0), "heat_transfer": draw.one(0.0, 5e4)}}
    if draw.chance(0.6):
        result["soot"] = {"threshold": draw.one(4e-4, 2e-4), "repeat": draw.one(True, False),
                          "burn_rate": draw.one(0.0, 0.1), "min_mass": 1e-8}
    return result


def _body(draw: Draw, number: int, size: list[float], end: float) -> Tree:
    shape = draw.one("pane", "box", "sphere")
    body: Tree = {
        "name": f"body {number}", "shape": shape, "size": [0.3, 0.2, 0.05], "radius": 0.15,
        "detail": 1, "points": draw.whole(6, 40), "rotate": [draw.whole(0, 360) for _ in range(3)],
        "place": [edge * draw.random.uniform(0.3, 0.7) for edge in size],
        "density": draw.number(1.0, 1000.0), "force": draw.one(0.0, 30.0, 3e4),
        "velocity": [draw.one(0.0, 5.0) for _ in range(3)],
        "spin": [draw.one(0.0, 50.0) for _ in range(3)]}
    if draw.chance(0.6):
        body["fracture"] = {"pieces": draw.whole(1, 5)}
    if draw.chance(0.3):
        body["deform_until"] = {"time": end / 2}
    return body
