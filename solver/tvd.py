"""Advection with limited slopes, bounded, with diffusion, in one sweep.

    -(u·∇)q = -Σ_sides F (q_side - q) / h            advective form, F outwards positive

The value on a side between L and R, the flow going from L to R and U lying upstream of L, is

    q_side = L + ½ s,   s = minmod(2 (L - U), ((R - L) + 2 (L - U)) / 3, 2 (R - L))

(minmod: the smallest in size if all signs agree, else 0; mirrored for the other direction). A value
stays between its neighbours for dt Σ|u|/h ≤ ½; where `bounded` it is held there for longer steps
too. Order: 3 in one dimension for smooth monotone q (2 with the face velocities of a staggered
grid), 1 at extrema.
Source: Koren, in Notes Numer. Fluid Mech. 45 (1993) 117.
"""

from solver.kernel import FIELD, GHOSTS, INT, REAL, part_of_sweep, sweep

PLANES, ROWS = FIELD, REAL[:, ::1]


@part_of_sweep
def low(a, b):
    """The smaller of two."""
    return a if a < b else b


@part_of_sweep
def high(a, b):
    """The larger of two."""
    return a if a > b else b


@part_of_sweep
def side_row(out, before, left, right, after, flow_a, flow_b):
    """q on the sides between `left` and `right`, for a row of them."""
    for i in range(out.size):
        l, r = left[i], right[i]  # noqa: E741
        down, up = l - before[i], after[i] - r
        downwards = flow_a[i] + flow_b[i] > 0.0
        upstream = 2 * (down if downwards else up)
        across = r - l
        middle, far = (across + upstream) * (1 / 3), 2 * across
        least = low(upstream, low(middle, far))
        most = high(upstream, high(middle, far))
        half = 0.5 * (high(0.0, least) + low(0.0, most))
        from_left, from_right = l + half, r - half
        out[i] = from_left if downwards else from_right


@part_of_sweep
def combine_row(out, start, here, east, west, north, south, front, rear,
                at_east, at_west, at_north, at_south, at_front, at_rear,
                east_a, east_b, west_a, west_b, north_a, north_b, south_a, south_b,
                front_a, front_b, rear_a, rear_b, old, new, dt, ax, ay, az, dx, dy, dz):
    """The new values of a row from the values on its six sides; F = (a + b) / 2, ax = 1 / 2h."""
    for i in range(out.size):
        q = here[i]
        rate = (ax * ((west_a[i] + west_b[i]) * (at_west[i] - q)
                      - (east_a[i] + east_b[i]) * (at_east[i] - q))
                + ay * ((south_a[i] + south_b[i]) * (at_south[i] - q)
                        - (north_a[i] + north_b[i]) * (at_north[i] - q))
                + az * ((rear_a[i] + rear_b[i]) * (at_rear[i] - q)
                        - (front_a[i] + front_b[i]) * (at_front[i] - q))
                + dx * (east[i] + west[i] - 2 * q) + dy * (north[i] + south[i] - 2 * q)
                + dz * (front[i] + rear[i] - 2 * q))
        out[i] = old * start[i] + new * (q + dt * rate)


@part_of_sweep
def bound_row(out, start, here, east, west, north, south, front, rear, old, new):
    """Hold the advanced value (out - old × start) / new between those of its neighbours."""
    for i in range(out.size):
        q, e, w, n, s, f, r = here[i], east[i], west[i], north[i], south[i], front[i], rear[i]
        least = low(low(low(q, e), low(w, n)), low(s, low(f, r)))
        most = high(high(high(q, e), high(w, n)), high(s, high(f, r)))
        rest = old * start[i]
        out[i] = high(rest + new * least, low(rest + new * most, out[i]))


@sweep(*[FIELD] * 6, PLANES, ROWS, *[INT] * 4, *[REAL] * 9)
def advance_tvd(out, start, q, u, v, w, planes, rows, bounded, di, dj, dk,
                old, new, dt, ax, ay, az, dx, dy, dz):
    """All values of this rank; arguments as for `advance_donor`.

    Written for GHOSTS = 2. planes (2, ny, nx) and rows (3, nx) keep the values on the front and
    rear, and on the north, south and x sides, so that each is computed once. Beyond the
    outermost ghost the field is taken to go on unchanged.
    """
    a, b = GHOSTS - di, q.shape[2] - GHOSTS
    A, B, width = a + di, b + di, b - a
    first_k, first_j = GHOSTS - dk, GHOSTS - dj
    for k in range(first_k - 1, q.shape[0] - GHOSTS):
        K, back = k + dk, max(k - 1, 0)
        at_front, at_rear = planes[k & 1], planes[1 - (k & 1)]
        for j in range(first_j, q.shape[1] - GHOSTS):
            side_row(at_front[j, :width], q[back, j, a:b], q[k, j, a:b], q[k + 1, j, a:b],
                     q[k + 2, j, a:b], w[k, j, a:b], w[K, j + dj, A:B])
        if k < first_k:
            continue
        for j in range(first_j - 1, q.shape[1] - GHOSTS):
            J, below = j + dj, max(j - 1, 0)
            at_north, at_south = rows[j & 1, :width], rows[1 - (j & 1), :width]
            side_row(at_north, q[k, below, a:b], q[k, j, a:b], q[k, j + 1, a:b],
                     q[k, j + 2, a:b], v[k, j, a:b], v[K, J, A:B])
            if j < first_j:
                continue
            at_x = rows[2]
            side_row(at_x[di:width + 1], q[k, j, :b - 1], q[k, j, 1:b], q[k, j, 2:b + 1],
                     q[k, j, 3:b + 2], u[k, j, 1:b], u[K, J, 1 + di:B])
            if di:
                at_x[0] = q[k, j, 0] if u[k, j, 0] + u[k, j, 1] > 0.0 else q[k, j, 1]
            combine_row(out[k, j, a:b], start[k, j, a:b], q[k, j, a:b],
                        q[k, j, a + 1:b + 1], q[k, j, a - 1:b - 1],
                        q[k, j + 1, a:b], q[k, j - 1, a:b], q[k + 1, j, a:b], q[k - 1, j, a:b],
                        at_x[1:width + 1], at_x[:width], at_north, at_south,
                        at_front[j, :width], at_rear[j, :width],
                        u[k, j, a:b], u[K, J, A:B], u[k, j, a - 1:b - 1], u[K, J, A - 1:B - 1],
                        v[k, j, a:b], v[K, J, A:B], v[k, j - 1, a:b], v[K, J - 1, A:B],
                        w[k, j, a:b], w[K, J, A:B], w[k - 1, j, a:b], w[K - 1, J, A:B],
                        old, new, dt, ax, ay, az, dx, dy, dz)
            if bounded:
                bound_row(out[k, j, a:b], start[k, j, a:b], q[k, j, a:b],
                          q[k, j, a + 1:b + 1], q[k, j, a - 1:b - 1], q[k, j + 1, a:b],
                          q[k, j - 1, a:b], q[k + 1, j, a:b], q[k - 1, j, a:b], old, new)
