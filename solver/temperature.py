"""Temperature: carried by the flow, heated by the fire, conducted.

    T_new = a T_old + b (T + dt [-(u·∇)T + c_k ∇²T + H])

Advective form, as for momentum: with the conservative form the gas of the fire would enter at
T = 0 and put it out. The control volume is the cell; the schemes are those of `advance`. With the
bounded one, T leaves the range of its neighbours only by H. In an implicit step the conduction is
solved for (`diffusion`, `helmholtz`).
"""

from typing import Any

import numpy as np

from solver.advance import Advance
from solver.boundary import fill_temperature
from solver.diffusion import Diffusion
from solver.grid import INNER, Field
from solver.kernel import FIELD, GHOSTS, REAL, kernel
from solver.scene import Scene
from solver.state import State

CELLS = 3


class Temperature:
    """Predicts T of a substep from advection, conduction and the heat of the fire."""

    def __init__(self, scene: Scene, state: State):
        fluid = scene.fluid
        self.ambient = fluid.ambient_temperature
        self.advance = Advance(state.grid, fluid.temperature_advection, fluid.donor_blend,
                               bounded=True)
        self.conduction = Diffusion(scene, state.grid, fluid.conductivity)
        self.solver: Any = None
        self.range = -np.inf, np.inf

    def diffusion_limit(self, otherwise: float) -> tuple[float, str]:
        """Explicit diffusion: dt ≤ ⅓ / (c_k Σ 1/h²)."""
        return self.conduction.limit(otherwise), "conduction"

    def __call__(self, state: State, old: float, new: float, dt: float) -> None:
        """(a, b) = (old, new) are the integrator's weights of the substep."""
        start: Field = state.T_old if old else state.T
        kappa, mu = self.conduction.split(state.number, new)
        explicit = 0.0 if mu else 1.0
        self.advance(state, state.T_new, start, state.T, CELLS, (old, new), dt,
                     explicit * self.conduction.rates)
        if state.heat is not None:
            add_heat(state.T_new, state.heat, new * dt)
        if mu:
            self._conduct(state, kappa * dt * self.conduction.rates,
                          mu * dt * self.conduction.rates)
        state.accept("T")
        fill_temperature(state.grid, state.T, state.velocity, self.ambient)

    def _conduct(self, state: State, explicit: Field, implicit: Field) -> None:
        """The conduction of an implicit substep; no flux through the faces."""
        if self.solver is None:
            from solver.helmholtz import Helmholtz
            self.solver = Helmholtz(state.grid, CELLS)
        if state.number == 0:
            self.range = self._range(state)
        add_laplacian(state.T_new, state.T, *explicit)
        self.solver(state.T_new, implicit)
        np.clip(state.T_new, *self.range, out=state.T_new)

    def _range(self, state: State) -> tuple[float, float]:
        """What neither advection nor conduction can take T out of in this step."""
        low, high = float(state.T[INNER].min()), float(state.T[INNER].max())
        if state.heat is not None:
            low += state.dt * min(float(state.heat[INNER].min()), 0.0)
            high += state.dt * max(float(state.heat[INNER].max()), 0.0)
        every = state.grid.comm.allgather((low, high))
        return min(low for low, _ in every), max(high for _, high in every)


@kernel(FIELD, FIELD, REAL)
def add_heat(T, heat, dt):
    """T += dt H in every cell of this rank."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            for i in range(GHOSTS, T.shape[2] - GHOSTS):
                T[k, j, i] += dt * heat[k, j, i]


@kernel(FIELD, FIELD, REAL, REAL, REAL)
def add_laplacian(made, T, cx, cy, cz):
    """made += Σ c δ²T in every cell of this rank."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            for i in range(GHOSTS, T.shape[2] - GHOSTS):
                here = 2 * T[k, j, i]
                made[k, j, i] += (cx * (T[k, j, i - 1] + T[k, j, i + 1] - here)
                                  + cy * (T[k, j - 1, i] + T[k, j + 1, i] - here)
                                  + cz * (T[k - 1, j, i] + T[k + 1, j, i] - here))
