"""The parameters of the simulation: box, time, fluid, fire and output (the thesis' Table 5.1).

Symbols in brackets are the thesis'. Temperatures are in scene units, not Kelvin.
"""

from collections.abc import Iterator
from math import inf
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from solver import formula
from solver.schema import Positive3, Section, Vector, parameter

Cells = Annotated[int, Field(ge=1, le=4096)]
Kind = Literal["open", "wall", "slip", "periodic"]
VARIABLES = ("x", "y", "z", "t", "pi")


def _formula(text: str) -> str:
    """Refuse what is no arithmetic, before anything runs."""
    if text:
        formula.check(text, VARIABLES)
    return text


Formula = Annotated[str, AfterValidator(_formula)]
FACES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


class MovingWall(Section):
    """A no-slip wall that slides: `{ wall = [u, v, w] }`; its normal component must be 0."""

    wall: Vector = parameter(..., "velocity of the wall", "L/s")


Face = Kind | MovingWall


class Faces(Section):
    """One boundary condition per face of the box."""

    x_min: Face = parameter("open", "face x = 0")
    x_max: Face = parameter("open", "face x = size")
    y_min: Face = parameter("open", "face y = 0 (below)")
    y_max: Face = parameter("open", "face y = size (above)")
    z_min: Face = parameter("open", "face z = 0")
    z_max: Face = parameter("open", "face z = size")


class Domain(Section):
    """The box [0, size] and its staggered grid."""

    size: Positive3 = parameter((1.0, 1.0, 1.0), "edges of the box", "L")
    cells: tuple[Cells, Cells, Cells] = parameter((32, 32, 32), "cells nx, ny, nz of the grid")
    boundary: Kind | Faces = parameter(
        "open", 'one kind for all faces, or a table per face; "open": p = 0, "wall": no slip, '
        '"slip", "periodic", { wall = [u, v, w] }: a moving wall')
    expansion: Literal["refuse", "spread"] = parameter(
        "refuse", "a closed box cannot take net expansion: refuse to start, or subtract the mean "
        "of the divergence source (a uniform sink)")

    def face(self, name: str) -> Face:
        """The boundary condition of one face, e.g. `face("y_max")`."""
        if isinstance(self.boundary, Faces):
            face: Face = getattr(self.boundary, name)
            return face
        return self.boundary


class Time(Section):
    """When the run ends, when frames are stored and how the step is bounded."""

    end: float = parameter(..., "simulated time", "s", gt=0, lt=inf)
    frame: float = parameter(..., "time between stored frames; steps land on them exactly", "s",
                             gt=0, lt=inf)
    cfl: float | None = parameter(
        None, "Courant number of dt = cfl / Σ(|u|/dx + |v|/dy + |w|/dz); absent: 1, or the largest "
        "stable one if that is less; without temperature 1.2 for rk3 with central4, 1.5 with "
        "central", "", gt=0, le=4)
    dt_max: float = parameter(inf, "longest step", "s", gt=0)
    integrator: Literal["euler", "rk2", "rk3"] = parameter(
        "rk3", "of the flow: forward Euler, or strong-stability-preserving Runge-Kutta of order "
        "2 or 3, a projection per substep")


class Fluid(Section):
    """The flow and its temperature."""

    reynolds: float = parameter(inf, "Reynolds number; inf: inviscid", "", gt=0)
    advection: Literal["donor", "central", "central4", "tvd"] = parameter(
        "central4", "scheme of the velocity: donor cell (first order), central (second), central4 "
        "(wider, far smaller errors; both conserve energy), tvd (limited slopes, bounded)")
    temperature_advection: Literal["donor", "central", "central4", "tvd"] = parameter(
        "tvd", "scheme of the temperature, likewise")
    diffusion: Literal["auto", "explicit", "implicit"] = parameter(
        "auto", "viscosity and conduction: explicit (bounds dt), implicit (a solve per value and "
        "substep; rk3 or euler, no open face), or in each step whichever is faster")
    donor_blend: float = parameter(1.0, "share of upwinding in the donor cell (γ)", "",
                                   ge=0, le=1)
    ambient_temperature: float = parameter(5.0, "temperature of still air and of inflow (T_a)", "K")
    max_temperature: float = parameter(100.0, "scale of the cooling law (T_max), not a bound", "K")
    conductivity: float = parameter(0.0, "heat diffusion (c_k)", "L²/s", ge=0)
    cooling: float = parameter(0.0, "radiative cooling at T_max (c_r)", "K/s", ge=0)
    gravity: Vector = parameter((0.0, -9.8, 0.0), "acceleration of bodies and of buoyancy", "L/s²")
    buoyancy: float = parameter(0.0, "lift -β (T - T_a) gravity (β)", "1/K", ge=0)
    vorticity_confinement: float = parameter(0.0, "strength ε of ε h (N × ω)", "", ge=0)
    force: tuple[Formula, Formula, Formula] = parameter(
        ("0", "0", "0"), "force per mass on the flow, expressions of x, y, z, t", "L/s²")
    source: Formula = parameter("", "divergence φ prescribed without fuel, an expression of x, y, "
                                "z, t; empty: none", "1/s")
    heat_source: Formula = parameter("", "heating prescribed without fuel, an expression of x, y, "
                                     "z, t; empty: none; needs a temperature (initial.T)", "K/s")


