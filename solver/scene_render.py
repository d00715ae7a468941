"""The parameters of the picture: camera, lights, materials, objects, backdrop, fire and tone.

Colours are linear RGB in the primaries of sRGB; lengths are those of the box.
"""

from collections.abc import Iterator
from math import inf
from typing import Annotated, Any, Literal

from pydantic import Field

from solver.schema import Section, Vector, parameter

NotNegative = Annotated[float, Field(ge=0, lt=inf)]
Cells = Annotated[int, Field(ge=1, le=4096)]
Colour = tuple[NotNegative, NotNegative, NotNegative]
BUILT_IN_MATERIALS = ("glass", "matt", "plaster", "brick", "stone", "metal", "mirror", "dark")


class Camera(Section):
    """A pinhole camera, or one with a lens."""

    position: Vector | None = parameter(None, "the eye; absent: in front of the box (+z)", "L")
    target: Vector | None = parameter(None, "point in the middle of the picture; absent: the "
                                      "centre of the box", "L")
    up: Vector = parameter((0.0, 1.0, 0.0), "direction that is up in the picture")
    fov: float = parameter(40.0, "field of view along the picture's shorter edge", "°",
                           gt=0, lt=180)
    aperture: float = parameter(0.0, "radius of the lens; 0: everything is sharp", "L", ge=0)
    focus: float | None = parameter(None, "distance that is sharp; absent: that of the target",
                                    "L", gt=0)
    shutter: float = parameter(0.0, "share of the time to the next frame during which moving "
                               "pieces blur", "", ge=0, le=1)


class Light(Section):
    """A light that casts sharp shadows."""

    kind: Literal["point", "directional"] = parameter("point", "kind of light")
    position: Vector = parameter((0.5, 2.0, 3.0), 'of a "point"', "L")
    direction: Vector = parameter((0.0, -1.0, 0.0), 'in which a "directional" light travels')
    colour: Colour = parameter((1.0, 1.0, 1.0), "colour")
    intensity: float = parameter(1.0, "irradiance at distance 1, or of a directional light", "",
                                 ge=0, lt=inf)
    falloff: Literal[0, 1, 2] = parameter(2, 'irradiance of a "point" falls as distance^-falloff')


class Texture(Section):
    """A pattern that replaces a material's colour, in the coordinates of the body at rest."""

    kind: Literal["checker", "brick", "noise", "wood", "marble", "image"] = parameter(
        "checker", 'kind of pattern; "image": a picture, laid out by u and v')
    scale: float = parameter(0.1, "size of its unit: a square, a brick's length, a ring", "L", gt=0)
    colour: Colour = parameter((0.1, 0.1, 0.1), "second colour: mortar, other squares, veins")
    image: str = parameter("", "path of the picture, relative to the scene")
    wrap: Literal["repeat", "clamp", "mirror"] = parameter("repeat", "picture: outside [0, 1]")
    repeat: float = parameter(1.0, "picture: times it repeats along u and v", "", gt=0)


class Material(Section):
    """How a surface answers light."""

    kind: Literal["phong", "ashikhmin", "glass"] = parameter(
        "phong", "Phong lighting, Ashikhmin and Shirley's for metal and varnish, or clear "
        '"glass" that reflects and refracts')
    colour: Colour = parameter((0.7, 0.7, 0.7), "colour of diffuse and ambient light")
    ambient: float = parameter(1.0, "ambient coefficient (R_a)", "", ge=0)
    diffuse: float = parameter(0.9, "diffuse coefficient (R_d)", "", ge=0)
    specular: float = parameter(0.0, "coefficient of the highlight (R_s)", "", ge=0)
    exponent: float = parameter(50.0, "sharpness of the highlight (f; n_u)", "", ge=1)
    exponent_v: float | None = parameter(None, "ashikhmin: sharpness along v (n_v); absent: as "
                                         "along u", "", ge=1)
    tint: Colour = parameter((1.0, 1.0, 1.0), "colour of highlights and of mirrored light")
    mirror: float = parameter(0.0, "share of mirrored light", "", ge=0, le=1)
    emission: Colour = parameter((0.0, 0.0, 0.0), "light of its own")
    incandescent: bool = parameter(False, "pieces glow as hot as the air at their corners is on "
                                   "average, in the colours of fire")
    ior: float = parameter(1.5, "refractive index of glass", "", ge=1, le=4)
    absorption: Colour = parameter((0.0, 0.0, 0.0), "glass: exp(-absorption * path)", "1/L")
    crease: float = parameter(35.0, "meshes: normals are smoothed across edges flatter than this; "
                              "0: facets", "°", ge=0, le=180)
    inner: str = parameter("", "material of inner fracture faces; empty: the same")
    texture: Texture | None = parameter(None, "pattern; absent: plain")


