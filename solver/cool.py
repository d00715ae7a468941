"""Radiative cooling towards the ambient temperature, exactly, for any dt.

    dT/dt = -c_r sign(θ) θ⁴,   θ = (T - T_a) / (T_max - T_a)

The odd extension makes cold air warm up (the printed even power would drive it to -∞). The exact
solution over dt is θ_new = θ (1 + 3 c_r/(T_max - T_a) |θ|³ dt)^(-1/3): no step is too long. Half of
it is taken before the flow and half after, so that heating and cooling together are of second order
in dt (Strang, SIAM J. Numer. Anal. 5 (1968) 506).
"""

from solver.boundary import fill_temperature
from solver.kernel import FIELD, GHOSTS, REAL, kernel, part_of_sweep, sweep
from solver.scene import Scene
from solver.state import State

LITTLE = 0.5   # of x - 1: up to here three Newton steps reach round-off


class Cool:
    """Cools T for half a step, before and after the flow."""

    def __init__(self, scene: Scene, _state: State):
        fluid = scene.fluid
        self.ambient = fluid.ambient_temperature
        self.range = fluid.max_temperature - fluid.ambient_temperature
        self.rate = fluid.cooling / self.range

    def __call__(self, state: State, dt: float) -> None:
        """Advance T by dt / 2."""
        strength = 1.5 * self.rate * dt
        theta = max(state.T.max() - self.ambient, self.ambient - state.T.min()) / self.range
        # Each rank asks for its own cells: both answer alike, to round-off.
        advance = cool_a_little if strength * theta**3 <= LITTLE else cool
        advance(state.T, self.ambient, self.range, strength)
        fill_temperature(state.grid, state.T, state.velocity, self.ambient)


@kernel(FIELD, REAL, REAL, REAL)
def cool(T, ambient, span, strength):
    """θ ← θ x^(-1/3), x = 1 + strength |θ|³, in every cell of this rank."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            for i in range(GHOSTS, T.shape[2] - GHOSTS):
                above = T[k, j, i] - ambient
                slower = 1 + strength * abs(above / span)**3
                T[k, j, i] += above * (slower ** (-1 / 3) - 1)


@part_of_sweep
def cool_row(T, ambient, per_span, strength):
    """A row of `cool_a_little`."""
    for i in range(T.size):
        above = T[i] - ambient
        theta = abs(above) * per_span
        x = 1 + strength * theta * theta * theta
        y = (2 + x) / (1 + 2 * x)
        y *= (4 - x * y * y * y) * (1 / 3)
        y *= (4 - x * y * y * y) * (1 / 3)
        y *= (4 - x * y * y * y) * (1 / 3)
        T[i] += above * (y - 1)


@sweep(FIELD, REAL, REAL, REAL)
def cool_a_little(T, ambient, span, strength):
    """`cool` for x - 1 ≤ LITTLE everywhere, several cells at a time: the root by Newton's method,
    y ← y (4 - x y³) / 3, from the Padé approximant (2 + x) / (1 + 2 x), which is off by a relative
    0.0016 at most."""
    for k in range(GHOSTS, T.shape[0] - GHOSTS):
        for j in range(GHOSTS, T.shape[1] - GHOSTS):
            cool_row(T[k, j, GHOSTS:T.shape[2] - GHOSTS], ambient, 1 / span, strength)
