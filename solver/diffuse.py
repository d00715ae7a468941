"""Implicit viscosity: the part of ∇²u / Re that belongs to the new velocity, in steps that have it.

    (1 - μ dt ν∇²) u* = r - b dt ∇p + (shear at the walls),     then b dt ∇p is given back

r is what all stages before have predicted, p a guess of the pressure that the projection is about
to find: what it is off by, times dt, is how far air slips along the walls afterwards
(Kim & Moin, J. Comput. Phys. 59 (1985) 308). The pressure of the same substep of the step before,
plus its change, is off by O(dt²); so the slip is O(dt³), and the pressure of the frame, which sees
ν∇² of it, is of second order. Where a step is so long that viscosity stills the box within it, what
is guessed would be found, and so be kept for ever: what it differs by from the last pressure counts
by 1 / (1 + ν dt π² Σ 1/L²). In the first implicit step the guess is the pressure at its start.
Each component is solved for by transforms (`helmholtz`); whether a step is implicit is decided by
`diffusion`.
"""

import math

import numpy as np

from solver.boundary import close_walls
from solver.helmholtz import Helmholtz
from solver.kernel import FIELD, GHOSTS, REAL, kernel
from solver.plan import SUBSTEPS
from solver.scene import Scene
from solver.shear import mend_shear
from solver.state import State


class Diffuse:
    """Turns the predicted velocity into one that has been diffused for the substep."""

    def __init__(self, scene: Scene, state: State):
        self.inverse_h = [1 / h for h in state.grid.spacing]
        self.solvers: list[Helmholtz] = []
        self.guess = np.empty(state.grid.shape)   # like `pressures`, no memory until it is used
        self.stilling = sum((math.pi / size)**2 for size in state.grid.size) / scene.fluid.reynolds
        substeps = len(SUBSTEPS[scene.time.integrator])
        state.pressures = np.zeros((substeps + 1, *state.grid.shape))

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Solve for u_new, v_new, w_new."""
        viscosity, grid = state.viscosity, state.grid
        if not viscosity.implicit:
            return
        _, mu = viscosity.split(state.number, new)
        if not self.solvers:
            self.solvers = [Helmholtz(grid, axis, viscosity.far) for axis in range(3)]
        self._guess_pressure(state)
        push = [new * dt * c for c in self.inverse_h]
        add_gradient(*state.velocity_new, self.guess, *(-c for c in push))
        close_walls(grid, state.velocity_new)
        c = mu * dt * viscosity.rates
        mend_shear(grid, state.velocity_new, state.velocity, c, viscosity.far, implicit=True)
        for solver, field in zip(self.solvers, state.velocity_new, strict=True):
            solver(field, c)
        add_gradient(*state.velocity_new, self.guess, *push)

    def _guess_pressure(self, state: State) -> None:
        """What the projection of this substep will find; keeps what that of the last one found."""
        if state.number:
            np.copyto(state.pressures[state.number - 1], state.p)
        elif not state.implicit_steps:
            np.copyto(self.guess, state.p)
        if state.implicit_steps:
            *_, last, change = state.pressures
            np.subtract(state.pressures[state.number], last, out=self.guess)
            if state.implicit_steps > 1:
                self.guess += state.dt * change
            self.guess /= 1 + state.dt * self.stilling
            self.guess += last

    def keep(self, state: State) -> None:
        """At the end of the step: the last pressure, and its change since the step before."""
        if not state.viscosity.implicit:
            state.implicit_steps = 0
            return
        *_, last, change = state.pressures
        np.subtract(state.p, last, out=change)
        change /= state.dt
        np.copyto(last, state.p)
        state.implicit_steps += 1


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
