"""How long does it take to cut a mesh in two, how exactly, and how well?

    python -m runs bench partition [TRIANGLES ...]      (10000 100000 1000000)

For meshes of about the given numbers of triangles (the generated animal, refined): seconds,
residual and eigenvalue error of the Fiedler vector by every solver at hand, and the cut that
follows from it: its length, the smaller side's share of the area, and the Cheeger ratio
length sqrt(area) / smaller side, which is small for a short and balanced cut. Beside SLEPc stand
scipy's eigsh (shift and invert), LOBPCG by scipy preconditioned by pyamg, and METIS, which knows no
eigenvector. Before that the whole command, from a file to its pieces, on one and on more ranks, and
pieces by breadth-first search against METIS; at the smallest size also the cuts by several
eigenvectors at once (`runs.bench.several`). Solvers that are not installed are left out and named.
Tables go to results/partition_N.csv for N triangles, a plot of all such tables to partition.png.
"""

import csv
import re
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_array, csr_matrix, diags_array
from scipy.sparse.linalg import eigsh, lobpcg

from partition import cut
from partition.animal import animal
from partition.bfs import break_up
from partition.figurines import GENERATED
from partition.graph import neighbours
from partition.mesh import Mesh
from partition.repair import repaired
from partition.shapes import subdivide
from partition.laplacian import laplacian
from partition.spectral import LARGE, LARGE_TOLERANCE, modes
from partition.weights import Graph, dihedral_graph, thesis_graph
from runs.bench import chart, several
from runs.ranks import environment, mpirun

Floats = NDArray[np.float64]
Vector = Callable[[Graph, csr_array], Floats]
SPACINGS = (0.045, 0.0165)          # at which the animal is closed
LIMITS = {"scipy eigsh": 30_000, "slepc direct": 400_000}   # nodes; factors need gigabytes above
PIECES = 512
RESIDUAL = 1e-7                     # relative to lambda; SLEPc is asked for no more
SIZES = [10_000, 100_000, 1_000_000]
SMALL = 50_000
COLUMNS = ("body", "pieces", "by", "command", "weights", "solver", "seconds", "cpu", "eigenproblem",
           "residual", "error", "length", "share", "cheeger", "largest", "smallest", "parts")
RESULTS = Path(__file__).parent / "results"
RANKS = (1, 2)


def main(arguments: list[str]) -> int:
    """Print the tables; exit code 0, or 2 for bad input."""
    if not all(argument.isdecimal() for argument in arguments):
        print(f"error: bench partition {' '.join(arguments)}: fix: give numbers of triangles",
              file=sys.stderr)
        return 2
    RESULTS.mkdir(exist_ok=True)
    for size in [int(argument) for argument in arguments] or SIZES:
        mesh, rows = refined_animal(size), []
        kinds = [many_pieces(mesh), whole_command(mesh), solvers(mesh)]
        if len(mesh.faces) < SMALL:
            kinds += [several.compare(name, repaired(*make(), name), (4, 8, 16))
                      for name, make in GENERATED.items()]
        for row in chain(*kinds):
            text = [f"{key} {_short(value)}" for key, value in row.items()]
            print("  ".join([f"triangles {len(mesh.faces)}", *text]), flush=True)
            rows.append([row.get(key, "") for key in COLUMNS])
        chart.write_csv(RESULTS / f"partition_{len(mesh.faces)}.csv", ",".join(COLUMNS), rows,
                        f"python -m runs bench partition {size}")
    plot(RESULTS / "partition.png")
    return 0


