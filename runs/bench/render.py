"""How fast are pictures, how good, and how much memory does a volume take?

    python -m runs bench render [speed] [ladder] [peers] [memory]       (default: all, some minutes)

speed   seconds per frame of 300 x 300 pixels with 2 x 2 samples on one core, after set-up: the
        window with 16 glass pieces in flight, its street, two lamps and a volume of 300³ cells, a
        quarter of them filled, from the grid and from 100 000 particles; and a mesh of the size of
        a cow with a mirror and a slab of glass, without volume.
ladder  seconds against the root mean square error to a converged picture of the same scene, over
        samples per pixel, the contrast above which a pixel is sampled again, the length of a
        volume's step, and the edge of its bricks (render_bricks.py; each edge compiles its own
        kernels first, which takes most of the time).
peers   the same beside Mitsuba 3, if it is installed (.venv/bin/pip install --no-deps
        -r runs/requirements-peers.txt), on equal scenes: render_peers.py.
memory  bytes of a 300³ volume of which 1 %, 10 % and 100 % is filled.

Writes results/render_*.csv and a plot of the ladder.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from partition.build import build as break_up
from partition.fragments import Fragments
from render.bricks import from_cells
from render.fire import Fire, particle_counts
from render.frame import Film, Picture
from render.splat import densest
from runs.bench import chart, render_bricks, render_peers
from solver import files, scene

RESULTS = Path(__file__).parent / "results"
COMMAND = "python -m runs bench render"
Array = NDArray[Any]
SMALL = {"width": 120, "height": 120}     # the pictures of the ladder
CELLS, QUARTER = 300, 0.36      # a ball of this radius, in boxes, fills a quarter of what is seen

LAMPS = [{"kind": "directional", "direction": [0.75, -0.5, -0.6], "intensity": 0.4},
         {"position": [1.9, 1.6, 2.2], "intensity": 0.6}]
WINDOW: dict[str, Any] = {
    "time": {"end": 1.0, "frame": 0.01}, "fuel": {},
    "body": [{"name": "pane", "shape": "pane", "size": [0.6, 0.5, 0.01], "points": 200,
              "place": [0.5, 0.5, 0.6], "areal_density": 20.0, "fracture": {"pieces": 16}}],
    "render": {"light": LAMPS, "camera": {"position": [0.98, 0.6, 1.75],
                                          "target": [0.5, 0.48, 0.6]},
               "object": [{"shape": "frame", "low": [-4.0, -1.0, 0.56], "high": [5.0, 4.0, 0.66],
                           "hole_low": [0.2, 0.25, 0.0], "hole_high": [0.8, 0.75, 1.0],
                           "material": "brick"},
                          {"shape": "plane", "place": [0, -0.4, 0], "material": "stone"}]}}
COW: dict[str, Any] = {
    "time": {"end": 1.0, "frame": 0.01},
    "body": [{"name": "cow", "shape": "mesh", "mesh": "animal", "place": [0.5, 0.45, 0.5],
              "scale": 0.8, "areal_density": 20.0}],
    "render": {"light": LAMPS, "object": [
        {"shape": "box", "low": [-1.0, -0.2, -0.6], "high": [2.0, 1.6, -0.55],
         "material": "mirror"},
        {"shape": "box", "low": [0.05, 0.1, 1.2], "high": [0.5, 0.9, 1.25], "material": "glass"},
        {"shape": "plane", "place": [0, -0.1, 0], "material": "checkered"}],
        "material": {"checkered": {"texture": {"kind": "checker", "scale": 0.2}}}}}


def main(argv: list[str]) -> int:
    """Run the parts that are named, or all; returns an exit code."""
    parts = {"speed": speed, "ladder": ladder, "peers": peers, "memory": memory}
    unknown = [name for name in argv if name not in parts]
    if unknown:
        print(f"bench render: {unknown[0]}: unknown; fix: some of {', '.join(parts)}")
        return 2
    RESULTS.mkdir(exist_ok=True)
    for name in argv or parts:
        parts[name]()
    return 0


def ball(cells: int, radius: float) -> Array:
    """(n, n, n) temperature of a ragged ball, 5 outside and up to 65, float32."""
    random = np.random.default_rng(3)
    rough = sum(height * zoom(random.normal(size=(size,) * 3), cells / size, order=1)
                for height, size in ((0.10, 8), (0.06, 20), (0.04, 60)))
    x = (np.arange(cells) + 0.5) / cells - 0.5
    away = np.sqrt(x[:, None, None] ** 2 + x[:, None] ** 2 + x ** 2)
    depth = (radius - away) / radius + rough
    return np.asarray(5 + 60 * np.clip(depth, 0, 1) ** 0.8, np.float32)


def in_flight(found: scene.Scene, pieces: Fragments) -> dict[str, Array]:
    """Poses of the pieces a while after the explosion."""
    centre = np.array([pieces.piece(i)[0].mean(axis=0) for i in range(pieces.count)])
    random = np.random.default_rng(5)
    turn = np.column_stack([np.ones(len(centre)), 0.3 * random.normal(size=(len(centre), 3))])
    away = centre - np.array(found.detonation.position)
    return {"position": centre + 0.6 * away, "rest_centre": centre,
            "orientation": turn / np.linalg.norm(turn, axis=1, keepdims=True)}


def prepared(data: dict[str, Any], volume: dict[str, Any] | None = None,
             **look: Any) -> tuple[Film, files.Snapshot]:
    """A film and a frame of it; `volume` are keys of [render.volume], None for no fire."""
    render = {**data["render"], **look, **({"volume": volume} if volume else {})}
    found = scene.build({**data, "render": render})
    assert found.render is not None
    pieces = break_up(found)
    poses = in_flight(found, pieces)
    if data is COW:
        poses["position"] = poses["rest_centre"]
        poses["orientation"] = np.array([[1.0, 0, 0, 0]])
    fields, particles = {}, {}
    if volume:
        heat = ball(CELLS if volume.get("source", "grid") == "grid" else 64, QUARTER)
        spacing = np.full(3, 1.0 / len(heat))
        fields = {"T": files.Field(heat, spacing / 2, spacing)}
        particles = {"fuel": sprayed(heat, 100_000)}
    snapshot = files.Snapshot(0, 0.0, 0, fields, particles, poses)
    fire = None
    if volume:
        settings = found.render.volume
        most = (densest(particle_counts(snapshot, settings, np.ones(3), 5.0, 65.0))
                if settings.source == "particles" else 1.0)
        fire = Fire(found, found.render, 65.0, most)
    return Film(found, found.render, pieces, fire), snapshot


def sprayed(heat: Array, count: int) -> dict[str, Array]:
    """Particles in the hot cells."""
    random = np.random.default_rng(7)
    cells = np.argwhere(heat > 8)
    cells = cells[random.integers(0, len(cells), count)]
    place = (cells[:, ::-1] + random.random((count, 3))) / len(heat)
    return {"position": place, "temperature": heat[tuple(cells.T)]}


def timed(film: Film, snapshot: files.Snapshot, times: int = 5) -> tuple[float, Picture]:
    """Median of the CPU seconds of a frame, after one row to compile, and the picture."""
    middle = film.render.height // 2
    picture, seconds = film.frame(snapshot, range(middle, middle + 1)), []
    for _ in range(times):
        start = time.process_time()
        picture = film.frame(snapshot)
        seconds.append(time.process_time() - start)
    return float(np.median(seconds)), picture


def speed() -> None:
    """Seconds per frame of the three scenes, beside the thesis'."""
    rows = []
    for name, data, volume, thesis in (
            ("window, volume from the grid", WINDOW, {"source": "grid"}, 1680.0),
            ("window, volume from particles", WINDOW, {"source": "particles"}, 1680.0),
            ("mesh, mirror, glass slab", COW, None, 125.0)):
        film, snapshot = prepared(data, volume)
        seconds, picture = timed(film, snapshot)
        rows.append((name, seconds, picture.rays, picture.rays / seconds / 1e6, thesis))
        print(f"{name:32s} {seconds:6.2f} s  {picture.rays / 1e6:5.2f} M rays  "
              f"{picture.rays / seconds / 1e6:5.2f} M rays/s  (thesis, 2005: {thesis:.0f} s)")
    chart.write_csv(RESULTS / "render_speed.csv",
                    "scene,seconds_per_frame,rays,million_rays_per_second,thesis_seconds", rows,
                    f"{COMMAND} speed")


