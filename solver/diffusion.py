"""Which part of a diffusion is explicit: a property of the scene, decided anew in every step.

Explicit diffusion needs dt ≤ ⅜ / (D Σ 1/h²); implicit diffusion needs none but a solve per value
and substep (`helmholtz`). Substep n of an implicit step takes κ dt D∇² of the values before it and
μ dt D∇² of those it makes (`plan.IMPLICIT`). fluid.diffusion = "auto" is implicit wherever dt
grows by more than the solves cost; in air at rest, where nothing else bounds dt, it is explicit.
"""

import numpy as np

from solver.grid import Grid
from solver.plan import IMPLICIT
from solver.scene import Scene

LIMIT = 0.375   # of h² / D: ½ in the middle of the box, ¾ of it beside a no-slip wall
WORTH = 3.0     # a step with implicit diffusion costs at most as much as so many without


class Diffusion:
    """D∇² of one kind of value; `rates` are D / h² per axis."""

    def __init__(self, scene: Scene, grid: Grid, diffusivity: float):
        self.rates = diffusivity / np.array(grid.spacing)**2
        self.longest = LIMIT / float(self.rates.sum()) if diffusivity else np.inf
        self.choice = scene.fluid.diffusion
        self.implicit = False
        self.possible = (diffusivity > 0 and scene.time.integrator in IMPLICIT
                         and scene.is_closed)
        self.weights = IMPLICIT.get(scene.time.integrator, ())

    def limit(self, otherwise: float) -> float:
        """Decide for a step that the flow would let be `otherwise` long (0: it is at rest); returns
        what is left of the limit."""
        self.implicit = self.possible and (self.choice == "implicit" or (
            self.choice == "auto" and otherwise > WORTH * self.longest))
        return np.inf if self.implicit else self.longest

    def split(self, substep: int, new: float) -> tuple[float, float]:
        """(κ, μ) of a substep whose weight of the rates is `new`, without its dt."""
        if not self.implicit:
            return new, 0.0
        kappa, mu = self.weights[substep]
        return kappa, mu
