"""Cuts along eigenvectors: where they should be, whole, exact in number, the same every time."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from numpy.typing import NDArray

from partition import cut
from partition.bfs import PartitionError
from partition.divide import divide
from partition.fracture import Sheet, labels
from partition.graph import Ints, components, cut_twins
from partition.half_list import half_list
from partition.measure import triangle_areas
from partition.mesh import Mesh
from partition.repair import repaired
from partition.shapes import box, sphere, subdivide
from solver.scene_body import Cut, Fracture
from tests.partition_shapes import dumb_bell, folded_sheet, lopsided, turned

Floats = NDArray[np.float64]
BELL = dumb_bell()
ANY_CUT = [Cut(method="spectral", weights=weights, cut=rule, mass=mass)
           for weights in ("dihedral", "thesis") for rule in ("sweep", "sign", "median")
           for mass in ("area", "count")]


def spectral(**keys: object) -> Cut:
    return Cut.model_validate({"method": "spectral", **keys})


def split(mesh: Mesh, wanted: Cut, pieces: int = 2) -> Ints:
    label, _ = divide(mesh, wanted, pieces, MPI.COMM_WORLD)
    assert np.array_equal(np.unique(label), np.arange(pieces))
    parts = components(len(label), cut_twins(mesh.twin, label))
    assert parts.max() + 1 == pieces
    return label


def areas(mesh: Mesh) -> Floats:
    return triangle_areas(mesh.vertices, mesh.faces)


@pytest.mark.parametrize("wanted", ANY_CUT, ids=lambda w: f"{w.weights}-{w.cut}-{w.mass}")
@pytest.mark.parametrize("pieces", [1, 2, 3, 7, 16])
def test_exactly_so_many_whole_pieces(wanted: Cut, pieces: int) -> None:
    split(BELL, wanted, pieces)


@pytest.mark.parametrize("wanted", [spectral(), spectral(mass="count"), spectral(cut="sign"),
                                    spectral(weights="thesis"),
                                    spectral(weights="thesis", mass="count")])
def test_dumb_bell_is_cut_at_its_neck(wanted: Cut) -> None:
    label = split(BELL, wanted)
    crossing = np.flatnonzero((label[np.arange(len(BELL.twin)) // 3] != label[BELL.twin // 3]))
    x = BELL.vertices[BELL.faces.ravel()[crossing], 0]
    assert -0.4 < x.min() and x.max() < 0.45


def test_shortest_cut_is_a_ring_round_the_neck() -> None:
    _, made = divide(BELL, spectral(), 2)
    assert 0.95 < made[0].length / (2 * np.pi * 0.15) < 1.3
    assert made[0].residual < 1e-6 and made[0].ratio > 1.05


@pytest.mark.parametrize("degrees", [30, 60, 90, -60])
def test_folded_sheet_is_cut_on_its_fold(degrees: float) -> None:
    sheet = folded_sheet(degrees)
    label = split(sheet, spectral())
    beyond = abs(sheet.vertices[sheet.faces][:, :, 2]).max(axis=1) > 1e-9
    agree = areas(sheet)[label == (label[np.argmax(beyond)] * beyond
                                   + (1 - label[np.argmax(beyond)]) * ~beyond)].sum()
    assert agree == pytest.approx(areas(sheet).sum(), rel=1e-12)


def test_flat_sheet_is_halved() -> None:
    sheet = folded_sheet(0)
    for wanted in (spectral(), spectral(weights="thesis")):
        share = np.bincount(split(sheet, wanted), areas(sheet)) / areas(sheet).sum()
        assert share == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("shape", [sphere(1.0, 3), box((1, 1, 1), 3)], ids=["sphere", "cube"])
def test_multiple_eigenvalues_still_give_halves(shape: tuple[Floats, Ints]) -> None:
    mesh = repaired(*shape, "shape")
    for wanted in (spectral(), spectral(weights="thesis")):
        first, second = split(mesh, wanted), split(mesh, wanted)
        assert np.array_equal(first, second)
        assert np.bincount(first, areas(mesh))[0] / mesh.area == pytest.approx(0.5, abs=0.04)


@pytest.mark.parametrize("wanted", [spectral(), spectral(mass="count"), spectral(weights="thesis"),
                                    spectral(cut="median")], ids=str)
@pytest.mark.parametrize("seed, scale", [(1, 1.0), (2, 1000.0), (3, 1e-3)])
def test_turned_scaled_and_renumbered(wanted: Cut, seed: int, scale: float) -> None:
    mesh = lopsided()
    again, old = turned(mesh, seed, scale)
    assert np.array_equal(split(again, wanted, 6), split(mesh, wanted, 6)[old])


def test_ranks_together_and_alone_agree() -> None:
    alone, _ = divide(BELL, spectral(), 9)
    together, _ = divide(BELL, spectral(), 9, MPI.COMM_WORLD)
    assert np.array_equal(alone, together)


@pytest.mark.parametrize("wanted", [spectral(), spectral(mass="count")], ids=str)
def test_same_cut_on_a_finer_mesh(wanted: Cut) -> None:
    coarse = split(BELL, wanted)
    fine = repaired(*subdivide(BELL.vertices, BELL.faces), "fine")
    agree = areas(fine)[split(fine, wanted) == np.tile(coarse, 4)].sum() / fine.area
    assert agree >= 0.99


def test_same_cut_on_a_jittered_mesh() -> None:
    edge = np.sqrt(areas(BELL).mean())
    noise = np.random.default_rng(8).normal(0, 1e-3 * edge, BELL.vertices.shape)
    jittered = repaired(BELL.vertices + noise, BELL.faces, "jittered")
    assert areas(BELL)[split(jittered, spectral()) == split(BELL, spectral())].sum() \
        >= 0.99 * BELL.area


def test_separate_parts_are_told_apart_first() -> None:
    small = sphere(0.3, 2)
    both = repaired(np.concatenate([BELL.vertices, small[0] + (0, 2, 0)]),
                    np.concatenate([BELL.faces, small[1] + len(BELL.vertices)]), "both")
    split(both, spectral(), 2)
    split(both, spectral(), 5)
    with pytest.raises(PartitionError, match="2 separate parts"):
        divide(both, spectral(), 1)
    with pytest.raises(PartitionError, match="fix: a number between"):
        divide(BELL, spectral(), len(BELL.faces) + 1)


def test_every_triangle_a_piece() -> None:
    mesh = repaired(*sphere(1.0, 0), "icosahedron")
    assert np.array_equal(np.sort(split(mesh, spectral(), 20)), np.arange(20))


def test_first_cut_then_one_side() -> None:
    """The thesis' scenes: a part cut off whole, and broken into all other pieces."""
    for side, whole in (("smallest", 0.7), ("largest", -0.7)):
        wanted = Fracture.model_validate({"pieces": 9, "first": {"method": "spectral"},
                                          "side": side})
        label, made = labels(Sheet(BELL), wanted, (0, 0, 0))
        assert len(made) == 1
        assert np.array_equal(np.unique(label), np.arange(9))
        assert components(len(label), cut_twins(BELL.twin, label)).max() == 8
        centre = BELL.vertices[BELL.faces].mean(axis=1)[:, 0]
        assert (np.sign(centre[label == 0].mean()) == -np.sign(whole))
        assert areas(BELL)[label == 0].sum() > 0.3 * BELL.area
    near = Fracture.model_validate({"pieces": 3, "first": {"method": "spectral"},
                                    "side": "detonation"})
    label, _ = labels(Sheet(BELL), near, (1.5, 0, 0))
    assert (centre[label == 0] < 0.4).all()


