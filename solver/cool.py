"""Radiative cooling towards the ambient temperature, exactly, for any dt.

    dT/dt = -c_r sign(θ) θ⁴,   θ = (T - T_a) / (T_max - T_a)

The odd extension makes cold air warm up (the printed even power would drive it to -∞). The exact
solution over dt is θ_new = θ (1 + 3 c_r/(T_max - T_a) |θ|³ dt)^(-1/3): no step is too long. Half of
it is taken before the flow and half after, so that heating and cooling together are of second order
in dt (Strang, SIAM J. Numer. Anal. 5 (1968) 506).
"""

from solver.boundary import fill_temperature
from solver.kernel import FIELD, GHOSTS, REAL, kernel
from solver.scene import Scene
from solver.state import State


class Cool:
    """Cools T for half a step, before and after the flow."""

    def __init__(self, scene: Scene, _state: State):
        fluid = scene.fluid
        self.ambient = fluid.ambient_temperature
        self.range = fluid.max_temperature - fluid.ambient_temperature
        self.rate = fluid.cooling / self.range

    def __call__(self, state: State, dt: float) -> None:
        """Advance T by dt / 2."""
        cool(state.T, self.ambient, self.range, 1.5 * self.rate * dt)
        fill_temperature(state.grid, state.T, state.velocity, self.ambient)


@kernel(FIELD, REAL, REAL, REAL)
def cool(T, ambient, span, strength):
    """θ ← θ (1 + strength |θ|³)^(-1/3) in every cell of this rank."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            for i in range(GHOSTS, T.shape[2] - GHOSTS):
                theta = (T[k, j, i] - ambient) / span
                slower = 1 + strength * abs(theta) ** 3
                if slower > 1:   # where it is 1 to round-off the root, which takes long, is too
                    T[k, j, i] = ambient + span * theta * slower ** (-1 / 3)
