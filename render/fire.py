"""How do temperature and soot of a run become a volume? Scales, colour table, the fire's own light.

    heat    = (T - T_low) / (T_high - T_low), clamped to [0, 1]; one scale for the whole sequence
    kelvin  = kelvin_low + heat (kelvin_high - kelvin_low)
    colour  = exposure * chromaticity(kelvin) * (luminance(kelvin) / luminance(kelvin_high))^c,
              c the contrast
    absorption = opacity * (heat - onset) / (1 - onset), 0 below onset
Soot particles are spread over their eight nearest cells by mass, and blurred over a cell.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, gaussian_filter

from render import blackbody
from render.lights import POINT, Lights
from render.volume import BRICK, ENTRIES, Volume
from solver import files
from solver.scene import Scene
from solver.scene_render import Render
from solver.scene_render import Volume as Settings

Array = NDArray[np.float64]
HOTTEST = 99.5      # percentile of the heated cells of a frame that counts as its hottest
FAINTEST = 1e-3     # absorption of soot, 1/L, that is still drawn


class Fire:
    """The colour of heat for a sequence; built once, it makes the volume of every frame."""

    def __init__(self, scene: Scene, render: Render, high: float):
        settings = render.volume
        self.settings = settings
        self.size = np.array(scene.domain.size)
        self.low, self.high = lowest(scene, settings), high
        self.table = colour_table(settings)
        self.smoke = np.append(np.array(settings.smoke_colour) * np.mean(render.ambient) / 0.14,
                               settings.smoke)
        self.reference = soot_reference(scene)

    def volume(self, snapshot: files.Snapshot) -> Volume | None:
        """The volume of a frame, or None where nothing in it can be seen."""
        temperature = snapshot.fields["T"].values
        cells = np.zeros((*temperature.shape, 2), np.float32)
        cells[..., 0] = np.clip((temperature - self.low) / (self.high - self.low), 0, 1)
        soot = snapshot.particles.get("soot", {})
        if self.reference and self.settings.smoke > 0 and len(soot.get("position", ())):
            dense = soot_density(soot, temperature.shape, self.size) / self.reference
            cells[..., 1] = np.where(dense * self.smoke[3] > FAINTEST, dense, 0)
        visible = (cells[..., 0] > self.settings.onset) | (cells[..., 1] > 0)
        if not visible.any():
            return None
        step = self.settings.step * float((self.size / temperature.shape[::-1]).min())
        rim = [(1, 1)] * 3 + [(0, 0)]
        return Volume(np.pad(cells, rim, mode="edge"), filled_bricks(visible), self.size,
                      self.table, self.smoke, step)

    def lights(self, volume: Volume) -> Lights:
        """Point lights with the power of the fire: at the middle of each octant around its own."""
        power, place = emitted(volume)
        total = power.sum()
        if total <= 0.0 or self.settings.lights == 0 or self.settings.glow == 0.0:
            return Lights(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
        luminous = power.sum(axis=1)
        middle = luminous @ place / luminous.sum()
        octant = ((place > middle) @ (1, 2, 4) if self.settings.lights == 8
                  else np.zeros(len(place), np.int64))
        groups = [octant == k for k in np.unique(octant[luminous > 0])]
        places = np.array([luminous[g] @ place[g] / luminous[g].sum() for g in groups])
        colours = np.array([power[g].sum(axis=0) for g in groups]) * self.settings.glow
        return Lights(np.full(len(groups), POINT), places, colours, np.full(len(groups), 2.0))


def lowest(scene: Scene, settings: Settings) -> float:
    """The temperature shown as kelvin_low."""
    return (scene.fluid.ambient_temperature if settings.temperature_low is None
            else settings.temperature_low)


def highest(scene: Scene, settings: Settings, directory: Path, frames: Sequence[int],
            comm: Any) -> float:
    """The temperature shown as kelvin_high: the scene's, or the hottest that a frame has.

    A frame's hottest is a high percentile of its heated cells, not the maximum, which is one cell's
    accident. All ranks read a share of `frames` and agree.
    """
    if settings.temperature_high is not None:
        return settings.temperature_high
    low = lowest(scene, settings)
    mine = low
    for frame in frames[comm.rank::comm.size]:
        field = files.read_snapshot(directory, frame, ("T",)).fields.get("T")
        if field is not None:
            heated = field.values[field.values > low + 0.1 * (field.values.max() - low)]
            mine = max(mine, float(np.percentile(heated, HOTTEST)) if heated.size > 8 else low)
    top = max(comm.allgather(mine))
    return top if top > low else low + 1.0


def colour_table(settings: Settings) -> Array:
    """(ENTRIES, 4) emitted linear RGB and absorption (1/L) by heat in [0, 1]."""
    heat = np.linspace(0, 1, ENTRIES)
    kelvin = settings.kelvin_low + heat * (settings.kelvin_high - settings.kelvin_low)
    chroma, luminance = blackbody.glow(kelvin, settings.kelvin_high)
    radiance = chroma * (luminance ** settings.contrast * settings.exposure)[:, None]
    dense = np.clip((heat - settings.onset) / (1 - settings.onset), 0, None)
    return np.column_stack([radiance, settings.opacity * dense])


def soot_reference(scene: Scene) -> float:
    """Soot mass per volume if all fuel were burnt to soot that fills the box; 0 without soot."""
    if scene.fuel is None or scene.soot is None:
        return 0.0
    volume = float(np.prod(scene.domain.size))
    return max(scene.fuel.particles, 1) * scene.fuel.mass * max(scene.fuel.soot, 1e-9) / volume


def soot_density(soot: dict[str, Array], shape: tuple[int, ...], size: Array) -> Array:
    """(nz, ny, nx) mass per volume: trilinear deposit, blurred over one cell."""
    cells = np.array(shape[::-1])
    place = soot["position"] / size * cells - 0.5
    low = np.floor(place).astype(np.int64)
    share = place - low
    total = np.zeros(shape)
    for corner in np.ndindex(2, 2, 2):
        index = np.clip(low + corner, 0, cells - 1)
        weight = np.prod(np.where(corner, share, 1 - share), axis=1) * soot["mass"]
        np.add.at(total, (index[:, 2], index[:, 1], index[:, 0]), weight)
    return np.asarray(gaussian_filter(total, 1.0, mode="nearest")) / float(np.prod(size / cells))


def filled_bricks(visible: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Bricks with a visible cell in them or, for interpolation, within one cell of them."""
    grown = binary_dilation(visible, np.ones((3, 3, 3), bool))
    return np.ascontiguousarray(bricked(grown).any(axis=(1, 3, 5)))


