"""Which numbers describe a surface? The materials of a scene as arrays for the kernels."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.image import load_linear
from render.texture import KINDS
from solver.scene_render import BUILT_IN_MATERIALS, Material, Texture

PHONG, ASHIKHMIN, GLASS = 0, 1, 2
WRAPS = ("repeat", "clamp", "mirror")
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
    exponents: Array        # (m, 2) along u and v
    tint: Array             # (m, 3)
    mirror: Array
    emission: Array         # (m, 3)
    incandescent: NDArray[np.bool_]
    ior: Array
    absorption: Array       # (m, 3), 1/L
    texture: NDArray[np.int64]   # index into texture.KINDS, -1 for none
    texture_scale: Array
    texture_colour: Array   # (m, 3)
    picture: NDArray[np.int64]      # (m, 4) start in pixels, height, width, index into WRAPS
    picture_repeat: Array
    pixels: NDArray[np.float32]     # (k, 3) all pictures, linear RGB


def all_materials(own: Mapping[str, Material]) -> dict[str, Material]:
    """The built-in materials and the scene's, which replace those of the same name."""
    return {**BUILT_IN, **own}


def material_table(materials: Mapping[str, Material], folder: Path) -> Materials:
    """The kernels' table, in the order of the mapping; pictures are read from `folder`."""
    rows = list(materials.values())
    textures = [row.texture or Texture() for row in rows]

    def column(name: str) -> Array:
        return np.array([getattr(row, name) for row in rows], np.float64)

    picture, pixels = _pictures(textures, folder)
    kinds = {"phong": PHONG, "ashikhmin": ASHIKHMIN, "glass": GLASS}
    return Materials(
        np.array([kinds[row.kind] for row in rows]),
        column("colour"), column("ambient"), column("diffuse"), column("specular"),
        np.array([(row.exponent, row.exponent_v or row.exponent) for row in rows]),
        column("tint"), column("mirror"), column("emission"),
        np.array([row.incandescent for row in rows]), column("ior"), column("absorption"),
        np.array([KINDS.index(row.texture.kind) if row.texture else -1 for row in rows]),
        np.array([texture.scale for texture in textures]),
        np.array([texture.colour for texture in textures]),
        picture, np.array([texture.repeat for texture in textures]), pixels)


def _pictures(textures: Sequence[Texture], folder: Path) -> tuple[NDArray[np.int64],
                                                                  NDArray[np.float32]]:
    """Where each picture starts and its size, and the pixels of all in one array."""
    where, parts, start = np.zeros((len(textures), 4), np.int64), [np.zeros((1, 3))], 1
    for row, texture in enumerate(textures):
        if texture.kind == "image":
            picture = load_linear(folder / texture.image)
            where[row] = start, *picture.shape[:2], WRAPS.index(texture.wrap)
            parts.append(picture.reshape(-1, 3))
            start += picture.shape[0] * picture.shape[1]
    return where, np.concatenate(parts).astype(np.float32)