# --- the rules by themselves ---------------------------------------------------------------------

@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(3, 30))
def test_sweep_is_the_best_threshold(seed: int, n: int) -> None:
    """Against trying every threshold."""
    rng = np.random.default_rng(seed)
    values, weight = rng.standard_normal(n), rng.uniform(0.5, 2, n)
    a, b = np.triu_indices(n, 1)
    keep = rng.random(len(a)) < 0.5
    a, b, cost = a[keep], b[keep], rng.uniform(0.1, 1, np.count_nonzero(keep))

    def ratio(side: NDArray[np.bool_]) -> float:
        lighter = min(weight[side].sum(), weight[~side].sum())
        return float(cost[side[a] != side[b]].sum() / lighter)

    sides = [values <= value for value in np.sort(values)[:-1]]
    least = 0.1 * weight.sum()
    allowed = [s for s in sides if min(weight[s].sum(), weight[~s].sum()) >= least] or sides
    found = cut.sweep(values, weight, a, b, cost)
    assert ratio(found) == pytest.approx(min(map(ratio, allowed)), rel=1e-5)


def test_median_and_sign() -> None:
    values = np.array([3.0, -1.0, 1e-12, 2.0, -2.0])
    assert list(cut.sign(values)) == [False, True, False, False, True]
    assert list(cut.median(values, np.ones(5), 0.6)) == [False, True, True, False, True]


def test_no_threshold_between_equal_values() -> None:
    """Triangles that the vector does not tell apart stay together."""
    values = np.array([-1.0, -1.0 + 1e-12, -1.0, 1.0, 1.0, 1.0])
    assert cut.median(values, np.ones(6), 1 / 6).sum() == 3


def test_star_is_mended() -> None:
    """On K(1, 4) the negative side may be two leaves that do not touch; one goes back."""
    a, b = np.zeros(4, dtype=np.int64), np.arange(1, 5)
    side = cut.sign(np.array([0.0, 1.0, 1.0, -1.0, -1.0]))
    assert side.sum() == 2
    whole = cut.mend(side, np.ones(5), a, b)
    assert whole.sum() == 1
    with pytest.raises(ValueError, match="empty"):
        cut.mend(np.zeros(5, dtype=bool), np.ones(5), a, b)


@pytest.mark.parametrize("pieces", [1, 2, 5, 16, 61])
def test_thesis_half_list_loses_nothing_and_is_even(pieces: int) -> None:
    size = np.bincount(half_list(BELL.faces, pieces))
    assert len(size) == pieces and size.min() > 0
    assert size.max() - size.min() <= (1 if pieces in (1, 2, 16) else size.mean())


def test_thesis_half_list_may_tear() -> None:
    label = half_list(BELL.faces, 16)
    assert components(len(label), cut_twins(BELL.twin, label)).max() + 1 > 16


def test_command_on_several_ranks(mpirun: object, tmp_path: Path) -> None:
    """The file is the same for every number of ranks."""
    from partition import fragments

    scene = tmp_path / "ball.toml"
    scene.write_text('[time]\nend = 1.0\nframe = 0.1\n[[body]]\nname = "box"\nshape = "box"\n'
                     'size = [1.0, 0.4, 0.3]\ndensity = 1.0\nfracture = { method = "spectral", '
                     'pieces = 7 }\n', encoding="utf-8")
    found = []
    for ranks in (1, 3):
        out = tmp_path / f"{ranks}.h5"
        done = mpirun(ranks, "-m", "partition", scene, "-o", out)  # type: ignore[operator]
        assert done.returncode == 0, done.stdout
        found.append(fragments.read(out))
    for other in found[1:]:
        assert np.array_equal(found[0].vertices, other.vertices)
        assert np.array_equal(found[0].faces, other.faces)
