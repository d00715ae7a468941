"""What do rays see that hit nothing? A picture at infinity, painted once per run.

The picture is equirectangular (rows from straight up to straight down, columns around the vertical,
+z in the middle), linear RGB; kernels look it up bilinearly. The street is ours: two rows of houses
with windows, some of them lit, under an evening sky, so that glass has something to reflect.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.image import load_linear
from render.kernel import kernel
from render.vector import Three
from solver.scene_render import Backdrop

Picture = NDArray[np.float32]
Array = NDArray[np.float64]
ROWS, COLUMNS = 512, 1024


@lru_cache(maxsize=2)
def backdrop(choice: Backdrop, folder: Path, seed: int) -> Picture:
    """(rows, columns, 3) the backdrop of a scene whose file lies in `folder`; not to be changed."""
    if choice.kind == "uniform":
        picture = np.ones((1, 1, 3))
    elif choice.kind == "image":
        picture = load_linear(folder / choice.image)
    else:
        up, around = _directions()
        picture = _sky(up, around)
        if choice.kind == "street":
            _street(picture, up, around, np.random.default_rng([seed, 0x57E7]))
    turn = round(choice.turn / 360.0 * picture.shape[1])
    return np.ascontiguousarray(np.roll(picture, turn, axis=1) * choice.colour, np.float32)


def _directions() -> tuple[Array, Array]:
    """Tangent of the elevation (rows, 1), azimuth from +z (1, columns) of the pixels' middles."""
    elevation = np.pi / 2 - np.pi * (np.arange(ROWS) + 0.5) / ROWS
    azimuth = 2 * np.pi * ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5)
    return np.tan(elevation)[:, None], azimuth[None, :]


def _sky(up: Array, around: Array) -> Array:
    """Dusk: deep blue above, a warm band at the horizon where the sun has set, dark ground."""
    height = (up / np.sqrt(1 + up * up))[..., None]
    zenith, horizon = np.array((0.05, 0.09, 0.2)), np.array((0.46, 0.42, 0.42))
    share = np.clip(height, 0, 1) ** 0.45
    sky = horizon * (1 - share) + zenith * share
    west = np.exp(-((around - 0.9) / 0.9) ** 2)[..., None] * np.exp(-np.abs(height) / 0.16)
    sky = sky + west * np.array((0.85, 0.34, 0.08))
    ground = np.array((0.05, 0.05, 0.055)) * np.ones_like(sky)
    return np.where(height > 0, sky, ground)


def _street(picture: Array, up: Array, around: Array, random: np.random.Generator) -> None:
    """Houses on both sides of a street that runs along x, seen from its middle."""
    with np.errstate(divide="ignore", over="ignore"):
        away = 1.0 / np.maximum(np.abs(np.cos(around)), 1e-3)   # distance of the facade's line
    along = np.tan(np.clip(around, -1.5, 1.5)) * 1.0
    along = np.where(np.abs(around) > np.pi / 2, 40.0 + np.tan(around), along)
    level = up * away                                           # height on the facade
    edges = np.cumsum(random.uniform(0.45, 0.95, 160)) - 20.0
    house = np.searchsorted(edges, along)
    roof = random.uniform(0.45, 1.0, len(edges) + 1)[house]
    tint = random.uniform(0.6, 1.2, (len(edges) + 1, 1)) * np.array((0.34, 0.25, 0.19))
    tint = tint + random.uniform(-0.05, 0.05, (len(edges) + 1, 3))
    facade = (level < roof) & (level > -0.3) & (away < 40.0)
    haze = np.clip((away - 3.0) / 25.0, 0, 0.75)[..., None] * np.ones_like(picture)
    wall = np.clip(tint[house], 0.02, 1) * np.ones_like(picture)
    wall *= (0.75 + 0.25 * np.cos(around))[..., None]
    _windows(wall, along, level, random)
    wall = wall * (1 - haze) + np.array((0.3, 0.29, 0.31)) * haze
    picture[:] = np.where(facade[..., None], wall, picture)
    _road(picture, up, around)


def _windows(wall: Array, along: Array, level: Array, random: np.random.Generator) -> None:
    """Rows of windows: most mirror the sky, some are lit."""
    column, row = np.floor(along / 0.16), np.floor(level / 0.2)
    x, y = along / 0.16 - column, level / 0.2 - row
    window = (np.abs(x - 0.5) < 0.27) & (np.abs(y - 0.55) < 0.32) & (level > -0.18)
    lamps = random.random((64, 1024))
    lamp = lamps[row.astype(int) % 64, column.astype(int) % 1024]
    sill = (np.abs(x - 0.5) < 0.33) & (np.abs(y - 0.2) < 0.05)
    lamp, shine = lamp[..., None], 1.2 - 0.5 * y[..., None]
    glass = np.where(lamp < 0.18, np.array((2.2, 1.35, 0.5)) * (0.5 + 3 * lamp),
                     np.array((0.10, 0.13, 0.18)) * shine)
    cross = (np.abs(x - 0.5) < 0.02) | (np.abs(y - 0.62) < 0.02)
    wall[:] = np.where((window & ~cross)[..., None], glass, wall)
    wall[:] = np.where(sill[..., None], wall * 0 + 0.42, wall)


def _road(picture: Array, up: Array, around: Array) -> None:
    """Asphalt with a broken white line and kerbs, below the facades."""
    with np.errstate(divide="ignore"):
        reach = np.where(up < 0, -0.3 / up, np.inf)             # distance on the ground
    across, ahead = reach * np.cos(around), reach * np.sin(around)
    ground = (up < 0) & (np.abs(across) < 1.0)
    ahead = np.where(ground, ahead, 0.0)
    asphalt = np.array((0.075, 0.075, 0.08)) * np.ones_like(picture)
    pavement = np.abs(across) > 0.72
    line = (np.abs(across - 0.35) < 0.02) & (np.mod(ahead, 0.5) < 0.28)
    paint = np.where(pavement[..., None], 0.17, asphalt)
    paint = np.where(line[..., None], 0.5, paint)
    picture[:] = np.where(ground[..., None], paint, picture)


@kernel
def look(picture: Picture, d: Three) -> Three:
    """The backdrop in direction d, bilinearly."""
    rows, columns = picture.shape[0], picture.shape[1]
    if rows == 1 and columns == 1:
        return float(picture[0, 0, 0]), float(picture[0, 0, 1]), float(picture[0, 0, 2])
    s = (0.5 + np.arctan2(d[0], d[2]) / (2.0 * np.pi)) * columns - 0.5
    t = np.arccos(min(1.0, max(-1.0, d[1]))) / np.pi * rows - 0.5
    i, j = np.floor(s), min(max(np.floor(t), 0.0), rows - 1.0)
    x, y = s - i, min(max(t - j, 0.0), 1.0)
    i0, j0 = int(i) % columns, int(j)
    i1, j1 = (i0 + 1) % columns, min(j0 + 1, rows - 1)
    a, b = (1.0 - x) * (1.0 - y), x * (1.0 - y)
    c, e = (1.0 - x) * y, x * y
    return (a * picture[j0, i0, 0] + b * picture[j0, i1, 0] + c * picture[j1, i0, 0]
            + e * picture[j1, i1, 0],
            a * picture[j0, i0, 1] + b * picture[j0, i1, 1] + c * picture[j1, i0, 1]
            + e * picture[j1, i1, 1],
            a * picture[j0, i0, 2] + b * picture[j0, i1, 2] + c * picture[j1, i0, 2]
            + e * picture[j1, i1, 2])
