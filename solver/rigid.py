"""Rigid motion: the implicit drag of `bodies`, and flight without torque.

Kernels work on rows of the arrays of `bodies.Bodies`: quaternions are (w, x, y, z), spins are world
angular velocities, inertias are about the centre in the axes of the body at rest.
"""

import math

import numpy as np

from solver.interpolate import velocity_at
from solver.kernel import FIELD, INT, REAL, inlined, kernel

ROWS = REAL[:, ::1]
LIST = REAL[::1]
INTS = INT[::1]


@inlined
def rotation(q):
    """The rotation matrix of a unit quaternion, as nine numbers."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))


@inlined
def owns(cell, box):
    """Whether a coordinate in cells lies in this rank's half-open range (closed at the box)."""
    return box[2] <= cell < box[3] or (box[4] > 0 and cell == box[3])


@kernel(ROWS, INTS, ROWS, LIST, ROWS, ROWS, FIELD, FIELD, FIELD, ROWS)
def sum_over_vertices(sums, vertex_start, lever, weight, position, orientation, u, v, w, box):
    """Add up weights, lever arms and flow velocities of the vertices in this rank's cells."""
    for n in range(len(position)):
        a, b, c, d, e, f, g, h, m = rotation(orientation[n])
        s = sums[n]
        for p in range(vertex_start[n], vertex_start[n + 1]):
            x, y, z = lever[p, 0], lever[p, 1], lever[p, 2]
            x, y, z = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + m * z
            X = (position[n, 0] + x) / box[0, 0]
            Y = (position[n, 1] + y) / box[1, 0]
            Z = (position[n, 2] + z) / box[2, 0]
            if not (owns(X, box[0]) and owns(Y, box[1]) and owns(Z, box[2])):
                continue
            q = weight[p]
            ux, uy, uz = velocity_at(u, v, w, X - box[0, 1], Y - box[1, 1], Z - box[2, 1])
            s[0] += q
            s[1] += q * x
            s[2] += q * y
            s[3] += q * z
            s[4] += q * x * x
            s[5] += q * y * y
            s[6] += q * z * z
            s[7] += q * x * y
            s[8] += q * x * z
            s[9] += q * y * z
            s[10] += q * ux
            s[11] += q * uy
            s[12] += q * uz
            s[13] += q * (y * uz - z * uy)
            s[14] += q * (z * ux - x * uz)
            s[15] += q * (x * uy - y * ux)


@inlined
def world_inertia(world, inertia, q):
    """R I Rᵀ."""
    R = rotation(q)
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                for m in range(3):
                    total += R[3 * i + k] * inertia[k, m] * R[3 * j + m]
            world[i, j] = total


@inlined
def drag_system(A, rhs, s, mass, inertia, c, velocity, spin):
    """The 6 × 6 system of the module's docstring; c = dt F_c, `velocity` with dt g added."""
    x, y, z = s[1], s[2], s[3]
    xx, yy, zz, xy, xz, yz = s[4], s[5], s[6], s[7], s[8], s[9]
    A[:] = 0.0
    for i in range(3):
        A[i, i] = mass + c * s[0]
        rhs[i] = mass * velocity[i] + c * s[10 + i]
        rhs[3 + i] = c * s[13 + i]
        for j in range(3):
            A[3 + i, 3 + j] = inertia[i, j]
            rhs[3 + i] += inertia[i, j] * spin[j]
    A[3, 3] += c * (yy + zz)
    A[4, 4] += c * (xx + zz)
    A[5, 5] += c * (xx + yy)
    for i, j, value in ((3, 4, xy), (3, 5, xz), (4, 5, yz)):
        A[i, j] -= c * value
        A[j, i] -= c * value
    for i, j, value in ((3, 1, -z), (3, 2, y), (4, 0, z), (4, 2, -x), (5, 0, -y), (5, 1, x)):
        A[i, j] = c * value   # Rr × v in the torque
        A[j, i] = c * value   # ω × Rr in the force


@inlined
def solve_spd(A, b):
    """b ← A⁻¹ b by Cholesky; A is 6 × 6, symmetric, positive definite, and destroyed."""
    for j in range(6):
        for k in range(j):
            for i in range(j, 6):
                A[i, j] -= A[i, k] * A[j, k]
        pivot = math.sqrt(A[j, j])
        for i in range(j, 6):
            A[i, j] /= pivot
    for i in range(6):
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            b[i] -= A[k, i] * b[k]
        b[i] /= A[i, i]


@inlined
def multiply(M, x, y, z):
    """M (x, y, z)."""
    return (M[0, 0] * x + M[0, 1] * y + M[0, 2] * z, M[1, 0] * x + M[1, 1] * y + M[1, 2] * z,
            M[2, 0] * x + M[2, 1] * y + M[2, 2] * z)


