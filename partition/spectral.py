"""What is the slowest vibration of a graph?

With the weights w of its links and the masses M of its nodes, the Laplacian L = B W B^T (B has one
column e_a - e_b per link) belongs to the energy sum w (v_a - v_b)^2. The Fiedler vector is the
eigenvector of the smallest eigenvalue above 0 of

    L v = lambda M v,       sum M v = 0

and a graph comes apart most easily where this vector changes fast. The constant vector, of
eigenvalue 0, is deflated; there is no other as long as the graph is connected.

Two ways to solve it with SLEPc, distributed over the ranks of a communicator where the graph is
large; a small one every rank solves by itself, in the same way:

direct     Krylov-Schur on (L + s M)^-1 M with a Cholesky factorisation; s is tiny
iterative  LOBPCG, preconditioned by algebraic multigrid: BoomerAMG where PETSc was built with
           hypre, GAMG otherwise, with a threshold without which its coarsening follows the strong
           links only and fails; nodes in breadth-first order. Needs a fraction of the memory of a
           factorisation, and above some 10^5 nodes of its time.

For one mode LOBPCG carries a second vector along, which makes it faster than either alone; its
Ritz value, an upper bound, tells how far away the next mode is. The options prefix is `fiedler_`.
"""

from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from slepc4py import SLEPc

from partition.rows import adjacency, breadth_first, rows, times
from partition.weights import Graph

Floats = NDArray[np.float64]
ALONE = 30_000              # nodes; below, sending takes longer than solving
DIRECT_LIMIT = 50_000       # nodes; above, the iterative solver is faster
TOLERANCE = 1e-8            # residual |L v - lambda M v| over |lambda M v|
DIRECT_TOLERANCE = 1e-13    # of the transformed problem, whose residuals count |L| / lambda times
LARGE = 400_000             # nodes, beyond which rounding is near that tolerance
LARGE_TOLERANCE = 3e-7
ACCEPTED = 1e-6             # larger residuals are an error
HYPRE = PETSc.Sys.hasExternalPackage("hypre")
MUMPS = PETSc.Sys.hasExternalPackage("mumps")   # else PETSc's own factors, on one process
ROOM = 100                  # per cent of work space that MUMPS gets beyond its estimate
MOST_ROOM = 6400
NO_ROOM = (-8, -9)          # its INFOG(1) where that was too little
BOOMERAMG = {"coarsen_type": "HMIS", "interp_type": "ext+i", "P_max": 4, "agg_nl": 1}
SHIFT = 1e-9                # of the mean diagonal


class SpectralError(Exception):
    """No eigenvector to the accuracy asked for; the message is one line for the user."""


@dataclass(frozen=True)
class Modes:
    """The slowest modes: values (k,), vectors (n, k) with v^T M v = 1, residuals (k,) relative to
    the value; the next value, or an upper bound of it; how many iterations of which method."""

    values: Floats
    vectors: Floats
    residuals: Floats
    next_value: float
    iterations: int
    method: str


def modes(graph: Graph, count: int = 1, comm: MPI.Comm | None = None,
          method: str = "auto") -> Modes:
    """The `count` slowest modes above 0 of a connected graph; raises SpectralError.

    method is "direct", "iterative" or "auto"; every rank of `comm` (None: this process alone)
    passes the same graph and gets the whole of every vector.
    """
    n = len(graph.mass)
    comm = MPI.COMM_SELF if comm is None or method == "auto" and n < ALONE else comm
    scale = graph.mass.mean()       # so that |M v| and |v|, and the residuals by either, are alike
    stiff = float(graph.weight.mean())      # solvers have thresholds of their own: keep L near 1
    scaled = replace(graph, mass=graph.mass / scale, weight=graph.weight / stiff)
    if n <= count + 3:
        found = _dense(scaled, count)
    elif method == "direct" or method == "auto" and n <= DIRECT_LIMIT:
        found = _direct(scaled, count, comm if MUMPS else MPI.COMM_SELF, ROOM)
    else:
        found = _iterative(scaled, count, comm)
    if not found.residuals[0] <= ACCEPTED:
        raise SpectralError(f"eigenvalue {found.values[0] * stiff / scale:.4g} of {n} nodes: "
                            f"residual {found.residuals[0]:.1e} lambda; fix: use method bfs")
    return replace(found, values=found.values * stiff / scale,
                   vectors=found.vectors / np.sqrt(scale),
                   next_value=found.next_value * stiff / scale)


