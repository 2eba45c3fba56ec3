"""States of earlier frames, used again where loads and boundary conditions are the same."""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats

# Loads and boundary conditions are the same if none differs by more (mm, and entries of a pose): rounding of a returning motion.
_SAME = 1e-9
# States are kept up to this memory [bytes] on each rank, the latest ones.
_MOST = 512e6


@dataclass(frozen=True, eq=False)
class KnownState:
    """``unknowns`` (n,) in equilibrium under ``acting`` (m,), all numbers that determine it, and its ``negative_modes``."""

    acting: Floats
    unknowns: Floats
    negative_modes: float | None


class Known:
    """The states of a run so far, the same on all ranks of ``comm``."""

    def __init__(self, comm: MPI.Comm) -> None:
        self.comm = comm
        self.states: list[KnownState] = []

    def add(self, state: KnownState) -> None:
        """Keep a state; it is in equilibrium."""
        self.states.append(state)
        size = self.comm.allreduce(state.unknowns.nbytes + state.acting.nbytes, MPI.MAX)
        del self.states[: max(0, len(self.states) - max(1, int(_MOST / size)))]

    def find(self, acting: Floats) -> KnownState | None:
        """The state under ``acting``, None where there is none."""
        same = np.array([np.abs(one.acting - acting).max(initial=0.0) <= _SAME for one in self.states], bool)
        self.comm.Allreduce(MPI.IN_PLACE, same, MPI.LAND)
        return self.states[int(np.argmax(same))] if same.any() else None
