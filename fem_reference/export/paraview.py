"""Export of all runs of a case to ParaView, as a collection of named blocks.

The points of each block are stored at their rest positions. The ParaView filter "Warp By Vector" moves them by the array
``displacement``. The files are:

forces.csv               force, point of application, moment and moment arm for each run, frame and bone
runs.pvd                 list of the frames with their times [s], or with their numbers if the case states no time
frames/frame_0010.vtm    blocks of a frame: reference and candidates (muscle, fibres, interior of the reference), bones, attachments
"""

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fem_reference.assessment import local_fields
from fem_reference.assessment.comparison import Comparison
from fem_reference.effects import contact, in_situ
from fem_reference.export import forces
from fem_reference.export.folders import new_folder, write_text
from fem_reference.foundations.mesh import Floats, Ints, Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry.embedding import embed
from fem_reference.io import files
from fem_reference.io.formats.vtk import DataBlock, Tree, write_blocks
from fem_reference.metrics import MeasurementContext
from fem_reference.metrics.fibre_length import fibre_points
from fem_reference.problems.contact import ContactLaw
from fem_reference.runs import results, states
from fem_reference.runs.contents import frame_file
from fem_reference.runs.results import Results
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile

log = logging.getLogger(__name__)

INDEX = "runs.pvd"
_NO_STATES = """
The reference was solved without `reference.store_state = true`, so the arrays that are computed from stored states are missing.
"""
# Arrays that are computed from stored states. The displacement is always written.
_EVALUATED = ("det_F", "pressure", "fibre_stretch", "fibre_stress", "von_mises")
_CORNERS = np.eye(4)
# The name of each array of error bars, and the statistic whose error bar the array contains.
_BARS = {"error_bar": "max", "error_bar_of_surface": "hausdorff"}


def write(comparison: Comparison, folder: Path) -> list[str]:
    """Write all runs of a muscle into ``folder`` and return the names of the written files.

    Raises InputError unless the folder is missing or empty. If writing fails, no partly written folder is left behind.
    """
    case = casefile.muscle(comparison.scene)
    with new_folder(folder) as part:
        frames = _Frames(comparison)
        entries = []
        for i, number in enumerate(comparison.reference.numbers):
            name = f"frames/{frame_file(number, '.vtm')}"
            (part / "frames").mkdir(exist_ok=True)
            write_blocks(part / name, frames.blocks(i))
            entries.append((number if case.frames.interval is None else number * case.frames.interval, name))
            log.info("%s: frame %d written", case.name, number)
        files.write_pvd(part / INDEX, entries)
        forces.write_table(comparison, part / forces.FILE)
        unit = "frame numbers" if case.frames.interval is None else "seconds"
        lacking = _NO_STATES if frames.results is None else ""
        write_text(part / "README.md", case, "PARAVIEW.md", unit=unit, lacking=lacking)
        return sorted(str(path.relative_to(part)) for path in part.rglob("*") if path.is_file())


