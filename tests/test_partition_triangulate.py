"""Both triangulations use every point, cover the hull exactly and have 2 n - 2 - h triangles."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints, sides, twins
from partition.pane import pane_points, rectangle
from partition.triangulate import TriangulationError, delaunay, orientation, trisection

Floats = NDArray[np.float64]
Method = Callable[[Floats], Ints]
METHODS = pytest.mark.parametrize("method", [trisection, delaunay])


def exact_area(points: Floats, triangles: Ints) -> Fraction:
    """Sum of the areas in rationals; fails if any triangle is flat or clockwise."""
    total = Fraction(0)
    for corners in points[triangles]:
        (ax, ay), (bx, by), (cx, cy) = [[Fraction(float(x)) for x in corner] for corner in corners]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        assert area > 0
        total += area / 2
    return total


def assert_triangulation(points: Floats, triangles: Ints) -> None:
    assert set(triangles.ravel()) == set(range(len(points)))
    twin = twins(triangles)
    border = np.count_nonzero(twin == NO_TWIN)
    assert len(triangles) == 2 * len(points) - 2 - border
    ends = sides(triangles)
    inner = twin != NO_TWIN
    assert np.array_equal(ends[inner], ends[twin[inner]][:, ::-1])


@METHODS
@pytest.mark.parametrize("count", [4, 5, 17, 200, 1100])
def test_pane(method: Method, count: int) -> None:
    points = pane_points(rectangle(2.0, 0.75), count, np.random.default_rng(3))
    assert points.shape == (count, 2)
    triangles = method(points)
    assert_triangulation(points, triangles)
    assert exact_area(points, triangles) == Fraction(3, 2)


@METHODS
def test_grid_of_collinear_points_loses_none(method: Method) -> None:
    """The thesis' open triangles lose 20 of these 36 points."""
    points = np.array([(x, y) for x in range(6) for y in range(6)], dtype=float)
    triangles = method(points)
    assert_triangulation(points, triangles)
    assert len(triangles) == 2 * 36 - 2 - 20
    assert exact_area(points, triangles) == 25


@METHODS
@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=3, max_size=25,
                unique=True))
def test_any_small_integer_points(method: Method, points: list[tuple[int, int]]) -> None:
    """Mostly collinear and cocircular."""
    array = np.array(points, dtype=float)
    assume(np.linalg.matrix_rank(array - array[0]) == 2)
    triangles = method(array)
    assert_triangulation(array, triangles)
    exact_area(array, triangles)


def test_no_point_in_a_circumcircle() -> None:
    points = pane_points(rectangle(1.0, 1.0), 150, np.random.default_rng(1))
    for corners in points[delaunay(points)]:
        (ax, ay), (bx, by), (cx, cy) = corners
        d = 2 * (ax * (by - cy) + bx * (cy - ay) + cx * (ay - by))
        centre = np.array([(ax**2 + ay**2) * (by - cy) + (bx**2 + by**2) * (cy - ay)
                           + (cx**2 + cy**2) * (ay - by),
                           (ax**2 + ay**2) * (cx - bx) + (bx**2 + by**2) * (ax - cx)
                           + (cx**2 + cy**2) * (bx - ax)]) / d
        radius = np.hypot(*(corners[0] - centre))
        assert np.hypot(*(points - centre).T).min() >= radius * (1 - 1e-9)


def test_delaunay_is_not_a_minimum_weight_triangulation() -> None:
    """Of these four points Delaunay takes the longer diagonal."""
    points = np.array([(9, 2), (10, 8), (1, 7), (8, 1)], dtype=float)
    ends = sides(delaunay(points))
    inner = ends[twins(delaunay(points)) != NO_TWIN][0]
    assert np.hypot(*(points[inner[0]] - points[inner[1]])) == pytest.approx(89**0.5)


def test_orientation_is_exact_where_floating_point_is_not() -> None:
    """On the line through (12, 12) and (24, 24), one unit in the last place decides."""
    step = 2.0**-53
    points = np.array([(0.5 + 4 * step, 0.5 + 2 * step), (12.0, 12.0), (24.0, 24.0), (0.5, 0.5)])
    assert orientation(points, 0, 1, 2) == -1
    assert orientation(points, 3, 1, 2) == 0
    assert orientation(points, 0, 2, 1) == 1


@METHODS
@pytest.mark.parametrize("points, complaint", [
    ([(0, 0), (1, 1), (2, 2), (5, 5)], "one line"),
    ([(0, 0), (1, 0), (0, 1), (1, 0)], "twice"),
    ([(0, 0), (1, 0), (np.nan, 1)], "not finite")])
def test_points_that_span_no_area_are_refused(method: Method, points: list[tuple[float, float]],
                                              complaint: str) -> None:
    with pytest.raises(TriangulationError, match=complaint):
        method(np.array(points, dtype=float))
