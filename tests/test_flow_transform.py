"""The pressure solve inverts the 7-point Laplacian for every mixture of faces.

Oracle: the matrix is assembled cell by cell and solved directly.
"""

import itertools

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg

from solver.grid import INNER, Grid
from solver.pressure import PressureSolver, clear_options, set_options
from tests.flow_case import COMM, faces, make_scene

PAIRS = [("wall", "wall"), ("open", "open"), ("wall", "open"), ("open", "wall"),
         ("periodic", "periodic")]


def one_dimension(n, h, low, high):
    """-d²/dx² of n cells: mirrored beyond a wall, sign turned beyond an open face (p = 0 on it)."""
    matrix = np.zeros((n, n))
    for i in range(n):
        for j, face in ((i - 1, low), (i + 1, high)):
            matrix[i, i] += 1
            if 0 <= j < n:
                matrix[i, j] -= 1
            elif face == "periodic":
                matrix[i, j % n] -= 1
            else:
                matrix[i, i] -= -1 if face == "open" else 1
    return scipy.sparse.csr_matrix(matrix / h**2)


def assembled(cells, size, pairs):
    """-∇² of the whole box, x fastest."""
    x, y, z = (one_dimension(n, s / n, *pair)
               for n, s, pair in zip(cells, size, pairs, strict=True))
    one = [scipy.sparse.identity(n) for n in cells]
    kron = scipy.sparse.kron
    return (kron(kron(one[2], one[1]), x) + kron(kron(one[2], y), one[0])
            + kron(kron(z, one[1]), one[0])).tocsc()


@pytest.mark.parametrize("pairs", [PAIRS[:3], [PAIRS[0]] * 3, [PAIRS[4], PAIRS[3], PAIRS[4]],
                                   [PAIRS[4]] * 3], ids=str)
@pytest.mark.parametrize("options", [
    "-pressure_pc_type gamg", "-pressure_pc_type none", "-pressure_pc_type bjacobi",
    "-pressure_ksp_type fgmres",
    "-pressure_pc_type mg -pressure_pc_mg_levels 2 -pressure_pc_mg_galerkin both"])
def test_options_choose_another_solver_with_the_same_answer(pairs, options):
    cells = (8, 4, 8) if "mg_levels" in options else (8, 6, 7)   # multigrid halves them
    b = np.random.default_rng(7).standard_normal(tuple(reversed(cells)))
    b -= b.mean()
    scene = make_scene(cells, faces(*itertools.chain(*pairs)), (1.0, 0.8, 1.7))
    wanted, _ = solve_everywhere(scene, b)
    set_options(options)
    try:
        found, iterations = solve_everywhere(scene, b)
    finally:
        clear_options(options)
    assert np.abs(found - wanted - (found - wanted).mean()).max() < 1e-8 * np.abs(wanted).max()
    assert iterations > 2 or "fgmres" in options


@pytest.mark.parametrize("pairs", [[PAIRS[0]] * 3, [PAIRS[4], PAIRS[2], PAIRS[1]]], ids=str)
def test_cg_goes_on_where_the_first_step_is_not_the_last(pairs):
    """An inverse that is off by a little, and not alike everywhere, is still a preconditioner."""
    def spoil(solver):
        pivots = solver.inverse.lines.pivots
        pivots *= 1 - 1e-3 * np.linspace(0, 1, pivots.shape[2])

    scene = make_scene((8, 6, 7), faces(*itertools.chain(*pairs)), (1.0, 0.8, 1.7))
    b = np.random.default_rng(7).standard_normal((7, 6, 8))
    b -= b.mean()
    wanted, _ = solve_everywhere(scene, b)
    found, iterations = solve_everywhere(scene, b, spoil)
    assert np.abs(found - wanted).max() < 1e-8 * np.abs(wanted).max()
    assert 2 < iterations < 10


@pytest.mark.parametrize("mean", [0.0, 1e-9, 1e-3, 1.0])
def test_a_mean_of_the_right_side_hides_no_residual(mean):
    """Where no face is open it is taken away; what is left over is held to the tolerance."""
    def spoil(solver):
        pivots = solver.inverse.lines.pivots
        pivots *= 1 + 3e-9 * np.linspace(0, 1, pivots.shape[2])

    b = np.random.default_rng(7).standard_normal((7, 6, 8))
    b -= b.mean()
    found, iterations = solve_everywhere(make_scene((8, 6, 7), "wall", (1.0, 0.8, 1.7)), b + mean,
                                         spoil)
    left = b.ravel() - assembled((8, 6, 7), (1.0, 0.8, 1.7), [PAIRS[0]] * 3) @ found.ravel()
    assert np.linalg.norm(left) < 1.1e-10 * np.linalg.norm(b)
    assert iterations == 2


def test_a_right_side_that_is_not_finite_is_refused():
    scene = make_scene((8, 6, 7))
    with pytest.raises(RuntimeError, match="pressure solve"):
        solve_everywhere(scene, np.full((7, 6, 8), np.nan))


def solve_everywhere(scene, b, change=lambda solver: None):
    """(solution on the whole box, iterations) by the solver under test."""
    grid = Grid(scene.domain, COMM)
    solver = PressureSolver(grid)
    change(solver)
    part = tuple(slice(s, s + n) for s, n in zip(reversed(grid.start), reversed(grid.count),
                                                 strict=True))
    solver.b[...] = b[part]
    p = grid.field()
    iterations = solver.solve(p, b[part].sum(), (b[part]**2).sum())
    whole = np.zeros(b.shape)
    for there, values in COMM.allgather((part, p[INNER])):
        whole[there] = values
    solver.destroy()
    grid.destroy()
    return whole, iterations


EVERY_MIX = [((6, 5, 7), pairs) for pairs in itertools.product(PAIRS, repeat=3)]
THIN = [(cells, (first, second, third))   # each pair of faces once along every axis
        for cells in ((5, 8, 1), (1, 4, 9), (8, 1, 6))
        for first, second, third in zip(PAIRS, PAIRS[2:] + PAIRS[:2], PAIRS[1:] + PAIRS[:1],
                                        strict=True)]


@pytest.mark.parametrize("cells, pairs", [*EVERY_MIX, *THIN])
def test_solution_equals_direct_solve(cells, pairs):
    size = (1.0, 0.8, 1.7)
    boundary = faces(*itertools.chain(*pairs))
    b = np.random.default_rng(7).standard_normal(tuple(reversed(cells)))
    singular = not any("open" in pair for pair in pairs)
    matrix = assembled(cells, size, pairs)
    if singular:
        b -= b.mean()
        n = matrix.shape[0]
        matrix = matrix + scipy.sparse.csc_matrix(np.full((n, n), 1.0 / n))
    wanted = scipy.sparse.linalg.spsolve(matrix, b.ravel()).reshape(b.shape)
    found, iterations = solve_everywhere(make_scene(cells, boundary, size), b)
    assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
    assert iterations <= 2


@pytest.mark.serial
@pytest.mark.parametrize("ranks", [3, 6])
def test_lines_that_ranks_share_are_solved_to_round_off(ranks, mpirun):
    """3 ranks share one axis, one of them with neighbours on both sides; 6 share two."""
    done = mpirun(ranks, "-m", "tests.poisson_ranks")
    assert done.returncode == 0, done.stdout
    error = float(done.stdout.split("largest error")[1].split()[0])
    assert error < 1e-10, done.stdout
