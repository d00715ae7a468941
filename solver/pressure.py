"""The pressure equation -∇²p = b by CG: matrix-free, preconditioned by fast transforms.

With the transform that fits the faces the preconditioner M is the inverse, and the first step of
CG, p = M b, is the last: it is made here, with one look at the residual,

    ‖b + ∇²p‖₂ ≤ 1e-10 ‖b‖₂,

and where that does not hold PETSc's CG starts from there. That spares CG's sweeps over its
vectors, a fifth of the solve, and all reductions but one.
PETSc options with the prefix `pressure_` override everything, e.g. `-pressure_pc_type gamg`: where
there is one, PETSc solves alone, from 0 (the matrix is assembled only for a preconditioner that
needs it).
"""

import ctypes
import math
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from solver.assemble import laplacian_rows
from solver.boundary import fill_pressure
from solver.grid import INNER, Field, Grid
from solver.kernel import FIELD, GHOSTS, INT, READ_FIELD, REAL, fetch_row, kernel
from solver.poisson import InverseLaplacian
from solver.scene import SceneError
from solver.transform import OPEN, PERIODIC, axis_kinds

TOLERANCE = 1e-10
PREFIX = "pressure_"
PLANE = REAL[:, ::1]
PETSC_MULTIGRID = PETSc.PC.Type.MG
MATRIX_FREE = (PETSc.PC.Type.PYTHON, PETSc.PC.Type.NONE)


def set_options(text: str) -> None:
    """PETSc options for the solvers made from now on, as in "-pressure_pc_type gamg"; raises
    `SceneError` for one that is not the pressure solve's."""
    for name in _names(text):
        if not name.startswith(PREFIX):
            raise SceneError(f"PETSc option -{name}: is not of the pressure solve; fix: begin it "
                             f"with -{PREFIX}, as in -{PREFIX}pc_type gamg, or set PETSC_OPTIONS")
    PETSc.Options().insertString(text)


def clear_options(text: str) -> None:
    """Forget them again."""
    for name in _names(text):
        PETSc.Options().delValue(name)


def _names(text: str) -> list[str]:
    """The options of a text, without their dash; a negative number is a value."""
    return [word[1:] for word in text.split() if word[:1] == "-" and word[1:2].isalpha()]


def _unused_options() -> list[str]:
    """The options with our prefix that PETSc has never asked for."""
    ask = ctypes.CDLL(PETSc.__file__).PetscOptionsUsed   # petsc4py does not offer it
    ask.argtypes = ctypes.c_void_p, ctypes.c_char_p, ctypes.POINTER(ctypes.c_int)
    found, used = [], ctypes.c_int(0)
    for name in PETSc.Options(PREFIX).getAll():
        ask(None, (PREFIX + name).encode(), ctypes.byref(used))
        if not used.value:
            found.append(PREFIX + name)
    return found


