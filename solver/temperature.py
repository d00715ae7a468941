"""Temperature: carried by the flow, heated by the fire, conducted.

    T_new = a T_old + b (T + dt [-(u·∇)T + c_k ∇²T + H])

Advective form, as for momentum: with the conservative form the gas of the fire would enter at
T = 0 and put it out. On a cell, with the face velocities F (outwards positive) and the donor cell,

    -(u·∇)T = Σ_faces (γ|F| - F) (T_N - T) / 2h

With γ = 1 and dt Σ|u|/h ≤ 1, T stays between its neighbours whatever ∇·u is.
"""

import numpy as np

from solver.boundary import fill_temperature
from solver.kernel import FIELD, GHOSTS, REAL, kernel
from solver.scene import Scene
from solver.state import State


class Temperature:
    """Predicts T of a substep from advection, conduction and the heat of the fire."""

    def __init__(self, scene: Scene, state: State):
        self.blend = scene.fluid.donor_blend
        self.ambient = scene.fluid.ambient_temperature
        h = np.array(state.grid.spacing)
        conductivity = scene.fluid.conductivity
        self.rates = 0.5 / h
        self.diffusion = conductivity / h**2
        self.diffusion_limit = (np.inf if conductivity == 0
                                else 0.5 / (conductivity * (1 / h**2).sum()))
        self.no_heat = state.grid.field() if state.heat is None else None

    def limit(self, _state: State) -> tuple[float, str]:
        """Explicit diffusion: dt ≤ 1 / (2 c_k Σ 1/h²)."""
        return self.diffusion_limit, "conduction"

    def __call__(self, state: State, old: float, new: float, dt: float) -> None:
        """(a, b) = (old, new) are the integrator's weights of the substep."""
        start = state.T_old if old else state.T
        heat = self.no_heat if state.heat is None else state.heat
        predict_temperature(state.T_new, start, state.T, *state.velocity, heat, old, new, dt,
                            self.blend, *self.rates, *self.diffusion)
        state.T, state.T_new = state.T_new, state.T
        fill_temperature(state.grid, state.T, state.velocity, self.ambient)


@kernel(*[FIELD] * 7, *[REAL] * 10)
def predict_temperature(T_new, T_old, T, u, v, w, heat, old, new, dt,
                        blend, rx, ry, rz, nx, ny, nz):
    """All cells of this rank."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            for i in range(GHOSTS, T.shape[2] - GHOSTS):
                c = T[k, j, i]
                east, west = u[k, j, i], u[k, j, i - 1]
                north, south = v[k, j, i], v[k, j - 1, i]
                front, rear = w[k, j, i], w[k - 1, j, i]
                rate = ((rx * (blend * abs(east) - east) + nx) * (T[k, j, i + 1] - c)
                        + (rx * (blend * abs(west) + west) + nx) * (T[k, j, i - 1] - c)
                        + (ry * (blend * abs(north) - north) + ny) * (T[k, j + 1, i] - c)
                        + (ry * (blend * abs(south) + south) + ny) * (T[k, j - 1, i] - c)
                        + (rz * (blend * abs(front) - front) + nz) * (T[k + 1, j, i] - c)
                        + (rz * (blend * abs(rear) + rear) + nz) * (T[k - 1, j, i] - c))
                T_new[k, j, i] = (old * T_old[k, j, i]
                                  + new * (c + dt * (rate + heat[k, j, i])))
