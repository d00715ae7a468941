"""Weights, Laplacian and its slowest modes, to closed forms."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import csr_array

from partition import spectral
from partition.graph import Ints
from partition.shapes import sphere, subdivide
from partition.repair import repaired
from partition.laplacian import laplacian
from partition.rows import adjacency, breadth_first, rows, times
from partition.spectral import SpectralError, modes
from partition.weights import (Graph, angle_defects, curvature, dihedral_graph, ring_areas,
                               thesis_graph)
from tests.partition_shapes import dumb_bell, folded_sheet, octahedron

Floats = NDArray[np.float64]
METHODS = pytest.mark.parametrize("method", ["direct", "iterative"])


def unit(count: int, links: list[tuple[int, int]]) -> Graph:
    """A graph of unit masses and weights."""
    a, b = np.array(links).T
    one = np.ones(len(links))
    return Graph(np.ones(count), a, b, one, one, one)


def path(n: int) -> Graph:
    return unit(n, [(i, i + 1) for i in range(n - 1)])


def cycle(n: int) -> Graph:
    return unit(n, [(i, (i + 1) % n) for i in range(n)])


def grid(n: int, m: int) -> Graph:
    links = [(i * m + j, (i + 1) * m + j) for i in range(n - 1) for j in range(m)]
    return unit(n * m, links + [(i * m + j, i * m + j + 1) for i in range(n) for j in range(m - 1)])


@METHODS
@pytest.mark.parametrize("graph, value", [
    (path(50), 2 - 2 * np.cos(np.pi / 50)),
    (cycle(60), 2 - 2 * np.cos(2 * np.pi / 60)),
    (grid(30, 11), 2 - 2 * np.cos(np.pi / 30))], ids=["path", "cycle", "grid"])
def test_closed_forms(graph: Graph, value: float, method: str) -> None:
    found = modes(graph, 2, MPI.COMM_WORLD, method)
    assert found.values[0] == pytest.approx(value, rel=1e-10)
    assert found.residuals[0] < 1e-6
    if value == 2 - 2 * np.cos(np.pi / 50):
        exact = np.cos(np.pi * (np.arange(50) + 0.5) / 50) * np.sqrt(2 / 50)
        assert abs(found.vectors[:, 0] @ exact) == pytest.approx(1, rel=1e-10)


@pytest.mark.parametrize("n", [2, 3, 4, 7])
def test_handful_of_nodes(n: int) -> None:
    assert modes(path(n), 2).values[0] == pytest.approx(2 - 2 * np.cos(np.pi / n))


@METHODS
@pytest.mark.parametrize("mass", ["area", "count"])
def test_slepc_equals_the_dense_solution(method: str, mass: str) -> None:
    graph = dihedral_graph(dumb_bell(0.2), mass)
    root = np.sqrt(graph.mass)
    values, vectors = np.linalg.eigh(laplacian(graph).toarray() / np.outer(root, root))
    found = modes(graph, 2, MPI.COMM_WORLD, method)
    assert found.values == pytest.approx(values[1:3], rel=1e-9)
    assert abs(found.vectors[:, 0] @ (root * vectors[:, 1])) == pytest.approx(1, rel=1e-8)
    assert found.vectors[:, 0] @ graph.mass == pytest.approx(0, abs=1e-9)


def test_without_hypre(monkeypatch: pytest.MonkeyPatch) -> None:
    """PETSc's own multigrid gives the same modes."""
    graph = dihedral_graph(dumb_bell(0.1), "count")
    exact = modes(graph, 1, MPI.COMM_WORLD, "direct")
    monkeypatch.setattr(spectral, "HYPRE", False)
    found = modes(graph, 1, MPI.COMM_WORLD, "iterative")
    assert found.values[0] == pytest.approx(exact.values[0], rel=1e-9)
    assert found.next_value == pytest.approx(exact.next_value, rel=1e-3)


