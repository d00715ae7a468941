"""The parameters of a body: its shape, place, mass and how it breaks."""

from typing import Literal

from solver.schema import Positive3, Section, Vector, parameter


class Fracture(Section):
    """How a body is cut into pieces before the run."""

    method: Literal["bfs"] = parameter("bfs", "recursive breadth-first search on the triangles")
    pieces: int = parameter(16, "number of pieces, exactly", "", ge=1)
    balance: Literal["area", "count"] = parameter("area", "pieces of equal area or triangle count")
    root: Literal["peripheral", "detonation"] = parameter(
        "peripheral", "where the search starts: at the rim, or nearest the detonation")


class Body(Section):
    """A rigid body that the flow throws, whole or in pieces."""

    name: str = parameter(..., "unique name", "", min_length=1)
    shape: Literal["pane", "box", "sphere", "mesh"] = parameter(..., "kind of body")
    mesh: str = parameter("", 'shape "mesh": path of a mesh file, relative to the scene, or '
                          '"animal", the generated one')
    size: Positive3 = parameter((1.0, 1.0, 0.01), "pane, box: edges before scaling; of a pane: "
                                "width, height, thickness", "L")
    radius: float = parameter(0.5, 'radius of a "sphere"', "L", gt=0)
    detail: int = parameter(3, "box, sphere: times that each triangle of the box or icosahedron is "
                            "divided in four", "", ge=0, le=8)
    points: int = parameter(200, "pane: random points, corners and edges included", "", ge=4)
    triangulation: Literal["trisection", "delaunay"] = parameter("delaunay", "of a pane")
    place: Vector = parameter((0.5, 0.5, 0.5), "position of the centre of its bounding box", "L")
    scale: float = parameter(1.0, "factor on its size", "", gt=0)
    rotate: Vector = parameter((0.0, 0.0, 0.0), "rotation about x, then y, then z", "°")
    density: float | None = parameter(None, "mass per volume (closed pieces)", "M/L³", gt=0)
    areal_density: float | None = parameter(None, "mass per surface area", "M/L²", gt=0)
    force: float = parameter(30.0, "drag constant (F_c) of F_c (u - velocity)", "M/s", ge=0)
    velocity: Vector = parameter((0.0, 0.0, 0.0), "initial velocity", "L/s")
    spin: Vector = parameter((0.0, 0.0, 0.0), "initial angular velocity", "rad/s")
    material: str = parameter("", "name of a [render.material]; empty: the renderer's default")
    fracture: Fracture | None = parameter(None, "how it breaks; absent: it stays whole")
