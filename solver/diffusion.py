"""Which part of a diffusion is explicit: a property of the scene, decided anew in every step.

Explicit diffusion needs dt ≤ ⅓ / (D Σ 1/h²); implicit diffusion needs none but a solve per value
and substep (`helmholtz`). Substep n of an implicit step takes κ dt D∇² of the values before it and
μ dt D∇² of those it makes (`plan.IMPLICIT`). fluid.diffusion = "auto" is implicit wherever dt
grows by more than the solves cost; in air at rest, where nothing else bounds dt, it is explicit.
Of fourth order ∇² is Σ (δ² - δ⁴ / 12) / h² along axes of at least four cells.
"""

import numpy as np

from solver.grid import Grid
from solver.plan import IMPLICIT, Weights
from solver.scene import Scene

LIMIT = 1 / 3   # of h² / D: ½ in the middle of the box, ⅜ of fourth order, 0.35 beside a wall
WORTH = 3.0     # a step with implicit diffusion costs at most as much as so many without


class Diffusion:
    """D∇² of one kind of value, of second or fourth order.

    rates   D / h² per axis
    far     how much of the fourth difference is taken off the second, per axis: 1/12 or 0
    """

    def __init__(self, scene: Scene, grid: Grid, diffusivity: float, order: int = 2,
                 weights: Weights = IMPLICIT):
        self.far = np.where(np.array(grid.cells) >= 4, (order - 2) / 24, 0.0)
        self.rates = diffusivity / np.array(grid.spacing)**2
        self.longest = LIMIT / float(self.rates.sum()) if diffusivity else np.inf
        self.choice = scene.fluid.diffusion
        self.implicit = False
        self.weights = weights.get(scene.time.integrator, ())
        self.possible = diffusivity > 0 and bool(self.weights) and scene.is_closed

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
