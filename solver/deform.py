"""Before it breaks, a body may be soft: the flow carries its vertices and swells or dents it.

    x_new = x + dt u(x + ½ dt u(x))                                    the midpoint rule, as tracers

until the given time, or until a vertex has moved by the given displacement. The exact flow never
turns a surface inside out, but the triangles that stand for it may flip: where the normal of a
triangle would turn over or its area collapse within a step, its corners move by their common mean
instead. Where that does not help any more, or a vertex has left the box, the body breaks early.

At the break each piece keeps the mass that it had at rest; its centre, inertia and areas are those
of the shape it has now, and it starts with the momentum of its surface: the velocity and spin of
the rigid motion nearest to that of its vertices, weighted by area.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.interpolate import velocity_at
from solver.kernel import FIELD, INT, REAL, kernel
from solver.scene import SceneError
from solver.state import State
from solver.vertices import HELD, ROWS, in_box, owns

if TYPE_CHECKING:
    from solver.bodies import Bodies

ROUNDS = 20          # of the guard
FLIPPED = 0.1        # the least new normal · old normal / old normal² (normals as long as areas)
MOVE, SEEN = slice(0, 3), 3


class Deformation:
    """The soft bodies of a scene, until the last of them has broken."""

    def __init__(self, bodies: "Bodies"):
        self.bodies = bodies
        self.soft = [Soft(bodies, b) for b in np.unique(bodies.fragments.body)
                     if bodies.scene.body[b].deform_until is not None]
        self.breaking: list[Soft] = []

    def __call__(self, state: State, dt: float) -> None:
        """Deform the soft bodies by dt; those that have had enough break at the step's end."""
        for body in self.soft:
            if body.carry(state, dt, self.bodies):
                self.breaking.append(body)
            body.show(self.bodies)

    def release(self) -> None:
        """Hand over the pieces of the bodies that have broken in this step."""
        for body in self.breaking:
            self.soft.remove(body)
            body.break_up(self.bodies)
        self.breaking.clear()


class Soft:
    """One soft body, all its pieces together; coincident vertices of its pieces are one point."""

    def __init__(self, bodies: "Bodies", index: int):
        fragments = bodies.fragments
        until = bodies.scene.body[index].deform_until
        assert until is not None
        self.time, self.displacement = until.time, until.displacement
        self.pieces = np.flatnonzero(fragments.body == index)
        self.vertices = np.flatnonzero(np.isin(fragments.piece_of_vertex, self.pieces))
        self.points, point_of = np.unique(fragments.vertices[self.vertices], axis=0,
                                          return_inverse=True)
        self.point_of: NDArray[np.int64] = point_of.reshape(-1)
        number = np.full(len(fragments.vertices), -1, np.int64)
        number[self.vertices] = self.point_of
        mine = np.isin(fragments.piece_of_face, self.pieces)
        self.faces: NDArray[np.int64] = number[fragments.faces[mine]]
        self.rest = self.points.copy()
        grid = bodies.grid
        outside = ((self.points < 0) | (self.points > grid.size)) & ~np.array(grid.periodic)
        if outside.any():
            name = bodies.scene.body[index].name
            raise SceneError(f"{bodies.scene.path}: body.{name}.deform_until: "
                             f"{outside.any(axis=1).sum()} of its vertices are outside the box, "
                             "where no flow is known; fix: another place or scale")
        self.moved = np.zeros((len(self.points), 4))
        self.dt = 0.0

    def carry(self, state: State, dt: float, bodies: "Bodies") -> bool:
        """Move the points with the flow; returns whether the body is to break now."""
        self.moved.fill(0.0)
        drift(self.points, self.moved, *state.velocity, bodies.ranges, dt)
        bodies.add_up(self.moved)
        left = bool(self.moved[:, SEEN].min() == 0)
        flips = untangle(self.points, self.moved, self.faces)
        self.dt = dt
        if flips == 0:
            self.points += self.moved[:, MOVE]
        if bodies.ground is not None:
            bodies.ground.keep_out(self.points)
        furthest = np.linalg.norm(self.points - self.rest, axis=1).max()
        over = state.time + dt >= self.time * (1 - 1e-12)
        return left or flips > 0 or over or bool(furthest >= self.displacement)

    def show(self, bodies: "Bodies") -> None:
        """Write the shape to the bodies; the pieces stand where their vertices are."""
        bodies.vertices[self.vertices] = self.points[self.point_of]
        for n in self.pieces:
            part = slice(bodies.vertex_start[n], bodies.vertex_start[n + 1])
            bodies.position[n] = bodies.rest_centre[n] = bodies.vertices[part].mean(axis=0)
            bodies.lever[part] = bodies.vertices[part] - bodies.position[n]

    def break_up(self, bodies: "Bodies") -> None:
        """Make rigid pieces of the shape that it has now."""
        velocity = np.zeros((len(bodies.vertices), 3))
        velocity[self.vertices] = self.moved[self.point_of, MOVE] / self.dt
        for n in self.pieces:
            part = slice(bodies.vertex_start[n], bodies.vertex_start[n + 1])
            bodies.reshape_piece(n)
            bodies.position[n] = bodies.rest_centre[n]
            bodies.velocity[n], bodies.spin[n] = nearest_rigid_motion(
                bodies.lever[part], bodies.area[part], velocity[part])
            bodies.law[n] &= ~np.uint8(HELD)


