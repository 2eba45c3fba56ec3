"""The states of a run on disk, exact to the bit: a process that reads them continues exactly as the writing process would have.

<run>/restart/frame_0010.npz   the unknowns and the arrays of the clock, (n,) in the order of the body's cells; ``facts``, in JSON
"""

import json
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.runs.states import read_arrays, write_arrays
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.jobs import Kept


class Restart:
    """Writes and reads the states of a ``body``; collective. The numbers of ranks that write and read may differ."""

    def __init__(self, body: AssembledBody, kept: Kept) -> None:
        self.body, self.kept = body, kept
        dofmap = body.unknowns.function_space.dofmap
        names = np.asarray(dofmap.list, np.int64)[:, :, None] * dofmap.bs + np.arange(dofmap.bs)
        self.dofs: Ints = names.reshape(len(names), -1)  # of this rank's cells, ghosts included
        self.cells = np.asarray(body.mesh.topology.original_cell_index, np.int64)[: len(names)]
        self.numbers = self._numbers()
        self.note = ""  # for a run that continues with other effects

    def _numbers(self) -> Ints:
        """The number of each unknown (m, u) of all cells, in order of first appearance: the same for any number of ranks."""
        dofmap = self.body.unknowns.function_space.dofmap
        blocks, components = np.divmod(self.dofs[: len(self.body.cells)], dofmap.index_map_bs)
        everywhere = dofmap.index_map.local_to_global(blocks.ravel().astype(np.int32)).reshape(blocks.shape)
        names = self.body.nodal.gathered(everywhere * dofmap.index_map_bs + components)
        _, first, which = np.unique(names, return_index=True, return_inverse=True)
        return np.asarray(np.argsort(np.argsort(first))[which]).reshape(names.shape)

    def _gathered(self, mine: Floats) -> Floats:
        """The values (n,) of all unknowns, gathered from ``mine`` and those of the other ranks."""
        values = self.body.nodal.gathered(mine[self.dofs[: len(self.body.cells)]])
        found = np.zeros(self.numbers.max() + 1)
        found[self.numbers] = values
        return found

    @property
    def _acting(self) -> str:
        """The effects and the contact law, as text."""
        contact = self.body.contact
        law = "no contact" if contact is None else f"contact {contact.law.stiffness:g} {contact.law.smoothing:g}"
        return " ".join([*map(repr, self.body.effects), law])

    def write(self, frame: float, facts: dict[str, Any]) -> None:
        """Store the current state, at ``frame``, with ``facts`` about the run so far."""
        body = self.body
        arrays = {"unknowns": body.unknowns.x.array} | body.clock.arrays()
        stored: dict[str, Any] = {name: self._gathered(values) for name, values in arrays.items()}
        own = {"mesh": self.kept.mesh, "recalled": body.recalled is not None, "acting": self._acting}
        own |= {"clock": body.clock.facts(), "modes": body.modes, "greatest_energy": body.path.greatest}
        if body.comm.rank == 0:
            stored["facts"] = np.array(json.dumps(facts | own))
            write_arrays(self.kept.place(frame), stored)

    def good(self) -> tuple[int, ...]:
        """The frames from whose states the run can continue. These are all frames, unless other effects acted when they were
        stored: then they are the frames before the first that is no longer in equilibrium, or none if an effect depends on
        the rate of motion. The body is restored afterwards.
        """
        body, found = self.body, list[int]()
        rest, at = np.array(body.unknowns.x.array), body.at
        for frame in self.kept.frames:
            arrays, facts = self._read(frame)
            if facts["acting"] == self._acting:
                return self.kept.frames
            if body.clock.matters:
                return ()
            body.take_up(frame, arrays["unknowns"], recalled=True)
            if body.system.residual() > body.newton.residual:
                break
            found.append(frame)
        body.take_up(at, rest, recalled=True)
        body.path.greatest = 0.0
        self.note = f"; effects were added, from frame {found[-1]} on" if found else ""
        return tuple(found)

    def _read(self, frame: int) -> tuple[dict[str, Floats], dict[str, Any]]:
        """This rank's arrays of a stored state, and the facts stored with it."""
        arrays = read_arrays(self.kept.place(frame))
        facts = json.loads(str(arrays.pop("facts")))
        mine = {name: np.zeros(len(self.body.unknowns.x.array)) for name in arrays}
        for name, values in arrays.items():
            mine[name][self.dofs] = values[self.numbers[self.cells]]
        return mine, facts

    def go_on(self, frames: tuple[int, ...]) -> dict[str, Any]:
        """Restore the state of the last of the ``frames``, register the earlier ones, and return the facts of the last state."""
        body, facts = self.body, dict[str, Any]()
        for frame in frames:
            arrays, facts = self._read(frame)
            if not facts["recalled"]:
                body.know(frame, arrays["unknowns"], facts["modes"])
            if frame == frames[-1]:
                body.clock.take_up(arrays, facts["clock"])
                body.take_up(frame, arrays["unknowns"], recalled=facts["recalled"])
                body.path.greatest = facts["greatest_energy"]
        return facts
