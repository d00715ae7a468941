"""The flow throws the pieces: rigid motion under drag and gravity.

Vertex n of a body, at x = position + R r_n, feels the force F_c w_n (u(x) - v - ω × R r_n) with
the weight w_n = (area around n) / (area of the body): relative to the flow, so a piece never
outruns it, and independent of how finely the surface is cut into triangles. Vertices outside the
box feel nothing (no still air there). Summed over vertices, the force and torque are linear in
(v, ω); one implicit Euler step of the 6 × 6 system

    [m + dt F_c W      dt F_c S^T ] [v_new]   [m v + dt (F_c Σ w u + m g)  ]
    [dt F_c S          I + dt F_c D] [ω_new] = [I ω + dt F_c Σ w (Rr × u)  ]

with W = Σw, S = Σ w [Rr]×, D = Σ w [Rr]×ᵀ[Rr]×, is stable for any dt. Then the body flies free
for dt: position += dt v (less ½ dt² g where nothing drags: a parabola), and the spin turns by the
exact rotation about the mid-step angular velocity Ω of Euler's equations, Π' = Π × I⁻¹Π, which
keeps |Iω| and the energy to round-off. A body that the flow deforms first is held until it breaks
(`deform`). The printed model uses the absolute flow velocity, as many shares of F_c as there are
vertices, the part of each force along its lever arm only, and an inertia of its own: `body.laws`
selects each of these; its wrong sign of the torque is not offered. Where the scene has obstacles,
the free flight ends in bounces, sliding and rest (`contact`).

All ranks hold all bodies; each sums over the vertices in its own cells, and the sums are added
once per step for all bodies.
"""

from typing import Any

import numpy as np
from mpi4py import MPI

from partition.fragments import Fragments
from solver.grid import Grid
from solver.inertia import (Array, MassProperties, mass_properties, shell_density,
                            smallest_edge_inertia)
from solver.rigid import throw
from solver.scene import Scene, SceneError
from solver.scene_body import Body
from solver.state import State
from solver.vertices import (ABSOLUTE, HELD, PARALLEL, SUMS, mean_temperature,
                             sum_over_vertices)