def rungs() -> Iterator[tuple[str, float, dict[str, Any], dict[str, Any]]]:
    """(kind, value, keys of [render], keys of [render.volume])."""
    for samples in (1, 2, 3, 4, 6):
        yield "samples", samples, {"samples": samples}, {}
    for contrast in (0.4, 0.2, 0.1, 0.05):
        yield "adaptive", contrast, {"samples": 2, "adaptive": contrast}, {}
    for step in (4.0, 2.0, 1.0, 0.5, 0.25):
        yield "step", step, {"samples": 2}, {"step": step}


def ladder() -> None:
    """Seconds and error of every rung, against 12 x 12 samples at a quarter of the step."""
    film, snapshot = prepared(WINDOW, {"step": 0.25}, samples=12, **SMALL)
    exact = film.frame(snapshot).light
    rows: list[tuple[str, float, float, float]] = []
    for kind, value, look, volume in rungs():
        film, _ = prepared(WINDOW, {"step": 1.0, **volume}, **SMALL, **look)
        film.frame(snapshot, range(60, 61))
        start = time.process_time()
        light = film.frame(snapshot).light
        seconds = time.process_time() - start
        rows.append((kind, value, seconds, error_of(light, exact)))
        print("{:8s} {:5g}  {:6.2f} s  RMSE {:.5f}".format(*rows[-1]))
    lights = {}
    for edge, seconds, size, lights[edge] in render_bricks.rungs():
        rows.append(("brick", edge, seconds, error_of(lights[edge], exact)))
        print("{:8s} {:5g}  {:6.2f} s  RMSE {:.5f}".format(*rows[-1])
              + f"  volume {size / 2**20:.1f} MiB")
    print(f"light of the edges differs by {render_bricks.largest_difference(lights):.1e} at most")
    chart.write_csv(RESULTS / "render_ladder.csv", "kind,value,seconds,rmse", rows,
                    f"{COMMAND} ladder")
    chart.lines(RESULTS / "render_ladder.png",
                [(kind, [row[2] for row in rows if row[0] == kind],
                  [row[3] for row in rows if row[0] == kind], style)
                 for kind, style in (("samples", "o-"), ("adaptive", "d-"), ("step", "s-"),
                                     ("brick", "^"))],
                "seconds", "RMSE of light", f"{COMMAND} ladder", logarithmic=True)


