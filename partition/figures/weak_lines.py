"""Do bodies break where they should? (thesis, figure 5.3 and Table 5.2)

The thesis' meshes are not ours to give away, so four bodies are generated, and of each it is known
by its construction where it is weakest. The picture shows the default cut; the table also the
thesis' weights and its sign rule. `python -m partition MESH --method spectral --pieces 2 --picture
FILE` does the same for any mesh.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition import picture
from partition.build import Broken, assemble
from partition.cut import CutMade
from partition.divide import divide
from partition.extrude import sheets
from partition.figurines import GENERATED, WEAKEST, Plane
from partition.graph import Ints
from partition.measure import triangle_areas
from partition.mesh import Mesh
from partition.repair import repaired
from solver.scene_body import Cut

Floats = NDArray[np.float64]
RULES = {
    "default": Cut(method="spectral"),
    "thesis": Cut(method="spectral", weights="thesis", mass="count", cut="sign"),
}
PLACES = {"animal": "neck", "bear": "neck", "pumpkin": "deep grooves, stem", "statue": "waist"}


def draw(path: str | Path) -> list[str]:
    """The picture; per body and rule the cut, and how much of the area lies on its right side."""
    made = picture.dark_figure(12.0, 4.2)
    numbers = [f"{'body':8} {'rule':8} {'triangles':>9} {'in two':>13} {'length':>7} {'plane':>7} "
               f"{'lambda2':>9} {'l3/l2':>6} {'agrees':>7}  expected at"]
    for column, (name, make) in enumerate(GENERATED.items()):
        mesh = repaired(*make(), name)
        for rule, wanted in RULES.items():
            label, (cut,) = divide(mesh, wanted, 2)
            if rule == "default":
                axes = made.add_axes((column / 4, 0.10, 1 / 4, 0.82))
                picture.draw(axes, assemble([Broken(name, sheets(mesh, label), False)]), 0.35,
                             40.0, 18.0)
                _caption(made, column, name, cut, agreement(mesh, label, WEAKEST[name]))
            numbers.append(
                f"{name:8} {rule:8} {cut.triangles:9d} {cut.triangles - cut.smaller:6d} "
                f"{cut.smaller:6d} {cut.length:7.3f} {section(mesh, WEAKEST[name]):7.3f} "
                f"{cut.eigenvalue:9.3g} {cut.ratio:6.2f} "
                f"{agreement(mesh, label, WEAKEST[name]):7.1%}  {PLACES[name]}")
    picture.write(made, path, colours=128)
    return numbers


def agreement(mesh: Mesh, label: Ints, plane: Plane) -> float:
    """Share of the area that two pieces put on the side on which the plane has it."""
    area = triangle_areas(mesh.vertices, mesh.faces)
    same = (label == 1) == plane.beyond(mesh.vertices[mesh.faces].mean(axis=1))
    share = float(area[same].sum() / area.sum())
    return max(share, 1 - share)


def section(mesh: Mesh, plane: Plane) -> float:
    """Length of the line in which a plane cuts the mesh."""
    height: Floats = (mesh.vertices - plane.point) @ np.array(plane.normal)
    total = 0.0
    for corners in mesh.faces[np.ptp((height > 0).astype(np.int8)[mesh.faces], axis=1) > 0]:
        ends = []
        for a, b in zip(corners, np.roll(corners, -1), strict=True):
            if (height[a] > 0) != (height[b] > 0):
                along = height[a] / (height[a] - height[b])
                ends.append(mesh.vertices[a] + along * (mesh.vertices[b] - mesh.vertices[a]))
        total += float(np.linalg.norm(ends[1] - ends[0]))
    return total


def _caption(made: Any, column: int, name: str, cut: CutMade, agrees: float) -> None:
    x = (column + 0.5) / 4
    style = {"color": picture.INK, "ha": "center"}
    made.text(x, 0.93, f"{name}: {PLACES[name]}", fontsize=13, **style)
    made.text(x, 0.02, f"{cut.triangles - cut.smaller} + {cut.smaller} triangles\n"
              f"cut {cut.length:.2f}, {agrees:.1%} as expected", fontsize=10, **style)
