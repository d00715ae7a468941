"""Breadth-first pieces: exactly as many as asked, each connected, balanced, every triangle once."""

import numpy as np
import pytest
from numpy.typing import NDArray

from partition.bfs import PartitionError, break_up, share_out
from partition.graph import Ints, components, cut_twins, neighbours, twins
from partition.measure import triangle_areas
from partition.pane import pane_points, rectangle
from partition.shapes import sphere
from partition.triangulate import delaunay, trisection

Floats = NDArray[np.float64]
POINTS = pane_points(rectangle(1.0, 1.0), 200, np.random.default_rng(5))
TRIANGLES = {"trisection": trisection(POINTS), "delaunay": delaunay(POINTS)}


def areas(faces: Ints) -> Floats:
    return triangle_areas(np.column_stack([POINTS, np.zeros(len(POINTS))]), faces)


def pieces_of(faces: Ints, pieces: int, weight: Floats | None = None,
              distance: Floats | None = None) -> Ints:
    twin = twins(faces)
    return break_up(neighbours(twin), np.ones(len(faces)) if weight is None else weight, pieces,
                    components(len(faces), twin), distance)


def assert_whole(faces: Ints, label: Ints, pieces: int) -> None:
    """Labels 0 ... pieces - 1 are all used, and each is one edge-connected component."""
    assert np.array_equal(np.unique(label), np.arange(pieces))
    component = components(len(faces), cut_twins(twins(faces), label))
    assert component.max() + 1 == pieces


@pytest.mark.parametrize("method", TRIANGLES)
def test_every_number_of_pieces(method: str) -> None:
    faces = TRIANGLES[method]
    for pieces in [*range(1, 70), 100, 128, len(faces) - 1, len(faces)]:
        assert_whole(faces, pieces_of(faces, pieces, areas(faces)), pieces)


@pytest.mark.parametrize("method", TRIANGLES)
def test_start_at_a_point(method: str) -> None:
    """Piece 0 holds the triangle where the search starts."""
    faces = TRIANGLES[method]
    distance = np.hypot(*(POINTS[faces].mean(axis=1) - (0.4, 0.6)).T)
    for pieces in (2, 3, 16, 61):
        label = pieces_of(faces, pieces, areas(faces), distance)
        assert_whole(faces, label, pieces)
        assert label[np.argmin(distance)] == 0


def test_pieces_of_one_triangle_each() -> None:
    faces = TRIANGLES["delaunay"]
    assert np.array_equal(np.sort(pieces_of(faces, len(faces))), np.arange(len(faces)))


@pytest.mark.parametrize("pieces", [2, 5, 16])
def test_balance(pieces: int) -> None:
    """Equal triangles on a sphere: no piece strays far from the mean."""
    _, faces = sphere(1.0, 4)
    size = np.bincount(pieces_of(faces, pieces))
    assert size.std() / size.mean() < 0.1


def test_balance_follows_the_weight() -> None:
    faces = TRIANGLES["delaunay"]
    for weight in (areas(faces), np.ones(len(faces))):
        share = np.bincount(pieces_of(faces, 8, weight), weight) / weight.sum()
        assert abs(share - 1 / 8).max() < 0.05


def test_separate_parts_share_the_pieces_by_weight() -> None:
    _, one = sphere(1.0, 1)
    faces = np.concatenate([one, one + 1000, one + 2000])
    weight = np.repeat([1.0, 2.0, 5.0], len(one))
    label = pieces_of(faces, 16, weight)
    assert_whole(faces, label, 16)
    each = [len(np.unique(part)) for part in np.split(label, 3)]
    assert each == [2, 4, 10]


def test_one_triangle_bridges() -> None:
    """A strip is cut across: every piece of it is a run of consecutive triangles."""
    strip = np.array([(i, i + 1, i + 2) if i % 2 == 0 else (i + 1, i, i + 2) for i in range(31)])
    for pieces in range(1, 32):
        label = pieces_of(strip, pieces)
        assert np.count_nonzero(np.diff(label)) == pieces - 1
        assert np.bincount(label).max() - np.bincount(label).min() <= 2


def test_same_labels_every_time() -> None:
    faces = TRIANGLES["trisection"]
    first, second = pieces_of(faces, 23, areas(faces)), pieces_of(faces, 23, areas(faces))
    assert np.array_equal(first, second)


def test_refusals() -> None:
    faces = TRIANGLES["delaunay"]
    with pytest.raises(PartitionError, match=f"pieces = 1000: more than the {len(faces)} tri"):
        pieces_of(faces, 1000)
    two = np.array([(0, 1, 2), (3, 4, 5)])
    with pytest.raises(PartitionError, match="fewer than the 2 separate parts"):
        pieces_of(two, 1)


def test_largest_remainder() -> None:
    many = np.full(3, 100)
    assert list(share_out(10, np.array([5.0, 3.0, 2.0]), many)) == [5, 3, 2]
    assert list(share_out(7, np.array([5.0, 3.0, 2.0]), many)) == [4, 2, 1]
    assert list(share_out(3, np.array([1000.0, 1.0, 1.0]), many)) == [1, 1, 1]
    assert list(share_out(10, np.array([8.0, 1.0, 1.0]), np.array([4, 9, 9]))) == [4, 3, 3]
