"""What is the matrix of a graph, for those who look at it as a whole?"""

from scipy.sparse import csr_array

from partition.rows import rows
from partition.weights import Graph


def laplacian(graph: Graph) -> csr_array:
    """L = B W B^T as a sparse matrix (n, n)."""
    n = len(graph.mass)
    start, columns, values = rows(n, graph.a, graph.b, graph.weight)
    return csr_array((values, columns, start), shape=(n, n))
