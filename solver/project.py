"""Projection: the pressure that makes ∇·u = φ.

    -∇²p = (φ - ∇·u*) / dt,   u = u* - dt ∇p            (Chorin 1968)

with the discrete divergence and gradient of the staggered grid, whose product is the 7-point
Laplacian of `pressure`: after it ∇·u = φ to the tolerance of the solve. That p belongs to the
middle of the substep and is first order in time; the p of a frame is made of the velocity there,

    -∇²p = ∂φ/∂t - ∇·R(u),

by predicting once more from there: it is as accurate as u.
"""

import numba

from solver.boundary import close_walls, fill_velocity
from solver.kernel import FIELD, GHOSTS, INT, REAL, kernel
from solver.pressure import PressureSolver
from solver.scene import Scene
from solver.state import VELOCITY, State


class Project:
    """Turns the predicted velocity into the velocity of the substep."""

    def __init__(self, _scene: Scene, state: State):
        self.solver = PressureSolver(state.grid)
        self.inverse_h = [1 / h for h in state.grid.spacing]

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Project u_new, v_new, w_new over new × dt and make them current."""
        state.iterations += self.find_pressure(state, new * dt)
        subtract_gradient(*state.velocity_new, state.p, *(new * dt * c for c in self.inverse_h))
        for name in VELOCITY:
            state.accept(name)
        fill_velocity(state.grid, state.velocity)

    def find_pressure(self, state: State, dt: float) -> int:
        """p that gives u_new, v_new, w_new the divergence φ within dt; returns the iterations."""
        grid = state.grid
        close_walls(grid, state.velocity_new)
        grid.share_faces(state.velocity_new)
        source = state.u_new if state.phi is None else state.phi
        total, square = divergence_defect(*state.velocity_new, source, int(state.phi is not None),
                                          self.solver.b, 1 / dt, *self.inverse_h)
        return self.solver.solve(state.p, total, square)

    def destroy(self) -> None:
        """Free PETSc's objects."""
        self.solver.destroy()


@kernel(FIELD, FIELD, FIELD, FIELD, INT, FIELD, REAL, REAL, REAL, REAL,
        result=numba.types.UniTuple(REAL, 2))
def divergence_defect(u, v, w, phi, has_phi, b, per_time, cx, cy, cz):
    """b = (φ - ∇·u) / dt in every cell of this rank (b has no ghosts); returns Σb and Σb²."""
    cx, cy, cz = cx * per_time, cy * per_time, cz * per_time
    total = square = 0.0
    for k in range(b.shape[0]):
        for j in range(b.shape[1]):
            K, J = k + GHOSTS, j + GHOSTS
            for i in range(b.shape[2]):
                I = i + GHOSTS  # noqa: E741
                b[k, j, i] = (cx * (u[K, J, I - 1] - u[K, J, I])
                              + cy * (v[K, J - 1, I] - v[K, J, I])
                              + cz * (w[K - 1, J, I] - w[K, J, I]))
            if has_phi:
                for i in range(b.shape[2]):
                    b[k, j, i] += per_time * phi[K, J, i + GHOSTS]
            for i in range(b.shape[2]):
                total += b[k, j, i]
                square += b[k, j, i] ** 2
    return total, square


@kernel(*[FIELD] * 4, REAL, REAL, REAL)
def subtract_gradient(u, v, w, p, cx, cy, cz):
    """u -= c ∇p on all faces of this rank's cells, the low ones too."""
    low = GHOSTS - 1
    for k in range(low, p.shape[0] - GHOSTS):
        for j in range(low, p.shape[1] - GHOSTS):
            for i in range(low, p.shape[2] - GHOSTS):
                c = p[k, j, i]
                u[k, j, i] -= cx * (p[k, j, i + 1] - c)
                v[k, j, i] -= cy * (p[k, j + 1, i] - c)
                w[k, j, i] -= cz * (p[k + 1, j, i] - c)
