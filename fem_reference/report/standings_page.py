"""The page ``standings``: a table of solvers of all kinds over all cases, and a table for each case."""

from fem_reference.assessment.standings import ERROR, MATCHED_ERROR, MATCHED_TIME, Standing, Standings
from fem_reference.metrics import described
from fem_reference.report.pages import Page

_SHOWN = (*described("solvers").items(), (("joint_moment", "moment"), described()["joint_moment", "moment"]))
COLUMNS = tuple((".".join(key), one.label, one.full_unit) for key, one in _SHOWN)


def page(found: Standings) -> Page:
    """The page of standings."""
    longest = max((sum(row.split.values()) for row in found.rows), default=0.0)
    limits = sorted({row.time_limit for row in found.rows if row.time_limit is not None})
    known = {
        case: {name for row in found.of(case) for name, value in (row.worst | row.bars).items() if value is not None}
        for case in found.cases
    }
    contents = {
        "limits": [f"{limit:g} s" for limit in limits],
        "found": found,
        "columns": {case: [column for column in COLUMNS if column[0] in names] for case, names in known.items()},
        "longest": longest or 1.0,
        "matched": (MATCHED_ERROR, MATCHED_TIME),
    }
    said = f"{len(found.rows)} results on {len(found.cases)} cases"
    numbers = found.model_dump(mode="json")
    return Page("standings", "Standings", (("", "", said),), "standings_page.html", contents, numbers)


def text(found: Standings) -> str:
    """The rows, the reasons for missing rows and the changes, as lines of text."""
    lines = [_line(row) for case in found.cases for row in found.of(case)]
    lines += [f"{name}: left out, {why}" for name, why in found.missing.items()]
    return "\n".join([*lines, *(f"changed: {line}" for line in found.changes)])


def _line(row: Standing) -> str:
    value, bar = row.worst.get(ERROR), row.bars.get(ERROR)
    parts = [f"{row.case}: {row.group}, {row.name} {row.version}: {row.ended}{' (stale)' if row.stale else ''}"]
    parts += [] if value is None or row.failed else [f"surface rms {value:.3g} mm"]
    parts += [] if bar is None else [f"error bar ± {bar:.2g} mm"]
    parts += [f"{name} {part:.3g} mm" for name, part in row.split.items()]
    return ", ".join(parts)
