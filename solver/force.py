"""A force per mass on the flow that the scene prescribes: du/dt = f(x, y, z, t) on the faces.

A substep takes it at the time at which it starts, like its other terms. (Uniform gravity is left to
the hydrostatic pressure: with p = 0 on open faces it would make all the air fall.)
"""

from solver.grid import INNER
from solver.kernel import GHOSTS
from solver.scene import Scene
from solver.state import State, evaluate


class Force:
    """Adds the body force to the predicted velocity."""

    def __init__(self, scene: Scene, state: State):
        self.formulas = scene.fluid.force
        self.values = state.grid.field()

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Add new × dt × f, on the low faces of this rank's cells too."""
        for axis, (field, formula) in enumerate(zip(state.velocity_new, self.formulas,
                                                    strict=True)):
            if formula == "0":
                continue
            evaluate(state.grid, formula, self.values, axis, state.substep[0])
            region = list(INNER)
            region[2 - axis] = slice(GHOSTS - 1, -GHOSTS)
            part = tuple(region)
            field[part] += new * dt * self.values[part]
