"""The parameters of a body: its shape, place, mass and how it breaks; and of what it falls on."""

from collections.abc import Iterator
from math import inf
from typing import Any, Literal

from solver.schema import Positive3, Section, Vector, parameter


class Cut(Section):
    """How a surface is cut into parts."""

    method: Literal["bfs", "spectral"] = parameter(
        "bfs", "breadth-first search: blocks of equal size; spectral: along the weakest lines")
    pieces: int = parameter(2, "number of parts, exactly", "", ge=1)
    mass: Literal["area", "count"] = parameter("area", "size of a part: area, or triangle count")
    root: Literal["peripheral", "detonation"] = parameter(
        "peripheral", "bfs: starts at the rim, or nearest the detonation")
    order: Literal["connected", "half_list"] = parameter(
        "connected", "bfs: whole parts, or the thesis' halved lists, whose parts may be torn")
    weights: Literal["dihedral", "thesis"] = parameter(
        "dihedral", "spectral: weak along concave folds, or where the Gaussian curvature is high")
    cut: Literal["sweep", "sign", "median"] = parameter(
        "sweep", "spectral: where the cut is shortest for its balance, at 0, or at equal sizes")


class Fracture(Cut):
    """How a body is cut into pieces before the run."""

    pieces: int = parameter(16, "number of pieces in all, exactly", "", ge=1)
    first: Cut | None = parameter(None, "a cut before: only one of its parts is broken further")
    side: Literal["smallest", "largest", "detonation"] = parameter(
        "smallest", "with first: the part that is broken, by size or nearest the detonation")


class Laws(Section):
    """How the flow moves a body; the second choice of each is the thesis' own formula."""

    drag: Literal["relative", "absolute"] = parameter(
        "relative", "from the flow's velocity past the body, or from the flow's velocity alone")
    weights: Literal["area", "vertex"] = parameter(
        "area", "F_c is shared out by area, or taken whole by every vertex")
    push: Literal["total", "parallel"] = parameter(
        "total", "what moves the centre: the whole force, or its part along the lever arm")
    inertia: Literal["exact", "smallest_edge"] = parameter(
        "exact", "of the shape, or 2 m a²/3 with the shortest edge a of its bounding box")


class DeformUntil(Section):
    """When a body that the flow deforms breaks: at the first of the two."""

    time: float = parameter(inf, "breaks at this time", "s", gt=0)
    displacement: float = parameter(inf, "breaks once a vertex has moved so far", "L", gt=0)


class Body(Section):
    """A rigid body that the flow throws, whole or in pieces."""

    name: str = parameter(..., "unique name", "", min_length=1)
    shape: Literal["pane", "box", "sphere", "mesh"] = parameter(..., "kind of body")
    mesh: str = parameter("", 'shape "mesh": path of a mesh file, relative to the scene, or '
                          'a generated one: "animal", "bear", "pumpkin", "statue"')
    size: Positive3 = parameter((1.0, 1.0, 0.01), "pane, box: edges before scaling; of a pane: "
                                "width, height, thickness", "L")
    radius: float = parameter(0.5, 'radius of a "sphere"', "L", gt=0)
    detail: int = parameter(3, "box, sphere: times that each triangle of the box or icosahedron is "
                            "divided in four", "", ge=0, le=8)
    points: int = parameter(200, "pane: random points, corners and edges included", "", ge=4)
    sampling: Literal["random", "even", "radial"] = parameter(
        "random", "pane: points uniform, without clusters, or dense around the detonation")
    outline: tuple[tuple[float, float], ...] = parameter(
        (), "pane: corners of a convex outline, in parts of width and height from its middle; "
        "empty: a rectangle")
    triangulation: Literal["trisection", "delaunay"] = parameter("delaunay", "of a pane")
    interior: Literal["open", "shell", "solid"] = parameter(
        "open", "pieces of a box, sphere or mesh: sheets, a skin of some thickness, or solid")
    skin: float = parameter(0.01, 'thickness of interior "shell", in the scene', "L", gt=0)
    grain: Literal["raw", "smooth", "rough"] = parameter(
        "raw", 'inner faces of interior "solid": as the tetrahedra lie, evened, or with noise')
    place: Vector = parameter((0.5, 0.5, 0.5), "position of the centre of its bounding box", "L")
    scale: float = parameter(1.0, "factor on its size", "", gt=0)
    rotate: Vector = parameter((0.0, 0.0, 0.0), "rotation about x, then y, then z", "°")
    density: float | None = parameter(None, "mass per volume (closed pieces)", "M/L³", gt=0)
    areal_density: float | None = parameter(None, "mass per surface area", "M/L²", gt=0)
    force: float = parameter(30.0, "drag constant (F_c) of F_c (u - velocity)", "M/s", ge=0)
    velocity: Vector = parameter((0.0, 0.0, 0.0), "initial velocity", "L/s")
    spin: Vector = parameter((0.0, 0.0, 0.0), "initial angular velocity", "rad/s")
    laws: Laws = parameter(Laws(), "formulas of its motion")
    deform_until: DeformUntil | None = parameter(
        None, "the flow carries its vertices until then; absent: it is rigid from the start")
    material: str = parameter("", "name of a [render.material]; empty: the renderer's default")
    fracture: Fracture | None = parameter(None, "how it breaks; absent: it stays whole")


class Obstacle(Section):
    """A fixed plane: pieces bounce off it, slide along it and come to rest on it. The flow does
    not know it."""

    place: Vector = parameter((0.0, 0.0, 0.0), "a point of the plane", "L")
    normal: Vector = parameter((0.0, 1.0, 0.0), "direction of the side where the pieces are")
    friction: float = parameter(0.5, "Coulomb's coefficient (μ): rubbing force per pressing force",
                                "", ge=0, lt=inf)
    restitution: float = parameter(0.2, "speed after an impact per speed before it (e)", "",
                                   ge=0, le=1)
    material: str = parameter("", "name of a material with which it is drawn; empty: not drawn")


def contradictions(scene: Any) -> Iterator[tuple[str, Any, str]]:
    """Values of bodies that cannot stand together, as (key, value, complaint; fix)."""
    for index, plane in enumerate(scene.obstacle):
        if not any(plane.normal):
            yield (f"obstacle.{index}.normal", plane.normal, "has no direction; fix: a vector that "
                   "is not zero")
        if not scene.body:
            yield (f"obstacle.{index}", "given", "nothing can meet it; fix: add [[body]] or remove "
                   "it")
    for index, body in enumerate(scene.body):
        until = body.deform_until
        if until is not None and until.time == until.displacement == inf:
            yield (f"body.{index}.deform_until", "{}", "it would never break; fix: give time or "
                   "displacement")
        breaks = body.fracture
        if breaks is not None and breaks.first is not None and breaks.first.pieces > breaks.pieces:
            yield (f"body.{index}.fracture.pieces", breaks.pieces, "fewer than its first cut makes;"
                   f" fix: at least fracture.first.pieces = {breaks.first.pieces}")
        if body.interior == "solid" and breaks is not None and breaks.order == "half_list":
            yield (f"body.{index}.fracture.order", breaks.order, "lists triangles, but a solid "
                   'body is made of tetrahedra; fix: interior = "open" or "shell"')
        if body.shape == "pane" and body.interior != "open":
            yield (f"body.{index}.interior", body.interior, "the pieces of a pane are solid "
                   "anyway; fix: remove it")
        if body.outline and body.shape != "pane":
            yield (f"body.{index}.outline", body.outline, "only a pane has one; fix: remove it")
