"""A problem as an input file of FEBio (febio_spec 4.0): quadratic tetrahedra, rigid bones moved by load curves, sliding contact.

The format is documented in FEBio's feature manual (febiosoftware/febio-feature-manual) and in the sources of FEBio and FEBio Studio
that read and write these files. FEBio 4.11 was run with exported files; FEBIO.md lists the identical parts of the models, and the
differences in results. Time is the frame number minus the first frame number.
"""

from collections.abc import Iterable
from math import ceil
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from fem_reference.effects import name_of
from fem_reference.effects.contact import Contact
from fem_reference.effects.fibre_passive import FibrePassive
from fem_reference.effects.fibre_passive_febio import FibrePassiveFebio
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.effects.mooney_rivlin import MooneyRivlin
from fem_reference.effects.neo_hooke import NeoHooke
from fem_reference.export import febio_mesh
from fem_reference.export.febio_contact import add_contact, has_contact, notes
from fem_reference.export.febio_material import add_fibres, add_materials
from fem_reference.export.febio_regions import parts
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import join
from fem_reference.io import files
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes.muscle import MuscleCase

# The effects that FEBio provides in the same form.
SAME = (NeoHooke, MooneyRivlin, Incompressible, IncompressiblePenalty, FibrePassive, FibrePassiveFebio, Contact)
LONGEST_STEP = 2.0  # the longest step [frame numbers], as in the runs that FEBIO.md compares
# Newton's method stops if the correction is less than dtol times the displacement increment of the step so far, and its energy is
# less than etol times the energy of the first iteration of the step. With dtol = 1e-3 the residual would be 0.4 % of the forces.
TOLERANCES = {"dtol": 1e-4, "etol": 1e-5}


def check(case: MuscleCase) -> None:
    """Raise InputError if FEBio lacks an effect of the case in the same form, or has no material for their combination."""
    for i, effect in enumerate(case.effects):
        if not isinstance(effect, SAME):
            want = f"an effect that FEBio has in the same form: {', '.join(name_of(kind) for kind in SAME)}"
            raise InputError(join(case.place, f"effect[{i}]"), f'"{name_of(effect)}"', want)
    if len({(one.c4, one.linear_from) for one in case.effects if isinstance(one, FibrePassiveFebio)}) > 1:
        got = "fibre_passive_febio with different c4 or linear_from"
        want = "the same values in all regions, as FEBio has one law"
        raise InputError(join(case.place, "effect"), got, want)
    matrix = (NeoHooke, MooneyRivlin), "no matrix: neither neo_hooke nor mooney_rivlin"
    volume = (Incompressible, IncompressiblePenalty), "neither incompressible nor incompressible_penalty"
    for kinds, got in (matrix, volume):
        if not any(isinstance(effect, kinds) for effect in case.effects):
            raise InputError(join(case.place, "effect"), got, "one of them, for an uncoupled material of FEBio")


def write(problem: MuscleProblem, folder: Path) -> None:
    """Write ``scene.feb`` and ``tet10.csv`` into ``folder``."""
    write_nodes(problem, folder)
    write_model(model(problem), folder)


def write_nodes(problem: MuscleProblem, folder: Path) -> None:
    """Write ``tet10.csv`` into ``folder``, for code that reads node positions from FEBio."""
    _, tets = febio_mesh.quadratic(problem.mesh)
    rows = "".join(",".join(map(str, row)) + "\n" for row in tets.tolist())
    files.write_text(folder / "tet10.csv", ",".join(f"n{i}" for i in range(10)) + "\n" + rows)


