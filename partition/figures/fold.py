"""Where does a curved surface break? (thesis, figures 4.4 and 4.5)

A sheet 1 long and 1/2 wide, flat but for a smooth bend a third of the way along it. The Gaussian
curvature of a bend is 0, so the thesis' weights do not see it and the sheet breaks in the middle;
the angle between neighbouring triangles shows it.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition import picture
from partition.build import Broken, assemble
from partition.divide import divide
from partition.extrude import sheets
from partition.fragments import Fragments
from partition.graph import Ints
from partition.measure import triangle_areas
from partition.mesh import Mesh
from partition.repair import repaired
from solver.scene_body import Cut

Floats = NDArray[np.float64]
LENGTH, WIDTH, BEND, SHARPNESS, ANGLE = 1.0, 0.5, 1 / 3, 14.0, 80.0
ALONG, ACROSS = 60, 30


def draw(path: str | Path) -> list[str]:
    """The picture; where the bend is and where the sheet broke."""
    mesh = sheet()
    uncut = np.zeros(len(mesh.faces), dtype=np.int64)
    made, numbers = picture.dark_figure(12.0, 4.4), []
    shown = [(uncut, "a curved surface", "")]
    for weights in ("dihedral", "thesis"):
        label, cuts = divide(mesh, Cut.model_validate({"method": "spectral", "weights": weights}),
                             2)
        shown.append((label, f"{weights} weights", f"cut at {_place(mesh, label):.3f}, length "
                      f"{cuts[0].length:.3f}, λ₂ {cuts[0].eigenvalue:.4g}"))
        numbers.append(f"{weights} weights: bend at {BEND:.3f} along the sheet, {shown[-1][2]} "
                       f"(straight across: {WIDTH})")
    for column, (label, title, text) in enumerate(shown):
        axes = made.add_axes((column / 3, 0.1, 1 / 3, 0.8))
        picture.draw(axes, _pieces(mesh, label), 0.3, -35.0, 30.0)
        made.text((column + 0.5) / 3, 0.93, title, color=picture.INK, ha="center", fontsize=13)
        made.text((column + 0.5) / 3, 0.03, text, color=picture.INK, ha="center", fontsize=10)
    picture.write(made, path)
    return numbers


def sheet() -> Mesh:
    """The surface: its slope goes from 0 to ANGLE as tanh does, around BEND."""
    s, z = np.meshgrid(np.linspace(0, LENGTH, ALONG + 1), np.linspace(0, WIDTH, ACROSS + 1),
                       indexing="ij")
    fine = np.linspace(0, LENGTH, 4001)
    slope = np.radians(ANGLE) * (1 + np.tanh(SHARPNESS * (fine - BEND))) / 2
    x, y = (np.interp(s, fine, np.cumsum(part) * (fine[1] - fine[0]))
            for part in (np.cos(slope), np.sin(slope)))
    corner = np.arange((ALONG + 1) * (ACROSS + 1)).reshape(ALONG + 1, ACROSS + 1)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:],
                                            corner[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return repaired(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces, "sheet")


def _place(mesh: Mesh, label: Ints) -> float:
    """How far along the sheet the two pieces meet: the smaller one's share of the area."""
    area = np.bincount(label, triangle_areas(mesh.vertices, mesh.faces))
    return float(area.min() / area.sum() * LENGTH)


def _pieces(mesh: Mesh, label: Ints) -> Fragments:
    return assemble([Broken("sheet", sheets(mesh, label), False)])
