"""Bodies with a known answer: free tops, falls, drag, and the block in a stirred flow.

The stirred flow is the thesis' Figure 5.1: a body in the solid rotation u = Ω ẑ × x. With relative
drag κ = F_c / m its centre obeys z'' = κ (iΩ z - z') (z = x + iy), so z = z0 exp(λ t) with

    λ = (-κ + √(κ² + 4iκΩ)) / 2          κ = 5, Ω = 1: growth 0.170, rotation 0.936

The absolute drag that the thesis prints gives z'' = iκΩ z, λ = √(iκΩ): growth and rotation 1.58,
so the body circles faster than the water that carries it.
"""

import cmath
import math

import numpy as np

from partition.build import build as build_fragments
from runs.exact.particles import Check
from solver import scene as scenes
from solver.contact import Ground
from solver.rigid import throw
from solver.scene_body import Obstacle
from solver.state import coordinates
from solver.step import Simulation
from solver.vertices import SUMS

KAPPA, OMEGA = 5.0, 1.0
BLOCK = {"name": "block", "shape": "box", "size": (0.02, 0.02, 0.02), "detail": 0, "density": 1e3}


def checks() -> list[Check]:
    """Every closed-form case of bodies."""
    top = [top_error(steps) for steps in (100, 200)]
    return [
        Check("symmetric top, 2 - order", max(0.0, 2 - math.log2(top[0] / top[1])), 0.1),
        Check("free top, drift of |Iω| over 10⁴ steps", max(top_drift()), 1e-10),
        Check("intermediate axis, share not flipped over", 1 + flipped(), 0.01),
        Check("free fall, in one step", fall_error(), 1e-12),
        Check("weight balanced by drag", balance_error(), 1e-3),
        Check("dropped block, height of the bounce", bounce_error(0.6), 1e-5),
        Check("sliding block, way to a stop", slide_error(0.4), 1e-4),
        Check("stirred block, relative drag, λ", stirred_error("relative", 1000), 2e-2),
        Check("stirred block, absolute drag, λ", stirred_error("absolute", 1000), 2e-2)]


