"""Where a piece touches the planes, and the impulses there.

Impulses p at the contacts c of one piece change its velocity by Σ p / m and its spin by
I⁻¹ Σ r × p. They are sought so that at every contact, with the velocity u there,

    u_n ≥ target,  p_n ≥ 0,  one of the two equal;      |p_t| ≤ μ p_n, and u_t = 0 where it is less

by sweeps over the contacts (projected Gauss-Seidel), each of which lowers the energy. A row of
`planes` is that of `contact.Ground`; `arm` (n, 3) points from the centre to the contacts,
`impulse` (n, 4) holds p_t and p_n.
"""

import math

from solver.kernel import inlined
from solver.rigid import multiply
from solver.vertices import rotation

NX, NY, NZ, OFFSET, FRICTION, RESTITUTION = range(6)   # a row of `planes`
DIRECTIONS = 8                 # in which the outermost contacts are sought
PER_PLANE = DIRECTIONS + 1
SWEEPS, ENOUGH = 100, 1e-12


@inlined
def into_body(R, x, y, z):
    """Rᵀ (x, y, z)."""
    return (R[0] * x + R[3] * y + R[6] * z, R[1] * x + R[4] * y + R[7] * z,
            R[2] * x + R[5] * y + R[8] * z)


@inlined
def into_world(R, x, y, z):
    """R (x, y, z)."""
    return (R[0] * x + R[1] * y + R[2] * z, R[3] * x + R[4] * y + R[5] * z,
            R[6] * x + R[7] * y + R[8] * z)


@inlined
def cross(a, b, c, x, y, z):
    """(a, b, c) × (x, y, z)."""
    return b * z - c * y, c * x - a * z, a * y - b * x


@inlined
def centre_gap(plane, x):
    """Distance of the centre from a plane."""
    return plane[NX] * x[0] + plane[NY] * x[1] + plane[NZ] * x[2] - plane[OFFSET]


@inlined
def least_gap(planes, x, q, lever, first, last):
    """The least distance of a vertex from a plane."""
    R = rotation(q)
    least = math.inf
    for m in range(len(planes)):
        a, b, c = into_body(R, planes[m, NX], planes[m, NY], planes[m, NZ])
        centre = centre_gap(planes[m], x)
        for p in range(first, last):
            least = min(least, centre + a * lever[p, 0] + b * lever[p, 1] + c * lever[p, 2])
    return least


@inlined
def tangents(x, y, z):
    """Two unit vectors across a unit vector."""
    if abs(x) < 0.6:
        a, b, c = cross(x, y, z, 1.0, 0.0, 0.0)
    else:
        a, b, c = cross(x, y, z, 0.0, 1.0, 0.0)
    length = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / length, b / length, c / length
    return (a, b, c), cross(x, y, z, a, b, c)


@inlined
def find_contacts(planes, x, q, v, w, lever, first, last, time, slop, arm, which, gap):
    """The vertices that touch, or would within `time`: the lowest and the outermost per plane."""
    R = rotation(q)
    count = 0
    for m in range(len(planes)):
        nx, ny, nz = planes[m, NX], planes[m, NY], planes[m, NZ]
        a, b, c = into_body(R, nx, ny, nz)
        turn = cross(nx, ny, nz, w[0], w[1], w[2])      # n·(w × r) = r·(n × w)
        d, e, f = into_body(R, turn[0], turn[1], turn[2])
        centre = centre_gap(planes[m], x)
        speed = nx * v[0] + ny * v[1] + nz * v[2]
        s, t = tangents(nx, ny, nz)
        begin = count
        for direction in range(PER_PLANE):
            angle = 2 * math.pi * direction / DIRECTIONS
            ca, sa = math.cos(angle), math.sin(angle)
            g, h, k = into_body(R, ca * s[0] + sa * t[0], ca * s[1] + sa * t[1],
                                ca * s[2] + sa * t[2])
            if direction == DIRECTIONS:
                g, h, k = -a, -b, -c
            best, found = -math.inf, -1
            for p in range(first, last):
                X, Y, Z = lever[p, 0], lever[p, 1], lever[p, 2]
                height = centre + a * X + b * Y + c * Z
                if height + min(0.0, time * (speed + d * X + e * Y + f * Z)) > slop:
                    continue
                along = g * X + h * Y + k * Z
                if along > best:
                    best, found = along, p
            if found < 0:
                break
            new = into_world(R, lever[found, 0], lever[found, 1], lever[found, 2])
            for old in range(begin, count):
                if arm[old, 0] == new[0] and arm[old, 1] == new[1] and arm[old, 2] == new[2]:
                    found = -1
            if found >= 0:
                arm[count, 0], arm[count, 1], arm[count, 2] = new
                which[count] = m
                gap[count] = centre + nx * new[0] + ny * new[1] + nz * new[2]
                count += 1
    return count


