"""Temperature: carried by the flow, heated by the fire, conducted.

    T_new = a T_old + b (T + dt [-(u·∇)T + c_k ∇²T + H])

Advective form, as for momentum: with the conservative form the gas of the fire would enter at
T = 0 and put it out. The control volume is the cell; the schemes are those of `advance`. With the
bounded one, T leaves the range of its neighbours only by H.
"""

from solver.advance import Advance
from solver.boundary import fill_temperature
from solver.grid import Field
from solver.kernel import FIELD, GHOSTS, REAL, kernel
from solver.scene import Scene
from solver.state import State

CELLS = 3


class Temperature:
    """Predicts T of a substep from advection, conduction and the heat of the fire."""

    def __init__(self, scene: Scene, state: State):
        fluid = scene.fluid
        self.ambient = fluid.ambient_temperature
        self.advance = Advance(state.grid, fluid.temperature_advection, fluid.donor_blend,
                               fluid.conductivity, bounded=True)

    def limit(self, _state: State) -> tuple[float, str]:
        """Explicit diffusion: dt ≤ ⅜ / (c_k Σ 1/h²)."""
        return self.advance.diffusion_limit, "conduction"

    def __call__(self, state: State, old: float, new: float, dt: float) -> None:
        """(a, b) = (old, new) are the integrator's weights of the substep."""
        start: Field = state.T_old if old else state.T
        self.advance(state, state.T_new, start, state.T, CELLS, (old, new), dt)
        if state.heat is not None:
            add_heat(state.T_new, state.heat, new * dt)
        state.accept("T")
        fill_temperature(state.grid, state.T, state.velocity, self.ambient)


@kernel(FIELD, FIELD, REAL)
def add_heat(T, heat, dt):
    """T += dt H in every cell of this rank."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            for i in range(GHOSTS, T.shape[2] - GHOSTS):
                T[k, j, i] += dt * heat[k, j, i]
