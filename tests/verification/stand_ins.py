"""Small entries and labs that stand in for those of the catalogue."""

from contextlib import contextmanager

from fem_reference.assessment.catalogue import Entry


def entry(name, measure=1.0, group="blocks", **changes) -> Entry:
    """An entry whose truth is 1, within 0.1; ``measure`` is its value, or what is done with the lab."""
    printed = {
        "title": f"The {name}",
        "unit": "mm",
        "because": "rounding",
        "source": "by hand",
        "negative_control": "twice as much",
    }
    numbers = {"truth": 1.0, "within": 0.1, "relative": False, "kind": "closed form"}
    if callable(measure):
        measured = {"measure": measure, "given": {}, "wrong": {}}
    else:
        measured = {"measure": lambda _, value: value, "given": {"value": measure}, "wrong": {"value": 2.0}}
    return Entry(name=name, group=group, **(printed | numbers | measured | changes))


def raising(error) -> Entry:
    def measure(_):
        raise error

    return entry("raising", measure)


class Labs:
    """Makes labs, and knows how many were made and how many are open."""

    def __init__(self) -> None:
        self.made, self.open = 0, 0

    @contextmanager
    def __call__(self):
        self.made, self.open = self.made + 1, self.open + 1
        try:
            yield self.made
        finally:
            self.open -= 1


def catalogue(*entries) -> dict[str, Entry]:
    return {one.name: one for one in entries}
