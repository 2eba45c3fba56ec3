"""The unknown parameters of a case and their ranges, from its effects or from the case itself."""

import re

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.limits import Range
from fem_reference.foundations.records import join
from fem_reference.scenes import numbers
from fem_reference.scenes.muscle import MuscleCase

# Keys, apart from those of effects, of numbers that may vary: the fibres, bones and frames used for measuring stay the same.
_OTHERS = re.compile(r"attachment\[\d+\]\.(stiffness|outline\.shift\.by)|fibres\.turned\.angle")
_VARIED = (
    "a number of an effect, the stiffness or outline.shift.by of an attachment, or fibres.turned.angle: "
    "the measured fibres, bones and frames of all runs are the same as in the case"
)


def ranges(case: MuscleCase) -> dict[str, Range]:
    """The ranges of the unknown parameters, by key. A range that the case states replaces the published range of the effect."""
    stated = {
        f"effect[{i}].{name}": one for i, effect in enumerate(case.effects) for name, one in effect.published.items()
    }
    return stated | {
        numbers.canonical(entry.key): Range(**entry.model_dump(exclude={"key"})) for entry in case.uncertain
    }


def left_out(case: MuscleCase) -> list[str]:
    """The keys of the numerical parameters of effects that have no range."""
    known = ranges(case)
    found = [
        f"effect[{i}].{name}"
        for i, effect in enumerate(case.effects)
        for name, value, _ in effect.parameters
        if isinstance(value, float)
    ]
    return [key for key in found if key not in known]


def ends(case: MuscleCase, key: str, one: Range, place: str) -> tuple[float, float]:
    """The lower and the upper end of the range ``one`` of the number at a ``key``, in the internal unit of the number.

    Raises an InputError that names ``place`` if the ends are invalid.
    """
    found = []
    for name in ("low", "high"):
        try:
            found.append(numbers.read(case, key, getattr(one, name)))
        except InputError as error:
            raise InputError(f"{place}.{name}", error.got, error.want) from error
    low, high = found
    if not low < high:
        raise InputError(f"{place}.high", f'"{one.high}"', f'more than low, "{one.low}"')
    if one.spread == "log-uniform" and not low > 0:
        raise InputError(f"{place}.low", f'"{one.low}"', "more than zero, for a log-uniform range")
    if one.spread == "log-uniform" and not (own := numbers.number(case, key)) > 0:
        raise InputError(f"{place}.spread", f'"log-uniform" of {own:g}', '"uniform", as this number has no logarithm')
    return low, high


def check(case: MuscleCase) -> None:
    """Raise InputError if the ``case`` states a range with invalid ends, or for a key that is repeated, unknown or may not vary."""
    keys = list[str]()
    for i, entry in enumerate(case.uncertain):
        place = join(case.place, f"uncertain[{i}]")
        key = numbers.canonical(entry.key)
        if key in keys:
            raise InputError(f"{place}.key", f'"{entry.key}" a second time', "every key once")
        keys.append(key)
        try:
            numbers.number(case, entry.key)
        except InputError as error:
            raise InputError(f"{place}.key", f'"{entry.key}"', error.want) from error
        if numbers.parts(key)[0] != "effect" and not _OTHERS.fullmatch(key):
            raise InputError(f"{place}.key", f'"{entry.key}"', _VARIED)
        ends(case, entry.key, entry, place)