class Initial(Section):
    """The state at t = 0, as expressions of x, y, z (numexpr syntax; `pi` is known)."""

    u: str = parameter("0", "velocity along x", "L/s")
    v: str = parameter("0", "velocity along y", "L/s")
    w: str = parameter("0", "velocity along z", "L/s")
    T: str = parameter("", "temperature; empty: ambient", "K")
    noise: float = parameter(0.0, "uniform random velocity within ± noise", "L/s", ge=0)


class Detonation(Section):
    """Where the fuel starts."""

    position: Vector = parameter((0.46573, 0.52375, 0.48), "centre (pos_det)", "L")
    radius: float = parameter(0.1, "radius (r_d)", "L", ge=0)
    fill: Literal["sphere", "ball"] = parameter("sphere", "particles on the surface or throughout")


class Fuel(Section):
    """Burning particles: they heat the air, expand it and leave soot."""

    particles: int = parameter(1000, "particles at the start (n_p)", "", ge=0)
    ignited: int = parameter(10, "of these, already burning (np_i)", "", ge=0)
    rate: float = parameter(0.0, "new particles per unit time (np_it)", "1/s", ge=0)
    emit_end: float = parameter(inf, "emission stops", "s", ge=0)
    cap: int = parameter(50_000, "emission never brings the fuel particles ever made above this",
                         "", ge=0)
    deposit: Literal["trilinear", "nearest"] = parameter(
        "trilinear", "how heat and gas reach the grid")
    mass: float = parameter(0.36, "mass of a particle (m)", "M", gt=0)
    burn_rate: float = parameter(0.21, "mass burnt per time (z_f)", "M/s", gt=0)
    heat: float = parameter(0.7019, "temperature times volume released per burnt mass (b_h)",
                            "K L³/M", ge=0)
    gas: float = parameter(2.61, "volume of gas per burnt mass (b_g)", "L³/M", ge=0)
    soot: float = parameter(1.0, "soot per burnt mass (b_s)", "", ge=0)
    ignition_temperature: float = parameter(10.0, "a particle above it burns (T_i)", "K")
    thermal_mass: float = parameter(20.54, "thermal mass of a particle (c_m)", "M L²/(s² K)", gt=0)
    drag: float = parameter(0.0, "drag coefficient (α_d); 0: a tracer", "M/L³", ge=0)
    heat_transfer: float = parameter(2.0e5, "heat exchange with the air (α_h)", "c_m/(L² s)", ge=0)
    exchange: Literal["one_way", "two_way"] = parameter(
        "one_way", "whether the air loses the heat that particles take up")
    air_heat_capacity: float = parameter(
        1.0, "two_way: heat capacity of the air per volume (ρ c_v)", "M/(L s² K)", gt=0)
    radius: float = parameter(0.1, "radius r in α_d r² and α_h r²", "L", gt=0)
    min_mass: float = parameter(1e-6, "a lighter fuel particle is removed (thres_mf)", "M", ge=0)
    min_thermal_mass: float = parameter(1e-4, "no heat exchange below this thermal mass (thres_cm)",
                                        "M L²/(s² K)", ge=0)


class Soot(Section):
    """Dark particles that burnt fuel leaves behind."""

    threshold: float = parameter(0.02, "soot that makes a fuel particle emit a soot particle "
                                 "(c_soot)", "M", gt=0)
    repeat: bool = parameter(False, "a soot particle of mass c_soot for every c_soot, instead of "
                             "one of the fuel particle's first mass")
    burn_rate: float = parameter(0.5, "decay of soot mass (z_s)", "M/s", ge=0)
    min_mass: float = parameter(1e-5, "lighter soot is removed (thres_ms)", "M", ge=0)
    perturbation: float = parameter(0.5, "random offset of a new soot particle, in cells", "", ge=0)


class Output(Section):
    """What a snapshot holds."""

    fields: tuple[Literal["u", "v", "w", "p", "T", "phi"], ...] = parameter(
        ("u", "v", "w", "p", "T", "phi"), "fields to store (those that the scene has)")
    particles: bool = parameter(True, "store particles")
    species: tuple[Literal["fuel", "soot"], ...] = parameter(("fuel", "soot"), "which of them")
    columns: tuple[Literal["velocity", "temperature", "mass", "soot"], ...] = parameter(
        ("velocity", "temperature", "mass", "soot"), "what is stored beside position, id")
    thinning: float = parameter(1.0, "share of the particles that is stored, in all frames the "
                                "same: id and seed decide", "", gt=0, le=1)
    precision: Literal["float32", "float64"] = parameter("float32", "of stored fields")
    compression: Literal["gzip", "none"] = parameter("gzip", "gzip level 1 with shuffle, or none")
    checkpoint_every: float = parameter(600.0, "wall time between checkpoints; 0: only where a "
                                        "session ends", "s of wall time", ge=0)
    checkpoint_keep: int = parameter(2, "the newest checkpoints that are kept", "", ge=1)


