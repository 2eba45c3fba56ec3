"""The catalogue, experiments and the evidence for each quantity."""

from collections import Counter
from functools import partial
from typing import Any

from fem_reference.assessment import credibility, experiments
from fem_reference.assessment.catalogue import Entry
from fem_reference.report import credibility_page
from fem_reference.verification import muscle_bodies, runner
from measurements.tables import Measurement, kept, number, table

_BESIDE = ("measurement", "model")
_RESTS = "source of the measured number"
_ARMS = ("mean", "least", "greatest")
# Frames of a hip that rotates from rest to -0.3 rad and then to 0.3 rad, 0.01 rad per frame number.
_POSES = {30: "at -17 degrees", 60: "at rest", 90: "at 17 degrees"}
_TURNED = (
    "./fem run CASE --set muscle.refinements=0 --set expect=[] --set frames.last=90 --set bone[2].motion.axis={} --set "
    """'bone[2].motion.keyframes=[{{frame=0,angle="0rad"}},{{frame=30,angle="-0.3rad"}},{{frame=90,angle="0.3rad"}}]'"""
)
_TURNING = ("iliacus_anatomical", "gluteus_maximus_anatomical")


def _verify(found: dict[str, Any]) -> Any:
    keys = ("group", "name", "kind", "verdict", "value", "truth", "error", "within", "unit")
    return [{key: one[key] for key in keys} for one in found["entries"]]


def _bodies(found: dict[str, Any]) -> Any:
    return [one | {"ladder": each["ladder"]} for one, each in zip(_verify(found), found["entries"], strict=True)]


def _bodies_rows() -> str:
    """For each entry, the value, the value on the coarser mesh with half as many load steps, and the measured value."""
    rows, several = [], (row["beside"] for row in kept("credibility")["measured"]["rows"])
    beside = {one["name"]: one for own in several for one in own}
    for one in kept("bodies")["measured"]:
        title = next(each.title for each in muscle_bodies.ENTRIES if each.name == one["name"])
        measured = f"{number(one['truth'])} ± {number(one['within'], 2)}"
        said = _where(beside[one["name"]]), _rests(beside[one["name"]])
        rows.append((title, number(one["value"]), f"{one['ladder'][0][1]:.4g}", measured, *said))
    coarse = "shipped material, with cells twice as large and half as many load steps"
    head = (
        "body and quantity",
        "shipped material",
        coarse,
        "measured (for the sphere: fitted law)",
        "result",
        _RESTS,
    )
    return table("bodies", head, rows)


def _verify_groups() -> str:
    groups = dict[str, list[dict[str, Any]]]()
    for one in kept("verify")["measured"]:
        if one["kind"] == "experiment":  # on the page of validation
            continue
        groups.setdefault(one["group"], []).append(one)
    rows = [
        (name, len(ones), ", ".join(sorted({one["kind"] for one in ones})), number(max(map(_share, ones)), 2))
        for name, ones in groups.items()
    ]
    return table("verify", ("group", "entries", "kind of truth", "maximum ratio of error to tolerance"), rows)


def _share(entry: dict[str, Any]) -> float:
    return entry["error"] / entry["within"] if entry["within"] else 0.0


def _credibility(found: dict[str, Any]) -> Any:
    keys = (
        "name",
        "title",
        "unit",
        "value",
        "truth",
        "within",
        "n",
        "met",
        "kind",
        "is_order",
        "experiment",
        "rests_on",
    )
    own = ("quantity", "grade", "bar", "band", "measurement", "model", "differences", "specimens", "bias", "scatter")
    rows = [
        {key: row[key] for key in own} | {"beside": [{key: one[key] for key in keys} for one in row["beside"]]}
        for row in found["rows"]
    ]
    fits = [
        {key: one[key] for key in ("law", "parameters", "values", "inside", "converged", "evaluations")}
        for one in found["fits"]
    ]
    return {"rows": rows, "arms": found["arms"], "fits": fits}


def _credibility_grades() -> str:
    """For each quantity, the evidence from measurements of muscle."""
    rows = []
    for one, claim in zip(kept("credibility")["measured"]["rows"], credibility.claims(), strict=True):
        met, models = (f"{one[kind]['met']} of {one[kind]['of']}" if one[kind]["of"] else "none" for kind in _BESIDE)
        said = (claim.compared or "nothing", met, one["differences"], one["specimens"] or "none", models)
        rows.append((one["quantity"], f"**{one['grade']}**", *said, " to ".join(one["band"]) or "not known"))
    experiment = (
        "measurements reproduced",
        "deviation from measurements not reproduced",
        "number of specimens, by source",
    )
    head = (
        "quantity",
        "grade",
        "what was compared",
        *experiment,
        "agreement with other models (does not count as evidence)",
        "model band",
    )
    return table("credibility", head, rows)


def _credibility_verified() -> str:
    """For each quantity, the entries of the current catalogue that verify it."""
    rows, groups = [], list(runner.entries().values())
    for claim in credibility.claims():
        behind = credibility.verifying(claim, groups)
        kinds, orders = (", ".join(part) for part in (_kinds(behind), _orders(behind)))
        verified = f"{claim.closed_forms}; {kinds}" if kinds else claim.closed_forms
        rows.append((claim.name, verified, orders or "none", claim.other_codes, claim.bar))
    head = (
        "quantity",
        "closed forms; entries of the catalogue",
        "required orders of convergence",
        "other codes",
        "numerical error bar, shipped cases",
    )
    return table("credibility", head, rows)


def _kinds(behind: list[Entry]) -> list[str]:
    return [f"{count} {kind}" for kind, count in sorted(Counter(str(one.kind) for one in behind).items())]


