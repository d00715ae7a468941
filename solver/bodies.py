"""The flow throws the pieces: rigid motion under drag and gravity.

Vertex n of a body, at x = position + R r_n, feels the force F_c w_n (u(x) - v - ω × R r_n) with
the weight w_n = (area around n) / (area of the body): relative to the flow, so a piece never
outruns it, and independent of how finely the surface is cut into triangles. Vertices outside the
box feel nothing (no still air there). Summed over vertices, the force and torque are linear in
(v, ω); one implicit Euler step of the 6 × 6 system

    [m + dt F_c W      dt F_c S^T ] [v_new]   [m v + dt (F_c Σ w u + m g)  ]
    [dt F_c S          I + dt F_c D] [ω_new] = [I ω + dt F_c Σ w (Rr × u)  ]

with W = Σw, S = Σ w [Rr]×, D = Σ w [Rr]×ᵀ[Rr]×, is stable for any dt. Then the body flies free
for dt: position += dt v, and the spin turns by the exact rotation about the mid-step angular
velocity Ω of Euler's equations, Π' = Π × I⁻¹Π, which keeps |Iω| and the energy to round-off.
(The printed model uses the absolute flow velocity, moves the body by the part of each force along
its lever arm only, and a wrong sign of the torque.)

All ranks hold all bodies; each sums over the vertices in its own cells, and the sums are added
once per step for all bodies.
"""

import numpy as np
from mpi4py import MPI

from partition.fragments import Fragments
from solver.grid import Grid
from solver.inertia import mass_properties
from solver.rigid import sum_over_vertices, throw
from solver.scene import Scene
from solver.state import State

SUMS = 16   # per body: Σw, Σw Rr (3), Σw r rᵀ (6), Σw u (3), Σw Rr × u (3)


class Bodies:
    """Positions, orientations (quaternions w, x, y, z), velocities and spins of all pieces."""

    def __init__(self, scene: Scene, state: State):
        self.take(state.fragments, scene)
        self.gravity = np.array(scene.fluid.gravity)
        self.sums = np.zeros((len(self.mass), SUMS))
        self.ranges = owned_box(state.grid)
        state.bodies = self

    def take(self, fragments: Fragments, scene: Scene) -> None:
        """Mass properties and initial motion of every piece."""
        count = fragments.count
        specs = [scene.body[b] for b in fragments.body]
        self.vertex_start = fragments.vertex_start.astype(np.int64)
        self.weight = np.empty(len(fragments.vertices))
        self.lever = np.empty((len(fragments.vertices), 3))
        self.mass, self.rest_centre = np.empty(count), np.empty((count, 3))
        self.inertia = np.empty((count, 3, 3))
        for n, spec in enumerate(specs):
            vertices, faces = fragments.piece(n)
            piece = mass_properties(vertices, faces, bool(fragments.closed[n]), spec.density,
                                    spec.areal_density)
            part = slice(self.vertex_start[n], self.vertex_start[n + 1])
            self.weight[part] = piece.vertex_area / piece.vertex_area.sum()
            self.lever[part] = vertices - piece.centre
            self.mass[n], self.rest_centre[n] = piece.mass, piece.centre
            self.inertia[n] = piece.inertia
        self.inverse_inertia = np.linalg.inv(self.inertia)
        self.force = np.array([spec.force for spec in specs], dtype=float)
        self.position = self.rest_centre.copy()
        self.orientation = np.tile([1.0, 0, 0, 0], (count, 1))
        self.spin = np.array([spec.spin for spec in specs], dtype=float).reshape(count, 3)
        arm = self.position - self._body_centres(fragments)
        self.velocity = np.array([spec.velocity for spec in specs], dtype=float).reshape(count, 3)
        self.velocity += np.cross(self.spin, arm)

    def _body_centres(self, fragments: Fragments) -> np.ndarray:
        """(n, 3) for each piece the mass centre of the whole body it belongs to."""
        bodies = fragments.body
        mass = np.bincount(bodies, self.mass)
        centres = [np.bincount(bodies, self.mass * self.rest_centre[:, a]) / mass for a in range(3)]
        return np.array(centres).T[bodies]

    def __call__(self, state: State, dt: float) -> None:
        """Advance all bodies by dt in the current flow."""
        self.sums.fill(0.0)
        sum_over_vertices(self.sums, self.vertex_start, self.lever, self.weight, self.position,
                          self.orientation, *state.velocity, self.ranges)
        if state.grid.comm.size > 1:
            state.grid.comm.Allreduce(MPI.IN_PLACE, self.sums)
        throw(self.sums, self.mass, self.inertia, self.inverse_inertia, self.force, self.gravity,
              dt, self.position, self.orientation, self.velocity, self.spin)


def owned_box(grid: Grid) -> np.ndarray:
    """(3, 5) per axis: spacing, start in cells, and low, high and closed end of what this rank
    samples, so that every point of the closed box belongs to exactly one rank."""
    rows = []
    for axis in range(3):
        start, count = grid.start[axis], grid.count[axis]
        rows.append([grid.spacing[axis], start, start, start + count,
                     float(grid.at_high_end(axis))])
    return np.array(rows)
