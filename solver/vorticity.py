"""Vorticity confinement: gives back the small eddies that the donor cell wears away.

    du/dt = ε h (N × ω),   N = ∇|ω| / |∇|ω||,   ω = ∇ × u        (h: mean cell edge)

ω and the force stand at cell centres; a face takes the mean of its two cells.
Source: Steinhoff & Underhill, Phys. Fluids 6 (1994) 2738; Fedkiw, Stam & Jensen, SIGGRAPH 2001.
"""

import numpy as np

from solver.boundary import fill_scalar
from solver.kernel import FIELD, GHOSTS, INT, REAL, kernel
from solver.scene import Scene
from solver.state import State


class Vorticity:
    """Adds the confinement force to the predicted velocity."""

    def __init__(self, scene: Scene, state: State):
        self.spacing = state.grid.spacing
        self.strength = scene.fluid.vorticity_confinement * float(np.mean(self.spacing))
        self.omega = [state.grid.field() for _ in range(3)]
        self.size = state.grid.field()
        self.force = [state.grid.field() for _ in range(3)]

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Add new × dt × force."""
        vorticity(*state.velocity, *self.omega, self.size, *self.spacing)
        fill_scalar(state.grid, self.size)
        confinement(*self.omega, self.size, *self.force, *self.spacing)
        for axis, (field, force) in enumerate(zip(state.velocity_new, self.force, strict=True)):
            fill_scalar(state.grid, force)
            add_face_mean(field, force, new * dt * self.strength, axis)


@kernel(*[FIELD] * 7, REAL, REAL, REAL)
def vorticity(u, v, w, ox, oy, oz, size, hx, hy, hz):
    """ω and |ω| at cell centres, from central differences of the velocities of the cells."""
    for k in range(GHOSTS, u.shape[0] - GHOSTS):
        for j in range(GHOSTS, u.shape[1] - GHOSTS):
            for i in range(GHOSTS, u.shape[2] - GHOSTS):
                wy = (w[k, j + 1, i] + w[k - 1, j + 1, i] - w[k, j - 1, i] - w[k - 1, j - 1, i])
                vz = (v[k + 1, j, i] + v[k + 1, j - 1, i] - v[k - 1, j, i] - v[k - 1, j - 1, i])
                uz = (u[k + 1, j, i] + u[k + 1, j, i - 1] - u[k - 1, j, i] - u[k - 1, j, i - 1])
                wx = (w[k, j, i + 1] + w[k - 1, j, i + 1] - w[k, j, i - 1] - w[k - 1, j, i - 1])
                vx = (v[k, j, i + 1] + v[k, j - 1, i + 1] - v[k, j, i - 1] - v[k, j - 1, i - 1])
                uy = (u[k, j + 1, i] + u[k, j + 1, i - 1] - u[k, j - 1, i] - u[k, j - 1, i - 1])
                a = 0.25 * (wy / hy - vz / hz)
                b = 0.25 * (uz / hz - wx / hx)
                c = 0.25 * (vx / hx - uy / hy)
                ox[k, j, i], oy[k, j, i], oz[k, j, i] = a, b, c
                size[k, j, i] = np.sqrt(a * a + b * b + c * c)


@kernel(*[FIELD] * 7, REAL, REAL, REAL)
def confinement(ox, oy, oz, size, fx, fy, fz, hx, hy, hz):
    """N × ω at cell centres."""
    for k in range(GHOSTS, ox.shape[0] - GHOSTS):
        for j in range(GHOSTS, ox.shape[1] - GHOSTS):
            for i in range(GHOSTS, ox.shape[2] - GHOSTS):
                gx = (size[k, j, i + 1] - size[k, j, i - 1]) / hx
                gy = (size[k, j + 1, i] - size[k, j - 1, i]) / hy
                gz = (size[k + 1, j, i] - size[k - 1, j, i]) / hz
                length = np.sqrt(gx * gx + gy * gy + gz * gz)
                scale = 1 / length if length > 1e-30 else 0.0
                a, b, c = ox[k, j, i], oy[k, j, i], oz[k, j, i]
                fx[k, j, i] = scale * (gy * c - gz * b)
                fy[k, j, i] = scale * (gz * a - gx * c)
                fz[k, j, i] = scale * (gx * b - gy * a)


@kernel(FIELD, FIELD, REAL, INT)
def add_face_mean(q, force, strength, axis):
    """q += strength × the mean of the two cells of each face of one axis."""
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for k in range(GHOSTS - dk, q.shape[0] - GHOSTS):
        for j in range(GHOSTS - dj, q.shape[1] - GHOSTS):
            for i in range(GHOSTS - di, q.shape[2] - GHOSTS):
                q[k, j, i] += strength * 0.5 * (force[k, j, i] + force[k + dk, j + dj, i + di])