class Thing(Section):
    """An object that is only rendered: the flow and the pieces do not know it."""

    shape: Literal["box", "frame", "plane", "sphere", "mesh"] = parameter(
        ..., 'kind; "frame": a box with a rectangular hole along its thinnest axis')
    low: Vector = parameter((0.0, 0.0, 0.0), "lower corner of a box or frame", "L")
    high: Vector = parameter((1.0, 1.0, 1.0), "upper corner of a box or frame", "L")
    hole_low: Vector = parameter((0.25, 0.25, 0.0), "frame: lower corner of the hole", "L")
    hole_high: Vector = parameter((0.75, 0.75, 1.0), "frame: upper corner of the hole", "L")
    place: Vector = parameter((0.0, 0.0, 0.0), "centre of a sphere, point of a plane, or where the "
                              "centre of a mesh's bounding box goes", "L")
    normal: Vector = parameter((0.0, 1.0, 0.0), "of an infinite plane")
    radius: float = parameter(0.1, "of a sphere", "L", gt=0)
    mesh: str = parameter("", "path of a mesh file, relative to the scene")
    scale: float = parameter(1.0, "of a mesh", "", gt=0)
    material: str = parameter("plaster", "name of a material")


class Backdrop(Section):
    """What rays see that hit nothing: a picture at infinity, made here."""

    kind: Literal["street", "sky", "uniform", "image"] = parameter(
        "street", '"street": houses around the scene under an evening sky; "image": an '
        "equirectangular picture")
    colour: Colour = parameter((1.0, 1.0, 1.0), "factor on it; of a uniform one: its colour")
    image: str = parameter("", 'path of the picture of kind "image", relative to the scene')
    turn: float = parameter(0.0, "rotation about the vertical", "°")


class Splat(Section):
    """The thesis' volume of particles."""

    cells: tuple[Cells, Cells, Cells] = parameter(
        (300, 300, 300), "cells of the volume (vx, vy, vz); only filled ones take memory")
    alpha: float = parameter(1.4, "width of the Gaussian blur (α)", "cells", gt=0)
    filter: int = parameter(5, "edge of the blur's filter (nf), odd", "cells", ge=1, le=99)
    min_density: float = parameter(0.05, "density of the thinnest cell (min_d)", "", ge=0, le=1)
    max_density: float = parameter(0.95, "density of the densest cell (max_d)", "", ge=0, le=1)
    tau: float = parameter(0.01, "absorption per density and cell (τ)", "1/cell", gt=0)
    most: float | None = parameter(None, "blurred particles per cell shown as max_density; absent: "
                                   "found once for the whole sequence", "", gt=0)


class Volume(Section):
    """Fire and smoke: how temperature and soot become light and opacity."""

    visible: bool = parameter(True, "render fire and smoke")
    source: Literal["grid", "particles"] = parameter(
        "grid", "fire from the temperature of the grid, or fire and soot from particles (splat)")
    splat: Splat = parameter(Splat(), 'for source "particles"')
    temperature_low: float | None = parameter(
        None, "temperature shown as kelvin_low; absent: fluid.ambient_temperature", "K")
    temperature_high: float | None = parameter(
        None, "temperature shown as kelvin_high; absent: found once for the whole sequence", "K")
    kelvin_low: float = parameter(300.0, "black body temperature of still air", "kelvin", ge=0)
    kelvin_high: float = parameter(3500.0, "black body temperature of the hottest fire", "kelvin",
                                   gt=0)
    palette: Literal["planck", "thesis"] = parameter(
        "planck", "colour of heat: a black body's, or the thesis' polynomial 2P²+100P+1000 of it")
    exposure: float = parameter(3.0, "radiance of the hottest fire", "", ge=0)
    contrast: float = parameter(
        0.35, "exponent on Planck's luminance; 1: physical, five decades from red to yellow", "",
        gt=0, le=2)
    opacity: float = parameter(40.0, "absorption of the hottest gas", "1/L", ge=0)
    onset: float = parameter(0.1, "share of the temperature range below which gas is clear", "",
                             ge=0, lt=1)
    smoke: float = parameter(30.0, "absorption of soot at its mean density, were all fuel burnt to "
                             "soot that fills the box", "1/L", ge=0)
    albedo: Colour = parameter((0.28, 0.26, 0.24), "share of light that smoke and hot gas scatter; "
                               "0: black smoke")
    step: float = parameter(1.0, "length of a ray's step, in cells, or in 1/64 of the box "
                            "where cells are finer", "", gt=0, le=4)
    lights: Literal[0, 1, 8, 64] = parameter(8, "parts of the fire that light its surroundings; "
                                             "more: softer shadows")
    shadows: bool = parameter(True, "fire and smoke cast shadows of lamps on surfaces")
    glow: float = parameter(1.0, "factor on the fire's light on surfaces and smoke; 1: "
                            "as bright as it shines", "", ge=0)