class Top:
    """A body without drag or gravity."""

    def __init__(self, moments: tuple[float, float, float], spin: tuple[float, float, float]):
        self.inertia = np.diag(moments)[None].copy()
        self.inverse = np.linalg.inv(self.inertia)
        self.orientation = np.array([[1.0, 0, 0, 0]])
        self.spin = np.array([spin])
        self.still = np.zeros((2, 1, 3))

    def turn(self, dt: float, steps: int = 1) -> None:
        """So many steps of the solver."""
        for _ in range(steps):
            throw(np.zeros((1, SUMS)), np.ones(1), self.inertia, self.inverse, np.zeros(1),
                  np.zeros(1, np.uint8), np.zeros(3), dt, self.still[0], self.orientation,
                  self.still[1], self.spin)

    @property
    def body_spin(self) -> np.ndarray:
        """ω in the axes of the body."""
        w, x, y, z = self.orientation[0]
        matrix = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                           [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                           [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        spin: np.ndarray = matrix.T @ self.spin[0]
        return spin


def top_error(steps: int) -> float:
    """|ω - exact| in body axes of a symmetric top, which precesses at (I₃ - I₁) ω₃ / I₁."""
    top = Top((1.0, 1.0, 1.8), (0.3, 0.0, 2.0))
    top.turn(3.0 / steps, steps)
    angle = 3.0 * (1.8 - 1.0) * 2.0
    return float(np.abs(top.body_spin - [0.3 * math.cos(angle), 0.3 * math.sin(angle), 2.0]).max())


def top_drift() -> tuple[float, float]:
    """Relative change of |Iω| and of the energy of an asymmetric top in 10⁴ steps."""
    top, found = Top((1.0, 2.0, 3.0), (0.5, 1.0, -0.7)), []
    for _ in range(2):
        momentum = top.inertia[0] @ top.body_spin
        found.append((np.linalg.norm(momentum), momentum @ top.body_spin))
        top.turn(0.01, 10_000)
    before, after = np.array(found)
    drift = np.abs(after / before - 1)
    return float(drift[0]), float(drift[1])


def flipped() -> float:
    """The least spin about the intermediate axis, of 1 at first: -1 once the top flips over."""
    top = Top((1.0, 2.0, 3.0), (1e-3, 1.0, 1e-3))
    least = 1.0
    for _ in range(600):
        top.turn(0.1)
        least = min(least, float(top.body_spin[1]))
    return least


def block(gravity: float = 0.0, **changes: object) -> Simulation:
    """A block in a closed box of still air."""
    scene = scenes.build({
        "domain": {"cells": [8, 8, 8], "boundary": "wall"}, "time": {"end": 10.0, "frame": 10.0},
        "fluid": {"gravity": (0.0, gravity, 0.0)}, "body": [BLOCK | changes]})
    return Simulation(scene, fragments=build_fragments(scene))


def fall_error() -> float:
    """Relative error of the fall outside the box, where nothing drags, in one step of 0.5."""
    simulation = block(-9.8, place=(9.0, 0.5, 0.5))
    simulation.stages["bodies"][1](simulation.state, 0.5)
    y = simulation.state.bodies.position[0, 1]
    simulation.destroy()
    return abs((0.5 - y) / (9.8 * 0.5**2 / 2) - 1)


def balance_error() -> float:
    """Relative error of the speed m g / F_c at which a body falls through still air in the end."""
    simulation = block(-9.8, force=1.0)
    bodies = simulation.state.bodies
    for _ in range(400):
        simulation.stages["bodies"][1](simulation.state, 5e-4)
    found = bodies.velocity[0, 1] / (-9.8 * bodies.mass[0] / 1.0)
    simulation.destroy()
    return float(abs(found - 1))


def bounce_error(restitution: float) -> float:
    """Relative error of the height e² h to which a block comes back from the ground."""
    simulation = block(-9.8, place=(9.0, 0.41, 0.5))
    bodies, highest = simulation.state.bodies, 0.0
    bodies.ground = Ground((Obstacle(restitution=restitution),))
    for _ in range(int(0.2 * math.sqrt(2) * (1 + 1.5 * restitution) / 1e-3)):
        simulation.stages["bodies"][1](simulation.state, 1e-3)
        if bodies.velocity[0, 1] > 0:
            highest = float(bodies.position[0, 1]) + bodies.velocity[0, 1]**2 / (2 * 9.8)
    simulation.destroy()
    return abs((highest - 0.01) / (restitution**2 * 0.4) - 1)


def slide_error(friction: float) -> float:
    """Relative error of the way v²/(2 μ g) that a block slides."""
    simulation = block(-9.8, place=(9.0, 0.01, 0.5), velocity=(1.0, 0.0, 0.0))
    bodies = simulation.state.bodies
    bodies.ground = Ground((Obstacle(friction=friction),))
    for _ in range(1000):
        simulation.stages["bodies"][1](simulation.state, 1e-3)
    way = float(bodies.position[0, 0]) - 9
    simulation.destroy()
    return abs(way / (1 / (2 * friction * 9.8)) - 1)


def stirred_error(drag: str, steps: int) -> float:
    """|λ - exact| of a small block that starts on its growing orbit."""
    if drag == "relative":
        rate = (-KAPPA + cmath.sqrt(KAPPA**2 + 4j * KAPPA * OMEGA)) / 2
    else:
        rate = cmath.sqrt(1j * KAPPA * OMEGA)
    simulation = block(laws={"drag": drag}, place=(0.6, 0.5, 0.5))
    state, bodies = simulation.state, simulation.state.bodies
    for axis, (field, sign, along) in enumerate(((state.u, -1, "y"), (state.v, 1, "x"))):
        field[...] = sign * OMEGA * (coordinates(state.grid, axis)[along] - 0.5)
    bodies.force[:] = KAPPA * bodies.mass
    bodies.velocity[0, :2] = 0.1 * rate.real, 0.1 * rate.imag
    for _ in range(steps):
        simulation.stages["bodies"][1](state, 1.0 / steps)
    x, y = bodies.position[0, :2] - 0.5
    simulation.destroy()
    return abs(cmath.log(complex(x, y) / 0.1) - rate)
