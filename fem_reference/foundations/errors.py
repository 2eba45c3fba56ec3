"""The two exceptions of this package: input that is not usable, and software that is not installed."""


class InputError(Exception):
    """What somebody gave is not what is wanted: names the place (file and key), what was got and what is wanted.

    >>> str(InputError("case.toml: effect[0].mu", '"1 mm"', "a pressure"))
    'case.toml: effect[0].mu: got "1 mm", want a pressure'
    """

    def __init__(self, place: object, got: object, want: str) -> None:
        super().__init__(f"{place}: got {got}, want {want}")
        self.place, self.got, self.want = place, got, want

    def __reduce__(self) -> tuple[type["InputError"], tuple[object, object, str]]:
        """So that it goes from one process to another."""
        return type(self), (self.place, self.got, self.want)


class MissingSoftware(Exception):  # noqa: N818 - it is a state of the machine, not a mistake of the caller
    """A package or program that this job needs is not installed; the message says how to get it."""
