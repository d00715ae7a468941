"""Advection by fourth-order central differences that conserve energy, with diffusion, in one sweep.

    q_new = a q_old + b (q + dt [-(u·∇)q + D ∇²q])

The advection is Richardson's extrapolation of the second-order scheme, whose control volume is 2h
wide, by that of twice the width (Verstappen & Veldman, J. Comput. Phys. 187 (2003) 343), along each
axis:

    -u ∂q/∂x = -[H₊ (q₁ - q) + H₋ (q - q₋₁)] / 2h + [W₊ (q₂ - q) + W₋ (q - q₋₂)] / 12h

W at q₁ is the velocity of what q and q₂ exchange, H at the side between q and q₁ that of q and q₁:
each pair of values sees one velocity, so the scheme can make ½q² only where Σ (δH - δW / 3) is not
0. Across the axis of the velocity (F on the sides, of fourth order from four values)

    W₊ = (F₁ + F₃) / 2      H = F + (F₋₁ + 2 F + F₁) / 12

along it W₊ is F at q₁ and H = 4/3 F. Then that sum is the discrete ∇·u of the two cells that the
control volume spans (smoothed as F is) whatever the velocity: where ∇·u = 0 no energy is made or
destroyed, and where all q are equal nothing changes, as the advective form must have it.
The viscosity is extrapolated alike, D (δ² - δ⁴ / 12) q / h² (conduction stays at δ²).
Order: 4 in a uniform flow; 2 with the continuity and pressure of the staggered grid, whose error is
all that is left.

Much of that error is that continuity holds exactly for u, v, w as means over their faces, and the
mean over a width h of v ∂u/∂y is more than the product of the means: by h²/12 ∂v/∂y ∂²u/∂y² (and
alike across the other axis), which is a diffusion, negative where the flow stretches along y. It
is added as far as the viscosity goes: then nothing can grow by it, and without viscosity, where
nothing would damp it, it is 0 and the energy conserved.
Written for GHOSTS = 2.
"""

from solver.kernel import FIELD, GHOSTS, INT, REAL, fetch_row, part_of_sweep, sweep

PLANES, ROWS = FIELD, REAL[:, ::1]


@part_of_sweep
def between_row(out, before, left, right, after):
    """Values midway between `left` and `right`, to fourth order."""
    for i in range(out.size):
        out[i] = (9 * (left[i] + right[i]) - (before[i] + after[i])) * (1 / 16)


@part_of_sweep
def copy_row(out, values):
    """What needs no interpolation."""
    for i in range(out.size):
        out[i] = values[i]


@part_of_sweep
def along(q, south2, south, north, north2, scale, near, far):
    """Rate of change by advection and diffusion along the axis along which q is the velocity."""
    up, down = north - q, q - south
    return near * (up - down) - far * (north2 - north - south + south2) - scale * (
        (9 * (q + north) - (south + north2)) * up + (9 * (q + south) - (north + south2)) * down
        - 0.25 * ((10 * north - q - north2) * (north2 - q)
                  + (10 * south - q - south2) * (q - south2)))


@part_of_sweep
def across(q, south2, south, north, north2, f_3, f_1, f1, f3, scale, near, far, most):
    """The same along another axis; f: velocity on the sides at -3/2 … 3/2 h. The means of products
    take h²/12 δf from the diffusion, `most` at most."""
    stretch = 2 * scale * (f1 - f_1)
    stretch = most if stretch > most else stretch
    stretch = -most if stretch < -most else stretch
    return ((near - stretch - scale * (13 * f1 + f_1)) * (north - q)
            - (near - stretch + scale * (13 * f_1 + f1)) * (q - south)
            + (scale * (f1 + f3) - far) * (north2 - north)
            + (scale * (f_1 + f_3) + far) * (south - south2))


@part_of_sweep
def face_row(out, start, q, a_2, a_1, a1, a2, b_2, b_1, b1, b2, bf_3, bf_1, bf1, bf3,
             c_2, c_1, c1, c2, cf_3, cf_1, cf1, cf3, old, new, dt,
             sa, sb, sc, da, db, dc, ra, rb, rc, mb, mc):
    """A row of values on the faces of axis a: q two and one values before and behind on each axis,
    velocities through the sides of axes b and c, and per axis scale, near, far and most."""
    for i in range(out.size):
        here = q[i]
        rate = (along(here, a_2[i], a_1[i], a1[i], a2[i], sa, da, ra)
                + across(here, b_2[i], b_1[i], b1[i], b2[i], bf_3[i], bf_1[i], bf1[i], bf3[i],
                         sb, db, rb, mb)
                + across(here, c_2[i], c_1[i], c1[i], c2[i], cf_3[i], cf_1[i], cf1[i], cf3[i],
                         sc, dc, rc, mc))
        out[i] = old * start[i] + new * (here + dt * rate)


@part_of_sweep
def cell_row(out, start, q, x_2, x_1, x1, x2, u_3, u_1, u1, u3, y_2, y_1, y1, y2, v_3, v_1, v1, v3,
             z_2, z_1, z1, z2, w_3, w_1, w1, w3, old, new, dt, ax, ay, az, dx, dy, dz):
    """A row of values in cells."""
    for i in range(out.size):
        here = q[i]
        rate = (across(here, x_2[i], x_1[i], x1[i], x2[i], u_3[i], u_1[i], u1[i], u3[i],
                       ax, dx, 0.0, 0.0)
                + across(here, y_2[i], y_1[i], y1[i], y2[i], v_3[i], v_1[i], v1[i], v3[i],
                         ay, dy, 0.0, 0.0)
                + across(here, z_2[i], z_1[i], z1[i], z2[i], w_3[i], w_1[i], w1[i], w3[i],
                         az, dz, 0.0, 0.0))
        out[i] = old * start[i] + new * (here + dt * rate)