# The longest stable step as a Courant number Σ|u| dt/h, by integrator and scheme.
LARGEST_CFL = {
    ("euler", "donor"): 1.0, ("rk2", "donor"): 1.0, ("rk3", "donor"): 1.0,
    ("euler", "tvd"): 0.5, ("rk2", "tvd"): 1.0, ("rk3", "tvd"): 1.0,
    ("euler", "central"): 1.0, ("rk2", "central"): 1.0, ("rk3", "central"): 1.7,
    ("euler", "central4"): 0.7, ("rk2", "central4"): 0.7, ("rk3", "central4"): 1.2}
RK2_INVISCID = 0.5   # of central differences, which rk2 lets grow like (cfl sin kh)⁴ / 8 per step


def frictionless(domain: Domain) -> Domain:
    """The box as air without viscosity meets it: it slips along walls, whether they move or not."""
    faces: dict[str, Face] = {name: domain.face(name) for name in FACES}
    for name, face in faces.items():
        if face not in ("open", "periodic"):
            faces[name] = "slip"
    return domain.model_copy(update={"boundary": Faces(**faces)})


def wall_rate(domain: Domain) -> float:
    """max Σ|U| / h of the moving walls: air at rest will soon move like them."""
    rates = [sum(abs(speed) * n / size for speed, n, size in
                 zip(face.wall, domain.cells, domain.size, strict=True))
             for face in map(domain.face, FACES) if isinstance(face, MovingWall)]
    return max(rates, default=0.0)


def largest_cfl(scene: Any) -> float:
    """The least of the limits of the schemes that a scene uses."""
    schemes = [scene.fluid.advection]
    if scene.has_temperature:
        schemes.append(scene.fluid.temperature_advection)
    least = min(LARGEST_CFL[scene.time.integrator, scheme] for scheme in schemes)
    inviscid = scene.fluid.reynolds == inf and scene.fluid.advection.startswith("central")
    return min(least, RK2_INVISCID) if inviscid and scene.time.integrator == "rk2" else least


def courant(scene: Any) -> float:
    """The Courant number of a scene: what it says, or the default of its schemes."""
    return float(scene.time.cfl or min(1.5, largest_cfl(scene)))


def contradictions(scene: Any) -> Iterator[tuple[str, Any, str]]:
    """What cannot stand together, as (key, value, complaint; fix)."""
    time, fluid = scene.time, scene.fluid
    if courant(scene) > largest_cfl(scene):
        yield ("time.cfl", time.cfl, f"integrator {time.integrator} with advection "
               f"{fluid.advection} and temperature_advection {fluid.temperature_advection} is "
               f"stable up to {largest_cfl(scene):g}; fix: at most that")
    central = fluid.advection in ("central", "central4")
    if central and time.integrator == "euler" and fluid.reynolds == inf:
        yield ("fluid.advection", fluid.advection, "grows with integrator euler for any step where "
               'there is no viscosity; fix: time.integrator = "rk3", or advection = "donor"')
    if fluid.diffusion == "implicit":
        if time.integrator == "rk2":
            yield ("fluid.diffusion", "implicit", "there is no implicit diffusion with integrator "
                   'rk2; fix: time.integrator = "rk3" or "euler", or diffusion = "auto"')
        if not scene.is_closed:
            yield ("fluid.diffusion", "implicit", "cannot be solved for at open faces, where the "
                   'ghosts depend on the flow; fix: diffusion = "auto" (explicit there)')
    prescribed = fluid.source or fluid.heat_source
    if scene.fuel is not None and prescribed:
        yield ("fluid.source" if fluid.source else "fluid.heat_source", prescribed,
               "cannot stand beside [fuel], which makes φ and heat itself; fix: remove one")
    yield from _output_contradictions(scene)


def _output_contradictions(scene: Any) -> Iterator[tuple[str, Any, str]]:
    """What the renderer would miss in the snapshots."""
    output, render = scene.output, scene.render
    if scene.fuel is None or render is None or not output.particles:
        return
    for column, needed in (("mass", scene.soot is not None and render.volume.smoke > 0),
                           ("temperature", render.volume.source == "particles")):
        if needed and column not in output.columns:
            yield ("output.columns", output.columns, f"[render.volume] needs the particles' "
                   f"{column}; fix: add it")
