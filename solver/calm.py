"""Where gas appears, central differences need a little diffusion to stay bounded.

    dq/dt = ¼ φ⁺ Σ_sides (q_neighbour - q)          for q = u, v, w, φ⁺ = max(φ, 0)

In the advective form ½∫q² grows by ½∫φ q² even where q only moves apart. Exactly, that is carried
away with the gas; of central differences, the waves shorter than four cells travel the wrong way,
into the source, and grow there like exp(½ φ t). The diffusion ¼ φ⁺ h² along each axis damps all of
these by as much (2 · ¼ φ at four cells, more below). It vanishes with h² like the error of the
schemes, and where there is no source. Explicit: held to dt Σ ≤ 1, so that it never limits dt.
The first-order upwind and the limited scheme do without.
"""

from solver.kernel import FIELD, GHOSTS, INT, REAL, kernel
from solver.scene import Scene
from solver.state import State

MOST = 1 / 12   # of 1 / dt: the coefficient of a side, six of which act on a value


class Calm:
    """Adds the diffusion to the predicted velocity."""

    def __init__(self, _scene: Scene, _state: State):
        """Nothing to keep."""

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Add new × dt × its rate, taken from the current velocity."""
        for axis in range(3):
            state.grid.exchange(axis, state.phi)
        for axis, (made, now) in enumerate(zip(state.velocity_new, state.velocity, strict=True)):
            calm(made, now, state.phi, *(int(axis == a) for a in range(3)), new * dt, MOST / dt)


@kernel(FIELD, FIELD, FIELD, INT, INT, INT, REAL, REAL)
def calm(made, q, phi, di, dj, dk, dt, most):
    """made += dt min(¼ φ⁺, most) Σ (q_neighbour - q) on the faces of one axis; φ of a face is the
    mean of its two cells. Rows without a source are left alone."""
    for k in range(GHOSTS - dk, q.shape[0] - GHOSTS):
        for j in range(GHOSTS - dj, q.shape[1] - GHOSTS):
            strongest = 0.0
            for i in range(GHOSTS - di, q.shape[2] - GHOSTS):
                strongest = max(strongest, phi[k, j, i] + phi[k + dk, j + dj, i + di])
            if strongest == 0.0:
                continue
            for i in range(GHOSTS - di, q.shape[2] - GHOSTS):
                rate = min(0.125 * max(phi[k, j, i] + phi[k + dk, j + dj, i + di], 0.0), most)
                made[k, j, i] += dt * rate * (
                    q[k, j, i + 1] + q[k, j, i - 1] + q[k, j + 1, i] + q[k, j - 1, i]
                    + q[k + 1, j, i] + q[k - 1, j, i] - 6 * q[k, j, i])
