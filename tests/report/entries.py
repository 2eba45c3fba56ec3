"""Results of the verification catalogue that tests of its page share."""

from fem_reference.assessment.catalogue import Entry, Finding, Result, Verification, result

NAN = float("nan")
# Errors that fall with the square of the mesh size, about a truth of 2.
LADDER = ((1.0, 2.16), (0.5, 2.04), (0.25, 2.01))


def made(name="bar", value=2.01, *, with_negative_control=False, truth=2.0, group="long_blocks", **changes) -> Result:
    """A result whose bound is 2 % of a truth of 2: 0.04."""
    given = {key: changes.pop(key) for key in ("order", "ladder", "note") if key in changes}
    printed = {"title": f"The <{name}>", "unit": "N mm", "because": "because & so", "source": "Ogden 1984, section 5.2"}
    numbers = {
        "truth": lambda: truth,
        "within": 0.02,
        "relative": True,
        "kind": "closed form",
        "negative_control": "mu twice",
    }
    entry = Entry(name=name, group=group, measure=None, given={}, wrong={}, **(printed | numbers | changes))
    return result(entry, Finding(value, **given), 1.25, with_negative_control=with_negative_control)


def verification(*results: Result) -> Verification:
    return Verification(results, 12.5, {"numpy": "2.9.1"})