def write_model(root: Element, folder: Path) -> None:
    """Write ``scene.feb`` into ``folder``."""
    ElementTree.indent(root, " ")
    text = ElementTree.tostring(root, encoding="unicode")
    files.write_text(folder / "scene.feb", f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def units(first: float) -> str:
    """A text with the units in a file whose motion begins at the frame number ``first``."""
    return f"mm, N, MPa; time is the frame number minus {first}"


def add_comments(root: Element, texts: Iterable[str]) -> None:
    """Append each of the ``texts`` to the file as a comment."""
    for text in texts:
        root.append(ElementTree.Comment(f" {text.replace('--', '- -')} "))  # two hyphens would end the comment


def model(problem: MuscleProblem) -> Element:
    """The root element of the complete input file of a muscle."""
    root = Element("febio_spec", version="4.0")
    add_comments(root, (units(problem.frames[0]), *notes(problem)))
    SubElement(root, "Module", type="solid")
    _control(root, problem)
    add_materials(root, problem)
    febio_mesh.Mesh(problem).add_to(root)
    _domains(root, problem)
    add_fibres(root, problem)
    _motions(root, problem)
    add_contact(root, problem)
    _curves(root, problem)
    _output(root)
    return root


def _control(root: Element, problem: MuscleProblem) -> None:
    """Add the section ``Control``: steps of at most ``LONGEST_STEP``, shorter if necessary so that a step ends at each frame."""
    control, step = SubElement(root, "Control"), _step(problem)
    steps = round((problem.frames[-1] - problem.frames[0]) / step)
    settings = {"analysis": "STATIC", "time_steps": steps, "step_size": step}
    settings |= {"plot_level": "PLOT_MUST_POINTS", "output_level": "OUTPUT_MUST_POINTS"}
    febio_mesh.leaves(control, settings)
    stepper = SubElement(control, "time_stepper", type="default")
    retries = {"max_retries": 20, "aggressiveness": 1, "cutback": 0.5}  # each retry halves the step
    febio_mesh.leaves(stepper, retries | {"opt_iter": 15, "dtmin": step / 200})
    febio_mesh.leaf(stepper, "dtmax", step, lc="1")
    solver = SubElement(control, "solver", type="solid")
    if has_contact(problem):
        febio_mesh.leaf(solver, "symmetric_stiffness", "non-symmetric")
    febio_mesh.leaves(solver, {"max_refs": 30, **TOLERANCES})
    febio_mesh.leaf(SubElement(solver, "qn_method", type="BFGS"), "max_ups", 0)


def _step(problem: MuscleProblem) -> float:
    """The initial and maximum step [frame numbers]; an integer number of these steps fits between the first two frames."""
    apart = problem.frames[1] - problem.frames[0]
    return apart / ceil(apart / LONGEST_STEP)


def _domains(root: Element, problem: MuscleProblem) -> None:
    """Add the element formulations of the muscle, of the rigid bones, and of the rigid copies of areas with springs."""
    domains = SubElement(root, "MeshDomains")
    mixed = any(isinstance(effect, Incompressible) for effect in problem.effects)
    kind = "three-field-solid" if mixed else "elastic-solid"
    for part in parts(problem):
        SubElement(domains, "SolidDomain", name=part.name, mat=part.name, type=kind)
    shells = {febio_mesh.bone_id(bone): bone for bone in problem.bones}
    shells |= {febio_mesh.springs_id(attached): attached.bone for attached in febio_mesh.by_springs(problem)}
    for name, bone in shells.items():
        shell = SubElement(domains, "ShellDomain", name=name, mat=febio_mesh.bone_id(bone))
        febio_mesh.leaf(shell, "shell_thickness", "0.01")


def _motions(root: Element, problem: MuscleProblem) -> None:
    if febio_mesh.exactly(problem):
        boundaries = SubElement(root, "Boundary")
        for attached in febio_mesh.exactly(problem):
            name = f"attached_{attached.attachment}"
            entry = SubElement(boundaries, "bc", name=name, type="rigid", node_set=name)
            febio_mesh.leaf(entry, "rb", febio_mesh.bone_id(attached.bone))
    rigid = SubElement(root, "Rigid")
    curves = _curve_numbers(problem)
    for bone in problem.bones:
        turns = bone.motion is not None and bone.motion.centre is not None
        places, angles = ("Rx", "Ry", "Rz"), ("Ru", "Rv", "Rw")
        fixed = (*places, *angles) if bone.motion is None else places if turns else angles
        moved = angles if turns else ("x", "y", "z")
        entry = SubElement(rigid, "rigid_bc", name=f"{febio_mesh.bone_id(bone)}_fixed", type="rigid_fixed")
        febio_mesh.leaves(entry, {"rb": febio_mesh.bone_id(bone)} | {f"{freedom}_dof": 1 for freedom in fixed})
        for freedom, share in zip(moved, [] if bone.motion is None else bone.motion.along.tolist(), strict=False):
            kind = "rigid_rotation" if turns else "rigid_displacement"
            entry = SubElement(rigid, "rigid_bc", name=f"{febio_mesh.bone_id(bone)}_{freedom}", type=kind)
            febio_mesh.leaves(entry, {"rb": febio_mesh.bone_id(bone), "dof": freedom})
            febio_mesh.leaf(entry, "value", repr(share), lc=str(curves[bone.name]))


def _curve_numbers(problem: MuscleProblem) -> dict[str, int]:
    """The number of the load curve of each bone that moves, by name: 2, 3, ..., because FEBio uses it as an index into a list."""
    moving = [bone.name for bone in problem.bones if bone.motion is not None]
    return {name: number for number, name in enumerate(moving, start=2)}


def _curves(root: Element, problem: MuscleProblem) -> None:
    """Add the load curves: curve 1 has the times at which FEBio must stop, each further curve the motion [rad or mm] of a bone."""
    data, (first, *_, last) = SubElement(root, "LoadData"), problem.frames
    _curve(data, 1, "STEP", [(frame - first, _step(problem)) for frame in problem.frames])
    numbers = _curve_numbers(problem)
    for bone in problem.bones:
        if bone.motion is None:
            continue
        motion = bone.motion
        times = sorted({*problem.frames, *(frame for frame in motion.frames if first < frame < last)})
        points = [(time - first, float(np.interp(time, motion.frames, motion.amounts))) for time in times]
        _curve(data, numbers[bone.name], "LINEAR", points)


def _curve(data: Element, number: int, kind: str, points: list[tuple[float, float]]) -> None:
    curve = SubElement(data, "load_controller", id=str(number), type="loadcurve")
    febio_mesh.leaves(curve, {"interpolate": kind, "extend": "CONSTANT"})
    listed = SubElement(curve, "points")
    for time, value in points:
        febio_mesh.leaf(listed, "pt", febio_mesh.vector((time, value)))


def _output(root: Element) -> None:
    """Add the section ``Output``: displacement and stress for FEBio Studio, and the positions of the muscle's nodes as text."""
    output = SubElement(root, "Output")
    plot = SubElement(output, "plotfile", type="febio")
    SubElement(plot, "var", type="displacement")
    SubElement(plot, "var", type="stress")
    log = SubElement(output, "logfile")
    SubElement(log, "node_data", data="x;y;z", delim=",", file="nodes.txt", node_set="muscle_nodes")
