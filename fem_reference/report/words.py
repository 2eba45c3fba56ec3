"""Numbers and names for readers: three significant digits, a true minus sign, powers of ten, plain words."""

import math
from collections.abc import Iterable

_MINUS, _TIMES, _DASH, _THIN = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}", "\N{EN DASH}", "\N{NARROW NO-BREAK SPACE}"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None) -> str:
    """A number with three significant digits; from 1000 to 10^7 an integer.

    >>> number(0.12345), number(12.3456), number(0), number(float("nan"))
    ('0.123', '12.3', '0', 'not a number')
    """
    if value is None:
        return _DASH
    if math.isnan(value):
        return "not a number"
    sign = _MINUS if value < 0 else ""
    size = abs(value)
    if math.isinf(size):
        return f"{sign}infinite"
    if size != 0 and not 1e-4 <= size < 1e7:
        mantissa, power = f"{size:.2e}".split("e")
        return f"{sign}{mantissa} {_TIMES} 10{str(int(power)).translate(_SUPERSCRIPT)}"
    if size >= 999.5:
        return sign + f"{size:,.0f}".replace(",", _THIN)
    return sign + (f"{size:.0f}" if size == int(size) else f"{size:#.3g}".rstrip("."))


def duration(seconds: float | None) -> str:
    """A time with its unit.

    >>> duration(0.0301), duration(45.678), duration(7200)
    ('30.1 ms', '45.7 s', '120 min')
    """
    if seconds is None:
        return _DASH
    if seconds >= 600:
        return f"{number(seconds / 60)} min"
    return f"{number(seconds * 1000)} ms" if 0 < seconds * 1000 < 999.5 else f"{number(seconds)} s"


def under_load(shares: Iterable[float], most: float) -> str:
    """A warning if any of ``shares``, the fractions of the machine that other processes kept busy (NaN: unknown), exceeds ``most``.

    >>> under_load([0.02, 0.5, 0.25], 0.1)
    '2 of 3 times were measured while other processes kept 25 % to 50 % of the machine busy: undisturbed runs take less time'
    >>> under_load([0.02, float("nan")], 0.1)
    ''
    """
    every = list(shares)
    loaded = sorted(share for share in every if share > most)
    if not loaded:
        return ""
    span = " to ".join(dict.fromkeys(f"{100 * share:.0f} %" for share in (loaded[0], loaded[-1])))
    count = f"{len(loaded)} of {len(every)} times were" if len(every) > 1 else "the time was"
    return f"{count} measured while other processes kept {span} of the machine busy: undisturbed runs take less time"


def ratio(one: float | None, other: float | None) -> float | None:
    """The ratio of two times, None if either is unknown or zero.

    >>> ratio(100.0, 0.5), ratio(None, 1.0)
    (200.0, None)
    """
    return one / other if one and other else None


def words(name: str) -> str:
    """A name from code as words.

    >>> words("surface_deviation"), words("max_percent")
    ('surface deviation', 'max percent')
    """
    return name.replace("_", " ")


def listed(names: list[str]) -> str:
    """Names joined for a sentence.

    >>> listed(["pbd"]), listed(["pbd", "arap", "ours"])
    ('pbd', 'pbd, arap and ours')
    """
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def title_of(name: str) -> str:
    """The name of a statistic of a metric, or any other name, in words.

    >>> title_of("surface_deviation.rms"), title_of("unknowns")
    ('surface deviation, rms', 'unknowns')
    """
    return ", ".join(map(words, name.split(".")))
