"""Free rotation: quaternions, and Euler's equations without drift."""

import numpy as np
import pytest

from solver.rigid import throw
from solver.vertices import SUMS

INERTIA = np.diag([1.0, 2.0, 3.0])


class Top:
    """One body without drag or gravity."""

    def __init__(self, inertia, spin):
        self.inertia = np.ascontiguousarray(inertia, float)[None]
        self.inverse = np.linalg.inv(self.inertia)
        self.position, self.velocity = np.zeros((1, 3)), np.zeros((1, 3))
        self.orientation = np.array([[1.0, 0, 0, 0]])
        self.spin = np.array([spin], float)

    def turn(self, dt, steps=1):
        for _ in range(steps):
            throw(np.zeros((1, SUMS)), np.ones(1), self.inertia, self.inverse, np.zeros(1),
                  np.zeros(1, np.uint8), np.zeros(3), dt, self.position, self.orientation,
                  self.velocity, self.spin)

    @property
    def matrix(self):
        w, x, y, z = self.orientation[0]
        return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])

    @property
    def momentum(self):
        return self.matrix @ self.inertia[0] @ self.matrix.T @ self.spin[0]

    @property
    def energy(self):
        return 0.5 * self.spin[0] @ self.momentum


@pytest.mark.parametrize("steps", [1, 10, 1000])
def test_constant_spin_is_the_exponential_map(steps):
    """ω = (1, 2, 3) for t = 1 takes e_x to (-0.694921, -0.192007, 0.692978), however cut."""
    top = Top(np.eye(3), [1, 2, 3])
    top.turn(1.0 / steps, steps)
    assert top.matrix[:, 0] == pytest.approx([-0.694921, -0.192007, 0.692978], abs=1e-6)
    assert top.spin[0] == pytest.approx([1, 2, 3], abs=1e-12)


@pytest.mark.parametrize("dt", [1e-3, 0.1, 10.0])
def test_torque_free_top_keeps_momentum_and_energy(dt):
    top = Top(INERTIA, [0.5, 1.0, -0.7])
    momentum, energy = top.momentum, top.energy
    top.turn(dt, 10_000 if dt < 1 else 100)
    assert np.linalg.norm(top.momentum - momentum) < 1e-10 * np.linalg.norm(momentum)
    assert abs(top.energy - energy) < 1e-10 * energy
    assert abs(np.linalg.norm(top.orientation) - 1) < 1e-14


def test_symmetric_top_precesses_at_the_exact_rate_to_second_order():
    """In body axes ω circles the axis at Ω = (I₃ - I₁) ω₃ / I₁."""
    inertia, spin, errors = np.diag([1.0, 1.0, 1.8]), np.array([0.3, 0.0, 2.0]), []
    rate = (1.8 - 1.0) * 2.0
    for steps in (50, 100, 200):
        top = Top(inertia, spin)
        top.turn(3.0 / steps, steps)
        body = top.matrix.T @ top.spin[0]
        exact = [0.3 * np.cos(3 * rate), 0.3 * np.sin(3 * rate), 2.0]
        errors.append(np.abs(body - exact).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 1.9


def test_rotation_about_the_intermediate_axis_flips_over():
    """Dzhanibekov: unstable about the middle inertia, stable about the others."""
    lowest = []
    for axis in range(3):
        spin = np.full(3, 1e-3)
        spin[axis] = 1.0
        top, along = Top(INERTIA, spin), []
        for _ in range(600):
            top.turn(0.1)
            along.append((top.matrix.T @ top.spin[0])[axis])
        lowest.append(min(along))
    assert lowest[0] > 0.99 and lowest[2] > 0.99
    assert lowest[1] < -0.99
