"""What are the eigenvalues of the worked example? (thesis, 4.2.2, figures 4.6 and 4.7)

From the printed coordinates follow A = 2.2361 at every vertex, an angle deficit of 1.6822 on the
ring and 2.9188 at the two apices, hence A / (3 dtheta) = 0.4431 and 0.2554, and weights of 0.4431
and 0.3492 (printed: 0.474 ... 0.482 and 0.372 ... 0.381, so other coordinates were used). The
printed vector is no eigenvector of the printed matrix. The right one parts the two apices and is 0
on the ring: the sign rule leaves one side empty, and the sweep halves the octahedron.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition import picture
from partition.build import Broken, assemble
from partition.divide import divide
from partition.extrude import sheets
from partition.mesh import Mesh
from partition.repair import repaired
from partition.laplacian import laplacian
from partition.weights import Graph, curvature, thesis_graph
from solver.scene_body import Cut

Floats = NDArray[np.float64]
VERTICES = np.array([(0, 0, 0), (1, 0, 0), (0.5, 0.5, 1), (1, 1, 0), (0, 1, 0), (0.5, 0.5, -1)],
                    dtype=np.float64)
# wound alike, unlike the list of the thesis; T1 ... T8 in its order
FACES = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5),
                  (0, 4, 5)])
PRINTED = np.array([
    (1.699, -0.474, -0.372, 0, -0.477, -0.376), (-0.474, 1.703, -0.373, -0.479, 0, -0.377),
    (-0.372, -0.373, 1.498, -0.377, -0.376, 0), (0, -0.479, -0.377, 1.720, -0.482, -0.381),
    (-0.477, 0, -0.376, -0.482, 1.716, -0.380), (-0.376, -0.377, 0, -0.381, -0.380, 1.515)])
PRINTED_VECTOR = np.array([-0.538, -0.020, -0.329, 0.521, -0.179, 0.546])


def draw(path: str | Path) -> list[str]:
    """The picture; the eigenvalues, printed and right."""
    mesh = octahedron()
    values, vectors = np.linalg.eigh(matrix(mesh))
    printed, _ = np.linalg.eigh(PRINTED)
    label, _ = divide(mesh, Cut(method="spectral", weights="thesis", mass="count"), 2)
    rayleigh = PRINTED_VECTOR @ PRINTED @ PRINTED_VECTOR / (PRINTED_VECTOR @ PRINTED_VECTOR)
    residual = float(np.linalg.norm(PRINTED @ PRINTED_VECTOR - rayleigh * PRINTED_VECTOR))
    vector = np.round(vectors[:, 1] * np.sign(vectors[2, 1]), 6) + 0.0
    made = picture.dark_figure(12.0, 4.6)
    for column, pieces in enumerate((np.zeros(8, dtype=np.int64), label)):
        axes = made.add_axes((column * 0.33, 0.0, 0.33, 0.9))
        picture.draw(axes, assemble([Broken("octahedron", sheets(mesh, pieces), False)]), 0.4,
                     25.0, 15.0)
    _write(made, 0.165, "the example (z upwards)", [])
    _write(made, 0.495, "in two", [])
    _write(made, 0.83, "eigenvalues of ML", [
        f"{'right':>10} {'as printed':>12}",
        *(f"{value:10.6f} {other:12.4f}" for value, other in zip(values, printed, strict=True)),
        "", "right $v_2$: " + " ".join(f"{x:.3g}" for x in vector),
        f"printed $v_2$: residual {residual:.2f}"])
    picture.write(made, path)
    return ["eigenvalues: " + " ".join(f"{value:.6f}" for value in values),
            "of the printed matrix: " + " ".join(f"{value:.4f}" for value in printed),
            "Fiedler vector: " + " ".join(f"{x:.6f}" for x in vector),
            f"printed vector: residual {residual:.3f} in the printed matrix, not an eigenvector",
            f"pieces: {' + '.join(map(str, np.bincount(label)))} triangles (thesis: 6 + 2)"]


def octahedron() -> Mesh:
    """The mesh of the example, z pointing up in the picture."""
    x, y, z = VERTICES.T
    return repaired(np.stack([x, z, -y], axis=1), FACES, "octahedron")


def matrix(mesh: Mesh) -> Floats:
    """(6, 6) ML with the weights (K_i + K_j) / 2, K = A / (3 dtheta), as the thesis defines it."""
    graph, inverse = thesis_graph(mesh, "count"), 1 / curvature(mesh)
    raw = Graph(graph.mass, graph.a, graph.b, (inverse[graph.a] + inverse[graph.b]) / 2,
                graph.length, graph.cost)
    full: Floats = laplacian(raw).toarray()
    return full


def _write(made: Any, x: float, title: str, lines: list[str]) -> None:
    made.text(x, 0.93, title, color=picture.INK, ha="center", fontsize=13)
    made.text(x, 0.85, "\n".join(lines), color=picture.INK, ha="center", va="top", fontsize=11,
              family="monospace", linespacing=1.5)
