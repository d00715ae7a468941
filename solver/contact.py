"""Pieces meet fixed planes: they bounce, slide to a stop and lie still.

A plane keeps the vertices x of every rigid piece where gap = n·x - d ≥ 0. What happens in a step
of a piece that comes near one, after its drag:

    flight    until its first vertex touches, found by bisection; nothing is lost on the way
    impact    impulses p at the touching vertices, at once: each leaves with the normal speed
              e |u_n| (restitution e) and rubs with |p_t| ≤ μ p_n against its sliding (Coulomb)
    contact   once a vertex leaves slower than gravity would bring it back within the step, e = 0:
              the impulses of all the time that is left hold u_n ≥ -gap / time, and the piece moves
              by the mean of its velocities before and after. Static to 0.1 % of its weight is
              static: such a piece stands still exactly.

The impulses of a piece solve  u_n ≥ target, p_n ≥ 0, one of them equal, |p_t| ≤ μ p_n  by
Gauss-Seidel sweeps over at most nine vertices per plane, the lowest and the outermost. The change
of energy in contact is Σ p·(u before + u after)/2, so rubbing only takes; where impulses with e
would add energy (they can, with friction) e is 0; what is left of a corner below its plane is
pushed out, and paid for with speed. The flow does not know the planes, nor do pieces meet each
other. Every rank does the same for every piece, so the number of ranks changes nothing.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.impulses import (FRICTION, OFFSET, PER_PLANE, RESTITUTION, centre_gap, find_contacts,
                             least_gap, motion_energy, normal_speed, resolve)
from solver.kernel import REAL, inlined, kernel
from solver.rigid import TENSORS, fly, push, rotate_freely, world_inertia
from solver.scene_body import Obstacle
from solver.vertices import FLAGS, HELD, INTS, LIST, ROWS

ROUNDING = 1e-10
IMPACTS = 8                    # in one step; then it is contact
BISECTIONS = 40
TOUCHING = 1e-6                # a gap below this share of the piece's radius
STILL = 1e-3                   # of the speed that gravity gives in a step

Array = NDArray[np.float64]


class Ground:
    """The obstacles of a scene.

    planes   (n, 6) unit normal, its distance from the origin, friction and restitution of each
    """

    def __init__(self, obstacles: tuple[Obstacle, ...]):
        self.planes = np.zeros((len(obstacles), 6))
        for row, plane in zip(self.planes, obstacles, strict=True):
            row[:OFFSET] = np.array(plane.normal) / np.linalg.norm(plane.normal)
            row[OFFSET] = row[:OFFSET] @ plane.place
            row[FRICTION], row[RESTITUTION] = plane.friction, plane.restitution

    def gaps(self, points: Array) -> Array:
        """(planes, points) distance of points (n, 3) from the planes, L; negative: behind."""
        gap: Array = self.planes[:, :OFFSET] @ points.T - self.planes[:, OFFSET, None]
        return gap

    def keep_out(self, points: Array) -> None:
        """Move points (n, 3) that are behind a plane back onto it."""
        for plane in self.planes:
            behind = np.minimum(points @ plane[:OFFSET] - plane[OFFSET], 0.0)
            points -= behind[:, None] * plane[:OFFSET]

    def throw(self, *motion: Any) -> None:
        """What `rigid.throw` does, among the planes; the arguments of `throw_and_land`."""
        throw_and_land(*motion, self.planes)


@inlined
def radius_of(lever, first, last):
    """The distance of the outermost vertex from the centre."""
    square = 0.0
    for p in range(first, last):
        square = max(square, lever[p, 0] ** 2 + lever[p, 1] ** 2 + lever[p, 2] ** 2)
    return math.sqrt(square)


@inlined
def may_touch(planes, x, v, fall, radius, dt):
    """Whether a ball around the piece could reach a plane within dt."""
    reach = radius * (1 + TOUCHING) + dt * (math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
                                            + dt * math.sqrt(fall[0] ** 2 + fall[1] ** 2
                                                             + fall[2] ** 2))
    for m in range(len(planes)):
        if centre_gap(planes[m], x) < reach:
            return True
    return False


@inlined
def advance(x, q, v, w, fall, inertia, inverse, dt):
    """Flight for dt under the acceleration `fall`, from the velocity at its start."""
    for axis in range(3):
        v[axis] += dt * fall[axis]
    fly(x, q, v, w, fall, inertia, inverse, dt)


@inlined
def fly_to_touch(planes, pose, lever, first, last, fall, inertia, inverse, time, trial):
    """Fly until a vertex touches, but no longer than `time`; returns what is left of it.

    `pose` and `trial` are rows x (3), q (4), v (3), ω (3)."""
    floor = min(0.0, least_gap(planes, pose[:3], pose[3:7], lever, first, last))
    low, high = 0.0, time
    for n in range(BISECTIONS):
        part = time if n == 0 else 0.5 * (low + high)
        trial[:] = pose
        advance(trial[:3], trial[3:7], trial[7:10], trial[10:], fall, inertia, inverse, part)
        if least_gap(planes, trial[:3], trial[3:7], lever, first, last) >= floor:
            low = part
            if n == 0:
                break
        else:
            high = part
    if low > 0:
        advance(pose[:3], pose[3:7], pose[7:10], pose[10:], fall, inertia, inverse, low)
    return time - low


@inlined
def bounce(planes, count, arm, which, target, impulse, mass, world, inverse, pose, trial, slow):
    """Impulses of an impact; returns whether every vertex then leaves faster than `slow`."""
    v, w = pose[7:10], pose[10:]
    hit = False
    for c in range(count):
        speed = normal_speed(planes, which[c], v, w, arm[c])
        rebound = -speed * planes[which[c], RESTITUTION]
        target[c] = rebound if rebound > slow else 0.0
        hit = hit or speed < 0
    if hit:
        before = motion_energy(mass, world, v, w)
        trial[:] = pose
        resolve(planes, count, arm, which, target, impulse, mass, inverse, v, w)
        if motion_energy(mass, world, v, w) > before * (1 + ROUNDING):
            pose[:] = trial
            target[:count] = 0.0
            resolve(planes, count, arm, which, target, impulse, mass, inverse, v, w)
    for c in range(count):
        if normal_speed(planes, which[c], v, w, arm[c]) <= slow:
            return False
    return True


@inlined
def still(v, w, radius, speed):
    """Whether no vertex moves faster than `speed`."""
    return (math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
            + radius * math.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2)) < speed


@inlined
def pay(mass, world, v, w, energy):
    """Take an energy from the motion, as far as there is any."""
    owned = motion_energy(mass, world, v, w)
    if energy > 0 and owned > 0:
        rest = math.sqrt(max(0.0, 1 - energy / owned))
        for axis in range(3):
            v[axis] *= rest
            w[axis] *= rest


@inlined
def lift_out(planes, mass, world, pose, lever, first, last, fall):
    """Push the piece out of the planes into which its rotation has taken a corner."""
    x, v, w = pose[:3], pose[7:10], pose[10:]
    for m in range(len(planes)):
        depth = -least_gap(planes[m:m + 1], x, pose[3:7], lever, first, last)
        if depth > 0:
            weight = 0.0
            for axis in range(3):
                x[axis] += depth * planes[m, axis]
                weight -= mass * fall[axis] * planes[m, axis]
            pay(mass, world, v, w, weight * depth)


@inlined
def lean(planes, contacts, mass, inertia, inverse, world, world_inverse, pose, lever, first, last,
         radius, fall, time):
    """Contact for `time`: the impulses that keep the piece out, its motion, and its rest."""
    arm, which, gap, target, impulse = contacts
    v, w = pose[7:10], pose[10:]
    a, b, c = v[0], v[1], v[2]
    for axis in range(3):
        v[axis] += time * fall[axis]
    count = find_contacts(planes, pose[:3], pose[3:7], v, w, lever, first, last, time,
                          TOUCHING * radius, arm, which, gap)
    for n in range(count):
        target[n] = min(0.0, -gap[n] / time)
    resolve(planes, count, arm, which, target, impulse, mass, world_inverse, v, w)
    weight = math.sqrt(fall[0] ** 2 + fall[1] ** 2 + fall[2] ** 2)
    if count > 0 and still(v, w, radius, STILL * time * weight):
        v[:] = 0.0
        w[:] = 0.0
        return
    pose[0] += 0.5 * time * (a + v[0])
    pose[1] += 0.5 * time * (b + v[1])
    pose[2] += 0.5 * time * (c + v[2])
    rotate_freely(pose[3:7], w, inertia, inverse, time)
    lift_out(planes, mass, world, pose, lever, first, last, fall)


@inlined
def land(planes, contacts, mass, inertia, inverse, world, world_inverse, pose, trial, lever, first,
         last, radius, fall, dt):
    """One piece near a plane for dt: flight and impacts in turn, then contact."""
    arm, which, gap, target, impulse = contacts
    slow = 0.5 * dt * math.sqrt(fall[0] ** 2 + fall[1] ** 2 + fall[2] ** 2)
    left = dt
    for impact in range(IMPACTS + 1):
        world_inertia(world, inertia, pose[3:7])
        world_inertia(world_inverse, inverse, pose[3:7])
        count = find_contacts(planes, pose[:3], pose[3:7], pose[7:10], pose[10:], lever, first,
                              last, 0.0, TOUCHING * radius, arm, which, gap)
        leaves = bounce(planes, count, arm, which, target, impulse, mass, world, world_inverse,
                        pose, trial, slow)
        if impact == IMPACTS or not leaves:
            lean(planes, contacts, mass, inertia, inverse, world, world_inverse, pose, lever,
                 first, last, radius, fall, left)
            return
        left = fly_to_touch(planes, pose, lever, first, last, fall, inertia, inverse, left, trial)
        if left <= 0:
            return


@kernel(ROWS, LIST, TENSORS, TENSORS, LIST, FLAGS, LIST, REAL, ROWS, ROWS, ROWS, ROWS, INTS, ROWS,
        ROWS)
def throw_and_land(sums, mass, inertia, inverse_inertia, force, law, gravity, dt, position,
                   orientation, velocity, spin, vertex_start, lever, planes):
    """`rigid.throw` among planes."""
    A, rhs, world, fall = np.empty((6, 6)), np.empty(6), np.empty((3, 3)), np.empty(3)
    world_inverse, pose, trial = np.empty((3, 3)), np.empty(13), np.empty(13)
    most = PER_PLANE * len(planes)
    contacts = (np.empty((most, 3)), np.empty(most, np.int64), np.empty(most), np.empty(most),
                np.empty((most, 4)))
    for n in range(len(mass)):
        if law[n] & HELD:
            continue
        first, last = vertex_start[n], vertex_start[n + 1]
        share = push(A, rhs, world, sums[n], mass[n], inertia[n], force[n], law[n], gravity, dt,
                     orientation[n], velocity[n], spin[n])
        fall[:] = share * gravity
        radius = radius_of(lever, first, last)
        if not may_touch(planes, position[n], velocity[n], fall, radius, dt):
            fly(position[n], orientation[n], velocity[n], spin[n], fall, inertia[n],
                inverse_inertia[n], dt)
            continue
        pose[:3], pose[3:7] = position[n], orientation[n]
        pose[7:10], pose[10:] = velocity[n] - dt * fall, spin[n]
        land(planes, contacts, mass[n], inertia[n], inverse_inertia[n], world, world_inverse, pose,
             trial, lever, first, last, radius, fall, dt)
        position[n], orientation[n] = pose[:3], pose[3:7]
        velocity[n], spin[n] = pose[7:10], pose[10:]
