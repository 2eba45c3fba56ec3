"""Materials in FEBio's input file: the effects of the muscle, the axes of its fibres, and rigid bones."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from fem_reference.effects import Effect
from fem_reference.effects.fibre_passive import FibrePassive
from fem_reference.effects.fibre_passive_febio import FibrePassiveFebio
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.effects.mooney_rivlin import MooneyRivlin
from fem_reference.effects.neo_hooke import NeoHooke
from fem_reference.export.febio_mesh import bone_id, leaf, leaves, vector
from fem_reference.export.febio_regions import Piece, parts
from fem_reference.problems.muscle import MuscleProblem

VOLUME_LAW = 2  # FEBio's pressure_model with the energy K/2 (J - 1)^2


def add_materials(root: Element, problem: MuscleProblem) -> None:
    """Add a material for each part of the muscle, numbered from 1, and then a rigid material for each bone."""
    materials, own = SubElement(root, "Material"), parts(problem)
    for number, part in enumerate(own, start=1):
        _muscle(materials, number, part)
    for number, bone in enumerate(problem.bones, start=len(own) + 1):
        rigid = SubElement(materials, "material", id=str(number), name=bone_id(bone), type="rigid body")
        middle = bone.surface.points.mean(axis=0)
        turned_about = None if bone.motion is None else bone.motion.centre
        leaves(rigid, {"density": 1e-9, "center_of_mass": vector(middle if turned_about is None else turned_about)})


def _muscle(materials: Element, number: int, part: Piece) -> None:
    """Add the material of a part: a mixture, whose stresses FEBio sums, if there is ``fibre_passive``, otherwise a single law."""
    matrix, volume = matrix_constants(part.effects), volume_constants(part.effects)
    kind = "trans iso Mooney-Rivlin" if "c3" in matrix else "Mooney-Rivlin"
    passive = [effect for effect in part.effects if isinstance(effect, FibrePassive)]
    outer = "uncoupled solid mixture" if passive else kind
    muscle = SubElement(materials, "material", id=str(number), name=part.name, type=outer)
    _leaves(muscle, volume)
    if not passive:
        _leaves(muscle, matrix)
        return
    _leaves(SubElement(muscle, "solid", type=kind), matrix)
    for effect in passive:
        _leaves(SubElement(muscle, "solid", type="muscle material"), fibre_constants(effect))


def _leaves(parent: Element, constants: dict[str, float]) -> None:
    """Add the constants of a material. If it has fibres (``lam_max``), their direction is the first axis of each element."""
    leaves(parent, constants)
    if "lam_max" in constants:
        leaf(SubElement(parent, "fiber", type="vector"), "vector", "1,0,0")


def volume_constants(effects: Sequence[Effect]) -> dict[str, float]:
    """The constants of the volumetric part: FEBio's law and the bulk modulus [MPa]."""
    bulk = sum(effect.bulk for effect in effects if isinstance(effect, Incompressible | IncompressiblePenalty))
    return {"pressure_model": VOLUME_LAW, "k": bulk}


def matrix_constants(effects: Sequence[Effect]) -> dict[str, float]:
    """The constants [MPa, 1] of FEBio's ``Mooney-Rivlin`` or, with ``fibre_passive_febio``, of ``trans iso Mooney-Rivlin``."""
    found = {"c1": 0.0, "c2": 0.0}
    for effect in effects:
        if isinstance(effect, NeoHooke):
            found["c1"] += effect.mu / 2
        elif isinstance(effect, MooneyRivlin):
            found["c1"] += effect.c1
            found["c2"] += effect.c2
        elif isinstance(effect, FibrePassiveFebio):
            c3, c5 = (found.get(key, 0.0) + getattr(effect, key) for key in ("c3", "c5"))
            found |= {"c3": c3, "c4": effect.c4, "c5": c5, "lam_max": effect.linear_from}
    return found


def fibre_constants(effect: FibrePassive) -> dict[str, float]:
    """The constants [MPa, 1] of FEBio's ``muscle material`` with passive fibres alone: the shear moduli (``g1``, ``g2``, ``g3``)
    and the activation are 0. The stretch ``lam_max`` in FEBio is relative to rest, ``linear_from`` to the optimal length.
    """
    off = {"g1": 0.0, "g2": 0.0, "g3": 0.0, "activation": 0.0}
    toe = {"p1": effect.p1, "p2": effect.p2, "Lofl": effect.optimal_stretch, "smax": effect.stress}
    return off | toe | {"lam_max": effect.linear_from * effect.optimal_stretch}


def add_fibres(root: Element, problem: MuscleProblem) -> None:
    """Add the material axes of each element: the first along the fibre, the second in some direction perpendicular to it."""
    if problem.directions is None:
        return
    section = SubElement(root, "MeshData")
    across = np.cross(problem.directions, np.eye(3)[np.abs(problem.directions).argmin(axis=1)])
    for part in parts(problem):
        data = SubElement(section, "ElementData", type="mat_axis", elem_set=part.name)
        for i, (a, d) in enumerate(zip(problem.directions[part.cells], across[part.cells], strict=True), start=1):
            axes = SubElement(data, "e", lid=str(i))
            leaf(axes, "a", vector(a))
            leaf(axes, "d", vector(d / np.linalg.norm(d)))
