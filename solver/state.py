"""What the stages share: the fields, the time, and the running totals.

A scene that needs no temperature or no divergence source holds no array for it.
"""

from dataclasses import dataclass, field
from typing import Any

import numexpr
import numpy as np

from solver.grid import INNER, Field, Grid
from solver.hashing import uniform_at
from solver.kernel import GHOSTS
from solver.scene import Scene

VELOCITY = ("u", "v", "w")
NOISE_STREAM = 1


@dataclass
class State:
    """Fields are ghosted arrays [k, j, i] (see `grid`).

    u, v, w      velocity on right, top, front faces, L/s
    u_new, ...   the next substep's velocity, while it is made
    u_old, T_old velocity and temperature at the start of the step (integrators of several substeps)
    p            pressure / density, L²/s², zero mean where no face is open
    T, T_new     temperature, K, or None
    phi          divergence source, 1/s, or None; heat: temperature source, K/s, or None
    substep      times at which the current substep starts and ends, s; number counts them from 0
    viscosity    how ∇²u / Re is split into explicit and implicit (`diffusion`)
    pressures    of each substep of the last of so many `implicit_steps`, and the change per time of
                 the last of them (`diffuse`); or None
    totals       running sums of this rank (burnt mass, gas, heat, ...)
    """

    grid: Grid
    scene: Scene
    time: float = 0.0
    substep: tuple[float, float] = (0.0, 0.0)
    number: int = 0
    step: int = 0
    frame: int = 0
    dt: float = 0.0
    iterations: int = 0
    totals: dict[str, float] = field(default_factory=dict)
    swarm: Any = None
    source_speed: float = 0.0
    bodies: Any = None
    viscosity: Any = None
    pressures: Any = None
    implicit_steps: int = 0
    fragments: Any = None

    def __post_init__(self) -> None:
        grid, scene = self.grid, self.scene
        self.u, self.v, self.w = (grid.field() for _ in VELOCITY)
        self.u_new, self.v_new, self.w_new = (grid.field() for _ in VELOCITY)
        self.p = grid.field()
        self.several = scene.time.integrator != "euler"
        self._free: tuple[Any, ...] = ()
        if self.several:
            self.u_old, self.v_old, self.w_old = (grid.field() for _ in VELOCITY)
        ambient = scene.fluid.ambient_temperature
        warm, fire = scene.has_temperature, scene.fuel is not None
        self.T: Any = grid.field(ambient) if warm else None
        self.T_new: Any = grid.field(ambient) if warm else None
        self.T_old: Any = grid.field() if warm and self.several else None
        self.phi: Any = grid.field() if fire or scene.fluid.source else None
        self.heat: Any = grid.field() if warm and (fire or scene.fluid.heat_source) else None
        self._initialise()

    @property
    def velocity(self) -> tuple[Field, Field, Field]:
        """u, v, w at the current time."""
        return self.u, self.v, self.w

    @property
    def velocity_new(self) -> tuple[Field, Field, Field]:
        """u, v, w of the substep in the making."""
        return self.u_new, self.v_new, self.w_new

    @property
    def velocity_old(self) -> tuple[Field, Field, Field]:
        """u, v, w at the start of the step; before `remember`, the current ones."""
        return (self.u_old, self.v_old, self.w_old) if self.several else self.velocity

    def remember(self) -> None:
        """Keep the fields at the start of the step, for an integrator of several substeps: the
        arrays only change names, and the ones kept before become free."""
        if self.several:
            self._free = self.u_old, self.v_old, self.w_old, self.T_old
            self.u_old, self.v_old, self.w_old, self.T_old = *self.velocity, self.T

    def accept(self, name: str) -> None:
        """Make the new field `name` (u, v, w, T) current; what it replaces takes the next one."""
        now, made = getattr(self, name), getattr(self, f"{name}_new")
        keep = self.several and now is getattr(self, f"{name}_old")
        setattr(self, name, made)
        setattr(self, f"{name}_new", self._free["uvwT".index(name)] if keep else now)

    def add_total(self, name: str, amount: float) -> None:
        """Add to a running sum of this rank."""
        self.totals[name] = self.totals.get(name, 0.0) + amount

    def _initialise(self) -> None:
        initial = self.scene.initial
        for axis, name in enumerate(VELOCITY):
            field_ = getattr(self, name)
            evaluate(self.grid, getattr(initial, name), field_, axis)
            if initial.noise:
                field_ += initial.noise * self._noise(axis)
        if self.T is not None and initial.T:
            evaluate(self.grid, initial.T, self.T, None)

    def _noise(self, axis: int) -> Field:
        """Uniform in [-1, 1], a function of the face's place in the whole grid alone."""
        k, j, i = np.ix_(*global_indices(self.grid))
        nx, ny, _ = (n + 1 for n in self.grid.cells)
        place = (((k + 1) * ny + j + 1) * nx + i + 1) * 3 + axis
        return 2 * uniform_at(self.scene.seed, NOISE_STREAM, place.astype(np.uint64)) - 1


def global_indices(grid: Grid) -> list[np.ndarray[Any, np.dtype[np.int64]]]:
    """The index in the whole grid of every local k, j, i, ghosts included; periodic ones wrap."""
    indices = []
    for axis in (2, 1, 0):
        local = np.arange(-GHOSTS, grid.count[axis] + GHOSTS) + grid.start[axis]
        indices.append(local % grid.cells[axis] if grid.periodic[axis] else local)
    return indices


def coordinates(grid: Grid, face_axis: int | None) -> dict[str, Any]:
    """x, y, z of cell centres, or of the faces of one axis, as arrays that broadcast to a field."""
    shifts = [0.5, 0.5, 0.5]
    if face_axis is not None:
        shifts[face_axis] = 1.0
    shapes = ((1, 1, -1), (1, -1, 1), (-1, 1, 1))
    return {letter: ((np.arange(-GHOSTS, n + GHOSTS) + start + shift) * h).reshape(shape)
            for letter, n, start, shift, h, shape in
            zip("xyz", grid.count, grid.start, shifts, grid.spacing, shapes, strict=True)}


def evaluate(grid: Grid, expression: str, target: Field, face_axis: int | None,
             time: float = 0.0) -> None:
    """Fill a field from an expression of x, y, z, t (checked when the scene was loaded)."""
    names = {**coordinates(grid, face_axis), "pi": np.pi, "t": time}
    target[...] = numexpr.evaluate(expression, local_dict=names, global_dict={})
    if not np.isfinite(target[INNER]).all():
        raise ValueError(f"the expression {expression!r} is not finite everywhere "
                         f"at t = {time:g}; fix: keep it finite in the whole box")
