"""The time loop: choose dt, act with the particles and bodies, advance the flow, look at it.

    1  fuel appears; the sources φ and H of this step are laid down
    2  dt is chosen, with its reason, and cut so that frames are hit exactly
    3  burning, particles and bodies act once with that dt
    4  the flow is advanced: temperature, momentum, forces, projection, per substep
    5  cooling
    6  one report for all: dt of the next step, divergence, budgets, finiteness
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI

from partition.fragments import Fragments
from solver import plan
from solver.boundary import fill_temperature, fill_velocity
from solver.grid import Grid
from solver.monitor import Monitor, Report
from solver.scene import Scene, SceneError
from solver.scene_physics import courant, frictionless, wall_rate
from solver.state import State

SMALLEST_STEP = 1e-9   # of the time between frames, and this
SMALLEST_SHARE = 1e-12   # of the whole time: with a smaller dt the run has collapsed


class StepError(Exception):
    """A step that failed: stage, step and reason in one line."""


class Simulation:
    """A scene under way. `advance()` makes one step, `run_to()` as many as reach a time."""

    def __init__(self, scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD,
                 fragments: Fragments | None = None):
        self.scene = scene
        self.cfl = courant(scene)
        domain = frictionless(scene.domain) if scene.fluid.reynolds == math.inf else scene.domain
        self.wall_rate = wall_rate(domain)
        self.state = State(Grid(domain, comm), scene)
        self.state.fragments = fragments
        self.stages = {s.name: (s, s.build(scene, self.state)) for s in plan.wanted(scene)}
        self.seconds = dict.fromkeys([*self.stages, "monitor"], 0.0)
        self.reason = ""
        self.substeps = len(plan.SUBSTEPS[scene.time.integrator])
        self._fill_ghosts()
        self.monitor = Monitor(self.state)
        self._make_divergence_free()
        self.report: Report = self.monitor(self.state)

    def _fill_ghosts(self) -> None:
        state = self.state
        fill_velocity(state.grid, state.velocity)
        if state.T is not None:
            fill_temperature(state.grid, state.T, state.velocity,
                             self.scene.fluid.ambient_temperature)

    def _make_divergence_free(self) -> None:
        """Project the initial velocity (noise is not divergence-free)."""
        state = self.state
        for now, then in zip(state.velocity, state.velocity_new, strict=True):
            np.copyto(then, now)
        try:
            self.stages["project"][1](state, 0.0, 1.0, 1.0)
        except RuntimeError as error:
            self.destroy()
            raise SceneError(f"{self.scene.path}: the initial velocity cannot be projected: "
                             f"{error}; fix: other PETSc options, or another initial velocity"
                             ) from error
        state.p.fill(0.0)
        state.iterations = 0

    def run_to(self, target: float) -> Iterator[Report]:
        """Step until `target` is reached exactly, yielding the report of each step."""
        while self.state.time < target:
            yield self.advance(target)

    def advance(self, target: float) -> Report:
        """One step, not beyond `target`."""
        state = self.state
        state.iterations = 0
        self._each("prepare", state)
        steps_left = self._choose_dt(target)
        self._act(plan.ONCE, state.dt)
        state.remember()
        start = state.time
        for number, (old, new, reached) in enumerate(plan.SUBSTEPS[self.scene.time.integrator]):
            state.number = number
            state.substep = start, state.time + reached * state.dt
            self._act(plan.SUBSTEP, old, new, state.dt)
            start = state.substep[1]
        self._each("keep", state)
        self._act(plan.AFTER, state.dt)
        state.time = target if steps_left == 1 else state.time + state.dt
        state.step += 1
        if steps_left == 1:
            self._find_pressure()
        with self._timed("monitor"):
            self.report = self.monitor(state)
        self._check()
        return self.report

    def _find_pressure(self) -> None:
        """The pressure of the velocity as it is now, for the frame (see `project`)."""
        state = self.state
        state.substep = state.time, state.time + state.dt
        state.viscosity.implicit = False
        for name, (entry, stage) in self.stages.items():
            if entry.when == plan.SUBSTEP and name not in ("temperature", "source", "project"):
                with self._timed(name):
                    stage(state, 0.0, 1.0, state.dt)
        with self._timed("project"):
            if "source" in self.stages:
                self.stages["source"][1].look_ahead(state, state.time, state.dt)
            self.stages["project"][1].find_pressure(state, state.dt)
            if "source" in self.stages:
                self.stages["source"][1].divergence(state, state.time)

    def _act(self, when: str, *arguments: float) -> None:
        for name, (entry, stage) in self.stages.items():
            if when in entry.when:
                with self._timed(name):
                    stage(self.state, *arguments)

    def _each(self, method: str, *arguments: Any) -> list[Any]:
        """Call a method on the stages that have it."""
        results = []
        for name, (_, stage) in self.stages.items():
            if hasattr(stage, method):
                with self._timed(name):
                    results.append(getattr(stage, method)(*arguments))
        return results

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        except (ArithmeticError, RuntimeError, ValueError) as error:
            raise StepError(f"stage {name}, step {self.state.step}, t = {self.state.time:.6g}: "
                            f"{error}") from error
        finally:
            self.seconds[name] += time.perf_counter() - start

    def _choose_dt(self, target: float) -> int:
        """Sets state.dt and the reason for it; returns how many such steps reach the target."""
        state, settings = self.state, self.scene.time
        state.source_speed = 0.0
        limits = self._each("limit", state)
        left = target - state.time
        limits += [self._flow_limit(), (settings.dt_max, "dt_max")]
        otherwise = min(left, *(limit for limit, _ in limits))
        if limits[-2][0] == math.inf:   # air at rest
            otherwise = 0.0
        limits += self._each("diffusion_limit", otherwise)
        self._each("foresee", state, min(left, *(limit for limit, _ in limits)))
        limits.append(self._flow_limit())
        dt, self.reason = min(limits, key=lambda limit: limit[0])
        smallest = max(SMALLEST_STEP * settings.frame, SMALLEST_SHARE * settings.end)
        if not dt >= min(smallest, left):
            raise StepError(f"step {state.step}, t = {state.time:.6g}: dt = {dt:.3g} has collapsed "
                            f"({self.reason}); fix: weaker sources or less diffusion, or fewer "
                            "cells")
        steps = max(1, math.ceil(left / dt - 1e-9))
        if steps == 1:
            self.reason = "frame"
        state.dt = left / steps
        return steps

    def _flow_limit(self) -> tuple[float, str]:
        """dt = cfl / Σ|u|/h, with the speed that the sources are about to cause."""
        state = self.state
        push = state.source_speed * math.sqrt(sum(1 / h**2 for h in state.grid.spacing))
        rate = max(self.report.rate, self.wall_rate) + push
        return (self.cfl / rate if rate > 0 else math.inf,
                "advection" if push < rate / 2 else "sources")

    def _check(self) -> None:
        if not (math.isfinite(self.report.energy) and math.isfinite(self.report.divergence)):
            raise StepError(f"step {self.state.step}, t = {self.state.time:.6g}: the flow is not "
                            "finite; fix: a smaller time.cfl, or weaker sources")

    def destroy(self) -> None:
        """Free everything that PETSc must not outlive."""
        self.stages["project"][1].destroy()
        if self.state.swarm is not None:
            self.state.swarm.destroy()
        self.state.grid.destroy()
