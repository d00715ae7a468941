"""Advection by donor cell, central differences or a blend of both, with diffusion, in one sweep.

    q_new = a q_old + b (q + dt [-(u·∇)q + D ∇²q])

On the control volume of a value q, with the velocities F through its six sides (outwards positive),
the advective form is -(u·∇)q = -Σ F (q_side - q) / h, whatever ∇·u is. The blend
q_side = ½(q + q_N) - ½ γ sign(F) (q_N - q) makes of it

    -(u·∇)q = Σ_sides (γ|F| - F) (q_N - q) / 2h

γ = 1: donor cell, first order, within the bounds of the neighbours for dt Σ|u|/h ≤ 1.
γ = 0: central, second order; for ∇·u = 0 it makes and destroys no ½q², and needs Runge-Kutta.
Source: Griebel, Dornseifer & Neunhoeffer, Numerical Simulation in Fluid Dynamics (SIAM 1998).
"""

from solver.kernel import FIELD, GHOSTS, INT, REAL, part_of_sweep, sweep


@part_of_sweep
def blend_row(out, start, here, east, west, north, south, front, rear,
              east_a, east_b, west_a, west_b, north_a, north_b, south_a, south_b,
              front_a, front_b, rear_a, rear_b, old, new, dt, blend, ax, ay, az, dx, dy, dz):
    """One row of values; F of a side is the mean of its two velocities (a, b): ax = 1 / 4h."""
    bx, by, bz = blend * ax, blend * ay, blend * az
    for i in range(out.size):
        q = here[i]
        e, w = east_a[i] + east_b[i], west_a[i] + west_b[i]
        n, s = north_a[i] + north_b[i], south_a[i] + south_b[i]
        f, r = front_a[i] + front_b[i], rear_a[i] + rear_b[i]
        rate = ((bx * abs(e) - ax * e + dx) * (east[i] - q)
                + (bx * abs(w) + ax * w + dx) * (west[i] - q)
                + (by * abs(n) - ay * n + dy) * (north[i] - q)
                + (by * abs(s) + ay * s + dy) * (south[i] - q)
                + (bz * abs(f) - az * f + dz) * (front[i] - q)
                + (bz * abs(r) + az * r + dz) * (rear[i] - q))
        out[i] = old * start[i] + new * (q + dt * rate)


@sweep(*[FIELD] * 6, INT, INT, INT, *[REAL] * 10)
def advance_donor(out, start, q, u, v, w, di, dj, dk, old, new, dt, blend, ax, ay, az, dx, dy, dz):
    """All values of this rank, for a face field its low face too.

    (di, dj, dk) leads to the other cell that the control volume spans: (1, 0, 0) for u, zeros for a
    cell-centred q. dx, dy, dz = D / h². `start` is q_old.
    """
    a, b = GHOSTS - di, q.shape[2] - GHOSTS
    for k in range(GHOSTS - dk, q.shape[0] - GHOSTS):
        for j in range(GHOSTS - dj, q.shape[1] - GHOSTS):
            K, J, A, B = k + dk, j + dj, a + di, b + di
            blend_row(out[k, j, a:b], start[k, j, a:b], q[k, j, a:b],
                      q[k, j, a + 1:b + 1], q[k, j, a - 1:b - 1],
                      q[k, j + 1, a:b], q[k, j - 1, a:b], q[k + 1, j, a:b], q[k - 1, j, a:b],
                      u[k, j, a:b], u[K, J, A:B], u[k, j, a - 1:b - 1], u[K, J, A - 1:B - 1],
                      v[k, j, a:b], v[K, J, A:B], v[k, j - 1, a:b], v[K, J - 1, A:B],
                      w[k, j, a:b], w[K, J, A:B], w[k - 1, j, a:b], w[K - 1, J, A:B],
                      old, new, dt, blend, ax, ay, az, dx, dy, dz)