def plot(path: Path) -> None:
    """Processor time against the residual (whose square is the error of the eigenvalue) and against
    the quality of the cut, from all tables there are."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    styles: dict[str, str] = {}
    for place, table in enumerate(sorted(RESULTS.glob("partition_*.csv"), key=_triangles)):
        with open(table, encoding="utf-8") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        for row in rows:
            if row["weights"] not in ("dihedral", "none") or not row["seconds"]:
                continue
            colour = styles.setdefault(row["solver"], f"C{len(styles)}")
            look = {"color": colour, "marker": "os^Dv"[place % 5], "linestyle": "none"}
            seconds = float(row["cpu"] or row["seconds"])
            label = None if place else row["solver"]
            if row["residual"]:
                left.plot(seconds, float(row["residual"]), label=label, **look)
            right.plot(seconds, float(row["cheeger"]), label=label, **look)
    for axes, text in ((left, "residual / λ₂"),
                       (right, "length √area / smaller side")):
        axes.set_xscale("log")
        axes.set_xlabel("seconds of processor time (METIS: by the clock)")
        axes.set_ylabel(text)
        axes.grid(alpha=0.3)
    left.set_yscale("log")
    right.legend(fontsize=8)
    figure.suptitle("Fiedler vector and cut, dihedral weights; ○ □ △: about 10⁴, 10⁵, 10⁶ "
                    "triangles (python -m runs bench partition)", fontsize=10)
    figure.savefig(path, dpi=90)


def _triangles(table: Path) -> int:
    return int(table.stem.split("_")[1])


def refined_animal(size: int) -> Mesh:
    """The animal with a number of triangles near `size`: at one of two spacings, each triangle
    divided in four some times."""
    choices = [(round(18 / spacing**2) * 4**level, spacing, level)
               for spacing in SPACINGS for level in range(6)]
    _, spacing, levels = min(choices, key=lambda choice: abs(np.log(choice[0] / size)))
    mesh = repaired(*animal(spacing), "animal")
    for _ in range(levels):
        mesh = repaired(*subdivide(mesh.vertices, mesh.faces), "animal")
    return mesh


def solvers(mesh: Mesh) -> Iterator[dict[str, Any]]:
    """A row for each way to find and use a Fiedler vector."""
    surface = dihedral_graph(mesh, "area")
    graphs = {"dihedral": surface, "thesis": thesis_graph(mesh, "count")}
    for weights, graph in graphs.items():
        matrix = laplacian(graph)
        exact = modes(graph).values[0]
        scaled = exact * graph.mass.mean()
        ways: dict[str, Vector] = {
            "slepc iterative": _slepc("iterative"), "slepc direct": _slepc("direct"),
            "scipy eigsh": _eigsh,
            "pyamg smoothed aggregation": _pyamg("smoothed_aggregation", scaled),
            "pyamg Ruge-Stueben": _pyamg("ruge_stuben", scaled)}
        for name, limit in LIMITS.items():
            if len(graph.mass) > limit:
                del ways[name]
        for name, way in ways.items():
            yield {"weights": weights, "solver": name} | _measured(way, graph, matrix, exact, mesh,
                                                                   surface)
    yield {"weights": "none", "solver": "metis"} | _metis(mesh, surface)


def _measured(way: Vector, graph: Graph, matrix: csr_array, exact: float, mesh: Mesh,
              surface: Graph) -> dict[str, Any]:
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        vector = way(graph, matrix)
    except ImportError as error:
        return {"seconds": None, "why": f"{error.name} is not installed"}
    seconds, cpu = time.perf_counter() - wall, time.process_time() - cpu
    vector = vector - (graph.mass @ vector) / graph.mass.sum()
    value = vector @ (matrix @ vector) / (graph.mass @ vector**2)
    weighted = value * graph.mass * vector
    residual = np.linalg.norm(matrix @ vector - weighted) / np.linalg.norm(weighted)
    values = vector if len(vector) == len(mesh.faces) else vector[mesh.faces].mean(axis=1)
    side = cut.sweep(values, surface.mass, surface.a, surface.b, surface.cost)
    return {"seconds": seconds, "cpu": cpu, "residual": residual,
            "error": abs(value / exact - 1)} | _quality(side, surface)


def _quality(side: cut.Bools, surface: Graph) -> dict[str, Any]:
    crossing = side[surface.a] != side[surface.b]
    length, total = surface.length[crossing].sum(), surface.mass.sum()
    smaller = min(surface.mass[side].sum(), surface.mass[~side].sum())
    return {"length": length, "share": smaller / total,
            "cheeger": length * np.sqrt(total) / smaller}


def _slepc(method: str) -> Vector:
    def way(graph: Graph, _: csr_array) -> Floats:
        return modes(graph, 1, None, method).vectors[:, 0]
    return way


def _eigsh(graph: Graph, matrix: csr_array) -> Floats:
    shift = -1e-9 * matrix.diagonal().mean() / graph.mass.mean()
    _, vectors = eigsh(csc_matrix(matrix), 2, csc_matrix(diags_array(graph.mass)), sigma=shift)
    return np.asarray(vectors[:, 1])


def _pyamg(kind: str, exact: float) -> Vector:
    """LOBPCG as SLEPc is asked for it: two vectors, the constant deflated, to a residual that is no
    smaller."""
    def way(graph: Graph, matrix: csr_array) -> Floats:
        import pyamg

        n = len(graph.mass)
        plain, mass = csr_matrix(matrix), graph.mass / graph.mass.mean()
        multigrid = getattr(pyamg, f"{kind}_solver")(plain).aspreconditioner()
        start = np.random.default_rng(0).standard_normal((n, 2))
        residual = RESIDUAL if n <= LARGE else LARGE_TOLERANCE
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)    # that the second has not converged
            _, vectors = lobpcg(plain, start, csr_matrix(diags_array(mass)), multigrid,
                                Y=np.ones((n, 1)), largest=False, tol=residual * exact,
                                maxiter=100)
        return np.asarray(vectors[:, 0])
    return way


def _metis(mesh: Mesh, surface: Graph) -> dict[str, Any]:
    try:
        seconds, label = _by_metis(mesh, 2)
    except ImportError as error:
        return {"seconds": None, "why": f"{error.name} is not installed"}
    return {"seconds": seconds} | _quality(label == 1, surface)


def _by_metis(mesh: Mesh, pieces: int) -> tuple[float, NDArray[np.int64]]:
    import pymetis

    around = neighbours(mesh.twin)
    start = np.concatenate([[0], np.cumsum((around >= 0).sum(axis=1))])
    began = time.perf_counter()
    _, label = pymetis.part_graph(pieces, xadj=start, adjncy=around[around >= 0])
    return time.perf_counter() - began, np.array(label)


def many_pieces(mesh: Mesh) -> Iterator[dict[str, Any]]:
    """512 pieces by breadth-first search, and by METIS."""
    count = np.ones(len(mesh.faces))
    around, parts = neighbours(mesh.twin), mesh.components
    if PIECES * 4 > len(count):
        return
    break_up(around, count, 2, parts)      # compiled, or loaded from the cache
    began = time.perf_counter()
    label = break_up(around, count, PIECES, parts)
    seconds = time.perf_counter() - began
    yield {"pieces": PIECES, "by": "bfs", "seconds": seconds,
           "largest": float(np.bincount(label).max() * PIECES / len(count))}
    try:
        seconds, label = _by_metis(mesh, PIECES)
    except ImportError:
        return
    yield {"pieces": PIECES, "by": "metis", "seconds": seconds,
           "largest": float(np.bincount(label).max() * PIECES / len(count))}


def whole_command(mesh: Mesh) -> Iterator[dict[str, Any]]:
    """From a file to two pieces in a file, on one rank and on several."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "animal.ply"
        meshio.write(path, meshio.Mesh(mesh.vertices, {"triangle": mesh.faces.astype(np.int32)}),
                     binary=True)
        for count in RANKS:
            command = [sys.executable, "-m", "partition", str(path), "--method", "spectral",
                       "--pieces", "2", "-o", str(Path(folder) / "two.h5")]
            launch = mpirun(count) if count > 1 else ()
            done = subprocess.run([*launch, *command], capture_output=True, text=True, check=True,
                                  env=environment())
            found = re.search(r"pieces in ([0-9.]+) s", done.stdout)
            cut_row = done.stdout.splitlines()
            eigen = next(line for place, line in enumerate(cut_row)
                         if cut_row[place - 1].split()[:1] == ["cut"])
            yield {"command": f"{count} rank{'s' * (count > 1)}",
                   "seconds": float(found.group(1)) if found else None,
                   "eigenproblem": float(eigen.split()[-1])}


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float | np.floating) else str(value)