def _dense(graph: Graph, count: int) -> Modes:
    """For a handful of nodes: the symmetric problem M^-1/2 L M^-1/2 in full."""
    root = np.sqrt(graph.mass)
    matrix = np.array([times(graph.a, graph.b, graph.weight, unit) for unit in np.eye(len(root))])
    values, vectors = np.linalg.eigh(matrix / np.outer(root, root))
    last = min(count, len(root) - 1) + 1
    after = float(values[last]) if last < len(root) else np.inf
    return _checked(graph, vectors[:, 1:last] / root[:, None], after, 0, "dense")


def _direct(graph: Graph, count: int, comm: MPI.Comm, room: int) -> Modes:
    """What MUMPS estimates holds for one order in which the messages between ranks arrive. As they
    come it takes up to 1.5 times that, where its own margin is 1.2: hence `room`, and more if need
    be."""
    shift = SHIFT * 2 * float(graph.weight.sum()) / len(graph.mass)
    problem = Problem(graph, comm)
    solver = problem.solver(count + 1, DIRECT_TOLERANCE)
    solver.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    solver.setTarget(-shift)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setPurify(False)     # purification would mix the constant back in
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setShift(-shift)
    inner = transform.getKSP()
    inner.setType(PETSc.KSP.Type.PREONLY)
    factors = inner.getPC()
    factors.setType(PETSc.PC.Type.CHOLESKY)
    if MUMPS:
        factors.setFactorSolverType("mumps")
    solver.setFromOptions()
    mumps = factors.getFactorSolverType() == "mumps"
    if mumps:
        factors.setOperators(problem.laplacian)     # for its layout
        factors.setFactorSetUpSolverType()
        matrix = factors.getFactorMatrix()
        matrix.setMumpsIcntl(14, room)
    try:
        vectors, values, iterations = problem.solve(solver, count + 1)
    except SpectralError:
        if not mumps or room >= MOST_ROOM or matrix.getMumpsInfog(1) not in NO_ROOM:
            raise
        return _direct(graph, count, comm, 4 * room)
    return _checked(graph, vectors[:, :count], values[count], iterations, "direct")


def _iterative(graph: Graph, count: int, comm: MPI.Comm) -> Modes:
    problem = Problem(graph, comm, ordered=True)
    solver = problem.solver(count, TOLERANCE if len(graph.mass) <= LARGE else LARGE_TOLERANCE)
    solver.setType(SLEPc.EPS.Type.LOBPCG)
    solver.setLOBPCGBlockSize(count + 1)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.PRECOND)
    inner = transform.getKSP()
    inner.setType(PETSc.KSP.Type.PREONLY)
    multigrid = inner.getPC()
    options = PETSc.Options()
    if HYPRE:
        multigrid.setType(PETSc.PC.Type.HYPRE)
        multigrid.setHYPREType("boomeramg")
        for key, value in BOOMERAMG.items():
            _default(options, f"fiedler_st_pc_hypre_boomeramg_{key}", value)
    else:
        multigrid.setType(PETSc.PC.Type.GAMG)
        _default(options, "fiedler_st_pc_gamg_threshold", 0.05)
    after = [np.inf]

    def watch(_: SLEPc.EPS, __: int, ___: int, estimates: list[complex], ____: object) -> None:
        if len(estimates) > count:
            after[0] = float(np.real(estimates[count]))

    solver.setMonitor(watch)
    solver.setFromOptions()
    vectors, _, iterations = problem.solve(solver, count)
    return _checked(graph, vectors, after[0], iterations, "iterative")


def _default(options: PETSc.Options, key: str, value: object) -> None:
    """What the user gave on the command line goes before."""
    if not options.hasName(key):
        options.setValue(key, value)


