"""What tests of FEBio's file share: a problem with something of everything, and how to read numbers from the file."""

from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

import acting
import numpy as np
import shapes

from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import parse
from fem_reference.problems.body import ByCell
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone

FRAMES = (10, 15, 20, 25)
TURNS = RigidMotion((1, 2, 2), (3.0, -4.0, 5.0), (10.0, 18.0, 40.0), (0.0, -0.7, 0.4))
SLIDES = RigidMotion((0, -3, 4), None, (10.0, 12.5, 30.0), (0.0, 2.0, 9.0))


def effects(*names: str) -> tuple[Any, ...]:
    changes = {"contact": {"bones": ["top"]}}
    return tuple(
        parse(acting.effects.find(name), acting.PARAMETERS[name] | changes.get(name, {}), "test") for name in names
    )


def bar() -> MuscleProblem:
    """A bar attached to a bone that slides and to an obstacle that turns, beside one that rests; its fibres point anywhere."""
    acts = effects("neo_hooke", "incompressible", "fibre_passive_febio", "contact")
    plain = shapes.bar((2, 2, 3), (10, 10, 30), {"bottom": SLIDES, "top": TURNS}, acts, FRAMES)
    ball = shapes.sphere(0, 5.0)
    bones = {bone.name: replace(bone, surface=ball) for bone in plain.bones}
    attached = tuple(replace(attached, bone=bones[attached.bone.name]) for attached in plain.attached)
    along = np.random.default_rng(3).normal(size=(len(plain.mesh.tets), 3))
    directions = along / np.linalg.norm(along, axis=1)[:, None]
    rests = Bone("rests & <waits>", ball.moved_to(ball.points + [50, 0, 0]), None)
    return replace(plain, bones=(*bones.values(), rests), attached=attached, fibre=ByCell(directions))


def numbers(element: Element) -> list[float]:
    return [float(text) for text in (element.text or "").split(",")]


def nodes(feb: Element) -> np.ndarray:
    """Positions by number, from 1; the numbers are all there, in their order."""
    found = list(feb.iterfind("Mesh/Nodes/node"))
    assert [int(node.attrib["id"]) for node in found] == list(range(1, len(found) + 1))
    return np.array([[np.nan] * 3, *map(numbers, found)])


def cells(feb: Element, name: str, tag: str = "Elements") -> np.ndarray:
    return np.array([numbers(cell) for cell in feb.find(f"Mesh/{tag}[@name='{name}']")], int)
