"""Momentum without pressure: advection and viscosity of u, v, w in one sweep.

    q_new = a q_old + b (q + dt [-(u·∇)q + ∇²q / Re])          for q = u, v, w

Advective form. ∇·u = φ ≠ 0 where fuel burns: the printed conservative form would let the new gas
enter at rest. On the control volume of a face, with the velocities F of the air through its six
sides (averaged from the two cells it spans, outwards positive), -(u·∇)q = -Σ F (q_side - q) / h.
The donor cell q_side = ½(q + q_N) - ½ γ sign(F) (q_N - q) gives

    -(u·∇)q = Σ_sides (γ|F| - F) (q_N - q) / 2h

γ = 1: upwind, first order; γ = 0: central, second order, unstable with Euler at Re = ∞.
Source: Griebel, Dornseifer & Neunhoeffer, Numerical Simulation in Fluid Dynamics (SIAM 1998).
"""

import numpy as np

from solver.kernel import FIELD, GHOSTS, INT, REAL, inlined, kernel
from solver.scene import Scene
from solver.state import State


class Momentum:
    """Predicts u, v, w of a substep from advection and viscosity."""

    def __init__(self, scene: Scene, state: State):
        self.blend = scene.fluid.donor_blend
        self.viscosity = 1 / scene.fluid.reynolds
        h = np.array(state.grid.spacing)
        self.rates = 0.5 / h
        self.diffusion = self.viscosity / h**2
        self.diffusion_limit = (np.inf if self.viscosity == 0
                                else 0.5 / (self.viscosity * (1 / h**2).sum()))

    def limit(self, _state: State) -> tuple[float, str]:
        """Explicit diffusion: dt ≤ 1 / (2 ν Σ 1/h²)."""
        return self.diffusion_limit, "viscosity"

    def __call__(self, state: State, old: float, new: float, dt: float) -> None:
        """(a, b) = (old, new) are the integrator's weights of the substep."""
        starts = state.velocity_old if old else state.velocity
        predict_velocity(*state.velocity_new, *starts, *state.velocity, old, new, dt, self.blend,
                         *self.rates, *self.diffusion)


@inlined
def advance_row(out, start, q, u, v, w, k, j, first, di, dj, dk,
                old, new, dt, blend, rx, ry, rz, nx, ny, nz):
    """One row of one component; (di, dj, dk) is the step to the other cell that its face spans."""
    for i in range(first, q.shape[2] - GHOSTS):
        c = q[k, j, i]
        east = u[k, j, i] + u[k + dk, j + dj, i + di]
        west = u[k, j, i - 1] + u[k + dk, j + dj, i - 1 + di]
        north = v[k, j, i] + v[k + dk, j + dj, i + di]
        south = v[k, j - 1, i] + v[k + dk, j - 1 + dj, i + di]
        front = w[k, j, i] + w[k + dk, j + dj, i + di]
        rear = w[k - 1, j, i] + w[k - 1 + dk, j + dj, i + di]
        ax, ay, az = 0.5 * rx, 0.5 * ry, 0.5 * rz
        rate = ((ax * (blend * abs(east) - east) + nx) * (q[k, j, i + 1] - c)
                + (ax * (blend * abs(west) + west) + nx) * (q[k, j, i - 1] - c)
                + (ay * (blend * abs(north) - north) + ny) * (q[k, j + 1, i] - c)
                + (ay * (blend * abs(south) + south) + ny) * (q[k, j - 1, i] - c)
                + (az * (blend * abs(front) - front) + nz) * (q[k + 1, j, i] - c)
                + (az * (blend * abs(rear) + rear) + nz) * (q[k - 1, j, i] - c))
        out[k, j, i] = old * start[k, j, i] + new * (c + dt * rate)


@kernel(*[FIELD] * 9, *[REAL] * 10)
def predict_velocity(u_new, v_new, w_new, u_old, v_old, w_old, u, v, w,
                     old, new, dt, blend, rx, ry, rz, nx, ny, nz):
    """All faces of this rank's cells, the low ones too: they belong to a neighbour (who computes
    the same) or to the box."""
    low = GHOSTS - 1
    for k in range(low, u.shape[0] - GHOSTS):
        for j in range(low, u.shape[1] - GHOSTS):
            if k > low and j > low:
                advance_row(u_new, u_old, u, u, v, w, k, j, low, 1, 0, 0,
                            old, new, dt, blend, rx, ry, rz, nx, ny, nz)
            if k > low:
                advance_row(v_new, v_old, v, u, v, w, k, j, GHOSTS, 0, 1, 0,
                            old, new, dt, blend, rx, ry, rz, nx, ny, nz)
            if j > low:
                advance_row(w_new, w_old, w, u, v, w, k, j, GHOSTS, 0, 0, 1,
                            old, new, dt, blend, rx, ry, rz, nx, ny, nz)