class PressureSolver:
    """Owns the vectors and the inverse; built once per run. PETSc's solver is made when it is
    needed: at once where there are options for it, else where CG has to go on."""

    def __init__(self, grid: Grid):
        self.grid = grid
        self.shape = tuple(reversed(grid.count))
        self.right_side = grid.dm.createGlobalVec()
        self.solution = grid.dm.createGlobalVec()
        self.singular = not any(OPEN in axis_kinds(grid, axis) for axis in range(3))
        self.inverse_h2 = [1 / h**2 for h in grid.spacing]
        self.inverse = InverseLaplacian(grid)
        self.ksp: PETSc.KSP | None = None
        self.starts_here = not PETSc.Options(PREFIX).getAll()
        if not self.starts_here:
            self._make_ksp()

    def _make_ksp(self) -> PETSc.KSP:
        grid = self.grid
        self.operator = NegativeLaplacian(grid)
        sizes = self.right_side.getSizes()
        self.matrix = PETSc.Mat().createPython((sizes, sizes), self.operator, comm=grid.comm)
        self.matrix.setUp()
        self.ksp = PETSc.KSP().create(comm=grid.comm)
        try:
            self._configure(self.ksp)
        except PETSc.Error as error:
            given = " ".join(f"-{PREFIX}{name} {value}".rstrip() for name, value
                             in PETSc.Options(PREFIX).getAll().items())
            self.destroy()
            raise SceneError(f"PETSc options {given}: {_last_line(error)}; fix: see PETSc's manual "
                             "of KSP and PC for what it offers") from error
        if unused := _unused_options():
            self.destroy()
            raise SceneError(f"PETSc option -{unused[0]}: the chosen solver does not know it; fix: "
                             "its spelling, or the solver that has it")
        return self.ksp

    def _configure(self, ksp: PETSc.KSP) -> None:
        ksp.setOptionsPrefix(PREFIX)
        ksp.setOperators(self.matrix)
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        ksp.setTolerances(rtol=TOLERANCE, atol=1e-300, max_it=1000)
        ksp.getPC().setType(PETSc.PC.Type.PYTHON)
        ksp.getPC().setPythonContext(TransformPreconditioner(self.inverse, self.shape))
        ksp.setInitialGuessNonzero(self.starts_here)
        ksp.setFromOptions()
        kind = ksp.getPC().getType()
        if kind not in MATRIX_FREE:
            matrix = self._assembled()
            ksp.setOperators(matrix if kind == PETSC_MULTIGRID else self.matrix, matrix)
        if kind == PETSC_MULTIGRID:   # it coarsens the DMDA, and the matrix with it
            self.grid.dm.setInterpolationType(PETSc.DMDA.InterpolationType.Q0)
            ksp.getPC().setDM(self.grid.dm)
        ksp.setUp()

    def _assembled(self) -> PETSc.Mat:
        """-∇² with its entries; where it is singular, it says so."""
        rows = laplacian_rows(self.grid, self.operator.signs)
        sizes = self.right_side.getSizes()
        matrix = PETSc.Mat().createAIJ(
            (sizes, sizes), comm=self.grid.comm,
            csr=(rows.indptr.astype(PETSc.IntType), rows.indices.astype(PETSc.IntType), rows.data))
        if self.singular:
            constant = PETSc.NullSpace().create(constant=True, comm=self.grid.comm)
            for item in (matrix, self.matrix):
                item.setNullSpace(constant)
        matrix.setOption(PETSc.Mat.Option.SPD if not self.singular
                         else PETSc.Mat.Option.SYMMETRIC, True)
        return matrix

    @property
    def b(self) -> Field:
        """The right side as (mz, my, mx), to be filled."""
        return self.right_side.getArray().reshape(self.shape)

    def solve(self, p: Field, total: float, square: float) -> int:
        """Find p and its ghosts; returns the iterations; raises RuntimeError if CG fails.

        `total`, `square`: Σb and Σb² of this rank. Where no face is open b must have no mean; it
        has none but for round-off, so it is taken away only where the solve would notice.
        """
        left = math.inf
        if self.starts_here:
            self.inverse.solve(self.b, self._solution(), p[INNER])
            fill_pressure(self.grid, p)
            left = residual(p, self.b, *self.inverse_h2)
        total, square, left = self._summed(total, square, left)
        mean = total / self.right_side.getSize() if self.singular else 0.0
        if mean * total > (0.1 * TOLERANCE)**2 * square:
            self.right_side.shift(-mean)   # of which M took no notice
            square -= mean * total
            if self.starts_here:
                [left] = self._summed(residual(p, self.b, *self.inverse_h2))
        if left <= TOLERANCE**2 * square:
            return 1
        return int(self.starts_here) + self._solve_by_petsc(p)

    def _summed(self, *values: float) -> list[float]:
        """Over all ranks."""
        sums = np.array(values)
        self.grid.comm.Allreduce(MPI.IN_PLACE, sums)
        return [float(each) for each in sums]

    def _solve_by_petsc(self, p: Field) -> int:
        ksp = self.ksp or self._make_ksp()
        ksp.solve(self.right_side, self.solution)
        reason = ksp.getConvergedReason()
        if reason < 0:
            raise RuntimeError(f"pressure solve: PETSc's converged reason is {reason} after "
                               f"{ksp.getIterationNumber()} iterations, residual "
                               f"{ksp.getResidualNorm():.3g}")
        p[INNER] = self._solution()
        fill_pressure(self.grid, p)
        return int(ksp.getIterationNumber())

    def _solution(self) -> Field:
        return self.solution.getArray().reshape(self.shape)

    def destroy(self) -> None:
        """Free what holds Python callbacks: they must be gone before PETSc is."""
        if self.ksp is not None:
            self.ksp.destroy()
            self.matrix.destroy()
        self.right_side.destroy()
        self.solution.destroy()
        self.inverse.destroy()


def _last_line(error: PETSc.Error) -> str:
    """What went wrong, without PETSc's stack."""
    return str(error).strip().splitlines()[-1].split("] ", 1)[-1].strip()