def error_of(light: Array, exact: Array) -> float:
    """Root mean square difference of lights; what is brighter than 2 counts as 2."""
    return float(np.sqrt(np.mean((np.minimum(light, 2) - np.minimum(exact, 2)) ** 2)))


def peers() -> None:
    """Seconds and error of our pictures and of Mitsuba's."""
    rows = []
    for row in render_peers.ladders(COW, prepared, ball(CELLS, QUARTER)):
        rows.append(row)
        print("{:6s} {:8s} {:4d} samples per pixel {:7.2f} s  RMSE {:.5f}".format(*row))
    chart.write_csv(RESULTS / "render_peers.csv", "scene,program,samples,seconds,rmse", rows,
                    f"{COMMAND} peers")
    curves = sorted({row[:2] for row in rows})
    chart.lines(RESULTS / "render_peers.png",
                [(f"{name}, {program}", [row[3] for row in rows if row[:2] == (name, program)],
                  [row[4] for row in rows if row[:2] == (name, program)],
                  "o-" if program == "ours" else "s--") for name, program in curves],
                "seconds", "RMSE of light", f"{COMMAND} peers", logarithmic=True)


def memory() -> None:
    """Bytes of a volume against the share of it that is filled."""
    rows = []
    nothing = np.empty((0, 0, 0), np.float32)
    for share in (0.01, 0.1, 1.0):
        heat = np.zeros((CELLS,) * 3, np.float32)
        edge = round(CELLS * share ** (1 / 3))
        heat[:edge, :edge, :edge] = 1.0
        bricks = from_cells(heat, nothing, 0.1)
        rows.append((share, bricks.bytes, bricks.bytes / heat.size))
        print(f"{100 * share:4.0f} % of {CELLS}³ filled: {bricks.bytes / 2**20:7.1f} MiB")
    chart.write_csv(RESULTS / "render_memory.csv", "filled,bytes,bytes_per_cell", rows,
                    f"{COMMAND} memory")
