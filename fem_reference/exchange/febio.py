"""A problem as FEBio's input file (febio_spec 4.0): quadratic tetrahedra, rigid bones moved by load curves, sliding contact.

Written from FEBio's feature manual (febiosoftware/febio-feature-manual) and the sources of FEBio and FEBio Studio that read and
write such files. It has not been run in FEBio. Time is the frame number minus the first.
"""

from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from fem_reference import files
from fem_reference.effects import Effect
from fem_reference.effects.contact import Contact
from fem_reference.effects.fibre_passive_febio import FibrePassiveFebio
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.effects.mooney_rivlin import MooneyRivlin
from fem_reference.effects.neo_hooke import NeoHooke
from fem_reference.errors import InputError
from fem_reference.exchange.febio_mesh import Mesh, bone_id, leaf, pushing, quadratic, vector
from fem_reference.exchange.open_formats import effect_name
from fem_reference.mesh import Floats
from fem_reference.motion import Rotation
from fem_reference.problem import Body, Problem
from fem_reference.records import join
from fem_reference.scene import Scene

# What FEBio has in the same way.
SAME = (NeoHooke, MooneyRivlin, Incompressible, IncompressiblePenalty, FibrePassiveFebio, Contact)
VOLUME_LAW = 2  # FEBio's pressure_model whose energy is K/2 (J - 1)^2
SEARCH_RADIUS = 5.0  # [mm]: contact is not looked for deeper than this inside a bone


def check(scene: Scene) -> None:
    """InputError where a scene has what FEBio has not, or not in the same way."""
    for i, effect in enumerate(scene.effects):
        if not isinstance(effect, SAME):
            same = ", ".join(kind.__module__.rpartition(".")[2] for kind in SAME)
            raise InputError(
                join(scene.place, f"effect[{i}]"), f'"{effect_name(effect)}"', f"what FEBio has in the same way: {same}"
            )
    for kinds, got in (
        ((NeoHooke, MooneyRivlin), "no matrix: neither neo_hooke nor mooney_rivlin"),
        ((Incompressible, IncompressiblePenalty), "neither incompressible nor incompressible_penalty"),
    ):
        if not any(isinstance(effect, kinds) for effect in scene.effects):
            raise InputError(join(scene.place, "effect"), got, "one of them, which FEBio's uncoupled materials need")
    for i, attachment in enumerate(scene.attachment):
        if attachment.stiffness is not None:
            place = join(scene.place, f"attachment[{i}].stiffness")
            raise InputError(
                place, f"{attachment.stiffness:g} MPa/mm", "no springs: FEBio's rigid nodes are held exactly"
            )


