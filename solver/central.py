"""Advection by fourth-order central differences that conserve energy, with diffusion, in one sweep.

    q_new = a q_old + b (q + dt [-(u·∇)q + D ∇²q])

Richardson's extrapolation of the second-order scheme, whose control volume is 2h wide, by that of
twice the width (Verstappen & Veldman, J. Comput. Phys. 187 (2003) 343), along each axis:

    -u ∂q/∂x = -[H₊ (q₁ - q) + H₋ (q - q₋₁)] / 2h + [W₊ (q₂ - q) + W₋ (q - q₋₂)] / 12h

W at q₁ is the velocity of what q and q₂ exchange, H at the side between q and q₁ that of q and q₁:
each pair of values sees one velocity, so the scheme can make ½q² only where Σ (δH - δW / 3) is not
0. Across the axis of the velocity (F on the sides, of fourth order from four values)

    W₊ = (F₁ + F₃) / 2      H = F + (F₋₁ + 2 F + F₁) / 12

along it W₊ is F at q₁ and H = 4/3 F. Then that sum is the discrete ∇·u of the two cells that the
control volume spans (smoothed as F is) whatever the velocity: where ∇·u = 0 no energy is made or
destroyed, and where all q are equal nothing changes, as the advective form must have it.
Order: 4 in a uniform flow; 2 with the continuity and pressure of the staggered grid, whose error is
all that is left (h²/24 ∂²u/∂x² ∂q/∂x across the axis of the velocity).
Written for GHOSTS = 2.
"""

from solver.kernel import FIELD, GHOSTS, INT, REAL, inlined, kernel

PLANES, ROWS = FIELD, REAL[:, ::1]


@inlined
def between_row(out, before, left, right, after):
    """Values midway between `left` and `right`, to fourth order."""
    for i in range(out.size):
        out[i] = (9 * (left[i] + right[i]) - (before[i] + after[i])) * (1 / 16)


@inlined
def copy_row(out, values):
    """What needs no interpolation."""
    for i in range(out.size):
        out[i] = values[i]


@inlined
def clear_row(rate):
    """Nothing yet."""
    for i in range(rate.size):
        rate[i] = 0.0


@inlined
def across_row(rate, q, south2, south, north, north2, f_3, f_1, f1, f3, scale, diffusion):
    """Add advection and diffusion along one axis; f: velocity on the sides at -3/2 … 3/2 h."""
    for i in range(rate.size):
        here = q[i]
        up, down = north[i] - here, here - south[i]
        wide_up, wide_down = north2[i] - here, here - south2[i]
        inner, outer = f1[i], f_1[i]
        rate[i] += diffusion * (up - down) - scale * (
            (outer + 14 * inner + f3[i]) * up + (f_3[i] + 14 * outer + inner) * down
            - (inner + f3[i]) * wide_up - (outer + f_3[i]) * wide_down)


@inlined
def along_row(rate, q, south2, south, north, north2, scale, diffusion):
    """The same for the axis along which q is the velocity."""
    for i in range(rate.size):
        here, above, below = q[i], north[i], south[i]
        above2, below2 = north2[i], south2[i]
        up, down = above - here, here - below
        rate[i] += diffusion * (up - down) - scale * (
            (9 * (here + above) - (below + above2)) * up
            + (9 * (here + below) - (above + below2)) * down
            - 0.25 * ((10 * above - here - above2) * (above2 - here)
                      + (10 * below - here - below2) * (here - below2)))


@inlined
def finish_row(out, start, q, rate, old, new, dt):
    """The integrator's combination."""
    for i in range(out.size):
        out[i] = old * start[i] + new * (q[i] + dt * rate[i])