class _Frames:
    """The blocks of every frame of a comparison, and the data that all frames share."""

    def __init__(self, comparison: Comparison) -> None:
        assert isinstance(comparison.context, MeasurementContext)  # the comparison is of a muscle
        self.comparison, self.setup, self.context = comparison, comparison.setup, comparison.context
        self.case, self.reference = casefile.muscle(comparison.scene), comparison.reference
        self.results, self.within = _states(comparison), None
        if self.results is not None:
            found = embed(self.results.mesh, self.setup.surface.points)
            # A vertex slightly outside the tetrahedra gets the values at the boundary of the nearest tetrahedron.
            inside = np.clip(found.barycentric, 0, None)
            self.within = found.tets, inside / inside.sum(axis=1, keepdims=True)
        self.arrays = {run.name: dict(self._of_surface(run)) for run in comparison.runs}
        self.fibres = {run.name: fibre_points(run, self.context) for run in comparison.runs}

    def _of_surface(self, run: Run) -> Iterator[tuple[str, Floats]]:
        """Names and arrays (f, n) of the quantities at the n surface vertices of a run in each of its f frames."""
        if not run.has_surface:
            return
        gaps = local_fields.to_bones(run, self.context)
        if gaps is not None:
            yield "distance_to_bones", gaps
        if run is self.reference:
            pressed = contact.among(self.case.effects) is not None and in_situ.among(self.case.effects) is None
            # With `in_situ` the contact pressure depends on the gaps at rest, which are known only to the solver.
            if gaps is not None and pressed:
                yield "contact_pressure", self._contact_pressure()
            return
        yield "distance_to_reference", local_fields.to_same_vertex(run, self.reference)
        yield "distance_to_reference_surface", local_fields.to_surface(run, self.reference)
        bars = self.comparison.error_bars
        for name, statistic in _BARS.items():
            bar = None if bars is None else bars.find("deviation", "surface_deviation", statistic)
            if bar is not None:
                yield name, np.repeat(bar.values[:, None], len(run.surface.points), axis=1)

    def _contact_pressure(self) -> Floats:
        """Contact pressure (f, n) [MPa] at the vertices of the reference, summed over all bones; 0 at exempt vertices."""
        effect = contact.among(self.case.effects)
        assert effect is not None  # the caller checked it
        law, run = ContactLaw("free", effect.stiffness, effect.smoothing), self.reference
        bones = [bone for bone in self.setup.bones if effect.is_by(bone.name)]
        pressures = np.zeros(run.positions.shape[:2])
        for i, (number, points) in enumerate(zip(run.numbers, run.positions, strict=True)):
            if not np.isfinite(points).all():
                pressures[i] = np.nan
                continue
            for bone in bones:
                pressures[i] += law.pressure(bone.distances(number, points))[0]
        return np.where(self.setup.free, pressures, 0.0)

    def blocks(self, i: int) -> Tree:
        """All blocks of the frame with index ``i``."""
        number, rest = self.reference.numbers[i], self.setup.surface
        bones = {}
        for bone in self.setup.bones:
            points = bone.surface.points
            moved = _moved(points, apply(bone.pose(number), points))
            bones[bone.name] = DataBlock(points, bone.surface.triangles, moved)
        now = self.reference.positions[i]
        attachments = {one.attachment: _part(rest, one.vertices, now) for one in self.setup.attached}
        runs = {run.name: self._run(run, i) for run in self.comparison.candidates}
        own = self._run(self.reference, i)
        return {"reference": own, "candidates": runs, "bones": bones, "attachments": attachments}

    def _run(self, run: Run, i: int) -> dict[str, DataBlock]:
        blocks, frame = {}, run.numbers[i]
        state = self.results if run is self.reference else None
        state = None if state is None or frame not in state.frames else state
        known = {name: float(values[i]) for name, values in run.scalars.items() if np.isfinite(values[i])}
        numbers = {"frame": float(frame)} | known
        if run.has_surface:
            rest = self.setup.surface
            arrays = _moved(rest.points, run.positions[i]) | {k: v[i] for k, v in self.arrays[run.name].items()}
            if state is not None and self.within is not None:
                arrays |= state.evaluate_in(*self.within, frame, _names(state, frame))
            blocks["muscle"] = DataBlock(rest.points, rest.triangles, arrays, numbers=numbers)
        lines, points = self.context.fibres, self.fibres[run.name][i]
        stretch = {"fibre_stretch": local_fields.stretch_along(lines, points[None])[0]}
        whole = {"stretch_of_fibre": lines.lengths(points) / lines.lengths()}
        blocks["fibres"] = DataBlock(lines.points, lines, _moved(lines.points, points) | stretch, whole)
        if (pull := forces.block(run, self.setup, i)) is not None:
            blocks["forces"] = pull
        if state is not None:
            blocks["interior"] = interior(state, frame)
        return blocks


def interior(made: Results, frame: float) -> DataBlock:
    """The tetrahedra of the reference at a ``frame``.

    Quantities that are discontinuous between tetrahedra are evaluated at the centroid of each tetrahedron. The array
    ``det_F_at_worst_corner`` contains the smallest det F at the four corners.
    """
    mesh, count = made.mesh, len(made.mesh.tets)
    cells = made.evaluate_in(np.arange(count), np.full((count, 4), 0.25), frame, _names(made, frame))
    middles = mesh.points[mesh.tets].mean(axis=1)
    cells |= {f"region_{name}": region(middles) for name, region in made.regions.items()}
    ends = made.evaluate_in(np.repeat(np.arange(count), 4), np.tile(_CORNERS, (count, 1)), frame, ("det_F",))
    cells["det_F_at_worst_corner"] = ends["det_F"].reshape(count, 4).min(axis=1)
    displacement = np.zeros_like(mesh.points)
    displacement[mesh.tets] = made.states[frame].displacement[:, :4]  # the first four nodes are the corners
    return DataBlock(mesh.points, mesh.tets, {"displacement": displacement}, cells)


def _names(made: Results, frame: float) -> list[str]:
    """The names of the arrays at a ``frame`` that are written in addition to the displacement."""
    return [name for name in made.names(made.states[frame]) if name in _EVALUATED]


def _states(comparison: Comparison) -> Results | None:
    """The results computed from the stored states of the reference; None if no states are stored."""
    run = comparison.reference
    folder = run.folder
    if folder is None or not states.are_kept(folder, run.numbers):
        log.info("%s has no stored states: stress, pressure, det F and fibre stretch are omitted", run.name)
        return None
    return results.of_run(folder, comparison.scene)


def _moved(rest: Floats, now: Floats) -> dict[str, Floats]:
    """The array ``displacement`` (n, 3) [mm] from ``rest`` (n, 3) to ``now`` (n, 3), for :class:`DataBlock`.

    A point with an unknown position has the displacement 0, so that ParaView can draw it.
    """
    known = np.isfinite(now)
    return {"displacement": np.where(known, now - np.where(known, rest, 0.0), 0.0)}


def _part(rest: Surface, vertices: Ints, now: Floats) -> DataBlock:
    """The part of the surface ``rest`` with only the given ``vertices``, and the triangles whose corners all belong to them.

    ``now`` (n, 3): present positions of all vertices of the surface [mm].
    """
    chosen = rest.triangles[np.isin(rest.triangles, vertices).all(axis=1)]
    own = np.unique(vertices)
    return DataBlock(rest.points[own], np.searchsorted(own, chosen), _moved(rest.points[own], now[own]))
