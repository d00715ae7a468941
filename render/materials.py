"""Which numbers describe a surface? The materials of a scene as arrays for the kernels."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.texture import KINDS
from solver.scene_render import BUILT_IN_MATERIALS, Material, Texture

PHONG, GLASS = 0, 1
Array = NDArray[np.float64]

BUILT_IN = dict(zip(BUILT_IN_MATERIALS, (
    # float glass: clear face on, green through its edge
    Material(kind="glass", specular=0.5, exponent=300.0, absorption=(6.0, 1.6, 3.4)),
    Material(colour=(0.62, 0.6, 0.57), specular=0.15, exponent=30.0),
    Material(colour=(0.72, 0.68, 0.6), texture=Texture(kind="noise", scale=0.15,
                                                       colour=(0.58, 0.54, 0.47))),
    Material(colour=(0.36, 0.13, 0.085), texture=Texture(kind="brick", scale=0.13,
                                                         colour=(0.36, 0.34, 0.31)), crease=0.0),
    Material(colour=(0.2, 0.2, 0.205), texture=Texture(kind="noise", scale=0.05,
                                                       colour=(0.13, 0.13, 0.135))),
    Material(colour=(0.25, 0.25, 0.27), diffuse=0.5, specular=0.9, exponent=60.0, mirror=0.45),
    Material(colour=(0.02, 0.02, 0.02), specular=0.8, exponent=400.0, mirror=0.92),
    Material(colour=(0.03, 0.03, 0.035)),
), strict=True))


class Materials(NamedTuple):
    """Arrays over the m materials; the names are those of `solver.scene_render.Material`."""

    kind: NDArray[np.int64]
    colour: Array           # (m, 3)
    ambient: Array
    diffuse: Array
    specular: Array
    exponent: Array
    mirror: Array
    emission: Array         # (m, 3)
    ior: Array
    absorption: Array       # (m, 3), 1/L
    texture: NDArray[np.int64]   # index into texture.KINDS, -1 for none
    texture_scale: Array
    texture_colour: Array   # (m, 3)


def all_materials(own: Mapping[str, Material]) -> dict[str, Material]:
    """The built-in materials and the scene's, which replace those of the same name."""
    return {**BUILT_IN, **own}


def material_table(materials: Mapping[str, Material]) -> Materials:
    """The kernels' table, in the order of the mapping."""
    rows = list(materials.values())
    textures = [row.texture or Texture() for row in rows]

    def column(name: str) -> Array:
        return np.array([getattr(row, name) for row in rows], np.float64)

    return Materials(
        np.array([GLASS if row.kind == "glass" else PHONG for row in rows]),
        column("colour"), column("ambient"), column("diffuse"), column("specular"),
        column("exponent"), column("mirror"), column("emission"), column("ior"),
        column("absorption"),
        np.array([KINDS.index(row.texture.kind) if row.texture else -1 for row in rows]),
        np.array([texture.scale for texture in textures]),
        np.array([texture.colour for texture in textures]))
