"""How do temperature and soot become a volume? Scales, colour table, the fire's own light.

    heat    = (T - T_low) / (T_high - T_low), clamped to [0, 1]; one scale for the whole sequence
    kelvin  = kelvin_low + heat (kelvin_high - kelvin_low)
    colour  = exposure * chromaticity(kelvin) * (luminance(kelvin) / luminance(kelvin_high))^c,
              c the contrast
From the grid (source = "grid"):
    absorption = opacity * (heat - onset) / (1 - onset), 0 below onset
    soot       = its mass per volume, trilinear and blurred over a cell, in units of its reference
From particles: densities of splat.py, absorption = tau * density per cell.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from render import blackbody, splat
from render.bricks import Bricks, from_cells
from render.lights import Lights, parts
from render.smoke import Haze, coarse, escaping, light_up
from render.volume import ENTRIES, Volume
from solver import files
from solver.scene import Scene
from solver.scene_render import Render
from solver.scene_render import Volume as Settings

Array = NDArray[np.float64]
STEPS = 64          # a ray takes through the box where the cells are finer than that
OCTANTS = (1, 8, 64)    # numbers of parts that a fire can be cut into
HOTTEST = 99.5      # percentile of the heated cells of a frame that counts as its hottest
FAINTEST = 1e-3     # absorption of soot, 1/L, that is still drawn
NO_CELLS = np.empty((0, 0, 0), np.float32)


class Fire:
    """The colour of heat for a sequence; built once, it makes the volume of every frame.

    high    temperature shown as kelvin_high
    most    blurred particles per cell shown as max_density (source "particles")
    """

    def __init__(self, scene: Scene, render: Render, high: float, most: float = 1.0):
        self.settings = render.volume
        self.size = np.array(scene.domain.size)
        self.low, self.high, self.most = lowest(scene, self.settings), high, most
        self.table = colour_table(self.settings)
        self.smoke = np.append(self.settings.albedo, self.settings.smoke)
        self.ambient = np.array(render.ambient)
        self.reference = soot_reference(scene)

    def volume(self, snapshot: files.Snapshot, lamps: Lights) -> tuple[Volume, Lights] | None:
        """The volume of a frame, lit by lamps, and the fire's own lights; None for an empty one."""
        if not self.settings.visible:
            return None
        particles = self.settings.source == "particles"
        bricks, cells = (self._splat(snapshot) if particles else self._grid(snapshot))
        if not len(bricks.pool):
            return None
        edge = float((self.size / cells).min())
        table, smoke = self.table, self.smoke
        if particles:
            table, smoke = table.copy(), smoke.copy()
            table[:, 3] = smoke[3] = self.settings.splat.tau / edge
        haze = coarse(bricks, cells, self.size, table, smoke[3])
        fire = self._lights(*emitted(haze), float((haze.edge ** 2).sum()) / 12)
        light_up(haze, lamps, fire, self.ambient)
        step = self.settings.step * max(edge, float(self.size.min()) / STEPS)
        return Volume(bricks, cells, self.size, table, smoke, step, haze), fire

    def incandescence(self, corner: Array, piece: NDArray[np.int64],
                      air: files.Field) -> Array:
        """(n, 3) light of triangles (n, 3, 3) of pieces as hot as the air at their corners."""
        index = ((corner.reshape(-1, 3) - air.origin) / air.spacing).T[::-1]
        hot = map_coordinates(air.values, index, order=1, mode="nearest")
        hot = hot.reshape(-1, 3).mean(axis=1)
        count = np.maximum(np.bincount(piece), 1)
        heat = (np.bincount(piece, hot) / count - self.low) / (self.high - self.low)
        entry = np.round(np.clip(heat, 0, 1) * (ENTRIES - 1)).astype(np.int64)
        return np.asarray(self.table[entry, :3][piece])

    def _grid(self, snapshot: files.Snapshot) -> tuple[Bricks, NDArray[np.int64]]:
        temperature = np.asarray(snapshot.fields["T"].values, np.float32)
        shape = temperature.shape
        soot, dense = snapshot.particles.get("soot", {}), NO_CELLS
        if self.reference and self.smoke[3] > 0 and len(soot.get("position", ())):
            dense = soot_density(soot, shape, self.size) / self.reference
            dense = np.where(dense * self.smoke[3] > FAINTEST, dense, 0).astype(np.float32)
        return (from_cells(temperature, dense, self.settings.onset, self.low, self.high),
                np.array(shape[::-1]))

    def _splat(self, snapshot: files.Snapshot) -> tuple[Bricks, NDArray[np.int64]]:
        settings = self.settings.splat
        bricks = particle_counts(snapshot, self.settings, self.size, self.low, self.high)
        return (splat.mapped(bricks, settings.min_density, settings.max_density, self.most),
                np.array(settings.cells))

    def _lights(self, power: Array, place: Array, cell: float) -> Lights:
        """Lights with the power of the fire, each in the middle of its part of the fire.

        The fire is cut into octants around its middle, each of them again into its own. `cell` is
        the mean squared size of a cell that shines.
        """
        luminous = power.sum(axis=1)
        shining = luminous > 0
        if not shining.any() or self.settings.lights == 0 or self.settings.glow == 0.0:
            return parts(np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
        power, place, luminous = power[shining], place[shining], luminous[shining]
        part = np.zeros(len(place), np.int64)
        for _ in range(OCTANTS.index(self.settings.lights)):
            octant = (place > middles(part, luminous, place)[part]) @ (1, 2, 4)
            _, part = np.unique(8 * part + octant, return_inverse=True)
        middle, total = middles(part, luminous, place), np.bincount(part, luminous)
        away = ((place - middle[part]) ** 2).sum(axis=1)
        colour = np.column_stack([np.bincount(part, power[:, c]) for c in range(3)])
        spread = np.bincount(part, luminous * away) / total + cell
        return parts(middle, colour * self.settings.glow, spread)


def middles(part: NDArray[np.int64], weight: Array, place: Array) -> Array:
    """(m, 3) weighted means of places (n, 3) over parts (n,) numbered 0 ... m - 1."""
    return np.column_stack([np.bincount(part, weight * place[:, axis]) for axis in range(3)]
                           ) / np.bincount(part, weight)[:, None]


def lowest(scene: Scene, settings: Settings) -> float:
    """The temperature shown as kelvin_low."""
    return (scene.fluid.ambient_temperature if settings.temperature_low is None
            else settings.temperature_low)


def fire_of_run(run: Path, scene: Scene, render: Render, comm: Any) -> Fire:
    """The fire of a run, its scales found from all of its frames; ranks share them and agree."""
    settings, frames = render.volume, files.snapshot_frames(run)
    low, high = lowest(scene, settings), settings.temperature_high
    if high is None:
        high = _largest(run, frames, comm, lambda snapshot: hottest(snapshot, low))
        high = high if high > low else low + 1.0
    if settings.source == "grid":
        return Fire(scene, render, high)
    size, most = np.array(scene.domain.size), settings.splat.most
    if most is None:
        most = _largest(run, frames, comm, lambda snapshot: splat.densest(
            particle_counts(snapshot, settings, size, low, high))) or 1.0
    return Fire(scene, render, high, most)


def _largest(run: Path, frames: Sequence[int], comm: Any,
             measure: Callable[[files.Snapshot], float]) -> float:
    mine = [measure(files.read_snapshot(run, frame, ("T",)))
            for frame in frames[comm.rank::comm.size]]
    return float(max(comm.allgather(max(mine, default=0.0))))


def hottest(snapshot: files.Snapshot, low: float) -> float:
    """A high percentile of the heated cells of a frame: the maximum is one cell's accident."""
    if "T" not in snapshot.fields:
        return low
    values = snapshot.fields["T"].values
    heated = values[values > low + 0.1 * (values.max() - low)]
    return float(np.percentile(heated, HOTTEST)) if heated.size > 8 else low


def particle_counts(snapshot: files.Snapshot, settings: Settings, size: Array, low: float,
                    high: float) -> Bricks:
    """Blurred counts of fuel and soot particles."""
    fuel = snapshot.particles.get("fuel", {})
    soot = snapshot.particles.get("soot", {})
    kinds = [kind for kind in (fuel, soot) if len(kind.get("position", ()))]
    position = (np.concatenate([kind["position"] for kind in kinds]).astype(np.float64)
                if kinds else np.empty((0, 3)))
    is_soot = np.concatenate([np.full(len(kind["position"]), kind is soot) for kind in kinds]
                             or [np.empty(0, bool)])
    kelvin = np.concatenate([kind["temperature"] for kind in kinds] or [np.empty(0)])
    heat = np.clip((kelvin - low) / (high - low), 0, 1).astype(np.float64)
    weights = splat.gaussian(settings.splat.alpha, settings.splat.filter)
    return splat.counted(position, heat, is_soot, settings.splat.cells, size,
                         weights / weights.sum())


def colour_table(settings: Settings) -> Array:
    """(ENTRIES, 4) emitted linear RGB and absorption (1/L) by heat in [0, 1]."""
    heat = np.linspace(0, 1, ENTRIES)
    kelvin = settings.kelvin_low + heat * (settings.kelvin_high - settings.kelvin_low)
    if settings.palette == "thesis":
        radiance = settings.exposure * blackbody.polynomial(kelvin, settings.kelvin_high)
    else:
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


def emitted(haze: Haze) -> tuple[Array, Array]:
    """(power (n, 3), place (n, 3)) of the cells of the haze that glow, as intensities of lamps.

    A cell of volume V and absorption s gives s I V per solid angle, a lamp of intensity 1 gives pi;
    the haze around the cell lets a share of it escape.
    """
    k, j, i = np.nonzero(haze.glow.any(axis=3))
    place = (np.column_stack([i, j, k]) + 0.5) * haze.edge
    share = np.zeros(len(place))
    escaping(haze.dense, haze.edge, place, share)
    volume = float(np.prod(haze.edge))
    return haze.glow[k, j, i] * (volume / np.pi * share)[:, None], place
