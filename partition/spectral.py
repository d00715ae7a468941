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
           links only and fails. Slower below some 10^5 nodes, and needs far less memory above.

The options prefix is `fiedler_`.
"""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import coo_array, csr_array
from slepc4py import SLEPc

from partition.weights import Graph

Floats = NDArray[np.float64]
ALONE = 30_000              # nodes; below, sending takes longer than solving
DIRECT_LIMIT = 60_000       # nodes; above, the iterative solver is faster
TOLERANCE = 1e-8            # residual |L v - lambda M v| over |lambda M v|
SHIFT = 1e-9                # of the mean diagonal


class SpectralError(Exception):
    """No eigenvector to the accuracy asked for; the message is one line for the user."""


@dataclass(frozen=True)
class Modes:
    """The slowest modes: values (k,), vectors (n, k) with v^T M v = 1, residuals (k,) relative to
    the value, and how many iterations of which method it took."""

    values: Floats
    vectors: Floats
    residuals: Floats
    iterations: int
    method: str


def laplacian(graph: Graph) -> csr_array:
    """L = B W B^T as a sparse matrix (n, n)."""
    n = len(graph.mass)
    rows = np.concatenate([graph.a, graph.b])
    columns = np.concatenate([graph.b, graph.a])
    off = coo_array((-np.concatenate([graph.weight, graph.weight]), (rows, columns)),
                    shape=(n, n)).tocsr()
    diagonal = coo_array((-off.sum(axis=1), (np.arange(n), np.arange(n))), shape=(n, n))
    return csr_array(off + diagonal)


def modes(graph: Graph, count: int, comm: MPI.Comm | None = None, method: str = "auto",
          tolerance: float = TOLERANCE) -> Modes:
    """The `count` slowest modes above 0 of a connected graph; raises SpectralError.

    method is "direct", "iterative" or "auto"; every rank of `comm` (None: this process alone)
    passes the same graph and gets the whole of every vector.
    """
    matrix = laplacian(graph)
    n = matrix.shape[0]
    comm = MPI.COMM_SELF if comm is None or method == "auto" and n < ALONE else comm
    if n <= count + 2:
        return _dense(matrix, graph.mass, count)
    if method == "auto":
        method = "direct" if n <= DIRECT_LIMIT else "iterative"
    found = _slepc(matrix, graph.mass, count, comm, method, tolerance)
    if found.residuals[0] > 100 * tolerance and method == "iterative":
        found = _slepc(matrix, graph.mass, count, comm, "direct", tolerance)
    if not found.residuals[0] <= 100 * tolerance:
        raise SpectralError(f"eigenvalue {found.values[0]:.4g} of {n} nodes: residual "
                            f"{found.residuals[0]:.1e} lambda; fix: use method bfs")
    return found


def _dense(matrix: csr_array, mass: Floats, count: int) -> Modes:
    """For a handful of nodes: the symmetric problem M^-1/2 L M^-1/2 in full."""
    root = np.sqrt(mass)
    values, vectors = np.linalg.eigh(matrix.toarray() / np.outer(root, root))
    take = slice(1, min(count, len(mass) - 1) + 1)
    return _checked(matrix, mass, values[take], vectors[:, take] / root[:, None], 0, "dense")


def _slepc(matrix: csr_array, mass: Floats, count: int, comm: MPI.Comm, method: str,
           tolerance: float) -> Modes:
    operator = _distributed(matrix, comm)
    masses = operator.createVecRight()
    low, high = operator.getOwnershipRange()
    masses.setArray(mass[low:high])
    weights = PETSc.Mat().createAIJ(operator.getSizes(), nnz=1, comm=comm)
    weights.setDiagonal(masses)
    weights.assemble()
    constant = operator.createVecRight()
    constant.set(1.0)
    solver = SLEPc.EPS().create(comm)
    solver.setOptionsPrefix("fiedler_")
    solver.setOperators(operator, weights)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(nev=count)
    solver.setTolerances(tolerance, 1000)
    solver.setConvergenceTest(SLEPc.EPS.Conv.REL)
    solver.setDeflationSpace([constant])
    start = operator.createVecRight()
    start.setArray(_start(len(mass))[low:high])
    solver.setInitialSpace([start])
    if method == "direct":
        _set_direct(solver, SHIFT * float((matrix.diagonal() / mass).mean()))
    else:
        _set_iterative(solver)
    solver.setFromOptions()
    solver.solve()
    found = solver.getConverged()
    if found < count:
        raise SpectralError(f"{method} eigensolver: {found} of {count} modes of {len(mass)} nodes "
                            "converged; fix: use method bfs")
    values = np.array([solver.getEigenvalue(k).real for k in range(count)])
    vectors = np.empty((len(mass), count))
    for k in range(count):
        solver.getEigenvector(k, start)
        vectors[:, k] = np.concatenate(comm.allgather(start.getArray()))
    iterations = solver.getIterationNumber()
    for thing in (solver, weights, operator, masses, constant, start):
        thing.destroy()
    return _checked(matrix, mass, values, vectors, iterations, method)


def _set_direct(solver: SLEPc.EPS, shift: float) -> None:
    solver.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    solver.setTarget(-shift)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setPurify(False)     # purification would mix the constant back in
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setShift(-shift)
    inner = transform.getKSP()
    inner.setType(PETSc.KSP.Type.PREONLY)
    inner.getPC().setType(PETSc.PC.Type.CHOLESKY)
    inner.getPC().setFactorSolverType("mumps")


def _set_iterative(solver: SLEPc.EPS) -> None:
    solver.setType(SLEPc.EPS.Type.LOBPCG)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.PRECOND)
    inner = transform.getKSP()
    inner.setType(PETSc.KSP.Type.PREONLY)
    multigrid = inner.getPC()
    if PETSc.Sys.hasExternalPackage("hypre"):
        multigrid.setType(PETSc.PC.Type.HYPRE)
        multigrid.setHYPREType("boomeramg")
    else:
        multigrid.setType(PETSc.PC.Type.GAMG)
        PETSc.Options().setValue("fiedler_st_pc_gamg_threshold", 0.05)


def _distributed(matrix: csr_array, comm: MPI.Comm) -> PETSc.Mat:
    """The rows of this rank, as a PETSc matrix."""
    n = matrix.shape[0]
    low, high = n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size
    starts = matrix.indptr[low:high + 1].astype(PETSc.IntType)
    part = slice(starts[0], starts[-1])
    columns = matrix.indices[part].astype(PETSc.IntType)
    operator = PETSc.Mat().createAIJ(size=((high - low, n), (high - low, n)), comm=comm,
                                     csr=(starts - starts[0], columns, matrix.data[part]))
    operator.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return operator


def _start(n: int) -> Floats:
    """The same start whatever the number of ranks."""
    return np.random.default_rng(n).standard_normal(n)


def _checked(matrix: csr_array, mass: Floats, values: Floats, vectors: Floats, iterations: int,
             method: str) -> Modes:
    """Remove what is left of the constant, normalise, and measure the residuals anew."""
    vectors = vectors - (mass @ vectors) / mass.sum()
    vectors = vectors / np.sqrt(mass @ vectors**2)
    weighted = mass[:, None] * vectors
    values = np.einsum("ij,ij->j", vectors, matrix @ vectors)
    residual = np.linalg.norm(matrix @ vectors - values * weighted, axis=0)
    scale = values * np.linalg.norm(weighted, axis=0)
    return Modes(values, vectors, residual / scale, iterations, method)
