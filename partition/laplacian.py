"""What is the matrix of a graph, for those who look at it as a whole?"""

import numpy as np
from scipy.sparse import csr_array

from partition.rows import adjacency, rows
from partition.weights import Graph


def laplacian(graph: Graph) -> csr_array:
    """L = B W B^T as a sparse matrix (n, n)."""
    n = len(graph.mass)
    linked = adjacency(n, graph.a, graph.b, graph.weight)
    start, columns, values = rows(*linked, np.arange(n, dtype=np.int32), 0, n)
    return csr_array((values, columns, start), shape=(n, n))
