"""Points of a pane: as many as asked, corners and edges included, laid out as their name says."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partition.build import BuildError, build
from partition.pane import pane_points, rectangle
from partition.triangulate import TriangulationError, delaunay, orientation, trisection
from solver import scene

Floats = NDArray[np.float64]
HEXAGON = np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3)], axis=1)
SAMPLINGS = ["random", "even", "radial"]


def stream() -> np.random.Generator:
    return np.random.default_rng(12)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("outline", [rectangle(2, 1), HEXAGON, HEXAGON[::-1], HEXAGON[:3]],
                         ids=["rectangle", "hexagon", "clockwise", "triangle"])
@pytest.mark.parametrize("count", [6, 50, 400])
def test_exact_count_inside_the_outline(sampling: str, outline: Floats, count: int) -> None:
    points = pane_points(outline, count, stream(), sampling, (0.1, 0.2))
    assert points.shape == (count, 2) and len(np.unique(points, axis=0)) == count
    assert {tuple(p) for p in outline} <= {tuple(p) for p in points}
    for method in (trisection, delaunay):
        triangles = method(points)
        assert set(triangles.ravel()) == set(range(count))
        assert (orientation(points, *triangles.T) > 0).all()


def gaps(points: Floats) -> Floats:
    return cKDTree(points).query(points, 2)[0][:, 1]


def test_even_points_do_not_cluster() -> None:
    random, even = (gaps(pane_points(rectangle(1, 1), 500, stream(), kind))
                    for kind in ("random", "even"))
    assert np.quantile(even, 0.05) > 4 * np.quantile(random, 0.05)


def test_radial_points_are_dense_at_the_impact() -> None:
    """Half of R u^2 lies within a quarter of R."""
    impact = np.array([0.2, -0.1])
    points = pane_points(rectangle(2, 2), 800, stream(), "radial", tuple(impact))
    far = np.linalg.norm(points - impact, axis=1)
    assert gaps(points)[far < 0.2].mean() < 0.4 * gaps(points)[far > 0.7].mean()


def test_impact_beside_the_pane() -> None:
    points = pane_points(rectangle(1, 1), 100, stream(), "radial", (3.0, 0.0))
    assert abs(points).max() <= 0.5 and len(points) == 100


def test_refusals() -> None:
    notch = np.array([(0, 0), (1, 0), (0.4, 0.4), (0, 1)])
    with pytest.raises(TriangulationError, match="not a convex polygon"):
        pane_points(notch, 50, stream())
    with pytest.raises(TriangulationError, match="points = 5: fewer than the 6 corners"):
        pane_points(HEXAGON, 5, stream())


def window(**body: object) -> dict[str, object]:
    table = {"name": "pane", "shape": "pane", "areal_density": 1.0, "size": [0.8, 0.4, 0.02],
             "place": [0.3, 0.4, 0.5], "rotate": [10.0, 20.0, 30.0], **body}
    return {"time": {"end": 1.0, "frame": 0.1}, "body": [table]}


def test_hexagonal_window_of_512_pieces() -> None:
    scaled = (HEXAGON / 2).tolist()
    fragments = build(scene.build(window(outline=scaled, points=1400, sampling="even",
                                         fracture={"pieces": 512})))
    assert fragments.count == 512
    area = 1.5 * 3**0.5 * 0.4 * 0.2
    assert fragments.measures()[1].sum() == pytest.approx(area * 0.02, rel=1e-9)


def test_impact_is_where_the_detonation_is() -> None:
    """Through rotation, scale and place: half of the points lie within a quarter of the reach."""
    where = [0.35, 0.45, 0.5]
    near = {}
    for sampling in ("random", "radial"):
        data = window(points=600, sampling=sampling, scale=2.0)
        data["detonation"] = {"position": where}
        vertices = build(scene.build(data)).vertices
        near[sampling] = np.median(np.linalg.norm(vertices - where, axis=1))
    assert near["radial"] < 0.65 * near["random"]


def test_error_names_the_body() -> None:
    with pytest.raises(BuildError, match=r"body.0 = 'pane': outline: not a convex"):
        build(scene.build(window(outline=[(0, 0), (1, 0), (0.4, 0.4), (0, 1)])))