@sweep(*[FIELD] * 6, PLANES, ROWS, *[INT] * 3, *[REAL] * 15)
def advance_central4(out, start, q, u, v, w, planes, rows, di, dj, dk,
                     old, new, dt, ax, ay, az, dx, dy, dz, rx, ry, rz, mx, my, mz):
    """All values of this rank; arguments as for `advance_donor`, but ax = 1 / 24h, dx = D / h² and
    3 rx more for velocities, whose δ⁴ takes rx (0 for others) and whose diffusion changes by mx.

    planes (4, ny, nx) keep the velocities through the four z sides around a row, rows (6, nx)
    those through the four y sides and the x sides: each is interpolated once. The value beyond
    the outermost ghost is taken to be that ghost.
    """
    a, b = GHOSTS - di, q.shape[2] - GHOSTS
    low_k, low_j = GHOSTS - dk, GHOSTS - dj
    high_k, high_j = q.shape[0] - GHOSTS, q.shape[1] - GHOSTS
    sides = rows[1, :b - a + 3]
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
            for velocity in (u, v, w):
                fetch_row(velocity, k + 2, j + 2)
            if dj == 0:
                for side in range(j - 2 if j == low_j else j + 1, j + 2):
                    if di + dk:
                        between_row(rows[2 + (side & 3), a:b],
                                    v[k - dk, side, a - di:b - di], v[k, side, a:b],
                                    v[k + dk, side, a + di:b + di],
                                    v[k + 2 * dk, side, a + 2 * di:b + 2 * di])
                    else:
                        copy_row(rows[2 + (side & 3), a:b], v[k, side, a:b])
            to, old_row, here = out[k, j, a:b], start[k, j, a:b], q[k, j, a:b]
            y_2, y_1 = q[k, max(j - 2, 0), a:b], q[k, j - 1, a:b]
            y1, y2 = q[k, j + 1, a:b], q[k, j + 2, a:b]
            z_2, z_1 = q[max(k - 2, 0), j, a:b], q[k - 1, j, a:b]
            z1, z2 = q[k + 1, j, a:b], q[k + 2, j, a:b]
            v_3, v_1 = rows[2 + ((j - 2) & 3), a:b], rows[2 + ((j - 1) & 3), a:b]
            v1, v3 = rows[2 + (j & 3), a:b], rows[2 + ((j + 1) & 3), a:b]
            w_3, w_1 = planes[(k - 2) & 3, j, a:b], planes[(k - 1) & 3, j, a:b]
            w1, w3 = planes[k & 3, j, a:b], planes[(k + 1) & 3, j, a:b]
            if di:
                rows[1, 0] = q[k, j, 0]
                copy_row(rows[1, 1:q.shape[2] + 1], q[k, j])
                face_row(to, old_row, here, rows[1, a - 1:b - 1], rows[1, a:b],
                         rows[1, a + 2:b + 2], rows[1, a + 3:b + 3], y_2, y_1, y1, y2,
                         v_3, v_1, v1, v3, z_2, z_1, z1, z2, w_3, w_1, w1, w3,
                         old, new, dt, ax, ay, az, dx, dy, dz, rx, ry, rz, my, mz)
                continue
            if dj + dk:
                between_row(sides, u[k - dk, j - dj, a - 2:b + 1], u[k, j, a - 2:b + 1],
                            u[k + dk, j + dj, a - 2:b + 1],
                            u[k + 2 * dk, j + 2 * dj, a - 2:b + 1])
            else:
                copy_row(sides, u[k, j, a - 2:b + 1])
            u_3, u_1, u1, u3 = (sides[:b - a], sides[1:b - a + 1], sides[2:b - a + 2],
                                sides[3:b - a + 3])
            x_2, x_1 = q[k, j, a - 2:b - 2], q[k, j, a - 1:b - 1]
            x1, x2 = q[k, j, a + 1:b + 1], q[k, j, a + 2:b + 2]
            if dj:
                face_row(to, old_row, here, y_2, y_1, y1, y2, x_2, x_1, x1, x2, u_3, u_1, u1, u3,
                         z_2, z_1, z1, z2, w_3, w_1, w1, w3,
                         old, new, dt, ay, ax, az, dy, dx, dz, ry, rx, rz, mx, mz)
            elif dk:
                face_row(to, old_row, here, z_2, z_1, z1, z2, x_2, x_1, x1, x2, u_3, u_1, u1, u3,
                         y_2, y_1, y1, y2, v_3, v_1, v1, v3,
                         old, new, dt, az, ax, ay, dz, dx, dy, rz, rx, ry, mx, my)
            else:
                cell_row(to, old_row, here, x_2, x_1, x1, x2, u_3, u_1, u1, u3, y_2, y_1, y1, y2,
                         v_3, v_1, v1, v3, z_2, z_1, z1, z2, w_3, w_1, w1, w3,
                         old, new, dt, ax, ay, az, dx, dy, dz)
