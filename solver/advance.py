"""Which scheme advances a field: the one place where `fluid.advection` becomes a kernel.

    q_new = a q_old + b (q + dt [-(u·∇)q + D ∇²q])

    "donor"    donor cell with the blend γ = fluid.donor_blend       order 1
    "central"  the same kernel with γ = 0                            order 2
    "central4" central differences twice as wide                     order 2, far smaller errors
    "tvd"      limited slopes                                        order 2, bounded
"""

import numpy as np

from solver.diffusion import Diffusion
from solver.grid import Field, Grid
from solver.state import State

RATES = {"donor": 1 / 4, "central": 1 / 4, "central4": 1 / 24, "tvd": 1 / 2}   # / h
STEPS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0))   # of u, v, w and of cell-centred values

NOTHING = np.zeros(3)


class Advance:
    """Advances values by advection and diffusion; the kernel it needs is compiled only then."""

    def __init__(self, grid: Grid, scheme: str, blend: float, bounded: bool):
        h = np.array(grid.spacing)
        self.blend = blend if scheme == "donor" else 0.0
        self.scheme = scheme
        self.bounded = int(bounded)
        self.rates = RATES[scheme] / h
        if scheme == "tvd":
            from solver.tvd import advance_tvd
            self.kernel = advance_tvd
            self.planes, self.rows = np.zeros((2, *grid.shape[1:])), np.zeros((3, grid.shape[2]))
        elif scheme == "central4":
            from solver.central import advance_central4
            self.kernel = advance_central4
            self.planes = np.zeros((4, *grid.shape[1:]))
            self.rows = np.zeros((6, grid.shape[2] + 2))
        else:
            from solver.donor import advance_donor
            self.kernel = advance_donor

    def __call__(self, state: State, new_values: Field, start: Field, values: Field, axis: int,
                 weights: tuple[float, float], dt: float, diffusion: Field,
                 viscosity: Diffusion | None = None) -> None:
        """`axis` 0, 1, 2: values on the faces of that axis; 3: in cells. diffusion: D / h² of what
        is explicit of it; viscosity: all of a velocity's."""
        if self.scheme == "tvd":
            self.kernel(new_values, start, values, *state.velocity, self.planes, self.rows,
                        self.bounded, *STEPS[axis], *weights, dt, *self.rates, *diffusion)
        elif self.scheme == "central4":
            far, most = (NOTHING, NOTHING) if viscosity is None else (
                viscosity.far * diffusion, viscosity.rates)
            self.kernel(new_values, start, values, *state.velocity, self.planes, self.rows,
                        *STEPS[axis], *weights, dt, *self.rates, *(diffusion + 3 * far), *far,
                        *most)
        else:
            self.kernel(new_values, start, values, *state.velocity, *STEPS[axis], *weights, dt,
                        self.blend, *self.rates, *diffusion)