@inlined
def point_velocity(v, w, r):
    """v + w × r."""
    a, b, c = cross(w[0], w[1], w[2], r[0], r[1], r[2])
    return v[0] + a, v[1] + b, v[2] + c


@inlined
def normal_speed(planes, m, v, w, r):
    """n·(v + w × r)."""
    a, b, c = point_velocity(v, w, r)
    return planes[m, NX] * a + planes[m, NY] * b + planes[m, NZ] * c


@inlined
def softness(mass, inverse, r, x, y, z):
    """Speed along the unit vector (x, y, z) that a unit impulse along it gives its vertex."""
    a, b, c = cross(r[0], r[1], r[2], x, y, z)
    d, e, f = multiply(inverse, a, b, c)
    return 1 / mass + a * d + b * e + c * f


@inlined
def strike(mass, inverse, v, w, r, x, y, z):
    """Change v and w by an impulse at a vertex."""
    a, b, c = cross(r[0], r[1], r[2], x, y, z)
    d, e, f = multiply(inverse, a, b, c)
    v[0] += x / mass
    v[1] += y / mass
    v[2] += z / mass
    w[0] += d
    w[1] += e
    w[2] += f


@inlined
def resolve(planes, count, arm, which, target, impulse, mass, inverse, v, w):
    """Impulses at all contacts, normal and rubbing, by Gauss-Seidel; changes v and w."""
    impulse[:count] = 0.0
    for _ in range(SWEEPS):
        change = total = 0.0
        for c in range(count):
            m, r, p = which[c], arm[c], impulse[c]
            nx, ny, nz = planes[m, NX], planes[m, NY], planes[m, NZ]
            missing = target[c] - normal_speed(planes, m, v, w, r)
            old = p[3]
            p[3] = max(0.0, old + missing / softness(mass, inverse, r, nx, ny, nz))
            step = p[3] - old
            strike(mass, inverse, v, w, r, step * nx, step * ny, step * nz)
            change += abs(step)
            total += p[3]
            a, b, d = point_velocity(v, w, r)
            along = nx * a + ny * b + nz * d
            a, b, d = a - along * nx, b - along * ny, d - along * nz
            slip = math.sqrt(a * a + b * b + d * d)
            x, y, z = p[0], p[1], p[2]
            if slip > 0:
                stop = 1 / softness(mass, inverse, r, a / slip, b / slip, d / slip)
                x, y, z = x - stop * a, y - stop * b, z - stop * d
            rub, limit = math.sqrt(x * x + y * y + z * z), planes[m, FRICTION] * p[3]
            if rub > limit:
                x, y, z = x * limit / rub, y * limit / rub, z * limit / rub
            strike(mass, inverse, v, w, r, x - p[0], y - p[1], z - p[2])
            change += abs(x - p[0]) + abs(y - p[1]) + abs(z - p[2])
            p[0], p[1], p[2] = x, y, z
        if change <= ENOUGH * total:
            break


@inlined
def motion_energy(mass, inertia, v, w):
    """½ m v² + ½ ω·Iω; `inertia` in the world's axes."""
    a, b, c = multiply(inertia, w[0], w[1], w[2])
    return 0.5 * (mass * (v[0] ** 2 + v[1] ** 2 + v[2] ** 2) + w[0] * a + w[1] * b + w[2] * c)
