"""Implicit viscosity: the part of ∇²u / Re that belongs to the new velocity, in steps that have it.

    (1 - μ dt ν∇²) u* = r - b dt ∇p + (shear at the walls),     then b dt ∇p is given back

r is what all stages before have predicted, p the pressure at the start of the step: with it u* has
the tangential velocity of the walls to O(dt²) after the projection too, instead of O(dt)
(Kim & Moin, J. Comput. Phys. 59 (1985) 308). It is the same in all substeps: their own pressures
differ by O(dt), which would show in the pressure of the frame. Each component is solved for by
transforms (`helmholtz`); whether a step is implicit is decided by `diffusion`. Order 2 in time with
rk3, 1 with euler; damps the stiffest modes for any dt.
"""

import numpy as np

from solver.boundary import add_wall_shear, close_walls
from solver.helmholtz import Helmholtz
from solver.kernel import FIELD, GHOSTS, REAL, kernel
from solver.scene import Scene
from solver.state import State


class Diffuse:
    """Turns the predicted velocity into one that has been diffused for the substep."""

    def __init__(self, _scene: Scene, state: State):
        self.inverse_h = [1 / h for h in state.grid.spacing]
        self.solvers: list[Helmholtz] = []
        self.p = state.grid.field()

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Solve for u_new, v_new, w_new."""
        viscosity, grid = state.viscosity, state.grid
        if not viscosity.implicit:
            return
        _, mu = viscosity.split(state.number, new)
        if not self.solvers:
            self.solvers = [Helmholtz(grid, axis) for axis in range(3)]
        if state.number == 0:
            np.copyto(self.p, state.p)
        push = [new * dt * c for c in self.inverse_h]
        add_gradient(*state.velocity_new, self.p, *(-c for c in push))
        close_walls(grid, state.velocity_new)
        c = mu * dt * viscosity.rates
        add_wall_shear(grid, state.velocity_new, state.velocity, (0.0,) * 3, c)
        for solver, field in zip(self.solvers, state.velocity_new, strict=True):
            solver(field, c)
        add_gradient(*state.velocity_new, self.p, *push)


@kernel(*[FIELD] * 4, REAL, REAL, REAL)
def add_gradient(u, v, w, p, cx, cy, cz):
    """u += c ∇p on the right, top and front faces of this rank's cells."""
    for k in range(GHOSTS, p.shape[0] - GHOSTS):
        for j in range(GHOSTS, p.shape[1] - GHOSTS):
            for i in range(GHOSTS, p.shape[2] - GHOSTS):
                c = p[k, j, i]
                u[k, j, i] += cx * (p[k, j, i + 1] - c)
                v[k, j, i] += cy * (p[k, j + 1, i] - c)
                w[k, j, i] += cz * (p[k + 1, j, i] - c)
