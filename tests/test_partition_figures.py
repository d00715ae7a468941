"""Generated bodies break where they were made weak; the diagrams are drawn and say what is so."""

import re
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from partition.divide import divide
from partition.figures import fold, levels, octahedron, string, triangulations, weak_lines
from partition.figures.__main__ import FIGURES, main
from partition.figurines import GENERATED, WEAKEST
from partition.graph import components, cut_twins
from partition.repair import repaired
from solver.scene_body import Cut

LARGEST = 100_000   # bytes of a picture


@pytest.mark.parametrize("name", GENERATED)
def test_breaks_where_it_was_made_weak(name: str) -> None:
    """Closed, without handles or repairs; two whole pieces; the cut is hardly longer than the plane
    section, which no path along edges of triangles can follow."""
    mesh = repaired(*GENERATED[name](), name)
    assert mesh.closed and mesh.genus == 0 and mesh.repairs == () and mesh.components.max() == 0
    plane = WEAKEST[name]
    for rule, agrees, longer in (("default", 0.98, 1.1), ("thesis", 0.95, 2.3)):
        label, (cut,) = divide(mesh, weak_lines.RULES[rule], 2, MPI.COMM_WORLD)
        assert components(len(label), cut_twins(mesh.twin, label)).max() == 1
        assert weak_lines.agreement(mesh, label, plane) > agrees
        assert cut.length < longer * weak_lines.section(mesh, plane)
        assert cut.residual < 1e-6


def test_section_of_a_ball_is_a_circle() -> None:
    from partition.figurines import Plane
    from partition.shapes import sphere

    ball = repaired(*sphere(1.0, 4), "ball")
    plane = Plane((0.0, 0.6, 0.0), (0.0, 2.0, 0.0))
    assert weak_lines.section(ball, plane) == pytest.approx(2 * np.pi * 0.8, rel=2e-3)
    label = np.where(plane.beyond(ball.vertices[ball.faces].mean(axis=1)), 0, 1)
    assert weak_lines.agreement(ball, label, plane) == 1.0


def test_curved_surface_breaks_at_its_bend_with_dihedral_weights_only() -> None:
    sheet = fold.sheet()
    share = {}
    for weights in ("dihedral", "thesis"):
        label, _ = divide(sheet, Cut.model_validate({"method": "spectral", "weights": weights}), 2,
                          MPI.COMM_WORLD)
        share[weights] = np.bincount(label).min() / len(label)
    assert share["dihedral"] == pytest.approx(fold.BEND, abs=0.04)
    assert share["thesis"] == pytest.approx(0.5, abs=0.03)


def test_thesis_weights_on_a_bend_that_is_all_but_developable() -> None:
    """Gaussian curvatures of 1e-14 beside some of 1: the weights stay within reason."""
    sheet = fold.sheet()
    noise = np.random.default_rng(1).normal(0, 1e-9, sheet.vertices.shape)
    bumpy = repaired(sheet.vertices + noise, sheet.faces, "bumpy")
    label, (cut,) = divide(bumpy, Cut(method="spectral", weights="thesis"), 2, MPI.COMM_WORLD)
    assert len(np.unique(label)) == 2 and cut.residual < 1e-6


def test_worked_example() -> None:
    values, vectors = np.linalg.eigh(octahedron.matrix(octahedron.octahedron()))
    assert values == pytest.approx([0, 1.396909, 1.584656, 1.584656, 2.095364, 2.470857], abs=1e-6)
    assert abs(vectors[:, 1]) == pytest.approx([0, 0, 0.5**0.5, 0, 0, 0.5**0.5], abs=1e-9)


def test_levels_by_shared_vertices() -> None:
    """A fan: every triangle is one step from every other; a strip: two on each side a step."""
    fan = np.array([(0, i, i + 1) for i in range(1, 9)])
    assert sorted(levels.levels(fan, 3)) == [0] + [1] * 7
    strip = np.array([(i, i + 1, i + 2) for i in range(7)])
    assert list(levels.levels(strip, 0)) == [0, 1, 1, 2, 2, 3, 3]
    apart = np.array([(0, 1, 2), (3, 4, 5)])
    assert list(levels.levels(apart, 0)) == [0, -1]


@pytest.mark.serial
def test_all_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One command draws them, each small, and prints their numbers."""
    from PIL import Image

    assert main(["-o", str(tmp_path / "figures")]) == 0
    printed = capsys.readouterr().out
    for name in FIGURES:
        path = tmp_path / "figures" / f"{name}.png"
        assert path.stat().st_size < LARGEST and f"{path}: figure" in printed
        with Image.open(path) as image:
            assert len(image.convert("RGB").getcolors(10**6)) > 10
    assert "1.396909 1.584656 1.584656 2.095364 2.470857" in printed
    assert "358 triangles (2 n - 2 - h = 358)" in printed
    assert re.search(r"second cut: .* in 1 \+ 3 edge-connected parts", printed)
    assert re.search(r"partition.bfs: .* in 1, 1, 1, 1 parts", printed)
    assert string.BEADS == 40 and "lambda_2 = 0.006165332534, closed form 0.006165332534" in printed
    assert triangulations.POINTS == 200


def test_bad_name_and_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["nothing"])
    assert stop.value.code == 2 and "invalid choice" in capsys.readouterr().err
    taken = tmp_path / "taken"
    taken.write_text("", encoding="utf-8")
    assert main(["string", "-o", str(taken)]) == 2
    assert "cannot be written" in capsys.readouterr().err