def write(problem: Problem, folder: Path) -> None:
    """``scene.feb`` and, for whoever reads FEBio's nodes, ``tet10.csv`` into ``folder``."""
    _, tets = quadratic(problem.mesh)
    rows = "".join(",".join(map(str, row)) + "\n" for row in tets.tolist())
    files.write_text(folder / "tet10.csv", ",".join(f"n{i}" for i in range(10)) + "\n" + rows)
    root = model(problem)
    ElementTree.indent(root, " ")
    text = ElementTree.tostring(root, encoding="unicode")
    files.write_text(folder / "scene.feb", f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def model(problem: Problem) -> Element:
    """The whole input file."""
    root = Element("febio_spec", version="4.0")
    root.append(ElementTree.Comment(f" mm, N, MPa; time is the frame number minus {problem.frames[0]} "))
    SubElement(root, "Module", type="solid")
    _control(root, problem)
    _materials(root, problem)
    Mesh(problem).add_to(root)
    domains = SubElement(root, "MeshDomains")
    mixed = any(isinstance(effect, Incompressible) for effect in problem.effects)
    SubElement(
        domains, "SolidDomain", name="muscle", mat="muscle", type="three-field-solid" if mixed else "elastic-solid"
    )
    for bone in problem.bones:
        shell = SubElement(domains, "ShellDomain", name=bone_id(bone), mat=bone_id(bone))
        leaf(shell, "shell_thickness", "0.01")
    _fibres(root, problem)
    _motions(root, problem)
    _contact(root, problem)
    _curves(root, problem)
    _output(root)
    return root


def _control(root: Element, problem: Problem) -> None:
    """Steps from frame to frame, shorter where FEBio needs it."""
    control, step = SubElement(root, "Control"), problem.frames[1] - problem.frames[0]
    settings = {"analysis": "STATIC", "time_steps": len(problem.frames) - 1, "step_size": step}
    settings |= {"plot_level": "PLOT_MUST_POINTS", "output_level": "OUTPUT_MUST_POINTS"}
    for tag, value in settings.items():
        leaf(control, tag, value)
    stepper = SubElement(control, "time_stepper", type="default")
    for tag, value in {"max_retries": 20, "opt_iter": 15, "dtmin": step / 1000}.items():
        leaf(stepper, tag, value)
    leaf(stepper, "dtmax", step, lc="1")
    solver = SubElement(control, "solver", type="solid")
    leaf(solver, "max_refs", 30)
    leaf(SubElement(solver, "qn_method", type="BFGS"), "max_ups", 0)


def _materials(root: Element, problem: Problem) -> None:
    materials = SubElement(root, "Material")
    kind = "Mooney-Rivlin" if problem.directions is None else "trans iso Mooney-Rivlin"
    muscle = SubElement(materials, "material", id="1", name="muscle", type=kind)
    for tag, value in constants(problem.effects).items():
        leaf(muscle, tag, value)
    if problem.directions is not None:
        leaf(SubElement(muscle, "fiber", type="vector"), "vector", "1,0,0")
    for number, bone in enumerate(problem.bones, start=2):
        rigid = SubElement(materials, "material", id=str(number), name=bone_id(bone), type="rigid body")
        leaf(rigid, "density", 1e-9)
        leaf(rigid, "center_of_mass", vector(_centre(bone)))


def constants(effects: Iterable[Effect]) -> dict[str, float]:
    """FEBio's material parameters [MPa, 1] of the sum of ``effects``."""
    found: dict[str, float] = {"pressure_model": VOLUME_LAW, "k": 0.0, "c1": 0.0, "c2": 0.0}
    for effect in effects:
        if isinstance(effect, NeoHooke):
            found["c1"] += effect.mu / 2
        elif isinstance(effect, MooneyRivlin):
            found["c1"] += effect.c1
            found["c2"] += effect.c2
        elif isinstance(effect, Incompressible | IncompressiblePenalty):
            found["k"] += effect.bulk
        elif isinstance(effect, FibrePassiveFebio):
            found |= {"c3": effect.c3, "c4": effect.c4, "c5": effect.c5, "lam_max": effect.linear_from}
    return found


def _centre(bone: Body) -> Floats:
    """The point that FEBio turns a bone about: that of its motion."""
    return np.asarray(bone.motion.centre if isinstance(bone.motion, Rotation) else bone.surface.points.mean(axis=0))


def _fibres(root: Element, problem: Problem) -> None:
    """The axes of each element: the first along the fibre, the second anywhere across it."""
    if problem.directions is None:
        return
    data = SubElement(SubElement(root, "MeshData"), "ElementData", type="mat_axis", elem_set="muscle")
    across = np.cross(problem.directions, np.eye(3)[np.abs(problem.directions).argmin(axis=1)])
    for i, (a, d) in enumerate(zip(problem.directions, across, strict=True), start=1):
        axes = SubElement(data, "e", lid=str(i))
        leaf(axes, "a", vector(a))
        leaf(axes, "d", vector(d / np.linalg.norm(d)))


def _motions(root: Element, problem: Problem) -> None:
    boundaries = SubElement(root, "Boundary")
    for held in problem.held:
        name = f"held_{held.attachment}"
        leaf(SubElement(boundaries, "bc", name=name, type="rigid", node_set=name), "rb", bone_id(held.bone))
    rigid = SubElement(root, "Rigid")
    for number, bone in enumerate(problem.bones, start=2):
        turns = isinstance(bone.motion, Rotation)
        places, angles = ("Rx", "Ry", "Rz"), ("Ru", "Rv", "Rw")
        fixed = (*places, *angles) if bone.motion is None else places if turns else angles
        moved = angles if turns else ("x", "y", "z")
        entry = SubElement(rigid, "rigid_bc", name=f"{bone_id(bone)}_fixed", type="rigid_fixed")
        leaf(entry, "rb", bone_id(bone))
        for freedom in fixed:
            leaf(entry, f"{freedom}_dof", 1)
        for freedom, share in zip(moved, way(bone), strict=False):
            kind = "rigid_rotation" if turns else "rigid_displacement"
            entry = SubElement(rigid, "rigid_bc", name=f"{bone_id(bone)}_{freedom}", type=kind)
            leaf(entry, "rb", bone_id(bone))
            leaf(entry, "dof", freedom)
            leaf(entry, "value", repr(share), lc=str(number))


def way(bone: Body) -> list[float]:
    """The unit vector that a bone turns about or slides along; none where it rests."""
    if bone.motion is None:
        return []
    along = np.asarray(bone.motion.axis if isinstance(bone.motion, Rotation) else bone.motion.direction, float)
    return [float(share) for share in along / np.linalg.norm(along)]


def _contact(root: Element, problem: Problem) -> None:
    if problem.contact is None:
        return
    contacts = SubElement(root, "Contact")
    for bone in pushing(problem):
        entry = SubElement(
            contacts,
            "contact",
            name=f"{bone_id(bone)}_contact",
            type="sliding-elastic",
            surface_pair=f"{bone_id(bone)}_pair",
        )
        settings = {"laugon": 0, "two_pass": 0, "auto_penalty": 0, "penalty": problem.contact.stiffness}
        for tag, value in (settings | {"search_radius": SEARCH_RADIUS, "fric_coeff": 0}).items():
            leaf(entry, tag, value)


def _curves(root: Element, problem: Problem) -> None:
    """The times that FEBio must pass, curve 1; then for each bone that moves, how far [rad, mm]."""
    data, (first, *_, last) = SubElement(root, "LoadData"), problem.frames
    step = problem.frames[1] - first
    _curve(data, 1, "STEP", [(frame - first, step) for frame in problem.frames])
    for number, bone in enumerate(problem.bones, start=2):
        if bone.motion is None:
            continue
        motion = bone.motion
        far = motion.angles if isinstance(motion, Rotation) else motion.distances
        times = sorted({*problem.frames, *(frame for frame in motion.frames if first < frame < last)})
        _curve(data, number, "LINEAR", [(time - first, float(np.interp(time, motion.frames, far))) for time in times])


def _curve(data: Element, number: int, kind: str, points: list[tuple[float, float]]) -> None:
    curve = SubElement(data, "load_controller", id=str(number), type="loadcurve")
    leaf(curve, "interpolate", kind)
    leaf(curve, "extend", "CONSTANT")
    rows = SubElement(curve, "points")
    for time, value in points:
        leaf(rows, "pt", vector((time, value)))


def _output(root: Element) -> None:
    """Displacements for FEBio's viewer, and the muscle's nodes as text."""
    output = SubElement(root, "Output")
    plot = SubElement(output, "plotfile", type="febio")
    SubElement(plot, "var", type="displacement")
    SubElement(plot, "var", type="stress")
    log = SubElement(output, "logfile")
    SubElement(log, "node_data", data="x;y;z", delim=",", file="nodes.txt", node_set="muscle_nodes")
