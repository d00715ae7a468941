"""Where gas appears, central differences need a little diffusion to stay bounded.

    dq/dt = -Σ_axes δ²(⅛ φ⁺ δ²q),   δ²q = q₊ - 2q + q₋          for q = u, v, w, φ⁺ = max(φ, 0)

In the advective form ½∫q² grows by ½∫φ q² even where q only moves apart. Exactly, that is carried
away with the gas; of central differences, the waves shorter than four cells travel the wrong way,
into the source, and grow there like exp(½ φ t). This damps them by as much (⅛ φ · 2² at four cells,
more below): it takes ⅛∫φ⁺ (δ²q)² from the energy. It vanishes with h⁴, faster than the error of the
schemes, and where there is no source. Explicit: held to ⅛ φ⁺ dt ≤ 1/24, where it ends the shortest
wave of three axes at once, so that it never limits dt. The first-order upwind and the limited
scheme do without.
"""

import numba
import numpy as np

from solver.kernel import FIELD, GHOSTS, INT, REAL, inlined, kernel
from solver.scene import Scene
from solver.state import State

MOST = 1 / 24   # of 1 / dt: 16 of it, for three axes, must not be more than 2


class Calm:
    """Adds the diffusion to the predicted velocity."""

    def __init__(self, _scene: Scene, state: State):
        self.reach = np.zeros((2, *state.grid.shape[:2]), dtype=np.int64)

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Add new × dt × its rate, taken from the current velocity."""
        for axis in range(3):
            state.grid.exchange(axis, state.phi)
        find_reach(state.phi, self.reach)
        for axis, (made, now) in enumerate(zip(state.velocity_new, state.velocity, strict=True)):
            calm(made, now, state.phi, self.reach, *(int(axis == a) for a in range(3)), new * dt,
                 MOST / dt)


@kernel(FIELD, numba.int64[:, :, ::1])
def find_reach(phi, reach):
    """Of every row of cells the first with φ > 0 and the one after the last."""
    for k in range(phi.shape[0]):
        for j in range(phi.shape[1]):
            first, end = phi.shape[2], 0
            for i in range(phi.shape[2]):
                if phi[k, j, i] > 0.0:
                    first, end = min(first, i), i + 1
            reach[0, k, j], reach[1, k, j] = first, end


@inlined
def spread_reach(reach, k, j, K, J):
    """The same of the rows that the coefficients of a row of values are made of."""
    first, end = reach[0, k, j], reach[1, k, j]
    for row, line in ((K, J), (k - 1, j), (k + 1, j), (k, j - 1), (k, j + 1),
                      (K - 1, J), (K + 1, J), (K, J - 1), (K, J + 1)):
        first, end = min(first, reach[0, row, line]), max(end, reach[1, row, line])
    return first, end


@inlined
def strength(phi, k, j, i, K, J, I, most):  # noqa: E741
    """The coefficient on the face between two cells."""
    return min(0.0625 * max(phi[k, j, i] + phi[K, J, I], 0.0), most)


@inlined
def bend(before, here, after):
    """The second difference."""
    return before - 2 * here + after


@kernel(FIELD, FIELD, FIELD, numba.int64[:, :, ::1], INT, INT, INT, REAL, REAL)
def calm(made, q, phi, reach, di, dj, dk, dt, most):
    """made -= dt Σ δ²(min(⅛ φ⁺, most) δ² q) on the faces of one axis; φ of a face is the mean of
    its two cells. Of each row only the part that a source reaches is looked at."""
    for k in range(GHOSTS - dk, q.shape[0] - GHOSTS):
        for j in range(GHOSTS - dj, q.shape[1] - GHOSTS):
            K, J = k + dk, j + dj
            first, end = spread_reach(reach, k, j, K, J)
            south2, rear2 = max(j - 2, 0), max(k - 2, 0)
            for i in range(max(first - 2, GHOSTS - di), min(end + 1, q.shape[2] - GHOSTS)):
                I, west2 = i + di, max(i - 2, 0)  # noqa: E741
                here = q[k, j, i]
                west, east = q[k, j, i - 1], q[k, j, i + 1]
                south, north = q[k, j - 1, i], q[k, j + 1, i]
                rear, front = q[k - 1, j, i], q[k + 1, j, i]
                change = 2 * strength(phi, k, j, i, K, J, I, most) * (
                    west + east + south + north + rear + front - 6 * here)
                change -= (strength(phi, k, j, i - 1, K, J, I - 1, most)
                           * bend(q[k, j, west2], west, here)
                           + strength(phi, k, j, i + 1, K, J, I + 1, most)
                           * bend(here, east, q[k, j, i + 2])
                           + strength(phi, k, j - 1, i, K, J - 1, I, most)
                           * bend(q[k, south2, i], south, here)
                           + strength(phi, k, j + 1, i, K, J + 1, I, most)
                           * bend(here, north, q[k, j + 2, i])
                           + strength(phi, k - 1, j, i, K - 1, J, I, most)
                           * bend(q[rear2, j, i], rear, here)
                           + strength(phi, k + 1, j, i, K + 1, J, I, most)
                           * bend(here, front, q[k + 2, j, i]))
                made[k, j, i] += dt * change