class Render(Section):
    """The [render] table; every key has a default that suits any run."""

    width: int = parameter(300, "image width", "px", ge=1, le=16384)
    height: int = parameter(300, "image height", "px", ge=1, le=16384)
    samples: int = parameter(2, "jittered samples per pixel along each axis", "", ge=1, le=64)
    adaptive: float = parameter(
        0.0, "contrast between the samples of a pixel, of x / (1 + x), above which it gets four "
        "times as many more; 0: never", "", ge=0, lt=1)
    depth: int = parameter(8, "reflections and refractions that a ray may take", "", ge=0, le=64)
    fps: int = parameter(30, "frames per second of the video", "1/s", ge=1, le=240)
    exposure: float = parameter(1.0, "factor on light before the tone curve", "", gt=0)
    exr: bool = parameter(False, "also write linear light, depth, normal, piece and temperature "
                          "as EXR")
    tone: Literal["film", "linear"] = parameter("film", "tone curve: a filmic shoulder, or clipped")
    crack_gap: float = parameter(0.05, "a fracture face appears once its pieces have parted by "
                                 "this share of the body's thickness", "", ge=0)
    ambient: Colour = parameter((0.12, 0.13, 0.16), "ambient light (I_a)")
    camera: Camera = parameter(Camera(), "the camera")
    light: tuple[Light, ...] | None = parameter(None, "lights; absent: a sun and a fill light")
    material: dict[str, Material] = parameter(
        {}, "materials by name, beside " + ", ".join(BUILT_IN_MATERIALS))
    object: tuple[Thing, ...] = parameter((), "objects that are only rendered")
    backdrop: Backdrop = parameter(Backdrop(), "behind everything")
    volume: Volume = parameter(Volume(), "fire and smoke")


def contradictions(scene: Any) -> Iterator[tuple[str, Any, str]]:
    """Values of [render] that cannot stand together, as (key, value, complaint; fix)."""
    render: Render | None = scene.render
    if render is None:
        return
    known = {*BUILT_IN_MATERIALS, *render.material}
    listing = ", ".join(sorted(known))
    uses = [(f"body.{i}.material", body.material) for i, body in enumerate(scene.body)]
    uses += [(f"obstacle.{i}.material", plane.material)
             for i, plane in enumerate(scene.obstacle)]
    uses += [(f"render.object.{i}.material", thing.material)
             for i, thing in enumerate(render.object)]
    uses += [(f"render.material.{name}.inner", material.inner)
             for name, material in render.material.items()]
    for key, name in uses:
        if name and name not in known:
            yield key, name, f"no such material; fix: one of {listing}, or [render.material.{name}]"
    yield from _camera_contradictions(render.camera)
    volume = render.volume
    if volume.kelvin_high <= volume.kelvin_low:
        yield ("render.volume.kelvin_high", volume.kelvin_high,
               f"must exceed kelvin_low = {volume.kelvin_low:g}; fix: raise it")
    if volume.splat.filter % 2 == 0:
        yield ("render.volume.splat.filter", volume.splat.filter,
               f"must be odd; fix: {volume.splat.filter + 1}")
    if volume.splat.max_density <= volume.splat.min_density:
        yield ("render.volume.splat.max_density", volume.splat.max_density,
               f"must exceed min_density = {volume.splat.min_density:g}; fix: raise it")
    for index, thing in enumerate(render.object):
        yield from _thing_contradictions(f"render.object.{index}", thing)
    for name, material in render.material.items():
        texture = material.texture
        if texture is not None and texture.kind == "image" and not texture.image:
            yield (f"render.material.{name}.texture.image", "",
                   "missing; fix: the path of a picture")
        if material.kind == "ashikhmin" and material.specular > 1:
            yield (f"render.material.{name}.specular", material.specular,
                   "reflects more than it gets; fix: at most 1")
    if render.backdrop.kind == "image" and not render.backdrop.image:
        yield "render.backdrop.image", "", "missing; fix: the path of an equirectangular picture"
    for index, light in enumerate(render.light or ()):
        if light.kind == "directional" and not any(light.direction):
            yield (f"render.light.{index}.direction", light.direction,
                   "has no direction; fix: a vector that is not zero")


def _camera_contradictions(camera: Camera) -> Iterator[tuple[str, Any, str]]:
    if camera.position is None or camera.target is None:
        return
    view = [t - p for t, p in zip(camera.target, camera.position, strict=True)]
    if not any(view):
        yield ("render.camera.target", camera.target, "is where the camera stands; fix: move it")
    u, v = camera.up, view
    cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    if any(view) and not any(cross):
        yield ("render.camera.up", camera.up,
               "is the direction of view; fix: any other direction, as in [0, 0, -1]")


def _thing_contradictions(key: str, thing: Thing) -> Iterator[tuple[str, Any, str]]:
    if thing.shape in ("box", "frame"):
        if any(a >= b for a, b in zip(thing.low, thing.high, strict=True)):
            yield f"{key}.high", thing.high, f"must exceed low = {thing.low}; fix: raise it"
    if thing.shape == "frame" and any(a >= b for a, b in zip(thing.hole_low, thing.hole_high,
                                                             strict=True)):
        yield (f"{key}.hole_high", thing.hole_high,
               f"must exceed hole_low = {thing.hole_low}; fix: raise it")
    if thing.shape == "mesh" and not thing.mesh:
        yield f"{key}.mesh", "", "missing; fix: the path of a mesh file"
    if thing.shape == "plane" and not any(thing.normal):
        yield f"{key}.normal", thing.normal, "has no direction; fix: as in [0, 1, 0]"