@inlined
def turn_back(x, y, z, a, b, c, dt):
    """Rotate (x, y, z) by -dt about (a, b, c) (Rodrigues)."""
    rate = math.sqrt(a * a + b * b + c * c)
    angle = rate * dt
    if rate == 0.0:
        return x, y, z
    a, b, c = a / rate, b / rate, c / rate
    cosine, sine = math.cos(angle), math.sin(angle)
    along = (1 - cosine) * (a * x + b * y + c * z)
    return (cosine * x - sine * (b * z - c * y) + along * a,
            cosine * y - sine * (c * x - a * z) + along * b,
            cosine * z - sine * (a * y - b * x) + along * c)


@inlined
def append_rotation(q, a, b, c, dt):
    """q ← q · (rotation by dt about (a, b, c) in body axes), normalised."""
    rate = math.sqrt(a * a + b * b + c * c)
    if rate == 0.0:
        return
    half = 0.5 * rate * dt
    s = math.sin(half) / rate
    w, x, y, z = math.cos(half), s * a, s * b, s * c
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    q[0] = q0 * w - q1 * x - q2 * y - q3 * z
    q[1] = q0 * x + q1 * w + q2 * z - q3 * y
    q[2] = q0 * y - q1 * z + q2 * w + q3 * x
    q[3] = q0 * z + q1 * y - q2 * x + q3 * w
    length = math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for n in range(4):
        q[n] /= length


@inlined
def rotate_freely(q, spin, inertia, inverse, dt):
    """Torque-free rotation for dt: turns q and updates the world angular velocity `spin`.

    In body axes, Π_new = exp(-dt [Ω]×) Π with Ω = I⁻¹ (Π + Π_new) / 2, solved by iteration;
    long steps are cut so that each turns by less than half a radian.
    """
    R = rotation(q)
    w0 = R[0] * spin[0] + R[3] * spin[1] + R[6] * spin[2]
    w1 = R[1] * spin[0] + R[4] * spin[1] + R[7] * spin[2]
    w2 = R[2] * spin[0] + R[5] * spin[1] + R[8] * spin[2]
    p0, p1, p2 = multiply(inertia, w0, w1, w2)
    speed = math.sqrt(w0 * w0 + w1 * w1 + w2 * w2)
    if speed == 0.0 or not math.isfinite(speed):
        return
    parts = int(min(2.0 * speed * dt, 1e6)) + 1
    step = dt / parts
    for _ in range(parts):
        a, b, c = multiply(inverse, p0, p1, p2)
        n0, n1, n2 = p0, p1, p2
        for _ in range(60):
            o0, o1, o2 = n0, n1, n2
            n0, n1, n2 = turn_back(p0, p1, p2, a, b, c, step)
            a, b, c = multiply(inverse, 0.5 * (p0 + n0), 0.5 * (p1 + n1), 0.5 * (p2 + n2))
            moved = abs(n0 - o0) + abs(n1 - o1) + abs(n2 - o2)
            if moved <= 1e-16 * (abs(p0) + abs(p1) + abs(p2)):
                break
        p0, p1, p2 = turn_back(p0, p1, p2, a, b, c, step)
        append_rotation(q, a, b, c, step)
    w0, w1, w2 = multiply(inverse, p0, p1, p2)
    R = rotation(q)
    spin[0] = R[0] * w0 + R[1] * w1 + R[2] * w2
    spin[1] = R[3] * w0 + R[4] * w1 + R[5] * w2
    spin[2] = R[6] * w0 + R[7] * w1 + R[8] * w2


@kernel(ROWS, LIST, REAL[:, :, ::1], REAL[:, :, ::1], LIST, LIST, REAL, ROWS, ROWS, ROWS, ROWS)
def throw(sums, mass, inertia, inverse_inertia, force, gravity, dt, position, orientation,
          velocity, spin):
    """Drag and gravity (implicit), then free flight, for every body."""
    A = np.empty((6, 6))
    rhs = np.empty(6)
    world = np.empty((3, 3))
    for n in range(len(mass)):
        for axis in range(3):
            velocity[n, axis] += dt * gravity[axis]
        world_inertia(world, inertia[n], orientation[n])
        if sums[n, 0] > 0 and force[n] > 0:
            drag_system(A, rhs, sums[n], mass[n], world, dt * force[n], velocity[n], spin[n])
            solve_spd(A, rhs)
            for axis in range(3):
                velocity[n, axis], spin[n, axis] = rhs[axis], rhs[3 + axis]
        for axis in range(3):
            position[n, axis] += dt * velocity[n, axis]
        rotate_freely(orientation[n], spin[n], inertia[n], inverse_inertia[n], dt)
