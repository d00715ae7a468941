"""Hot air rises: du/dt = -β (T - T_a) g on the faces (Boussinesq; not in the thesis).

The temperature of a face is the mean of its two cells. Uniform gravity itself is left to the
hydrostatic pressure.
"""

from solver.kernel import FIELD, GHOSTS, INT, REAL, kernel
from solver.scene import Scene
from solver.state import State


class Buoyancy:
    """Adds the lift to the predicted velocity."""

    def __init__(self, scene: Scene, _state: State):
        fluid = scene.fluid
        self.ambient = fluid.ambient_temperature
        self.lift = [-fluid.buoyancy * g for g in fluid.gravity]

    def __call__(self, state: State, _old: float, new: float, dt: float) -> None:
        """Add new × dt × lift."""
        for axis, (field, lift) in enumerate(zip(state.velocity_new, self.lift, strict=True)):
            if lift:
                add_lift(field, state.T, self.ambient, new * dt * lift, axis)


@kernel(FIELD, FIELD, REAL, REAL, INT)
def add_lift(q, T, ambient, strength, axis):
    """q += strength (T_face - ambient) on the faces of one axis."""
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for k in range(GHOSTS - dk, q.shape[0] - GHOSTS):
        for j in range(GHOSTS - dj, q.shape[1] - GHOSTS):
            for i in range(GHOSTS - di, q.shape[2] - GHOSTS):
                face = 0.5 * (T[k, j, i] + T[k + dk, j + dj, i + di])
                q[k, j, i] += strength * (face - ambient)
