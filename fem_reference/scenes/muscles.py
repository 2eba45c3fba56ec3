"""Frozen records of the case of several muscles with common bones, frames and reference, and its split into single muscles."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Self

from pydantic import Field

from fem_reference.effects import Effect
from fem_reference.effects.touching import MuscleContact, among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import PartName, join
from fem_reference.scenes.case import Expectation
from fem_reference.scenes.fibres import Fibres
from fem_reference.scenes.muscle import Attachment, DrivenCase, Muscle, MuscleCase
from fem_reference.scenes.regions import CaseRegion

# Keys that each of several muscles has in its table. In the case of a single muscle they are keys of the case.
BESIDE = ("attachment", "fibres", "region", "expect")
# Keys of the case that the separate cases of its muscles share.
_SHARED = ("proves", "choice", "bone", "joint", "frames", "reference", "candidate", "folder", "from_file")


class MuscleOfSeveral(Muscle):
    """One of several muscles: the keys of ``Muscle``, and its own attachments, regions and fibres. ``name``: the name of the
    muscle, with which the names of its forces begin. ``effect``: the effects that act on this muscle only. ``expect``: the
    expectations of this muscle.
    """

    name: PartName
    attachment: tuple[Attachment, ...] = ()
    region: tuple[CaseRegion, ...] = ()
    fibres: Fibres
    effect: tuple[Any, ...] = ()
    expect: tuple[Expectation, ...] = ()


class MusclesCase(DrivenCase):
    """The case of several muscles. ``effect``: a table for each effect that acts on all muscles, with its ``name`` and its
    parameters. ``effects``: with ``"listed"`` all listed effects act, with ``"auto"`` only the effects that the case needs.
    ``quick``: new values by key, for a faster and less accurate solution. ``unsolved``: the reason, if the reference does not reach
    the last frame.
    """

    muscle: tuple[MuscleOfSeveral, ...] = Field(min_length=2)

    determined_by = frozenset({"muscle", "bone", "frames"})

    @property
    def touching(self) -> MuscleContact | None:
        """The effect of contact between the muscles; None without contact."""
        return among(self.effect)

    @property
    def apart(self) -> bool:
        """True if muscles must not cross: contact acts between them, or was left out because they do not come near each other."""
        return any(isinstance(one, MuscleContact) for one in (*self.effect, *(some.effect for some in self.decisions)))

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that act on all muscles, then those of each muscle."""
        return (*self.effect, *(one for muscle in self.muscle for one in muscle.effect))

    @property
    def acting(self) -> dict[str, Effect]:
        """The effects by title. The title of an effect on a single muscle begins with the name of the muscle."""
        own = {f"{muscle.name}: {one.title}": one for muscle in self.muscle for one in muscle.effect}
        return {one.title: one for one in self.effect} | own

    @property
    def facts(self) -> dict[str, str]:
        """A summary of the case in words, by heading."""
        return {
            "muscles": ", ".join(muscle.name for muscle in self.muscle),
            "bones": ", ".join(bone.name for bone in self.bone),
            "frames": f"{self.frames.first} to {self.frames.last}, every {self.frames.every}",
        }

    def determining(self) -> dict[str, Any]:
        """The keys that determine the solution, with their values but without expectations. If contact between the muscles was left
        out, ``apart`` is included, because the second check depends on it.
        """
        tables = super().determining()
        checked = {"apart": True} if self.apart and self.touching is None else {}
        own = [{key: own for key, own in one.items() if key != "expect"} for one in tables["muscle"]]
        return tables | checked | {"muscle": own}

    @property
    def decides(self) -> list[Any]:
        """Everything that affects verdicts, as in ``Case.decides``. A solver is judged if an expectation of any muscle names it."""
        judged = self.model_copy(update={"expect": tuple(one for muscle in self.muscle for one in muscle.expect)})
        return [self.determining(), *super(MusclesCase, judged).decides[1:]]

    def expecting(self, more: tuple[Expectation, ...]) -> Self:
        """A copy of the case in which the expectations ``more`` are added to each muscle."""
        muscles = (one.model_copy(update={"expect": (*one.expect, *more)}) for one in self.muscle)
        return self.model_copy(update={"muscle": tuple(muscles)})

    @contextmanager
    def placed(self, i: int) -> Iterator[None]:
        """A context in which an InputError about the separate case of muscle ``i`` gets the corresponding place in the scene."""
        try:
            yield
        except InputError as error:
            part = join(self.place, f"muscle[{i}]")
            if not str(error.place).startswith(f"{part}."):
                raise
            key = self._key(i, str(error.place).removeprefix(f"{part}."))
            raise InputError(join(self.place, key), error.got, error.want) from error

    def _key(self, i: int, key: str) -> str:
        """The key in the scene that corresponds to ``key`` in the separate case of muscle ``i``. In the separate case, the effects
        on all muscles precede the effects on this muscle.
        """
        own, name = f"muscle[{i}].", key.partition(".")[0].partition("[")[0]
        shared = [k for k, one in enumerate(self.effect) if not isinstance(one, MuscleContact)]
        if match := re.match(r"effect\[(\d+)\]", key):
            number = int(match[1])
            rest = key[match.end() :]
            of_all = number < len(shared)
            return f"effect[{shared[number]}]{rest}" if of_all else f"{own}effect[{number - len(shared)}]{rest}"
        if name == "muscle":
            return own + key.removeprefix("muscle.")
        return own + key if name in BESIDE or name == "effect" else key

    @property
    def parts(self) -> tuple[MuscleCase, ...]:
        """The separate case of each muscle. These cases are not checked again, as they were checked when this case was read."""
        everywhere, found = tuple(one for one in self.effect if not isinstance(one, MuscleContact)), list[MuscleCase]()
        for i, muscle in enumerate(self.muscle):
            made: dict[str, Any] = {name: getattr(self, name) for name in _SHARED}
            made |= {name: getattr(muscle, name) for name in BESIDE}
            made["muscle"] = Muscle.model_construct(**{name: getattr(muscle, name) for name in Muscle.model_fields})
            made |= {"title": f"{self.title}: {muscle.name}", "name": f"{self.name}_{muscle.name}"}
            made |= {"effect": (*everywhere, *muscle.effect), "place": join(self.place, f"muscle[{i}]")}
            found.append(MuscleCase.model_construct(None, **made))
        return tuple(found)


