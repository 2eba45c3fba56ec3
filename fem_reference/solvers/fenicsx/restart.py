"""The states of a run on disk, bit by bit: a process that reads them continues exactly as the writer would have done.

<run>/restart/layout_<hash>.npz   by rank: its cells, and the unknowns of each
/frame_0010.npz      by rank: the unknowns and the arrays of the clock; ``facts``, in JSON
"""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, fingerprint
from fem_reference.runs.states import read_arrays, write_arrays
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.jobs import Kept


class Restart:
    """Writes and reads the states of a ``body``; collective. The number of ranks may differ when they are read."""

    def __init__(self, body: AssembledBody, kept: Kept) -> None:
        self.body, self.kept = body, kept
        dofmap = body.unknowns.function_space.dofmap
        names = np.asarray(dofmap.list, np.int64)[:, :, None] * dofmap.bs + np.arange(dofmap.bs)
        self.dofs: Ints = names.reshape(len(names), -1)  # of this rank's cells, shared ones too
        self.cells = np.asarray(body.mesh.topology.original_cell_index, np.int64)[: len(names)]
        self.layout = self._layout()
        self.note = ""  # on a run that continues with other effects

    def _layout(self) -> str:
        """The name of the file with the distribution of the unknowns."""
        own = len(self.body.cells)
        arrays = self._gathered({"cells": self.cells[:own], "dofs": self.dofs[:own]})
        name = f"layout_{fingerprint(*arrays.values())[:16]}.npz"
        if self.body.comm.rank == 0 and not (self.kept.folder / name).exists():
            write_arrays(self.kept.folder / name, arrays)
        return name

    def _gathered(self, mine: dict[str, Any]) -> dict[str, Any]:
        """Arrays of all ranks on the first rank; nothing on the others."""
        parts = self.body.comm.gather(mine) or []
        return {f"{rank} {name}": array for rank, part in enumerate(parts) for name, array in part.items()}

    @property
    def _acting(self) -> str:
        """The effects and the contact law, in words."""
        contact = self.body.contact
        law = "no contact" if contact is None else f"contact {contact.law.stiffness:g} {contact.law.smoothing:g}"
        return " ".join([*map(repr, self.body.effects), law])

    def write(self, frame: float, facts: dict[str, Any]) -> None:
        """Store the present state, that of ``frame``, with the facts of the run until then."""
        body = self.body
        arrays = self._gathered({"unknowns": body.unknowns.x.array} | body.clock.arrays())
        own = {"mesh": self.kept.mesh, "layout": self.layout, "recalled": body.recalled is not None}
        own |= {
            "acting": self._acting,
            "clock": body.clock.facts(),
            "modes": body.modes,
            "greatest_energy": body.path.greatest,
        }
        if body.comm.rank == 0:
            arrays["facts"] = np.array(json.dumps(facts | own))
            write_arrays(self.kept.place(frame), arrays)

    def good(self) -> tuple[int, ...]:
        """The frames of the states to continue from: all of them. If other effects acted in them, those up to the first that is
        not in equilibrium now, and none where time matters. The body is restored afterwards.
        """
        body, found = self.body, list[int]()
        rest, at = np.array(body.unknowns.x.array), body.at
        for frame in self.kept.frames:
            arrays, facts, layout = self._read(frame)
            if facts["acting"] == self._acting:
                return self.kept.frames
            if body.clock.matters:
                return ()
            body.take_up(frame, self._spread("unknowns", arrays, layout), recalled=True)
            if body.system.residual() > body.newton.residual:
                break
            found.append(frame)
        body.take_up(at, rest, recalled=True)
        body.path.greatest = 0.0
        self.note = f"; effects were added, from frame {found[-1]} on" if found else ""
        return tuple(found)

    def _read(self, frame: int) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
        """The arrays of a state, its facts, and its layout."""
        arrays = read_arrays(self.kept.place(frame))
        facts = json.loads(str(arrays["facts"]))
        return arrays, facts, read_arrays(self.kept.folder / facts["layout"])

    def go_on(self, frames: tuple[int, ...]) -> dict[str, Any]:
        """Take up the state of the last of the ``frames`` and register the others; the facts stored with it."""
        body, facts = self.body, dict[str, Any]()
        for frame in frames:
            arrays, facts, layout = self._read(frame)
            if not facts["recalled"]:
                body.know(frame, self._spread("unknowns", arrays, layout), facts["modes"])
            if frame == frames[-1]:
                names = {name.partition(" ")[2] for name in arrays} - {"", "unknowns"}
                body.clock.take_up({name: self._spread(name, arrays, layout) for name in names}, facts["clock"])
                body.take_up(frame, self._spread("unknowns", arrays, layout), recalled=facts["recalled"])
                body.path.greatest = facts["greatest_energy"]
        return facts

    def _spread(self, name: str, arrays: Mapping[str, Any], layout: Mapping[str, Any]) -> Floats:
        """This rank's values (n,) of an array of all ranks, by cell."""
        ranks = [int(key.split()[0]) for key in layout if key.endswith(" cells")]
        parts = [(layout[f"{rank} cells"], arrays[f"{rank} {name}"][layout[f"{rank} dofs"]]) for rank in ranks]
        inside = np.zeros((sum(len(cells) for cells, _ in parts), self.dofs.shape[1]))
        for cells, values in parts:
            inside[cells] = values
        mine = np.zeros(len(self.body.unknowns.x.array))
        mine[self.dofs] = inside[self.cells]
        return mine
