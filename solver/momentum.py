"""Momentum without pressure: advection and viscosity of u, v, w.

    q_new = a q_old + b (q + dt [-(u·∇)q + ∇²q / Re])          for q = u, v, w

Advective form: ∇·u = φ ≠ 0 where fuel burns, and the printed conservative form would let the new
gas enter at rest. The control volume of a face spans two cells; the velocity through each of its
sides is the mean of theirs. The schemes are those of `advance`; the viscosity of an implicit step
is left to `diffuse`, but for κ/b of it (`diffusion`).
"""

from solver.advance import Advance
from solver.diffusion import Diffusion
from solver.openings import Openings
from solver.plan import ACCURATE, IMPLICIT
from solver.scene import Scene
from solver.scene_physics import FACES
from solver.shear import mend_shear
from solver.state import State


class Momentum:
    """Predicts u, v, w of a substep from advection and viscosity."""

    def __init__(self, scene: Scene, state: State):
        fluid = scene.fluid
        self.advance = Advance(state.grid, fluid.advection, fluid.donor_blend, bounded=False)
        self.openings = Openings(state, 0.0 if fluid.advection.startswith("central") else 1.0)
        walls = any(scene.domain.face(name) not in ("slip", "periodic") for name in FACES)
        state.viscosity = self.viscosity = Diffusion(
            scene, state.grid, 1 / fluid.reynolds, order=4 if fluid.advection == "central4" else 2,
            weights=IMPLICIT if walls else ACCURATE)

    def diffusion_limit(self, otherwise: float) -> tuple[float, str]:
        """Explicit diffusion: dt ≤ ⅓ / (ν Σ 1/h²)."""
        return self.viscosity.limit(otherwise), "viscosity"

    def __call__(self, state: State, old: float, new: float, dt: float) -> None:
        """(a, b) = (old, new) are the integrator's weights of the substep."""
        kappa, _ = self.viscosity.split(state.number, new)
        diffusion = kappa / new * self.viscosity.rates
        starts = state.velocity_old if old else state.velocity
        for axis, (made, start, now) in enumerate(zip(state.velocity_new, starts, state.velocity,
                                                      strict=True)):
            self.advance(state, made, start, now, axis, (old, new), dt, diffusion,
                         self.viscosity)
            self.openings(state, made, start, axis, (old, new), dt, diffusion)
        mend_shear(state.grid, state.velocity_new, state.velocity, new * dt * diffusion,
                   self.viscosity.far, implicit=False)