def test_laplacian_is_incidence_squared() -> None:
    """L = B W B^T, L 1 = 0, and one eigenvalue 0 per connected part."""
    rng = np.random.default_rng(4)
    one = thesis_graph(dumb_bell(0.25), "count")
    n = len(one.mass)
    graph = Graph(np.ones(2 * n), np.concatenate([one.a, one.a + n]),
                  np.concatenate([one.b, one.b + n]), rng.uniform(0.1, 9, 2 * len(one.a)),
                  np.ones(2 * len(one.a)), np.ones(2 * len(one.a)))
    incidence = np.zeros((2 * n, len(graph.a)))
    incidence[graph.a, np.arange(len(graph.a))] = 1
    incidence[graph.b, np.arange(len(graph.a))] = -1
    dense = laplacian(graph).toarray()
    assert dense == pytest.approx(incidence * graph.weight @ incidence.T, abs=1e-12)
    assert dense @ np.ones(2 * n) == pytest.approx(0, abs=1e-11)
    values = np.linalg.eigvalsh(dense)
    assert values[:2] == pytest.approx(0, abs=1e-10) and values[2] > 1e-3


def test_rows_in_another_order() -> None:
    """P L P^T, whole and a share of its rows."""
    graph = dihedral_graph(dumb_bell(0.25), "area")
    matrix, n = laplacian(graph), len(graph.mass)
    order = np.random.default_rng(6).permutation(n).astype(np.int32)
    linked = adjacency(n, graph.a, graph.b, graph.weight)
    for low, high in ((0, n), (n // 3, n // 2)):
        start, columns, values = rows(*linked, order, low, high)
        found = csr_array((values, columns, start), shape=(high - low, n))
        assert found.has_sorted_indices
        assert np.array_equal(found.toarray(), matrix.toarray()[order][low:high, order])


def test_links_given_more_than_once_add_up() -> None:
    graph = unit(4, [(0, 1), (2, 1), (1, 0), (1, 2), (0, 1), (3, 0)])
    linked = adjacency(4, graph.a, graph.b, graph.weight)
    start, columns, values = rows(*linked, np.arange(4, dtype=np.int32), 0, 4)
    assert start.tolist() == [0, 3, 6, 8, 10]
    assert columns.tolist() == [0, 1, 3, 0, 1, 2, 1, 2, 0, 3]
    assert values.tolist() == [4, -3, -1, -3, 5, -2, -2, 2, -1, 1]


def test_product_link_by_link() -> None:
    graph = dihedral_graph(dumb_bell(0.2), "area")
    vector = np.random.default_rng(3).standard_normal(len(graph.mass))
    matrix = laplacian(graph)
    assert times(graph.a, graph.b, graph.weight, vector) == pytest.approx(
        matrix @ vector, rel=1e-12, abs=1e-12 * abs(matrix).max())


def test_breadth_first_order() -> None:
    """In a grid every node stands within two layers of its neighbours; separate parts follow one
    another."""
    n, m = 30, 7
    shuffled = np.random.default_rng(5).permutation(n * m)
    graph = grid(n, m)
    start, near, _ = adjacency(n * m, shuffled[graph.a], shuffled[graph.b], graph.weight)
    place = np.argsort(breadth_first(start, near))
    assert sorted(place) == list(range(n * m))
    assert abs(place[shuffled[graph.a]] - place[shuffled[graph.b]]).max() < 4 * m
    two = unit(9, [(3, 0), (0, 8), (8, 1), (2, 4), (4, 6), (6, 7), (7, 5)])
    start, near, _ = adjacency(9, two.a, two.b, two.weight)
    assert breadth_first(start, near).tolist() == [0, 3, 8, 1, 2, 4, 6, 7, 5]


def test_separate_parts_have_no_fiedler_vector() -> None:
    """Two parts in one eigenproblem: the solver is never asked, and says so if it is."""
    two = unit(40, [(i, i + 1) for i in range(39) if i != 19])
    with pytest.raises(SpectralError, match="fix: "):
        modes(two, 2)


def test_octahedron() -> None:
    """The thesis' example, computed from its coordinates."""
    mesh = octahedron()
    apex = abs(mesh.vertices[:, 2]) > 0.5
    assert ring_areas(mesh) == pytest.approx(2.23606797749979, rel=1e-12)
    half = np.arctan(1 / 5**0.5)    # of the angle of each triangle at its apex
    assert angle_defects(mesh)[~apex] == pytest.approx(4 * half, rel=1e-12)
    assert angle_defects(mesh)[apex] == pytest.approx(2 * np.pi - 8 * half, rel=1e-12)
    assert angle_defects(mesh).sum() == pytest.approx(4 * np.pi, rel=1e-12)
    inverse = 1 / curvature(mesh)
    assert inverse[~apex] == pytest.approx(0.44310, rel=1e-4)
    assert inverse[apex] == pytest.approx(0.25535, rel=1e-4)
    graph = thesis_graph(mesh, "count")
    raw = Graph(graph.mass, graph.a, graph.b, (inverse[graph.a] + inverse[graph.b]) / 2,
                graph.length, graph.cost)
    values, vectors = np.linalg.eigh(laplacian(raw).toarray())
    assert values == pytest.approx([0, 1.396909, 1.584656, 1.584656, 2.095364, 2.470857], abs=1e-6)
    assert abs(vectors[apex, 1]) == pytest.approx(0.5**0.5, rel=1e-9)
    assert vectors[apex, 1].sum() == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("radius", [0.01, 1.0, 300.0])
def test_curvature_of_a_sphere(radius: float) -> None:
    mesh = repaired(*sphere(radius, 3), "sphere")
    assert curvature(mesh).mean() == pytest.approx(1 / radius**2, rel=0.01)
    assert angle_defects(mesh).sum() == pytest.approx(4 * np.pi)


def test_border_and_plane_have_no_curvature() -> None:
    """A flat sheet: no vertex but its corners is curved, and its weights are finite."""
    sheet = folded_sheet(0)
    assert np.count_nonzero(abs(angle_defects(sheet)) > 1e-9) == 4
    assert angle_defects(sheet).sum() == pytest.approx(2 * np.pi)
    for graph in (thesis_graph(sheet, "area"), dihedral_graph(sheet, "area")):
        assert np.isfinite(graph.weight).all() and (graph.weight > 0).all()


def test_weights_of_a_flat_sheet_do_not_depend_on_the_mesh() -> None:
    """lambda_2 of -div grad on 1 x 0.5 with free edges is pi^2, on any triangulation."""
    sheet = folded_sheet(0)
    values = []
    for _ in range(2):
        values.append(modes(dihedral_graph(sheet, "area"), 1).values[0])
        sheet = repaired(*subdivide(sheet.vertices, sheet.faces), "finer")
    assert values == pytest.approx([np.pi**2] * 2, rel=0.1)


def test_all_weights_positive_on_saddles() -> None:
    mesh = dumb_bell(0.2)
    assert (curvature(mesh) < 0).any()
    for graph in (thesis_graph(mesh, "count"), dihedral_graph(mesh, "count")):
        assert (graph.weight > 0).all()
        assert np.linalg.eigvalsh(laplacian(graph).toarray())[1] > 0


def test_every_inner_edge_is_one_link() -> None:
    mesh = dumb_bell(0.2)
    dual, direct = dihedral_graph(mesh, "area"), thesis_graph(mesh, "area")
    assert len(dual.a) == len(direct.a) == 3 * len(mesh.faces) // 2
    assert dual.mass.sum() == pytest.approx(direct.mass.sum()) == pytest.approx(mesh.area)
    assert _pairs(dual.a, dual.b).shape == (len(dual.a), 2)
    assert _pairs(direct.a, direct.b).shape == (len(direct.a), 2)


def _pairs(a: Ints, b: Ints) -> Ints:
    return np.unique(np.sort(np.stack([a, b], axis=1), axis=1), axis=0)
