"""What a step consists of: the terms of the equations, in order, and which of them a scene needs.

`ORDER` is the only place that says what runs, when and why. A stage that is not wanted is not
imported, allocated or timed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from math import inf
from typing import Any

from solver.scene import Scene

ONCE, SUBSTEP, AFTER = "once", "substep", "after"

# Strong-stability-preserving Runge-Kutta (Shu & Osher 1988) as (a, b, c) per substep:
# q ← a q_start + b (q + dt R(q)), each followed by its own projection; it stands at t + c dt.
SUBSTEPS = {"euler": ((0.0, 1.0, 1.0),),
            "rk2": ((0.0, 1.0, 1.0), (1 / 2, 1 / 2, 1.0)),
            "rk3": ((0.0, 1.0, 1.0), (3 / 4, 1 / 4, 1 / 2), (1 / 3, 2 / 3, 1.0))}

# Implicit diffusion beside them, (κ, μ) per substep: κ dt D∇² of the values before the substep, and
# μ dt D∇² of the new ones. With rk3 of second order; a step of D∇² dt = -z alone errs by z³/3, and
# hardly changes sign; it holds beside walls, whose shear is explicit. `ACCURATE`, for velocities
# without such walls, errs by z⁴. Both damp z → ∞ to nothing.
Weights = dict[str, tuple[tuple[float, float], ...]]
IMPLICIT: Weights = {"euler": ((0.0, 1.0),),
                     "rk3": ((0.0, 1.0), (-3 / 4, 1.0), (1 / 3, 1 / 3))}
ACCURATE = IMPLICIT | {"rk3": ((0.0, 1.0), (-7 / 20, 3 / 5), (3 / 5, 1 / 15))}


@dataclass(frozen=True)
class Stage:
    """One line of the plan.

    name     module of `solver` that holds it, and its name in logs and timings
    kind     class in that module
    term     what it computes
    when     ONCE per step before the flow, in every SUBSTEP of it, AFTER it, or at several of these
    missing  what a scene lacks that does not need it, or "" when it runs
    """

    name: str
    kind: str
    term: str
    when: str | tuple[str, ...]
    missing: Callable[[Scene], str]

    def load(self) -> Any:
        """Import the module (which compiles its kernels); returns the class."""
        return getattr(import_module(f"solver.{self.name}"), self.kind)

    def build(self, scene: Scene, state: Any) -> Any:
        """Construct the stage for a scene and its state."""
        return self.load()(scene, state)


def _fire(scene: Scene) -> str:
    return "" if scene.fuel is not None else "no [fuel]"


def _bodies(scene: Scene) -> str:
    return "" if scene.body else "no [[body]]"


def _temperature(scene: Scene) -> str:
    return "" if scene.has_temperature else "no [fuel], initial.T or buoyancy"


def _cooling(scene: Scene) -> str:
    return _temperature(scene) or ("" if scene.fluid.cooling else "fluid.cooling = 0")


def _calm(scene: Scene) -> str:
    fluid = scene.fluid
    if scene.fuel is None and not fluid.source:
        return "no [fuel] or fluid.source"
    return "" if fluid.advection.startswith("central") else f"advection {fluid.advection}"


def _buoyancy(scene: Scene) -> str:
    return "" if scene.fluid.buoyancy else "fluid.buoyancy = 0"


def _vorticity(scene: Scene) -> str:
    return "" if scene.fluid.vorticity_confinement else "fluid.vorticity_confinement = 0"


def _source(scene: Scene) -> str:
    return "" if scene.fluid.source or scene.fluid.heat_source else "no fluid.source, heat_source"


def _force(scene: Scene) -> str:
    return "" if any(f != "0" for f in scene.fluid.force) else "fluid.force = 0"


def _implicit(scene: Scene) -> str:
    if scene.fluid.reynolds == inf:
        return "fluid.reynolds = inf"
    if scene.fluid.diffusion == "explicit":
        return 'fluid.diffusion = "explicit"'
    if scene.time.integrator not in IMPLICIT:
        return f'time.integrator = "{scene.time.integrator}"'
    return "" if scene.is_closed else "open faces"


def _always(_scene: Scene) -> str:
    return ""


ORDER = (
    Stage("burn", "Burn", "φ, heat and soot of burning fuel", ONCE, _fire),
    Stage("particles", "Particles", "particles move, heat up, catch fire", ONCE, _fire),
    Stage("emit", "Emit", "fuel particles appear", ONCE, _fire),
    Stage("bodies", "Bodies", "pieces under drag and gravity", ONCE, _bodies),
    Stage("source", "Source", "prescribed φ and heat", SUBSTEP, _source),
    Stage("temperature", "Temperature", "-(u·∇)T + c_k ∇²T + H", SUBSTEP, _temperature),
    Stage("momentum", "Momentum", "-(u·∇)u + ∇²u / Re", SUBSTEP, _always),
    Stage("calm", "Calm", "-Σ δ²(⅛ max(φ, 0) δ²u) per axis", SUBSTEP, _calm),
    Stage("buoyancy", "Buoyancy", "-β (T - T_a) g", SUBSTEP, _buoyancy),
    Stage("force", "Force", "f(x, y, z, t)", SUBSTEP, _force),
    Stage("vorticity", "Vorticity", "ε h (N × ω)", SUBSTEP, _vorticity),
    Stage("diffuse", "Diffuse", "∇²u / Re, where it is implicit", SUBSTEP, _implicit),
    Stage("project", "Project", "-∇p with ∇·u = φ", SUBSTEP, _always),
    Stage("cool", "Cool", "-c_r ((T - T_a) / (T_max - T_a))⁴", (ONCE, AFTER), _cooling),
)


def wanted(scene: Scene) -> list[Stage]:
    """The stages that the scene needs, in order."""
    return [stage for stage in ORDER if not stage.missing(scene)]


def describe(scene: Scene) -> str:
    """The plan as a table: stage, runs or skipped and why, term."""
    lines = [f"{'stage':<12} {'':<8} term"]
    for stage in ORDER:
        missing = stage.missing(scene)
        lines.append(f"{stage.name:<12} {'skipped' if missing else 'runs':<8} {stage.term}"
                     + (f"   ({missing})" if missing else ""))
    number = len(SUBSTEPS[scene.time.integrator])
    lines.append(f"integrator {scene.time.integrator}: {number} projection"
                 f"{'s' if number > 1 else ''} per step")
    return "\n".join(lines)