class Problem:
    """L v = lambda M v over the ranks of a communicator, the constant deflated; the nodes stand in
    PETSc's vectors as they are, or in breadth-first order."""

    def __init__(self, graph: Graph, comm: MPI.Comm, ordered: bool = False):
        n = len(graph.mass)
        low, high = n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size
        linked = adjacency(n, graph.a, graph.b, graph.weight)
        order = breadth_first(*linked[:2]) if ordered else np.arange(n, dtype=np.int32)
        starts, columns, values = rows(*linked, order, low, high)
        self.comm, self.count, self.order = comm, n, order
        self.laplacian = PETSc.Mat().createAIJ(
            size=((high - low, n), (high - low, n)), comm=comm,
            csr=(starts.astype(PETSc.IntType, copy=False),
                 columns.astype(PETSc.IntType, copy=False), values))
        self.laplacian.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.vector = self.laplacian.createVecRight()
        self.vector.setArray(graph.mass[order[low:high]])
        self.mass = PETSc.Mat().createAIJ(self.laplacian.getSizes(), comm=comm, csr=(
            np.arange(high - low + 1, dtype=PETSc.IntType),
            np.arange(low, high, dtype=PETSc.IntType), graph.mass[order[low:high]]))
        # the same start whatever the number of ranks
        self.start = self.laplacian.createVecRight()
        self.start.setArray(np.random.default_rng(n).standard_normal(n)[low:high])
        self.constant = self.laplacian.createVecRight()
        self.constant.set(1.0)

    def solver(self, count: int, tolerance: float) -> SLEPc.EPS:
        """A solver for `count` modes, its method not yet chosen."""
        solver = SLEPc.EPS().create(self.comm)
        solver.setOptionsPrefix("fiedler_")
        solver.setOperators(self.laplacian, self.mass)
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setDimensions(nev=count)
        solver.setTolerances(tolerance, 1000)
        solver.setConvergenceTest(SLEPc.EPS.Conv.REL)
        solver.setDeflationSpace([self.constant])
        solver.setInitialSpace([self.start])
        return solver

    def solve(self, solver: SLEPc.EPS, count: int) -> tuple[Floats, list[float], int]:
        """Whole vectors (n, count), values and iterations; frees everything."""
        try:
            return self._solved(solver, count)
        except PETSc.Error as error:
            raise SpectralError(f"eigensolver: PETSc error {error.ierr} on {self.count} nodes; "
                                "fix: use method bfs") from None
        finally:
            for thing in (solver, self.mass, self.laplacian, self.vector, self.start,
                          self.constant):
                thing.destroy()

    def _solved(self, solver: SLEPc.EPS, count: int) -> tuple[Floats, list[float], int]:
        solver.solve()
        found = solver.getConverged()
        if found < count:
            raise SpectralError(f"eigensolver: {found} of {count} modes of {self.count} nodes "
                                "converged; fix: use method bfs")
        values = [float(solver.getEigenvalue(k).real) for k in range(count)]
        vectors = np.empty((self.count, count))
        for k in range(count):
            solver.getEigenvector(k, self.vector)
            vectors[:, k] = self._whole(self.vector.getArray())
        return vectors, values, int(solver.getIterationNumber())

    def _whole(self, part: Floats) -> Floats:
        """(n,) from the part of each rank, the nodes as in the graph."""
        ordered, whole = np.empty(self.count), np.empty(self.count)
        self.comm.Allgatherv(part, (ordered, np.diff(self.laplacian.getOwnershipRanges())))
        whole[self.order] = ordered
        return whole


def _checked(graph: Graph, vectors: Floats, after: float, iterations: int, method: str) -> Modes:
    """Remove what is left of the constant, normalise, and measure the residuals anew."""
    mass = graph.mass
    vectors = vectors - (mass @ vectors) / mass.sum()
    vectors = vectors / np.sqrt(mass @ vectors**2)
    pulls = np.stack([times(graph.a, graph.b, graph.weight, np.ascontiguousarray(vector))
                      for vector in vectors.T], axis=1)
    values = np.einsum("ij,ij->j", vectors, pulls)
    weighted = values * mass[:, None] * vectors
    residual = np.linalg.norm(pulls - weighted, axis=0) / np.linalg.norm(weighted, axis=0)
    return Modes(values, vectors, residual, after, iterations, method)
