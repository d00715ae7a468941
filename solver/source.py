"""A divergence source and a heating that the scene prescribes, without fuel.

    ∇·u = φ(x, y, z, t),   dT/dt = ... + H(x, y, z, t)

A substep that goes from t₀ to t₁ takes H at t₀, where its other terms are taken, and φ at t₁, where
its velocity has to satisfy ∇·u = φ. Before a step φ at its end is looked at: the speed that the
change will cause bounds dt, however suddenly it comes. A closed box has no room for a net ∫φ dV: it
is refused, or its mean is taken away from φ (`domain.expansion = "spread"`).
"""

import re

import numpy as np

from solver.expansion import source_speed
from solver.grid import INNER
from solver.scene import Scene, SceneError
from solver.state import State, evaluate

NEAR = 1e-3     # of dt: the distance in time over which ∂φ/∂t is taken
CLOSED = 1e-9   # of ∫|φ| dV: as much net expansion is round-off


class Source:
    """Evaluates φ and H of a substep."""

    def __init__(self, scene: Scene, state: State):
        self.scene, fluid = scene, scene.fluid
        if scene.fuel is not None:
            raise SceneError(f"{scene.path}: fluid.source = {fluid.source!r}: given beside [fuel], "
                             "which makes its own; fix: remove one")
        if fluid.heat_source and state.T is None:
            raise SceneError(f"{scene.path}: fluid.heat_source = {fluid.heat_source!r}: the scene "
                             "has no temperature; fix: give initial.T")
        self.changes = "t" in re.findall(r"[a-z0-9]+", fluid.source)
        self.divergence(state, 0.0)

    def foresee(self, state: State, dt: float) -> None:
        """Set state.source_speed to what the change of φ within a step of dt can cause."""
        state.source_speed = 0.0
        if self.changes:
            grid, before = state.grid, state.phi[INNER].copy()
            self.divergence(state, state.time + dt)
            change = np.abs(state.phi[INNER] - before)
            total = grid.comm.allreduce(float(change.sum())) * grid.volume
            peak = grid.comm.allreduce(float(change.max(initial=0.0)), op=max)
            state.source_speed = source_speed(peak, total, grid.cells, grid.size)

    def __call__(self, state: State, _old: float, _new: float, _dt: float) -> None:
        """Set φ and H for the substep state.substep."""
        start, end = state.substep
        if state.heat is not None:
            evaluate(state.grid, self.scene.fluid.heat_source, state.heat, None, start)
        self.divergence(state, end)

    def look_ahead(self, state: State, time: float, dt: float) -> None:
        """Set φ to φ(t) + dt ∂φ/∂t, by central differences."""
        if state.phi is None:
            return
        parts = []
        for moment in (time - NEAR * dt, time + NEAR * dt, time):
            self.divergence(state, moment)
            parts.append(state.phi.copy())
        state.phi += (parts[1] - parts[0]) / (2 * NEAR)

    def divergence(self, state: State, time: float) -> None:
        """Set φ(t)."""
        if state.phi is None:
            return
        evaluate(state.grid, self.scene.fluid.source, state.phi, None, time)
        if not self.scene.is_closed:
            return
        inner = state.phi[INNER]
        sums = state.grid.comm.allreduce(np.array([inner.sum(), np.abs(inner).sum()]))
        if self.scene.domain.expansion == "spread":
            inner -= sums[0] / np.prod(state.grid.cells)
        elif abs(sums[0]) > CLOSED * sums[1]:
            raise SceneError(f"{self.scene.path}: fluid.source = {self.scene.fluid.source!r}: a "
                             f"closed box cannot take its net expansion at t = {time:g}; fix: "
                             'open a face, or set domain.expansion = "spread"')