def nearest_rigid_motion(arm: NDArray[np.float64], area: NDArray[np.float64],
                         velocity: NDArray[np.float64]) -> tuple[NDArray[np.float64],
                                                                 NDArray[np.float64]]:
    """(v, ω) with the least Σ A |v + ω × arm - velocity|²; ω = 0 about an axis without extent."""
    share = area / area.sum()
    centre = share @ arm
    arm = arm - centre
    mean = share @ velocity
    spread = np.einsum("n,ni,nj->ij", share, arm, arm)
    moment = share @ np.cross(arm, velocity)
    spin = np.linalg.pinv(np.trace(spread) * np.eye(3) - spread, hermitian=True) @ moment
    return mean - np.cross(spin, centre), spin


@kernel(ROWS, ROWS, FIELD, FIELD, FIELD, ROWS, REAL)
def drift(points, moved, u, v, w, box, dt):
    """Displacement of this rank's points in dt, and 1 to say that it is known."""
    for n in range(len(points)):
        X = in_box(points[n, 0], box[0])
        Y = in_box(points[n, 1], box[1])
        Z = in_box(points[n, 2], box[2])
        if owns(X, box[0]) and owns(Y, box[1]) and owns(Z, box[2]):
            X, Y, Z = X - box[0, 1], Y - box[1, 1], Z - box[2, 1]
            a, b, c = velocity_at(u, v, w, X, Y, Z)
            half = 0.5 * dt
            a, b, c = velocity_at(u, v, w, X + half * a / box[0, 0], Y + half * b / box[1, 0],
                                  Z + half * c / box[2, 0])
            moved[n, 0], moved[n, 1], moved[n, 2], moved[n, SEEN] = dt * a, dt * b, dt * c, 1.0


@kernel(ROWS, ROWS, INT[:, ::1], result=INT)
def untangle(points, moved, faces):
    """Even out the moves of the corners of triangles that would flip; returns how many still do."""
    flips = 0
    for _ in range(ROUNDS):
        flips = 0
        for n in range(len(faces)):
            i, j, k = faces[n]
            dot = square = 0.0
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                p, q = points[j, b] - points[i, b], points[k, c] - points[i, c]
                r, s = points[j, c] - points[i, c], points[k, b] - points[i, b]
                old = p * q - r * s
                p += moved[j, b] - moved[i, b]
                q += moved[k, c] - moved[i, c]
                r += moved[j, c] - moved[i, c]
                s += moved[k, b] - moved[i, b]
                dot += old * (p * q - r * s)
                square += old * old
            if dot < FLIPPED * square:
                flips += 1
                for a in range(3):
                    mean = (moved[i, a] + moved[j, a] + moved[k, a]) / 3
                    moved[i, a] = moved[j, a] = moved[k, a] = mean
        if flips == 0:
            break
    return flips