@kernel(FIELD, FIELD, REAL, REAL, REAL, result=REAL)
def residual(p, b, cx, cy, cz):
    """Σ (b + ∇²p)² over this rank's cells (p has ghosts, b has none)."""
    total = 0.0
    for k in range(b.shape[0]):
        for j in range(b.shape[1]):
            K, J = k + GHOSTS, j + GHOSTS
            fetch_row(p, K + 1, J + 2)
            fetch_row(b, k, j + 2)
            for i in range(b.shape[2]):
                I = i + GHOSTS  # noqa: E741
                twice = 2 * p[K, J, I]
                gap = (b[k, j, i] + cx * (p[K, J, I - 1] + p[K, J, I + 1] - twice)
                       + cy * (p[K, J - 1, I] + p[K, J + 1, I] - twice)
                       + cz * (p[K - 1, J, I] + p[K + 1, J, I] - twice))
                total += gap * gap
    return total


class TransformPreconditioner:
    """PETSc's callback for z = (-∇²)⁻¹ r."""

    def __init__(self, inverse: InverseLaplacian, shape: tuple[int, ...]):
        self.inverse, self.shape = inverse, shape

    def apply(self, _pc: PETSc.PC, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """Called by PETSc once per iteration."""
        self.inverse.solve(r.getArray(readonly=True).reshape(self.shape),
                           z.getArray().reshape(self.shape))


class NegativeLaplacian:
    """PETSc's callback for y = -∇²x, 7 points, no matrix.

    Beyond a face of the box x is mirrored (wall) or its sign turned (open: p = 0 on the face).
    """

    def __init__(self, grid: Grid):
        self.grid = grid
        self.shape = mz, my, mx = tuple(reversed(grid.count))
        kinds = [axis_kinds(grid, axis) for axis in range(3)]
        self.signs = [[-1.0 if kind == OPEN else 1.0 for kind in pair] for pair in kinds]
        self.wraps_x = kinds[0][0] == PERIODIC
        self.inverse_h2 = [1 / h**2 for h in grid.spacing]
        self.beyond_y = np.empty((2, mz, mx))
        self.beyond_z = np.empty((2, my, mx))
        self.sent_y = np.empty((2, mz, mx))

    def mult(self, _mat: Any, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Called by PETSc once per iteration."""
        values = x.getArray(readonly=True).reshape(self.shape)
        self._fill(1, self.beyond_y, values[:, 0], values[:, -1], self.sent_y)
        self._fill(2, self.beyond_z, values[0], values[-1], None)
        negative_laplacian(values, y.getArray().reshape(self.shape), *self.beyond_y,
                           *self.beyond_z, *self.signs[0], int(self.wraps_x), *self.inverse_h2)

    def _fill(self, axis: int, beyond: Field, first: Field, last: Field,
              packed: Field | None) -> None:
        """The planes of values just beyond this rank's cells along y or z."""
        low, high = self.grid.neighbours(axis)
        for side, (rank, plane, far) in enumerate(((low, first, last), (high, last, first))):
            wraps = rank == self.grid.comm.rank
            if rank == MPI.PROC_NULL or wraps:
                np.multiply(far if wraps else plane, self.signs[axis][side], out=beyond[side])
        if self.grid.processes[axis] > 1:
            if packed is not None:
                packed[0], packed[1] = first, last
                first, last = packed
            self.grid.comm.Sendrecv(first, low, 5, beyond[1], high, 5)
            self.grid.comm.Sendrecv(last, high, 6, beyond[0], low, 6)


@kernel(READ_FIELD, FIELD, PLANE, PLANE, PLANE, PLANE, REAL, REAL, INT, REAL, REAL, REAL)
def negative_laplacian(x, y, below_y, above_y, below_z, above_z,
                       sign_low, sign_high, wraps_x, cx, cy, cz):
    """y = -∇²x; rows beyond this rank are handed in as planes."""
    nz, ny, nx = x.shape
    diagonal = 2 * (cx + cy + cz)
    for k in range(nz):
        for j in range(ny):
            south = x[k, j - 1] if j > 0 else below_y[k]
            north = x[k, j + 1] if j < ny - 1 else above_y[k]
            rear = x[k - 1, j] if k > 0 else below_z[j]
            front = x[k + 1, j] if k < nz - 1 else above_z[j]
            row, out = x[k, j], y[k, j]
            for i in range(nx):
                out[i] = (diagonal * row[i] - cy * (south[i] + north[i])
                          - cz * (rear[i] + front[i]))
            for i in range(1, nx - 1):
                out[i] -= cx * (row[i - 1] + row[i + 1])
            before = row[nx - 1] if wraps_x else sign_low * row[0]
            after = row[0] if wraps_x else sign_high * row[nx - 1]
            if nx == 1:
                out[0] -= cx * (before + after)
            else:
                out[0] -= cx * (before + row[1])
                out[nx - 1] -= cx * (row[nx - 2] + after)