def _orders(behind: list[Entry]) -> list[str]:
    return [
        number(order)
        for order in sorted({one.refinement.order for one in behind if one.refinement and one.refinement.order})
    ]


def _credibility_cubes() -> str:
    measured = kept("credibility")["measured"]
    found = [each for row in measured["rows"] for each in row["beside"] if each["unit"] == "1"]
    bodies = {one.name for one in muscle_bodies.ENTRIES}
    rows = []
    for one in (one for one in found if one["name"] not in bodies):
        order = one["is_order"]
        cells = [fit["values"].get(one["name"], "") for fit in measured["fits"]]
        said = [("yes" if cell > 0.5 else "no") if order and cell != "" else cell for cell in (one["value"], *cells)]
        known = "yes" if order else f"{number(one['truth'])} ± {number(one['within'], 2)}"
        said = [number(cell) if isinstance(cell, float) else cell for cell in said]
        rows.append((one["title"], said[0], known, _where(one), _rests(one), *said[1:]))
    laws = (
        f"{'best fit' if fit['converged'] else 'fit that did not converge'}: {fit['law']}" for fit in measured["fits"]
    )
    return table("credibility", ("body and quantity", "shipped material", "measured", "result", _RESTS, *laws), rows)


def _rests(one: dict[str, Any]) -> str:
    return f"{credibility_page.source(one['experiment'])}: {_recalled(one['rests_on'])}"


def _recalled(text: str) -> str:
    """The source from which a number was read; the page explains the word recalled."""
    return text.replace("from memory", "recalled").replace("memory", "recalled")


def _where(one: dict[str, Any]) -> str:
    if one["met"] or one["is_order"]:
        return "within" if one["met"] else "outside"
    return f"outside: too {'large' if one['value'] > one['truth'] else 'small'}"


def _credibility_sources() -> str:
    """For each source, the specimens and the number of measurements that the model reproduces."""
    found = [one for row in kept("credibility")["measured"]["rows"] for one in row["beside"]]
    rows = []
    for name, record in experiments.experiments().items():
        own = [one for one in found if one["experiment"] == name and one["kind"] == "measurement"]
        if own:
            met, n = f"{sum(one['met'] for one in own)} of {len(own)}", own[0]["n"] or "not known"
            rests = " / ".join(dict.fromkeys(_recalled(one["rests_on"]) for one in own))
            rows.append((credibility_page.source(name), record.specimen, n, met, rests))
    return table("credibility", ("source", "specimens", "n", "numbers reproduced", "origin of the numbers"), rows)


def _credibility_arms() -> str:
    rows = []
    for one in kept("credibility")["measured"]["arms"]:
        offsets = (f"{one[key]:.1f} mm" for key in ("bias", "scatter", "coarser"))
        beside = f"{credibility_page.source(one['experiment'])} ({one['kind']})"
        asked = 100 if one["kind"] == "measurement" else one["reached"]
        shares = (f"{100 * one[key]:.0f} %" for key in ("share", "common"))
        first, last = one["angles"]
        at = f"{first:.0f} to {last:.0f}"
        rows.append(
            (
                f"`{one['case']}`",
                beside,
                *shares,
                f"{asked:.0f} %",
                f"{one['reached']:.0f} %",
                at,
                one["poses"],
                *offsets,
            )
        )
    shares = (
        "share of the poses, or of the range",
        "share from 0 to 57 degrees only",
        "required share",
        "share with Modenese and Kohout's fibres",
    )
    poses = ("flexion, degrees", "number of poses", "bias", "scatter over the poses", "change on larger tetrahedra")
    return table("credibility", ("case", "compared with", *shares, *poses), rows)


def _arms_about(found: dict[str, Any]) -> Any:
    rows = []
    for case, one in found.items():
        own = [each for each in one["measures"] if each["candidate"] == "reference" and each["metric"] == "moment_arm"]
        arms = {f"{each['statistic']} {each['frame']}": each["value"] for each in own}
        kept = {name: arms[name] for at in _POSES for name in (f"{which} {at}" for which in _ARMS) if name in arms}
        rows.append({"case": case, "status": one["status"], "arms": kept})
    return rows


def _arms_about_rows(file: str) -> str:
    rows = []
    for one in kept(file)["measured"]:
        found = ([one["arms"].get(f"{which} {at}") for which in _ARMS] for at in _POSES)
        cells = (one["status"] if None in arm else "{:.1f} ({:.1f} to {:.1f})".format(*arm) for arm in found)
        rows.append((f"`{one['case']}`", *cells))
    return table(file, ("case", *(f"{angle}, mm" for angle in _POSES.values())), rows)


MEASUREMENTS = {
    "verify": Measurement("./fem verify", _verify),
    "bodies": Measurement("./fem verify vastus_stretch indentation_tenth indentation_fifth", _bodies),
    "arms_adduction": Measurement(_TURNED.format("[0,-1,0]"), _arms_about, _TURNING),
    "arms_rotation": Measurement(_TURNED.format("[0,0,1]"), _arms_about, _TURNING),
    "credibility": Measurement("./fem page credibility", _credibility),
}
TABLES = {
    "verify_groups": _verify_groups,
    "bodies": _bodies_rows,
    "credibility_grades": _credibility_grades,
    "credibility_verified": _credibility_verified,
    "credibility_sources": _credibility_sources,
    "credibility_cubes": _credibility_cubes,
    "credibility_arms": _credibility_arms,
    "arms_adduction": partial(_arms_about_rows, "arms_adduction"),
    "arms_rotation": partial(_arms_about_rows, "arms_rotation"),
}
