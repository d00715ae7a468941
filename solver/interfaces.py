"""What joins the parts of lines that ranks share: two unknowns per part and line.

A part i that has been eliminated for itself knows its first and last value up to the values next to
it, last_{i-1} and first_{i+1}:

    first_i = D_i + G_i last_{i-1} + H_i first_{i+1}
    last_i  = E_i + H_i last_{i-1} + K_i first_{i+1}

Two parts that meet once tell each other the plane there, and each solves for itself (`Meeting`).
More share the work (`Interfaces`): each rank solves these systems for its share of the lines, by
elimination from part to part: with last_{i-1} = α + β first_i + γ y every part is one step;
y = last_{-1} and x = first_P close the ring where the axis is periodic and are 0 elsewhere. Two
exchanges of two planes, spread over the ranks.
Source: Mattor, Williams & Hewett, Parallel Computing 21 (1995) 1769.
"""

import numpy as np
from mpi4py import MPI

from solver.grid import Field
from solver.kernel import INT, REAL, kernel


class Meeting:
    """Joins two parts, which know first_1 = D + G last_0 and last_0 = E + K first_1; `answer` is
    this rank's G or K as a plane."""

    def __init__(self, comm: MPI.Comm, answer: Field):
        self.comm, self.other = comm, 1 - comm.rank
        self.mine, self.theirs = np.array(answer), np.empty_like(answer)
        self._swap()
        self.answer = self.theirs.copy()
        self.scale = 1 / (1 - self.answer * answer)

    def solve(self, end: Field, beyond: Field) -> None:
        """A plane of D or E → the plane of values next to this part, `beyond`."""
        np.copyto(self.mine, end)
        self._swap()
        answer_both(self.mine, self.theirs, self.answer, self.scale, beyond)

    def _swap(self) -> None:
        self.comm.Sendrecv(self.mine, self.other, 8, self.theirs, self.other, 8)


@kernel(*[REAL[:, ::1]] * 5)
def answer_both(mine, theirs, answer, scale, beyond):
    """What the other part knows of its end, and its answer to ours."""
    for j in range(beyond.shape[0]):
        for i in range(beyond.shape[1]):
            beyond[j, i] = (theirs[j, i] + answer[j, i] * mine[j, i]) * scale[j, i]


class Interfaces:
    """Joins the parts of one set of lines; collective over the ranks that share them.

    `answers` are this rank's G, H and K as planes.
    """

    def __init__(self, comm: MPI.Comm, ring: bool, answers: Field):
        self.comm, self.ring = comm, ring
        self.shape = answers.shape[1:]
        self.lines = answers[0].size
        self.share = -(-self.lines // comm.size)   # lines per rank, the last ones padded
        self.low, self.across, self.high = self._hand_out(answers)
        self._factor()
        self.alpha = np.zeros((comm.size + 1, self.share))
        self.planes = np.zeros((2, comm.size * self.share))
        self.sent, self.received = np.zeros((2, comm.size, 2, self.share))

    def _hand_out(self, answers: Field) -> Field:
        """G, H and K of all parts on this rank's share of the lines: (3, P, share)."""
        padded = np.zeros((3, self.comm.size * self.share))
        padded[:, :self.lines] = answers.reshape(3, -1)
        given = np.empty((3, self.comm.size, self.share))
        for plane, received in zip(padded, given, strict=True):
            self.comm.Alltoall(plane, received)
        return given

    def _factor(self) -> None:
        """β, γ and 1 / (1 - Gβ) of every part, and how first_0 depends on the ring's x and y."""
        size = self.comm.size
        self.beta, self.gamma = np.zeros((2, size + 1, self.share))
        self.gamma[0] = float(self.ring)
        self.scale = np.empty((size, self.share))
        for i in range(size):
            self.scale[i] = 1 / (1 - self.low[i] * self.beta[i])
            self.beta[i + 1] = self.high[i] + self.across[i]**2 * self.beta[i] * self.scale[i]
            self.gamma[i + 1] = self.across[i] * self.gamma[i] * self.scale[i]
        self.on_next = self.scale * self.across                   # first_i on first_{i+1}
        self.on_ring = self.scale * self.low * self.gamma[:-1]    # and on y
        self.on_x, self.on_y = self.on_next[-1].copy(), self.on_ring[-1].copy()
        for i in reversed(range(size - 1)):
            self.on_x = self.on_next[i] * self.on_x
            self.on_y = self.on_ring[i] + self.on_next[i] * self.on_y

    def solve(self, first: Field, last: Field) -> tuple[Field, Field]:
        """Planes of D and E → planes of the values next to this part, below and above it."""
        self.planes[0, :self.lines] = first.ravel()
        self.planes[1, :self.lines] = last.ravel()
        ranks = self.planes.reshape(2, self.comm.size, self.share).swapaxes(0, 1)
        np.copyto(self.sent, ranks)
        self.comm.Alltoall(self.sent, self.received)
        join(self.received, self.low, self.across, self.scale, self.beta, self.gamma, self.on_next,
             self.on_ring, self.on_x, self.on_y, self.alpha, int(self.ring))
        self.comm.Alltoall(self.received, self.sent)
        np.copyto(ranks, self.sent)
        below, above = self.planes[:, :self.lines].reshape(2, *self.shape)
        return below, above


@kernel(REAL[:, :, ::1], *[REAL[:, ::1]] * 7, REAL[::1], REAL[::1], REAL[:, ::1], INT)
def join(parts, low, across, scale, beta, gamma, on_next, on_ring, on_x, on_y, alpha, ring):
    """D and E of every part (P, 2, lines) → the values next to it, in place."""
    size, _, lines = parts.shape
    for i in range(size):
        for n in range(lines):
            d = scale[i, n] * (parts[i, 0, n] + low[i, n] * alpha[i, n])
            alpha[i + 1, n] = parts[i, 1, n] + across[i, n] * (alpha[i, n] + beta[i, n] * d)
            parts[i, 0, n] = d
    for n in range(lines):
        x = y = 0.0
        if ring:
            known = parts[size - 1, 0, n]
            for i in range(size - 2, -1, -1):
                known = parts[i, 0, n] + on_next[i, n] * known
            rest = 1 - gamma[size, n]
            x = ((known * rest + on_y[n] * alpha[size, n])
                 / ((1 - on_x[n]) * rest - on_y[n] * beta[size, n]))
            y = (alpha[size, n] + beta[size, n] * x) / rest
        for i in range(size - 1, -1, -1):
            parts[i, 1, n] = x
            x = parts[i, 0, n] + on_next[i, n] * x + on_ring[i, n] * y
            parts[i, 0, n] = alpha[i, n] + beta[i, n] * x + gamma[i, n] * y
