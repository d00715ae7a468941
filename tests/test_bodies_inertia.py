"""Mass, centre and inertia against closed forms: solids by volume, shells by area."""

import numpy as np
import pytest

from partition import shapes
from solver.inertia import mass_properties

QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def box(size, detail=0):
    return shapes.box(size, detail)


def solid(vertices, faces, **kwargs):
    return mass_properties(vertices, faces, True, 2.0, None, **kwargs)


@pytest.mark.parametrize("detail", [0, 2])
@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (1.0, 2.0, 3.0), (0.3, 0.3, 0.01)])
def test_solid_box(size, detail):
    """m/12 diag(h² + d², w² + d², w² + h²), however finely the surface is cut."""
    vertices, faces = box(size, detail)
    w, h, d = size
    piece = solid(vertices + [2, 3, 4], faces)
    mass = 2 * w * h * d
    assert piece.mass == pytest.approx(mass, rel=1e-12)
    assert piece.centre == pytest.approx([2, 3, 4], abs=1e-12)
    exact = mass / 12 * np.diag([h * h + d * d, w * w + d * d, w * w + h * h])
    assert np.abs(piece.inertia - exact).max() < 1e-12 * exact.max()
    assert piece.vertex_area.sum() == pytest.approx(2 * (w * h + w * d + h * d), rel=1e-12)


def test_unit_cube_and_the_numbers_of_a_pane():
    assert solid(*box((1, 1, 1))).inertia[0, 0] / 2 == pytest.approx(1 / 6)
    pane = solid(*box((0.3, 0.3, 0.01)))
    assert np.diag(pane.inertia) / pane.mass == pytest.approx([0.00750833, 0.00750833, 0.015],
                                                              rel=1e-5)


def test_rotated_and_far_away_box():
    vertices, faces = box((1, 2, 3))
    piece = solid(vertices @ QUARTER.T + 1e4, faces)
    exact = QUARTER @ solid(vertices, faces).inertia @ QUARTER.T
    assert np.abs(piece.inertia - exact).max() < 1e-7


def test_inside_out_box_is_refused():
    vertices, faces = box((1, 2, 3))
    with pytest.raises(ValueError, match="no volume"):
        solid(vertices, faces[:, ::-1])


@pytest.mark.parametrize("closed, factor", [(True, 2 / 5), (False, 2 / 3)])
def test_sphere_solid_and_hollow(closed, factor):
    """2 m r²/5 and 2 m r²/3: the mesh approaches them at second order in the edge length."""
    errors = []
    for detail in (2, 3, 4):
        vertices, faces = shapes.sphere(0.5, detail)
        piece = mass_properties(vertices, faces, closed, 3.0, None if closed else 3.0)
        assert np.abs(piece.inertia - piece.inertia[0, 0] * np.eye(3)).max() < 1e-12
        errors.append(1 - piece.inertia[0, 0] / (factor * piece.mass * 0.25))
    assert 0 < errors[-1] < 5e-3
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([4, 4], rel=0.05)


def test_open_sheet_is_a_lamina_and_its_centre_does_not_follow_the_tessellation():
    """Unit square with one corner refined many times: centre (½, ½), I = m/12 diag(1, 1, 2)."""
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    extra = [[2.0**-n, 0.0] for n in range(1, 20)]
    points = np.vstack([corners, extra])
    fan = [0, *range(len(points) - 1, 3, -1), 1, 2]         # along y = 0, then up
    ring = np.array([[3, fan[n], fan[n + 1]] for n in range(len(fan) - 1)])
    vertices = np.column_stack([points, np.zeros(len(points))])
    piece = mass_properties(vertices, ring.astype(np.int32), False, None, 3.0)
    assert piece.mass == pytest.approx(3.0, rel=1e-12)
    assert piece.centre == pytest.approx([0.5, 0.5, 0], abs=1e-12)
    assert np.diag(piece.inertia) == pytest.approx([0.25, 0.25, 0.5], rel=1e-9)
    assert vertices.mean(axis=0)[0] < 0.25                  # the mean of the vertices does