def bricked(cells: NDArray[Any]) -> NDArray[Any]:
    """(nz, ny, nx) cells as (bz, BRICK, by, BRICK, bx, BRICK), filled up with zeros."""
    shape = [-(-n // BRICK) for n in cells.shape]
    padded = np.pad(cells, [(0, n * BRICK - m) for n, m in zip(shape, cells.shape, strict=True)])
    return padded.reshape(shape[0], BRICK, shape[1], BRICK, shape[2], BRICK)


def emitted(volume: Volume) -> tuple[Array, Array]:
    """(power (n, 3), place (n, 3)) of the filled bricks: what they would give at distance 1.

    A cell of volume V and absorption s gives s I V in all directions; thick fire hides its own
    inside, so that a brick of edge h counts with (1 - exp(-s h)) / (s h) of it.
    """
    heat = volume.cells[1:-1, 1:-1, 1:-1, 0]
    cells = np.array(heat.shape)
    edge = volume.size / cells[::-1]
    across = float(edge.mean()) * BRICK
    k, j, i = np.nonzero(volume.filled)
    blocks = bricked(heat)[k, :, j, :, i, :].reshape(len(k), -1)
    entry = volume.table[np.minimum((blocks * (ENTRIES - 1)).astype(np.int64), ENTRIES - 1)]
    visible = -np.expm1(-entry[..., 3] * across) / across
    power = np.einsum("bec,be->bc", entry[..., :3], visible) * float(np.prod(edge))
    return power, (np.column_stack([i, j, k]) + 0.5) * BRICK * edge
