"""What the flow does to a body: sums over its vertices, each taken by the rank that owns its cell.

Kernels work on rows of the arrays of `bodies.Bodies`; quaternions are (w, x, y, z). `box` is
`bodies.owned_box`.
"""

import math

from numba import uint8

from solver.interpolate import scalar_at, velocity_at
from solver.kernel import FIELD, INT, REAL, inlined, kernel

ROWS = REAL[:, ::1]
LIST = REAL[::1]
INTS = INT[::1]
FLAGS = uint8[::1]

# Σw, Σw Rr (3), Σw Rr Rrᵀ (6: xx yy zz xy xz yz), Σw u (3), Σw Rr × u (3); and of the directions
# r̂ of Rr: Σw r̂ r̂ᵀ (6), Σw r̂ (r̂·u) (3), for bodies with the law PARALLEL alone.
SUMS = 25
HELD, ABSOLUTE, PARALLEL = 1, 2, 4   # flags of a piece: not thrown yet, and the thesis' laws


@inlined
def rotation(q):
    """The rotation matrix of a unit quaternion, as nine numbers."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))


@inlined
def add_parallel(s, q, x, y, z, ux, uy, uz):
    """Σ w r̂ r̂ᵀ and Σ w r̂ (r̂·u), r̂ the direction of the lever arm."""
    square = x * x + y * y + z * z
    if square > 0:
        along = q * (x * ux + y * uy + z * uz) / square
        q /= square
        s[16] += q * x * x
        s[17] += q * y * y
        s[18] += q * z * z
        s[19] += q * x * y
        s[20] += q * x * z
        s[21] += q * y * z
        s[22] += along * x
        s[23] += along * y
        s[24] += along * z


@inlined
def in_box(x, box):
    """A coordinate in cells, brought into the box where its axis is periodic."""
    x = x / box[0]
    if box[5] > 0:
        x -= math.floor(x / box[5]) * box[5]
        return x if x < box[5] else 0.0   # the difference may round up to a whole box
    return x


@inlined
def owns(cell, box):
    """Whether a coordinate in cells lies in this rank's half-open range (closed at the box)."""
    return box[2] <= cell < box[3] or (box[4] > 0 and cell == box[3])


@kernel(ROWS, INTS, ROWS, LIST, ROWS, ROWS, FLAGS, FIELD, FIELD, FIELD, ROWS)
def sum_over_vertices(sums, vertex_start, lever, weight, position, orientation, law, u, v, w, box):
    """Add up weights, lever arms and flow velocities of the vertices in this rank's cells."""
    for n in range(len(position)):
        if law[n] & HELD:
            continue
        a, b, c, d, e, f, g, h, m = rotation(orientation[n])
        # in registers: written to memory for every vertex, the sums alone would take half the time
        W = Sx = Sy = Sz = xx = yy = zz = xy = xz = yz = Ux = Uy = Uz = Tx = Ty = Tz = 0.0
        for p in range(vertex_start[n], vertex_start[n + 1]):
            x, y, z = lever[p, 0], lever[p, 1], lever[p, 2]
            x, y, z = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + m * z
            X = in_box(position[n, 0] + x, box[0])
            Y = in_box(position[n, 1] + y, box[1])
            Z = in_box(position[n, 2] + z, box[2])
            if not (owns(X, box[0]) and owns(Y, box[1]) and owns(Z, box[2])):
                continue
            q = weight[p]
            ux, uy, uz = velocity_at(u, v, w, X - box[0, 1], Y - box[1, 1], Z - box[2, 1])
            W += q
            Sx += q * x
            Sy += q * y
            Sz += q * z
            xx += q * x * x
            yy += q * y * y
            zz += q * z * z
            xy += q * x * y
            xz += q * x * z
            yz += q * y * z
            Ux += q * ux
            Uy += q * uy
            Uz += q * uz
            Tx += q * (y * uz - z * uy)
            Ty += q * (z * ux - x * uz)
            Tz += q * (x * uy - y * ux)
            if law[n] & PARALLEL:
                add_parallel(sums[n], q, x, y, z, ux, uy, uz)
        for column, value in enumerate((W, Sx, Sy, Sz, xx, yy, zz, xy, xz, yz, Ux, Uy, Uz, Tx, Ty,
                                        Tz)):
            sums[n, column] = value


@kernel(ROWS, INTS, ROWS, ROWS, ROWS, FIELD, ROWS)
def mean_temperature(sums, vertex_start, lever, position, orientation, T, box):
    """Per body: how many of its vertices are in this rank's cells, and the sum of T there."""
    for n in range(len(position)):
        a, b, c, d, e, f, g, h, m = rotation(orientation[n])
        for p in range(vertex_start[n], vertex_start[n + 1]):
            x, y, z = lever[p, 0], lever[p, 1], lever[p, 2]
            X = in_box(position[n, 0] + a * x + b * y + c * z, box[0])
            Y = in_box(position[n, 1] + d * x + e * y + f * z, box[1])
            Z = in_box(position[n, 2] + g * x + h * y + m * z, box[2])
            if owns(X, box[0]) and owns(Y, box[1]) and owns(Z, box[2]):
                sums[n, 0] += 1.0
                sums[n, 1] += scalar_at(T, X - box[0, 1], Y - box[1, 1], Z - box[2, 1])