class Bodies:
    """Positions, orientations (quaternions w, x, y, z), velocities and spins of all pieces.

    vertices     (nv, 3) shape of every piece, in the place where it is at rest, L; it changes while
                 a body is deformed, and is then what `position` and `orientation` refer to
    rest_centre  (n, 3) mass centre there
    """

    def __init__(self, scene: Scene, state: State):
        fragments: Fragments = state.fragments
        count = fragments.count
        self.scene, self.grid, self.comm = scene, state.grid, state.grid.comm
        self.fragments = fragments
        self.specs = [scene.body[b] for b in fragments.body]
        self.vertices = fragments.vertices.copy()
        self.vertex_start = fragments.vertex_start.astype(np.int64)
        self.weight, self.area = np.empty(len(self.vertices)), np.empty(len(self.vertices))
        self.lever = np.empty((len(self.vertices), 3))
        self.mass, self.rest_centre = np.empty(count), np.empty((count, 3))
        self.inertia, self.inverse_inertia = np.empty((count, 3, 3)), np.empty((count, 3, 3))
        self.force = np.array([spec.force for spec in self.specs], dtype=float)
        self.law = np.array([law_flags(spec) for spec in self.specs], dtype=np.uint8)
        self.orientation = np.tile([1.0, 0, 0, 0], (count, 1))
        for n, areal_density in enumerate(self._areal_densities()):
            self._shape_piece(n, areal_density)
        self._start_moving()
        self.gravity = np.array(scene.fluid.gravity)
        self.sums = np.zeros((count, SUMS))
        self.ranges = owned_box(state.grid)
        state.bodies = self
        self.ground: Any = None
        if scene.obstacle:
            from solver.contact import Ground
            self.ground = Ground(scene.obstacle)
            self._refuse_sunken()
        self.deformation: Any = None
        if any(spec.deform_until is not None for spec in self.specs):
            from solver.deform import Deformation
            self.deformation = Deformation(self)

    def _areal_densities(self) -> list[float | None]:
        """Per piece: given, or so that the open pieces of a closed surface weigh what it holds."""
        corners = self.vertices[self.fragments.faces]
        body_of_face = self.fragments.body[self.fragments.piece_of_face]
        found: dict[int, float] = {}
        for n, b in enumerate(self.fragments.body):
            density = self.specs[n].density
            if density is not None and not self.fragments.closed[n] and b not in found:
                try:
                    found[b] = shell_density(corners[body_of_face == b], density)
                except ValueError as error:
                    raise self._refused(n, "density", density, f"{error}; fix: areal_density "
                                        "instead") from None
        return [found.get(b, self.specs[n].areal_density)
                for n, b in enumerate(self.fragments.body)]

    def _refused(self, piece: int, key: str, value: object, why: str) -> SceneError:
        return SceneError(f"{self.scene.path}: body.{self.specs[piece].name}.{key} = {value}: "
                          f"{why}")

    def _refuse_sunken(self) -> None:
        """A piece must start on the free side of every obstacle."""
        gap = self.ground.gaps(self.vertices)
        plane, vertex = np.unravel_index(gap.argmin(), gap.shape)
        size = np.ptp(self.vertices, axis=0).max()
        if gap[plane, vertex] < -1e-9 * size:
            piece = int(self.fragments.piece_of_vertex[vertex])
            raise self._refused(piece, "place", self.specs[piece].place,
                                f"it starts {-gap[plane, vertex]:.3g} behind obstacle.{plane}; "
                                "fix: move one of them")

    def _shape_piece(self, n: int, areal_density: float | None) -> None:
        """Mass and mass properties of piece n, at rest."""
        vertices, faces = self.fragments.piece(n)
        self._set_piece(n, mass_properties(vertices, faces, bool(self.fragments.closed[n]),
                                           self.specs[n].density, areal_density))

    def reshape_piece(self, n: int) -> None:
        """Mass properties of piece n, whose `vertices` have changed but not its mass."""
        vertices = self.vertices[self.vertex_start[n]:self.vertex_start[n + 1]]
        _, faces = self.fragments.piece(n)
        try:
            piece = mass_properties(vertices, faces, bool(self.fragments.closed[n]), 1.0, 1.0)
        except ValueError:   # squeezed flat: what is left of it is its surface
            piece = mass_properties(vertices, faces, False, None, 1.0)
        self._set_piece(n, piece.with_mass(float(self.mass[n])))

    def _set_piece(self, n: int, piece: MassProperties) -> None:
        """Centre, inertia, weights and lever arms."""
        laws, part = self.specs[n].laws, slice(self.vertex_start[n], self.vertex_start[n + 1])
        self.area[part] = piece.vertex_area
        self.weight[part] = (piece.vertex_area / piece.vertex_area.sum()
                             if laws.weights == "area" else 1.0)
        self.lever[part] = self.vertices[part] - piece.centre
        self.mass[n], self.rest_centre[n] = piece.mass, piece.centre
        self.inertia[n] = piece.inertia
        if laws.inertia == "smallest_edge":
            try:
                self.inertia[n] = smallest_edge_inertia(self.vertices[part], piece.mass)
            except ValueError as error:
                raise self._refused(n, "laws.inertia", "smallest_edge",
                                    f'{error}; fix: "exact"') from None
        self.inverse_inertia[n] = np.linalg.inv(self.inertia[n])

    def _start_moving(self) -> None:
        """All pieces of a body move as one at first: v = V + ω × (arm from its mass centre)."""
        bodies, count = self.fragments.body, self.fragments.count
        self.position = self.rest_centre.copy()
        self.spin = np.array([spec.spin for spec in self.specs], dtype=float).reshape(count, 3)
        mass = np.bincount(bodies, self.mass)
        centres = [np.bincount(bodies, self.mass * self.rest_centre[:, a]) / mass for a in range(3)]
        arm = self.position - np.array(centres).T[bodies]
        self.velocity = np.array([spec.velocity for spec in self.specs],
                                 dtype=float).reshape(count, 3)
        self.velocity += np.cross(self.spin, arm)

    def __call__(self, state: State, dt: float) -> None:
        """Advance all bodies by dt in the current flow."""
        if self.deformation is not None:
            self.deformation(state, dt)
        self.sums.fill(0.0)
        sum_over_vertices(self.sums, self.vertex_start, self.lever, self.weight, self.position,
                          self.orientation, self.law, *state.velocity, self.ranges)
        self.add_up(self.sums)
        motion = (self.sums, self.mass, self.inertia, self.inverse_inertia, self.force, self.law,
                  self.gravity, dt, self.position, self.orientation, self.velocity, self.spin)
        if self.ground is None:
            throw(*motion)
        else:
            self.ground.throw(*motion, self.vertex_start, self.lever)
        if self.deformation is not None:
            self.deformation.release()

    def add_up(self, sums: Array) -> None:
        """Add the sums of all ranks."""
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, sums)

    def temperature(self, state: State) -> Array:
        """(n,) mean over the vertices of each piece of the air's temperature there, K; ambient
        outside the box. Every rank must call it."""
        sums = np.zeros((len(self.mass), 2))
        mean_temperature(sums, self.vertex_start, self.lever, self.position, self.orientation,
                         state.T, self.ranges)
        self.add_up(sums)
        ambient = self.scene.fluid.ambient_temperature
        number = np.diff(self.vertex_start)
        mean: Array = (sums[:, 1] + (number - sums[:, 0]) * ambient) / number
        return mean


def law_flags(spec: Body) -> int:
    """What `rigid` is to do otherwise for this body."""
    laws = spec.laws
    return ((ABSOLUTE if laws.drag == "absolute" else 0)
            | (PARALLEL if laws.push == "parallel" else 0)
            | (HELD if spec.deform_until is not None else 0))


def owned_box(grid: Grid) -> Array:
    """(3, 6) per axis: spacing, start in cells, low, high and closed end of what this rank
    samples, so that every point of the closed box belongs to exactly one rank, and the number of
    cells after which a periodic axis repeats (0: it does not)."""
    rows = []
    for axis in range(3):
        start, count, periodic = grid.start[axis], grid.count[axis], grid.periodic[axis]
        rows.append([grid.spacing[axis], start, start, start + count,
                     float(grid.at_high_end(axis) and not periodic),
                     float(grid.cells[axis] if periodic else 0)])
    return np.array(rows)
