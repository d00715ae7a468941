"""Rigid motion: the implicit drag of `bodies`, and flight without torque.

Kernels work on rows of the arrays of `bodies.Bodies`: quaternions are (w, x, y, z), spins are world
angular velocities, inertias are about the centre in the axes of the body at rest.
"""

import math

import numpy as np

from solver.kernel import REAL, inlined, kernel
from solver.vertices import ABSOLUTE, FLAGS, HELD, LIST, PARALLEL, ROWS, rotation

TENSORS = REAL[:, :, ::1]


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
def symmetric(A, first, c, xx, yy, zz, xy, xz, yz):
    """Add c times a symmetric 3 × 3 matrix to the diagonal block that starts at `first`."""
    i, j, k = first, first + 1, first + 2
    A[i, i] += c * xx
    A[j, j] += c * yy
    A[k, k] += c * zz
    for a, b, value in ((i, j, xy), (i, k, xz), (j, k, yz)):
        A[a, b] += c * value
        A[b, a] += c * value


@inlined
def drag_system(A, rhs, s, mass, inertia, c, drag, velocity, spin):
    """The 6 × 6 system of `bodies`: c = dt F_c, drag = c or 0; `velocity` with dt g added."""
    x, y, z = s[1], s[2], s[3]
    xx, yy, zz = s[4], s[5], s[6]
    A[:] = 0.0
    for i in range(3):
        A[i, i] = mass + drag * s[0]
        rhs[i] = mass * velocity[i] + c * s[10 + i]
        rhs[3 + i] = c * s[13 + i]
        for j in range(3):
            A[3 + i, 3 + j] = inertia[i, j]
            rhs[3 + i] += inertia[i, j] * spin[j]
    symmetric(A, 3, drag, yy + zz, xx + zz, xx + yy, -s[7], -s[8], -s[9])
    for i, j, value in ((3, 1, -z), (3, 2, y), (4, 0, z), (4, 2, -x), (5, 0, -y), (5, 1, x)):
        A[i, j] = drag * value   # Rr × v in the torque
        A[j, i] = drag * value   # ω × Rr in the force


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
def parallel_push(A, rhs, s, mass, c, drag, velocity):
    """Replace the force by Σ w r̂ (r̂·(u - v)): the spin drops out of it, and v is known first."""
    for i in range(3):
        for j in range(6):
            A[i, j] = A[j, i] = 0.0
        A[i, i] = mass
        rhs[i] = mass * velocity[i] + c * s[22 + i]
    symmetric(A, 0, drag, s[16], s[17], s[18], s[19], s[20], s[21])
    first = A.copy()
    for i in range(3):
        first[3 + i, :] = 0.0
        first[3 + i, 3 + i] = 1.0
    known = rhs.copy()
    solve_spd(first, known)
    x, y, z = s[1], s[2], s[3]
    a, b, c = known[0], known[1], known[2]
    rhs[3] -= drag * (y * c - z * b)
    rhs[4] -= drag * (z * a - x * c)
    rhs[5] -= drag * (x * b - y * a)


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


@inlined
def push(A, rhs, world, s, mass, inertia, force, law, gravity, dt, orientation, velocity, spin):
    """Drag and gravity of one body for dt (implicit); returns the share of gravity that is left
    to its flight: a parabola where nothing drags."""
    for axis in range(3):
        velocity[axis] += dt * gravity[axis]
    drag = 0.0
    if s[0] > 0 and force > 0:
        c = dt * force
        drag = 0.0 if law & ABSOLUTE else c
        world_inertia(world, inertia, orientation)
        drag_system(A, rhs, s, mass, world, c, drag, velocity, spin)
        if law & PARALLEL:
            parallel_push(A, rhs, s, mass, c, drag, velocity)
        solve_spd(A, rhs)
        for axis in range(3):
            velocity[axis], spin[axis] = rhs[axis], rhs[3 + axis]
    return mass / (mass + drag * s[0])


@inlined
def fly(position, orientation, velocity, spin, fall, inertia, inverse, dt):
    """Free flight for dt under the acceleration `fall`; `velocity` is that at its end."""
    for axis in range(3):
        position[axis] += dt * (velocity[axis] - 0.5 * dt * fall[axis])
    rotate_freely(orientation, spin, inertia, inverse, dt)


@kernel(ROWS, LIST, TENSORS, TENSORS, LIST, FLAGS, LIST, REAL, ROWS, ROWS, ROWS, ROWS)
def throw(sums, mass, inertia, inverse_inertia, force, law, gravity, dt, position, orientation,
          velocity, spin):
    """Drag and gravity, then free flight, for every body that is not held."""
    A, rhs, world, fall = np.empty((6, 6)), np.empty(6), np.empty((3, 3)), np.empty(3)
    for n in range(len(mass)):
        if law[n] & HELD:
            continue
        share = push(A, rhs, world, sums[n], mass[n], inertia[n], force[n], law[n], gravity, dt,
                     orientation[n], velocity[n], spin[n])
        fall[:] = share * gravity
        fly(position[n], orientation[n], velocity[n], spin[n], fall, inertia[n],
            inverse_inertia[n], dt)