@kernel(*[FIELD] * 6, PLANES, ROWS, *[INT] * 3, *[REAL] * 9)
def advance_central4(out, start, q, u, v, w, planes, rows, di, dj, dk,
                     old, new, dt, ax, ay, az, dx, dy, dz):
    """All values of this rank; arguments as for `advance_donor`, but ax = 1 / 24h.

    planes (4, ny, nx) keep the velocities through the four z sides around a row, rows (6, nx)
    those through the four y sides and the x sides: each is interpolated once. The value beyond
    the outermost ghost is taken to be that ghost.
    """
    a, b = GHOSTS - di, q.shape[2] - GHOSTS
    low_k, low_j = GHOSTS - dk, GHOSTS - dj
    high_k, high_j = q.shape[0] - GHOSTS, q.shape[1] - GHOSTS
    rate, sides = rows[0, :b - a], rows[1, :b - a + 3]
    for k in range(low_k, high_k):
        if dk == 0:
            for side in range(k - 2 if k == low_k else k + 1, k + 2):
                for j in range(low_j, high_j):
                    if di + dj:
                        between_row(planes[side & 3, j, a:b],
                                    w[side, j - dj, a - di:b - di], w[side, j, a:b],
                                    w[side, j + dj, a + di:b + di],
                                    w[side, j + 2 * dj, a + 2 * di:b + 2 * di])
                    else:
                        copy_row(planes[side & 3, j, a:b], w[side, j, a:b])
        for j in range(low_j, high_j):
            here = q[k, j, a:b]
            clear_row(rate)
            if di:
                rows[1, 0] = q[k, j, 0]
                copy_row(rows[1, 1:q.shape[2] + 1], q[k, j])
                along_row(rate, here, rows[1, a - 1:b - 1], rows[1, a:b],
                          rows[1, a + 2:b + 2], rows[1, a + 3:b + 3], ax, dx)
            else:
                if dj + dk:
                    between_row(sides, u[k - dk, j - dj, a - 2:b + 1], u[k, j, a - 2:b + 1],
                                u[k + dk, j + dj, a - 2:b + 1],
                                u[k + 2 * dk, j + 2 * dj, a - 2:b + 1])
                else:
                    copy_row(sides, u[k, j, a - 2:b + 1])
                across_row(rate, here, q[k, j, a - 2:b - 2], q[k, j, a - 1:b - 1],
                           q[k, j, a + 1:b + 1], q[k, j, a + 2:b + 2],
                           sides[:b - a], sides[1:b - a + 1], sides[2:b - a + 2], sides[3:],
                           ax, dx)
            south2, south = q[k, max(j - 2, 0), a:b], q[k, j - 1, a:b]
            if dj:
                along_row(rate, here, south2, south, q[k, j + 1, a:b], q[k, j + 2, a:b],
                          ay, dy)
            else:
                for side in range(j - 2 if j == low_j else j + 1, j + 2):
                    if di + dk:
                        between_row(rows[2 + (side & 3), a:b],
                                    v[k - dk, side, a - di:b - di], v[k, side, a:b],
                                    v[k + dk, side, a + di:b + di],
                                    v[k + 2 * dk, side, a + 2 * di:b + 2 * di])
                    else:
                        copy_row(rows[2 + (side & 3), a:b], v[k, side, a:b])
                across_row(rate, here, south2, south, q[k, j + 1, a:b], q[k, j + 2, a:b],
                           rows[2 + ((j - 2) & 3), a:b], rows[2 + ((j - 1) & 3), a:b],
                           rows[2 + (j & 3), a:b], rows[2 + ((j + 1) & 3), a:b], ay, dy)
            rear2, rear = q[max(k - 2, 0), j, a:b], q[k - 1, j, a:b]
            if dk:
                along_row(rate, here, rear2, rear, q[k + 1, j, a:b], q[k + 2, j, a:b],
                          az, dz)
            else:
                across_row(rate, here, rear2, rear, q[k + 1, j, a:b], q[k + 2, j, a:b],
                           planes[(k - 2) & 3, j, a:b], planes[(k - 1) & 3, j, a:b],
                           planes[k & 3, j, a:b], planes[(k + 1) & 3, j, a:b], az, dz)
            finish_row(out[k, j, a:b], start[k, j, a:b], here, rate, old, new, dt)
