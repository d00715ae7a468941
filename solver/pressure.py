"""The pressure equation -∇²ψ = b by PETSc's CG: matrix-free, preconditioned by fast transforms.

With the transform that fits the faces the preconditioner is the inverse, and CG converges in one
iteration; it stays a Krylov solve, so the residual is checked and other solvers can be compared:
PETSc options with the prefix `pressure_` override everything, e.g. `-pressure_pc_type gamg` (the
matrix is assembled only for a preconditioner that needs it).
Convergence: ‖b + ∇²ψ‖₂ ≤ 1e-10 ‖b‖₂ (unpreconditioned norm; the default norm would cost one more
application of the preconditioner).
"""

import ctypes
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from solver.assemble import laplacian_rows
from solver.grid import Field, Grid
from solver.kernel import FIELD, INT, READ_FIELD, REAL, kernel
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
    """Owns the vectors, operator and KSP; built once per run."""

    def __init__(self, grid: Grid):
        self.grid = grid
        self.shape = tuple(reversed(grid.count))
        self.right_side = grid.dm.createGlobalVec()
        self.solution = grid.dm.createGlobalVec()
        self.operator = NegativeLaplacian(grid)
        sizes = self.right_side.getSizes()
        self.matrix = PETSc.Mat().createPython((sizes, sizes), self.operator, comm=grid.comm)
        self.matrix.setUp()
        self.singular = not any(OPEN in axis_kinds(grid, axis) for axis in range(3))
        self.preconditioner = TransformPreconditioner(grid)
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

    def _configure(self, ksp: PETSc.KSP) -> None:
        ksp.setOptionsPrefix(PREFIX)
        ksp.setOperators(self.matrix)
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        ksp.setTolerances(rtol=TOLERANCE, atol=1e-300, max_it=1000)
        ksp.getPC().setType(PETSc.PC.Type.PYTHON)
        ksp.getPC().setPythonContext(self.preconditioner)
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

    def solve(self, total: float, square: float) -> tuple[Field, int]:
        """ψ as (mz, my, mx) and the number of iterations; raises RuntimeError if CG fails.

        `total`, `square`: Σb and Σb² of this rank. Where no face is open b must have no mean; it
        has none but for round-off, so it is taken away only where the solve would notice.
        """
        if self.singular:
            cells = self.right_side.getSize()
            total, square = self.grid.comm.allreduce(np.array([total, square]))
            if abs(total) > 0.1 * TOLERANCE * np.sqrt(cells * square):
                self.right_side.shift(-total / cells)
        self.ksp.solve(self.right_side, self.solution)
        reason = self.ksp.getConvergedReason()
        if reason < 0:
            raise RuntimeError(f"pressure solve: PETSc's converged reason is {reason} after "
                               f"{self.ksp.getIterationNumber()} iterations, residual "
                               f"{self.ksp.getResidualNorm():.3g}")
        return self.solution.getArray().reshape(self.shape), self.ksp.getIterationNumber()

    def destroy(self) -> None:
        """Free what holds Python callbacks: they must be gone before PETSc is."""
        for item in (self.ksp, self.matrix, self.right_side, self.solution):
            item.destroy()
        self.preconditioner.inverse.destroy()


def _last_line(error: PETSc.Error) -> str:
    """What went wrong, without PETSc's stack."""
    return str(error).strip().splitlines()[-1].split("] ", 1)[-1].strip()


class TransformPreconditioner:
    """PETSc's callback for z = (-∇²)⁻¹ r."""

    def __init__(self, grid: Grid):
        self.inverse = InverseLaplacian(grid)
        self.shape = tuple(reversed(grid.count))

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
