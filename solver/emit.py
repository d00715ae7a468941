"""Fuel particles appear: at the start around the detonation, later at a constant rate.

A direction is uniform on the sphere (a normalised Gaussian); `fill = "sphere"` puts the particle on
the surface of radius r_d (the thesis), `"ball"` anywhere inside. Particle number n has the id
n << 16 (its soot takes the ids just above) and its own random numbers, so that neither the rank
count nor the step size changes which particles there are: at time t, n_p + rate × t have been made.
(The printed model makes a fixed number per step, so many more where the steps are short.)
"""

import numpy as np
from numpy.typing import NDArray

from solver.hashing import normal_at, uniform_at
from solver.scene import Scene
from solver.state import State
from solver.swarm import FUEL, ID_BITS, PARTICLE, Swarm, owners

DIRECTION_STREAM, RADIUS_STREAM = 10, 11


class Emit:
    """Owns the count of fuel particles ever made."""

    def __init__(self, scene: Scene, state: State):
        assert scene.fuel is not None
        self.scene, self.fuel = scene, scene.fuel
        state.swarm = Swarm(state.grid)
        self.made = 0
        self._add(state, self.fuel.particles)

    def __call__(self, state: State, dt: float) -> None:
        """Bring the number made up to n_p + rate × time at the end of the step, at most the cap."""
        fuel = self.fuel
        if fuel.rate > 0:
            time = min(state.time + dt, fuel.emit_end)
            due = fuel.particles + int(fuel.rate * time * (1 + 1e-12))   # whole numbers stay whole
            self._add(state, min(due, fuel.cap) - self.made)

    def _add(self, state: State, count: int) -> None:
        if count > 0:
            grid = state.grid
            records = self._records(np.arange(self.made, self.made + count, dtype=np.uint64))
            position, size = records["position"], np.array(grid.size)
            np.mod(position, size, out=position, where=np.array(grid.periodic))
            mine = owners(grid, position) == grid.comm.rank
            inside = np.all((position >= 0) & (position <= size), axis=1)
            state.swarm.append(records[mine & inside])
            self.made += count

    def _records(self, number: NDArray[np.uint64]) -> NDArray[np.void]:
        scene, fuel = self.scene, self.fuel
        axes = np.arange(3, dtype=np.uint64)
        direction = normal_at(scene.seed, DIRECTION_STREAM,
                              np.uint64(3) * number[:, None] + axes)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        radius = np.full(len(number), scene.detonation.radius)
        if scene.detonation.fill == "ball":
            radius *= np.cbrt(uniform_at(scene.seed, RADIUS_STREAM, number))
        lit = number < fuel.ignited
        records = np.zeros(len(number), PARTICLE)
        records["position"] = scene.detonation.position + radius[:, None] * direction
        records["mass"] = fuel.mass
        records["temperature"] = np.where(lit, fuel.ignition_temperature,
                                          scene.fluid.ambient_temperature)
        records["id"] = (number << np.uint64(ID_BITS)).astype(np.int64)
        records["kind"] = FUEL
        records["ignited"] = lit
        return records
