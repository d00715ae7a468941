"""Vorticity confinement: gives back the small eddies that the donor cell wears away.

    du/dt = ε h (N × ω),   N = ∇|ω| / |∇|ω||,   ω = ∇ × u        (h: mean cell edge)

ω and the force stand at cell centres; a face takes the mean of its two cells.
Source: Steinhoff & Underhill, Phys. Fluids 6 (1994) 2738; Fedkiw, Stam & Jensen, SIGGRAPH 2001.
"""

import numpy as np

from solver.boundary import fill_scalar
from solver.kernel import FIELD, GHOSTS, INT, REAL, kernel, part_of_sweep, sweep
from solver.scene import Scene
from solver.state import State

LEAST = 1e-60   # of |∇|ω||²: where it is 0 so is the force


class Vorticity:
    """Adds the confinement force to the predicted velocity."""

    def __init__(self, scene: Scene, state: State):
        self.inverse_h = [1 / h for h in state.grid.spacing]
        self.strength = scene.fluid.vorticity_confinement * float(np.mean(state.grid.spacing))
        self.omega = [state.grid.field() for _ in range(3)]
        self.size = state.grid.field()
        self.force = [state.grid.field() for _ in range(3)]

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Add new × dt × force."""
        vorticity(*state.velocity, *self.omega, self.size, *(c / 4 for c in self.inverse_h))
        fill_scalar(state.grid, self.size)
        confinement(*self.omega, self.size, *self.force, *self.inverse_h)
        for axis, (field, force) in enumerate(zip(state.velocity_new, self.force, strict=True)):
            fill_scalar(state.grid, force, [axis])
            add_face_mean(field, force, new * dt * self.strength, axis)


@part_of_sweep
def curl_row(out, ca, above_a, above_b, below_a, below_b, cc, after_a, after_b, before_a, before_b):
    """One component of ω: the change of one velocity along one axis less that of another along
    another, each the mean of its two faces; c = 1/4h."""
    for i in range(out.size):
        out[i] = (ca * (above_a[i] + above_b[i] - below_a[i] - below_b[i])
                  - cc * (after_a[i] + after_b[i] - before_a[i] - before_b[i]))


@part_of_sweep
def size_row(out, a, b, c):
    """|ω|."""
    for i in range(out.size):
        out[i] = np.sqrt(a[i] * a[i] + b[i] * b[i] + c[i] * c[i])


@sweep(*[FIELD] * 7, REAL, REAL, REAL)
def vorticity(u, v, w, ox, oy, oz, size, cx, cy, cz):
    """ω and |ω| at cell centres, from central differences of the velocities of the cells."""
    a, b = GHOSTS, u.shape[2] - GHOSTS
    A, B = a - 1, b - 1
    for k in range(GHOSTS, u.shape[0] - GHOSTS):
        for j in range(GHOSTS, u.shape[1] - GHOSTS):
            K, J = k - 1, j - 1
            curl_row(ox[k, j, a:b],
                     cy, w[k, j + 1, a:b], w[K, j + 1, a:b], w[k, J, a:b], w[K, J, a:b],
                     cz, v[k + 1, j, a:b], v[k + 1, J, a:b], v[K, j, a:b], v[K, J, a:b])
            curl_row(oy[k, j, a:b],
                     cz, u[k + 1, j, a:b], u[k + 1, j, A:B], u[K, j, a:b], u[K, j, A:B],
                     cx, w[k, j, a + 1:b + 1], w[K, j, a + 1:b + 1], w[k, j, A:B], w[K, j, A:B])
            curl_row(oz[k, j, a:b],
                     cx, v[k, j, a + 1:b + 1], v[k, J, a + 1:b + 1], v[k, j, A:B], v[k, J, A:B],
                     cy, u[k, j + 1, a:b], u[k, j + 1, A:B], u[k, J, a:b], u[k, J, A:B])
            size_row(size[k, j, a:b], ox[k, j, a:b], oy[k, j, a:b], oz[k, j, a:b])


@part_of_sweep
def force_row(fx, fy, fz, a, b, c, west, east, south, north, rear, front, cx, cy, cz):
    """N × ω; a, b, c: ω, the others |ω| around; c = 1/h."""
    for i in range(fx.size):
        gx, gy, gz = cx * (east[i] - west[i]), cy * (north[i] - south[i]), cz * (front[i] - rear[i])
        scale = 1 / np.sqrt(max(gx * gx + gy * gy + gz * gz, LEAST))
        fx[i] = scale * (gy * c[i] - gz * b[i])
        fy[i] = scale * (gz * a[i] - gx * c[i])
        fz[i] = scale * (gx * b[i] - gy * a[i])


@sweep(*[FIELD] * 7, REAL, REAL, REAL)
def confinement(ox, oy, oz, size, fx, fy, fz, cx, cy, cz):
    """N × ω at cell centres."""
    a, b = GHOSTS, ox.shape[2] - GHOSTS
    for k in range(GHOSTS, ox.shape[0] - GHOSTS):
        for j in range(GHOSTS, ox.shape[1] - GHOSTS):
            force_row(fx[k, j, a:b], fy[k, j, a:b], fz[k, j, a:b],
                      ox[k, j, a:b], oy[k, j, a:b], oz[k, j, a:b],
                      size[k, j, a - 1:b - 1], size[k, j, a + 1:b + 1],
                      size[k, j - 1, a:b], size[k, j + 1, a:b],
                      size[k - 1, j, a:b], size[k + 1, j, a:b], cx, cy, cz)


@kernel(FIELD, FIELD, REAL, INT)
def add_face_mean(q, force, strength, axis):
    """q += strength × the mean of the two cells of each face of one axis."""
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for k in range(GHOSTS - dk, q.shape[0] - GHOSTS):
        for j in range(GHOSTS - dj, q.shape[1] - GHOSTS):
            for i in range(GHOSTS - di, q.shape[2] - GHOSTS):
                q[k, j, i] += strength * 0.5 * (force[k, j, i] + force[k + dk, j + dj, i + di])
