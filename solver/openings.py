"""What moves the velocity that stands on an open face: the half of its control volume in the box.

With U the velocity into the box on the face, U₁ the one a cell further in, V the velocities through
the four sides of the first cell across them, q_N the neighbours of U on the face,

    dU/dt = -F (U₁ - U) / h - 2 U⁺ U / h - Σ_sides (V - γ|V|) (q_N - U) / 2h + ∇²U / Re
    F = (U + U₁) / 2

The second term is what it costs to draw air in from rest. The volume is the one that the pressure
acts upon, whose ∇·u is φ and with which the first face inside exchanges: without sources advection
takes ½|U|³ per area from the energy wherever air passes an open face, in or out, with central
differences (γ = 0), and more with others (γ = 1). In a volume of full width, half outside, air that
flows in could feed itself. Of first order on the face, which leaves the flow of second.
"""

from solver.boundary import FACE, SIGN, box_sides, inward, side_name
from solver.grid import AXES, TURNS, Field
from solver.kernel import GHOSTS, INT, REAL, VIEW, kernel
from solver.shear import fourth
from solver.state import State


class Openings:
    """Makes the new normal velocity on the open faces of this rank."""

    def __init__(self, state: State, upwind: float):
        grid = state.grid
        self.upwind = upwind
        self.inverse_h = [1 / h for h in grid.spacing]
        self.faces = [[side for side in box_sides(grid, axis)
                       if grid.domain.face(side_name(axis, side)) == "open"] for axis in range(3)]

    def __call__(self, state: State, made: Field, start: Field, axis: int,
                 weights: tuple[float, float], dt: float, diffusion: Field) -> None:
        """made = a start + b (U + dt dU/dt) on the open faces of an axis. diffusion: D / h²."""
        along = [AXES.index(a) for a in TURNS[axis]]
        for side in self.faces[axis]:
            views = [inward(state.velocity[a], axis, side) for a in along]
            move_openings(inward(made, axis, side), inward(start, axis, side), *views, FACE[side],
                          SIGN[side], self.upwind, *weights, dt,
                          *(self.inverse_h[a] for a in along), *(diffusion[a] for a in along),
                          *((diffusion * state.viscosity.far)[a] for a in along[1:]))


@kernel(*[VIEW] * 5, INT, *[REAL] * 13)
def move_openings(made, start, u, v, w, face, inwards, upwind, old, new, dt,
                  ch, cb, cc, dh, db, dc, eb, ec):
    """The layer `face` of the normal velocity u; v and w run along its second and third index; of
    the fourth differences along it eb and ec are taken off."""
    for b in range(GHOSTS, u.shape[1] - GHOSTS):
        for c in range(GHOSTS, u.shape[2] - GHOSTS):
            here, inner = u[face, b, c], u[face + 1, b, c]
            south, north = u[face, b - 1, c] - here, u[face, b + 1, c] - here
            rear, front = u[face, b, c - 1] - here, u[face, b, c + 1] - here
            into_s, into_n = v[GHOSTS, b - 1, c], -v[GHOSTS, b, c]
            into_r, into_f = w[GHOSTS, b, c - 1], -w[GHOSTS, b, c]
            drawn = 2 * ch * max(inwards * here, 0.0)
            rate = (-0.5 * ch * inwards * (here + inner) * (inner - here)
                    - drawn / (1 + dt * drawn) * here
                    + 0.5 * cb * ((into_s + upwind * abs(into_s)) * south
                                  + (into_n + upwind * abs(into_n)) * north)
                    + 0.5 * cc * ((into_r + upwind * abs(into_r)) * rear
                                  + (into_f + upwind * abs(into_f)) * front)
                    + dh * (u[face - 1, b, c] - 2 * here + inner)
                    + db * (south + north) + dc * (rear + front)
                    - eb * fourth(u[face, b - 2, c], u[face, b - 1, c], here, u[face, b + 1, c],
                                  u[face, b + 2, c])
                    - ec * fourth(u[face, b, c - 2], u[face, b, c - 1], here, u[face, b, c + 1],
                                  u[face, b, c + 2]))
            made[face, b, c] = old * start[face, b, c] + new * (here + dt * rate)