def muscles_of(case: DrivenCase) -> tuple[Muscle, ...]:
    """The muscles of a case: one or several."""
    return case.muscle if isinstance(case.muscle, tuple) else (case.muscle,)


def with_muscles[C: DrivenCase](case: C, change: Callable[[Muscle], Mapping[str, object]]) -> C:
    """A copy of the case with changes to each of its muscles. ``change``: a function from a muscle to its new values by key."""
    changed = [one.model_copy(update=change(one)) for one in muscles_of(case)]
    return case.model_copy(update={"muscle": tuple(changed) if isinstance(case.muscle, tuple) else changed[0]})


def exactly_attached[C: DrivenCase](case: C) -> C:
    """A copy of the case with exact attachments instead of springs."""

    def exact(one: DrivenCase | Muscle) -> dict[str, object]:
        if not isinstance(one, MuscleCase | MuscleOfSeveral):
            return {}
        return {"attachment": tuple(entry.model_copy(update={"stiffness": None}) for entry in one.attachment)}

    return with_muscles(case, exact).model_copy(update=exact(case))


def alone(table: dict[str, Any], place: str) -> dict[str, Any]:
    """The ``table`` of a scene, rewritten as for a single muscle if its list of muscles has one entry, otherwise unchanged.

    Raises an InputError that names ``place`` if the muscle and the scene state the same key.
    """
    listed = table.get("muscle")
    if not isinstance(listed, list) or len(listed) != 1 or not isinstance(listed[0], dict):
        return table
    muscle = {key: value for key, value in listed[0].items() if key not in (*BESIDE, "effect", "name")}
    own = {key: listed[0][key] for key in (*BESIDE, "effect") if key in listed[0]}
    for key in set(own) & set(table) - {"effect", "expect"}:
        raise InputError(join(place, key), f"this key and muscle[0].{key}", "only one of these")
    lists = {key: [*table.get(key, []), *own.pop(key)] for key in ("effect", "expect") if key in own}
    return table | own | lists | {"muscle": muscle}
