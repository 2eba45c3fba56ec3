"""The unknown parameters of a case, with their keys in the case file and their ranges; and the case with other values."""

from dataclasses import dataclass

from fem_reference.assessment.uncertainty import Parameter
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import join
from fem_reference.problems import of_case
from fem_reference.scenes import casefile, numbers, ranges
from fem_reference.scenes.muscle import MuscleCase


@dataclass(frozen=True)
class Unknowns:
    """A case as in its file (``whole``), whose keys refer to effects by number, and the indices of the acting effects (``kept``).

    With ``effects = "auto"``, the same effects act in all runs: those that the case needs with the values in its file.
    """

    whole: MuscleCase
    kept: tuple[int, ...]

    @property
    def case(self) -> MuscleCase:
        """The case with the acting effects alone, as if its file listed only these."""
        return self.at({})

    def at(self, values: dict[str, float]) -> MuscleCase:
        """The case with other ``values`` by key, in internal units. Raises InputError if the values are invalid in a case file."""
        changed = casefile.with_numbers(self.whole, values)
        acting = tuple(changed.effect[i] for i in self.kept)
        return changed.model_copy(update={"effect": acting, "choice": "listed", "decisions": (), "uncertain": ()})

    def acts(self, key: str) -> bool:
        """True unless the value at a ``key`` belongs to an effect that the case leaves out."""
        first, *others = numbers.parts(key)
        return first != "effect" or others[0] in self.kept

    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters with a range. Raises InputError if there are none, or if one belongs to an effect that is left out."""
        case, found = self.whole, []
        for i, entry in enumerate(case.uncertain):
            if not self.acts(entry.key):
                got = f'"{entry.key}", of {numbers.title(case, entry.key)}, which this case leaves out'
                want = 'a parameter of an acting effect, or effects = "listed"'
                raise InputError(join(case.place, f"uncertain[{i}].key"), got, want)
        for key, one in ranges.ranges(case).items():
            if self.acts(key):
                low, high = ranges.ends(case, key, one, join(case.place, key))
                named = numbers.title(case, key), numbers.unit(case, key), numbers.number(case, key)
                found.append(Parameter(key, *named, low, high, one.spread, one.source))
        if not found:
            want = 'a range of a parameter: [[uncertain]] with key, low, high and source, such as key = "effect[0].mu"'
            raise InputError(join(case.place, "uncertain"), "no parameter with a range", want)
        return tuple(found)

    def fixed(self) -> tuple[str, ...]:
        """The titles of those parameters of acting effects that have no range."""
        return tuple(numbers.title(self.whole, key) for key in ranges.left_out(self.whole) if self.acts(key))


def unknowns(case: MuscleCase) -> Unknowns:
    """The unknown parameters of a case."""
    if case.choice == "listed":
        return Unknowns(case, tuple(range(len(case.effect))))
    needed = [one.needed for one in of_case.chosen(case).decisions]
    return Unknowns(case, tuple(i for i, one in enumerate(needed) if one))
