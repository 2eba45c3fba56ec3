"""The two exceptions of this package: one for unusable input, one for software that is not installed."""

import errno

# Error numbers of a full disk, an exhausted quota and a file that is too large.
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
# The maximum number of characters of a value in a message.
_SHOWN = 400


class InputError(Exception):
    """Unusable input: the file and key (``place``), the value found there (``got``) and the value expected (``want``).

    >>> str(InputError("case.toml: effect[0].mu", '"1 mm"', "a pressure"))
    'case.toml: effect[0].mu: got "1 mm", want a pressure'
    """

    def __init__(self, place: object, got: object, want: str) -> None:
        super().__init__(f"{_shown(place)}: got {_shown(got)}, want {want}")
        self.place, self.got, self.want = place, got, want

    def __reduce__(self) -> tuple[type["InputError"], tuple[object, object, str]]:
        """Return the class and its arguments, so that the error can be passed to another process."""
        return type(self), (self.place, self.got, self.want)


def _shown(value: object) -> str:
    """Format a value as one line of text for a terminal: shortened if it is long, with control characters escaped."""
    text = str(value)
    if len(text) > _SHOWN:
        text = f"{text[: _SHOWN // 2]} ... {text[-_SHOWN // 4 :]}"
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)


class MissingSoftware(Exception):  # noqa: N818 - it is a state of the machine, not a mistake of the caller
    """A required package or program is not installed; the message states how to get it."""
