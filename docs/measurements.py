"""Tables of the documentation: what is kept of each measurement, and the rows that a page shows of it."""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from fem_reference.assessment import cost_study, credibility, experiments, fronts
from fem_reference.assessment.catalogue import Entry
from fem_reference.assessment.recommendation import TIME
from fem_reference.assessment.stress import VERDICTS
from fem_reference.foundations.records import parse
from fem_reference.report import credibility_page
from fem_reference.verification import muscle_bodies, runner

KEPT = Path(__file__).parent / "measured"
_SURFACE, _TIME = "surface_deviation.rms", "seconds_processor"
# Ends of the reference in other numbers of load steps, as a sentence of the verb stress has them.
_ENDS = re.compile(r"end state at frame (\d+) by number of load steps: (.*?)(?:$|;)")
_END = re.compile(r"(\d+): (?:([\d.e+-]+) % from that of (\d+)|([a-z ]+))")
# Ends of fibres by name, each with its distance from its attachment, as a fact of a mesh has them.
_FAR = re.compile(r"(first|last) end of fibre (\d+), of [^:]*: ([\d.]+) mm")
_STEPS = ("1", "10", "40")
# Runs on other meshes, as a sentence of the verb stress has them.
_MESHES = re.compile(
    r"on other meshes: ((?:\d+ [a-z ]+(?:, )?)+), up to frame ([\d to]+), apart by (\S+) % at most, (\S+) % in"
)
_JITTERED = tuple(
    f"neighbours.{name}"
    for name in (
        "at_once",
        "bars",
        "edges_cross",
        "gives_way",
        "held_through",
        "narrow",
        "overlap",
        "row",
        "rubs",
        "slides_off",
        "squeezed",
        "stiff",
    )
)
_BESIDE = ("measurement", "model")
_RESTS = "source of the measured number"
_ARMS = ("mean", "least", "greatest")
# Frames of a hip that turns from rest to -0.3 rad and on to 0.3 rad, a hundredth of a radian a frame.
_POSES = {30: "at -17 degrees", 60: "at rest", 90: "at 17 degrees"}
_TURNED = (
    "./fem run CASE --set muscle.refinements=0 --set expect=[] --set frames.last=90 --set bone[2].motion.axis={} --set "
    """'bone[2].motion.keyframes=[{{frame=0,angle="0rad"}},{{frame=30,angle="-0.3rad"}},{{frame=90,angle="0.3rad"}}]'"""
)
_PROGRAMS = ("newton_vbd", "mujoco_flex", "pbat_vbd", "pbat_xpbd", "pypbd_xpbd", "drake_fem")
_STANDING = ("hip_flexion_tendon", "hip_flexion", "box_squeeze", "adductor_brevis", "gluteus_medius")
_DRAWN = " ".join(f"my_data/scenes/muscle_{number}" for number in ("0001", "0004", "0005"))
_LIMITED = "--time-limit '120 s' " + " ".join(f"--program candidates/{name}" for name in _PROGRAMS)
_FAST_PROGRAMS = ("mujoco_flex", "pypbd_xpbd")
_HARD = "at_rest bones degenerate fibres hip incompressible moved_away round_edge squeeze_bonded squeeze_sliding start twist"
_TURNING = ("iliacus_anatomical", "gluteus_maximus_anatomical")
_QUARTER = 50  # the frame at 0.5 rad


def _traced(count: int, flux: str = "") -> str:
    """The setting of ``count`` traced fibres."""
    return f"""--set 'fibres.traced={{count={count},start="origin",end="insertion"{flux}}}'"""


_POTENTIAL, _LENGTH = _traced(20), ("fibre_length", "mean", _QUARTER)
_NO_TENDON = (
    """--set fibres.complete=false --set 'attachment[2]={name="insertion",bone="femur",stiffness="100kPa/mm",outline={"""
    """file="data:hip/landmarks.csv",unit="mm",clouds=["LC_SET_Ins_1_R_M081_Glut_Max"],reach="5mm"}}'"""
)
_SHIPPED = "--error-bar"  # what is asked for of the fibres as shipped alone
# By case, its fibres as shipped, others, and the setting of these.
_CHOICES = {
    "hip_flexion": ("potential", "by area", _traced(25, ',flux="area"')),
    "hip_flexion_tendon": ("potential", "by area", _traced(25, ',flux="area"')),
    "adductor_brevis": ("by area", "potential", _POTENTIAL),
    "gluteus_medius": ("by area", "potential", _POTENTIAL),
    "gluteus_medius_anatomical": ("by area", "potential", _POTENTIAL),
    "iliacus": ("by area", "potential", _POTENTIAL),
    "iliacus_anatomical": ("by area", "potential", _POTENTIAL),
    "iliacus_in_situ": ("by area", "potential", _POTENTIAL),
    "gluteus_maximus": ("as given", "completed", "--set fibres.complete=true"),
    "gluteus_maximus_anatomical": ("completed, with the tendon", "as given", _NO_TENDON),
    "gluteus_maximus_tract": (
        "completed, with the tendon",
        "as given, with the tendon",
        "--set fibres.complete=false",
    ),
}


class Measurement(NamedTuple):
    """A ``command``; ``keep`` picks from its JSON what tables need; made of each of the ``cases``, if any, in place of CASE."""

    command: str
    keep: Callable[[Any], Any]
    cases: tuple[str, ...] = ()


def kept(name: str) -> dict[str, Any]:
    """A kept measurement."""
    return json.loads((KEPT / f"{name}.json").read_text(encoding="utf-8"))


def table(name: str, head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown, and below it where its numbers come from."""
    lines = [list(head), ["---"] * len(list(head)), *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + f"\n\n<small>{origin(name)}</small>\n"


def origin(name: str) -> str:
    """The command of a kept measurement, and when and where it was made."""
    file = kept(name)
    return f"`{file['command']}`, {file['date']}, commit `{file['commit']}`, {file['machine']}"


def number(value: float | None, digits: int = 3) -> str:
    """A number as people read it."""
    if value is None:
        return "not known"
    return f"{value:.0f}" if abs(value) >= 10**digits else f"{value:.{digits}g}"


def _verify(found: dict[str, Any]) -> Any:
    keys = ("group", "name", "kind", "verdict", "value", "truth", "error", "within", "unit")
    return [{key: one[key] for key in keys} for one in found["entries"]]


def _bodies(found: dict[str, Any]) -> Any:
    return [one | {"ladder": each["ladder"]} for one, each in zip(_verify(found), found["entries"], strict=True)]


def _bodies_rows() -> str:
    """By entry the value, that of the coarser mesh with half the load steps, and the measured one."""
    rows, several = [], (row["beside"] for row in kept("credibility")["measured"]["rows"])
    beside = {one["name"]: one for own in several for one in own}
    for one in kept("bodies")["measured"]:
        title = next(each.title for each in muscle_bodies.ENTRIES if each.name == one["name"])
        measured = f"{number(one['truth'])} ± {number(one['within'], 2)}"
        said = _where(beside[one["name"]]), _rests(beside[one["name"]])
        rows.append((title, number(one["value"]), f"{one['ladder'][0][1]:.4g}", measured, *said))
    coarse = "on cells twice as large, in half the load steps"
    head = ("", "shipped material", coarse, "measured; for the ball the fitted law", "", _RESTS)
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
    return table("verify", ("group", "entries", "truth", "greatest share of a tolerance"), rows)


def _share(entry: dict[str, Any]) -> float:
    return entry["error"] / entry["within"] if entry["within"] else 0.0


def _comparison(found: dict[str, Any]) -> Any:
    costs = ("seconds_processor", "unknowns", "newton_iterations", "load_steps")
    cost = {name: {key: one[key] for key in costs if key in one} for name, one in found["cost"].items()}
    worst = dict[tuple[str, ...], dict[str, Any]]()
    for one in found["measures"]:
        key = one["candidate"], one["metric"], one["statistic"]
        if one["value"] is not None and abs(one["value"]) > abs(worst.get(key, {"value": -0.0})["value"]):
            worst[key] = one
    shown = {("volume", "deviation"), ("fibre_length", "max"), ("surface_deviation", "rms"), ("penetration", "deepest")}
    measures = [one for (_, *what), one in worst.items() if tuple(what) in shown]
    return {"cost": cost, "worst": measures}


def _comparison_worst() -> str:
    measured = kept("hip_flexion")["measured"]
    columns = {
        ("surface_deviation", "rms"): "surface, rms",
        ("fibre_length", "max"): "worst fibre",
        ("volume", "deviation"): "volume",
        ("penetration", "deepest"): "deepest in a bone",
    }
    rows = []
    for name, cost in measured["cost"].items():
        found = {(one["metric"], one["statistic"]): one for one in measured["worst"] if one["candidate"] == name}
        if name != "reference":
            cells = (f"{number(found[key]['value'])} {found[key]['unit']}" if key in found else "" for key in columns)
            rows.append((f"`{name}`", *cells, f"{number(cost['seconds_processor'], 2)} s"))
    return table("hip_flexion", ("candidate", *columns.values(), "processor time"), rows)


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
    """By quantity what measurements of muscle say."""
    rows = []
    for one, claim in zip(kept("credibility")["measured"]["rows"], credibility.claims(), strict=True):
        met, models = (f"{one[kind]['met']} of {one[kind]['of']}" if one[kind]["of"] else "none" for kind in _BESIDE)
        said = (claim.compared or "nothing", met, one["differences"], one["specimens"] or "none", models)
        rows.append((one["quantity"], f"**{one['grade']}**", *said, " to ".join(one["band"]) or "not known"))
    experiment = ("measurements met", "deviation of the others", "specimens, by source")
    head = ("quantity", "grade", "compared", *experiment, "other models matched (no evidence)", "model band")
    return table("credibility", head, rows)


def _credibility_verified() -> str:
    """By quantity what verifies it by the catalogue as it is."""
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
        "numerical bar, of shipped cases",
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
    return table("credibility", ("", "shipped material", "measured", "", _RESTS, *laws), rows)


def _rests(one: dict[str, Any]) -> str:
    return f"{credibility_page.source(one['experiment'])}: {one['rests_on']}"


def _where(one: dict[str, Any]) -> str:
    if one["met"] or one["is_order"]:
        return "within" if one["met"] else "outside"
    return f"outside: too {'great' if one['value'] > one['truth'] else 'small'}"


def _credibility_sources() -> str:
    """By source the specimens, and what of its measurements is within."""
    found = [one for row in kept("credibility")["measured"]["rows"] for one in row["beside"]]
    rows = []
    for name, record in experiments.experiments().items():
        own = [one for one in found if one["experiment"] == name and one["kind"] == "measurement"]
        if own:
            met, n = f"{sum(one['met'] for one in own)} of {len(own)}", own[0]["n"] or "not known"
            rests = " / ".join(dict.fromkeys(one["rests_on"] for one in own))
            rows.append((credibility_page.source(name), record.specimen, n, met, rests))
    return table("credibility", ("source", "specimens", "n", "met", "source of its numbers"), rows)


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
        "from 0 to 57 degrees only",
        "required",
        "Modenese and Kohout's fibres",
    )
    poses = ("flexion, degrees", "poses", "bias", "scatter over the poses", "change on larger tetrahedra")
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


def _uncertainty(found: dict[str, Any]) -> Any:
    picked = {
        "parameters": ("key", "title"),
        "bands": ("quantity", "title", "unit", "error", "refused", "first", "total"),
        "placed": ("candidate", "quantity", "word", "worst"),
    }
    rows = {name: [{key: one[key] for key in keys} for one in found[name]] for name, keys in picked.items()}
    for one, band in zip(rows["bands"], found["bands"], strict=True):
        low = [0.0] * len(band["high"]) if band["distance"] else band["low"]
        one["width"] = max((b - a for a, b in zip(low, band["high"], strict=True) if None not in (a, b)), default=None)
        one["bar"] = max((bar for bar in band["bar"] or () if bar is not None), default=None)
    return {"runs": found["runs"], "failures": len(found["failures"]), "seconds": found["seconds"]} | rows


def _uncertainty_bands(file: str) -> str:
    measured = kept(file)["measured"]
    keys, titles = zip(*((one["key"], one["title"]) for one in measured["parameters"]), strict=True)
    rows = []
    for one in measured["bands"]:
        sizes = (f"{number(one[name])} {one['unit']}" if one[name] else "none" for name in ("width", "bar"))
        shares = (
            f"{100 * one['first'][key]:.0f} / {100 * one['total'][key]:.0f} %" if one["first"] else "" for key in keys
        )
        rows.append((one["title"], *sizes, f"{100 * (one['error'] or 0):.2g} %", *shares))
    return table(file, ("", "band, greatest width", "error bar", "error of the surrogate", *titles), rows)


def _uncertainty_candidates(file: str) -> str:
    measured = kept(file)["measured"]
    bands = [one for one in measured["bands"] if not one["refused"]]
    rows = dict[str, dict[str, str]]()
    for one in measured["placed"]:
        beyond = f" by {number(one['worst'], 2)}" if one["worst"] and one["word"] != "no answer" else ""
        rows.setdefault(one["candidate"], {})[one["quantity"]] = one["word"] + beyond
    head = ("candidate", *(f"{one['title']}, {one['unit']}" for one in bands))
    cells = ((f"`{name}`", *(row.get(one["quantity"], "") for one in bands)) for name, row in rows.items())
    return table(file, head, cells)


def _reference() -> str:
    cost = kept("hip_flexion")["measured"]["cost"]["reference"]
    row = [f"{cost[key]:.0f}" for key in ("unknowns", "load_steps", "newton_iterations", "seconds_processor")]
    return table("hip_flexion", ("unknowns", "load steps", "Newton iterations", "processor time, s"), [row])


def _omissions(found: dict[str, Any]) -> Any:
    statistics = ("surface_deviation.rms", "fibre_length.rms_percent", "volume.deviation")
    rows = []
    for solver in found["ablations"]:
        costs = solver["whole"]["costs"]
        clock = "seconds_processor_solve" if solver["name"] == "reference" else "seconds_processor"
        for one in solver["omissions"]:
            share = one["costs"][clock] / costs[clock] if one["status"] == "converged" else None
            changes = [one["changes"].get(name) for name in statistics]
            rows.append({"of": solver["name"], "left_out": one["left_out"], "status": one["status"]})
            rows[-1] |= {"changes": changes, "time": share, "verdict": one.get("verdict", "")}
    return rows


_MOVED = {
    "surface_deviation.rms": "surface, rms",
    "surface_deviation.max": "surface, greatest",
    "fibre_length.rms_percent": "fibre length, rms",
    "volume.deviation": "volume",
}


def _collagen(found: dict[str, Any]) -> Any:
    kept = {}
    for case, one in found.items():
        (left,) = (each for each in one["ablations"][0]["omissions"] if each["left_out"] == ["collagen_across"])
        kept[case] = {"changes": _only(left["changes"], _MOVED), "bars": _only(one["bars"], _MOVED)}
    return kept


def _collagen_rows() -> str:
    """By case the change of each statistic ± its error bar; KeyError where one is missing."""
    rows = []
    for case, one in kept("collagen")["measured"].items():
        found = ((one["changes"][key], one["bars"][key]) for key in _MOVED)
        cells = (
            f"{number(change, 2)} ± {number(bar, 2)} {unit}"
            for (change, bar), unit in zip(found, ("mm", "mm", "%", "%"), strict=True)
        )
        rows.append((f"`{case}`", *cells))
    return table("collagen", ("change ± its error bar", *_MOVED.values()), rows)


def _omission_rows() -> str:
    rows = []
    for one in kept("effects")["measured"]:
        of = "" if one["of"] == "reference" else f"`{one['of']}`: "
        name = of + ", ".join(f"`{effect}`" for effect in one["left_out"])
        changes = [
            "" if value is None else f"{number(value, 2)} {unit}"
            for value, unit in zip(one["changes"], ("mm", "%", "%"), strict=True)
        ]
        time = "" if one["time"] is None else f"{100 * one['time']:.0f} %"
        rows.append((name, *changes, time, one["verdict"] or one["status"]))
    return table("effects", ("omitted", "surface, rms", "fibre length, rms", "volume", "remaining time", ""), rows)


def _study(found: dict[str, Any]) -> Any:
    study = parse(cost_study.CaseStudy, found["cases"][0], "study")
    own = [one for one in study.points if one.name == "reference" and not one.is_truth and one.status == "converged"]
    keys = ("unknowns", _TIME)
    reference = [{"setting": one.label} | {key: one.costs[key] for key in keys} | _errors(one) for one in own]
    return {"bar": study.bars[_SURFACE], "reference": reference}


def _errors(point: fronts.Point) -> dict[str, float]:
    return {name: point.errors[name] for name in (_SURFACE, "fibre_length.rms_percent")}


def _study_reference() -> str:
    rows = []
    for one in kept("study")["measured"]["reference"]:
        surface, fibres = number(one[_SURFACE], 2), number(one["fibre_length.rms_percent"], 2)
        rows.append((one["setting"], f"{one['unknowns']:.0f}", f"{surface} mm", f"{fibres} %", number(one[_TIME], 2)))
    return table("study", ("setting", "unknowns", "surface, rms", "fibres, rms", "processor time, s"), rows)


def _fibre_ends(found: dict[str, Any]) -> Any:
    rows = []
    for case, one in found.items():
        facts = {key: value for key, value in one["mesh"].items() if key.startswith("fibre_end")}
        covered = {key[:-16]: value for key, value in one["mesh"].items() if key.endswith("_covered_percent")}
        ends = [each for each in one["measures"] if each["metric"] == "fibre_ends" and each["statistic"] == "max"]
        off = {each["frame"]: each["value"] for each in ends if each["candidate"] == "reference" and each["frame"]}
        rows.append({"case": case, "status": one["status"], "facts": facts, "covered": covered, "off": off})
    return rows


def _fibre_ends_rows() -> str:
    rows = []
    for one in kept("fibre_ends")["measured"]:
        facts, covered = one["facts"], ", ".join(f"{name} {value:.0f}" for name, value in one["covered"].items())
        words = facts.get("fibre_ends_not_attached", "") + facts.get("fibre_ends_continued_by", "")
        named = [f"{end} of {fibre} {float(far):.0f} mm" for end, fibre, far in _FAR.findall(words)]
        far = ("by a tendon: " if "fibre_ends_continued_by" in facts else "") + (", ".join(named) or "none")
        off = [one["status"] if value is None else f"{value:.1f}" for value in one["off"].values()] or [one["status"]]
        rows.append((f"`{one['case']}`", covered, f"{facts['fibre_ends']:.0f}", far, ", ".join(off)))
    beside, off_bone = (
        "ends more than 2 mm from their attachment",
        "greatest distance of an end from its bone, 0.5, 1 rad, mm",
    )
    return table("fibre_ends", ("case", "covered share of attachments, %", "ends", beside, off_bone), rows)


def _fibre_choice(found: dict[str, Any]) -> Any:
    """By case and fibres the mean length at rest, its change and the moment arms, with the error bars of the fibres as shipped."""
    rows = []
    for command, one in found.items():
        case, _, option = command.partition(" ")
        own, bars = _values(one["measures"], "candidate"), _values(one["error_bars"], "of")
        arms = [[own.get(("moment_arm", which, frame)) for which in _ARMS] for frame in (0, _QUARTER)]
        known = [bars.get(key) for key in (_LENGTH, ("moment_arm", "mean", 0), ("moment_arm", "mean", _QUARTER))]
        rows.append({"case": case, "fibres": _CHOICES[case][option != _SHIPPED], "status": one["status"]})
        rows[-1] |= {
            "length": one["mesh"]["fibre_length_mean_mm"],
            "change": own.get(_LENGTH),
            "arms": arms,
            "bars": known,
        }
    return rows


def _values(rows: list[dict[str, Any]], of: str) -> dict[tuple[str, str, int], float]:
    """By metric, statistic and frame the values of the reference's own change."""
    return {
        (one["metric"], one["statistic"], one["frame"]): one["value"]
        for one in rows
        if one[of] in ("reference", "change")
    }


def _fibre_choice_rows() -> str:
    """A row for each case: its fibres as shipped, and others."""
    by_case = dict[str, list[dict[str, Any]]]()
    for one in kept("fibre_choice")["measured"]:
        by_case.setdefault(one["case"], []).append(one)
    rows = []
    for case, ones in by_case.items():
        cells = [[one["fibres"], f"{one['length']:.1f}", *_choice_cells(one)] for one in ones]
        ended = ", ".join(sorted({one["status"] for one in ones} - {"converged"}))
        rows.append(
            (f"`{case}`" + f" ({ended})" * bool(ended), *(" / ".join(pair) for pair in zip(*cells, strict=True)))
        )
    head = ("case", "fibres: shipped / others", "mean length at rest, mm", "its change to 0.5 rad, mm")
    return table("fibre_choice", (*head, "arm at rest, mm", "arm at 0.5 rad, mm"), rows)


def _choice_cells(one: dict[str, Any]) -> Iterator[str]:
    """The change of the mean length, and the mean arms (least to greatest), each ± its error bar."""
    for values, bar in zip(([one["change"]], *one["arms"]), one["bars"], strict=True):
        if None in values:
            yield one["status"]
            continue
        between = f" ({values[1]:.1f} to {values[2]:.1f})" if len(values) > 1 else ""
        yield f"{values[0]:.1f}" + ("" if bar is None else f" ± {number(bar, 2)}") + between


def _fronts(found: dict[str, Any]) -> Any:
    """A study of all solvers, with the errors and costs that are drawn."""
    case = found["cases"][0]
    errors, costs = (_SURFACE, "fibre_length.rms_percent"), (TIME, _TIME, "unknowns", fronts.LOAD)
    points = [
        one | {"errors": _only(one["errors"], errors), "costs": _only(one["costs"], costs)} for one in case["points"]
    ]
    drawn = {"points": points, "claims": [one for one in case["claims"] if one["metric"] == "surface_deviation"]}
    names = (field.name for field in fields(cost_study.CaseStudy))
    return (
        {name: case[name] for name in names} | drawn | {name: _only(case[name], errors) for name in ("units", "bars")}
    )


def _fronts_rows() -> str:
    case = parse(cost_study.CaseStudy, kept("fronts")["measured"], "fronts")
    rows = []
    for solver in fronts.solvers(case.counted):
        price = fronts.price(case.counted, solver, _SURFACE, TIME)
        own = next((one for one in case.counted if one.solver == solver and one.is_default), None)
        if price is None:
            continue
        half = "more time hardly reduces the error"
        if price.factor > 1:
            half = f"{'costs' if price.is_measured else 'would cost'} {number(price.factor, 2)} times the time"
        rows.append((f"`{solver}`", _error_and_time(own), _error_and_time(price.nearest), price.nearest.label, half))
    head = ("solver", "settings of the case", "most accurate", "setting", "half the error")
    return table("fronts", head, rows)


def _error_and_time(point: fronts.Point | None) -> str:
    pair = point.at(_SURFACE, TIME) if point else None
    return f"{number(pair[0], 2)} mm, {number(pair[1], 2)} s" if pair else "no result"


def _only(found: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    return {name: found[name] for name in names if name in found}


def _stress(found: dict[str, Any]) -> Any:
    counts = [
        {"solver": name} | Counter(one["verdict"] for one in found["cells"] if one["solver"] == name)
        for name in found["solvers"]
    ]
    ends = []
    for one in found["cells"]:
        if one["solver"] == "fenicsx" and (said := _ENDS.search(one["sentence"])):
            off = {count: float(share) if share else status for count, share, _, status in _END.findall(said[2])}
            finest = {of for _, _, of, _ in _END.findall(said[2]) if of}
            ends.append({"case": one["case"], "verdict": one["verdict"], "frame": int(said[1])})
            ends[-1] |= {"off": off | dict.fromkeys(finest, "finest")}
    cases = list(dict.fromkeys(one["case"] for one in found["cells"]))
    by_place = {(one["case"], one["solver"]): one["verdict"] for one in found["cells"]}
    verdicts = [[by_place.get((case, solver), "") for solver in found["solvers"]] for case in cases]
    return {"counts": counts, "ends": ends, "cases": cases, "verdicts": verdicts}


def _stress_solvers() -> str:
    rows = [
        (f"`{one['solver']}`", *(one.get(verdict, 0) for verdict in VERDICTS))
        for one in kept("stress")["measured"]["counts"]
    ]
    return table("stress", ("solver", *VERDICTS), rows)


def _hard_programs(found: dict[str, Any]) -> Any:
    kept_keys = ("case", "solver", "verdict", "sentence", "quantity", "unit", "value", "bound")
    return [{key: one.get(key) for key in kept_keys} for one in found["cells"]]


def _hard_programs_rows() -> str:
    """By case the verdict on each program, where one of them takes what acts."""
    cells = kept("stress_programs")["measured"]
    programs = list(dict.fromkeys(one["solver"] for one in cells))
    taken = dict.fromkeys(one["case"] for one in cells if one["verdict"] != "not applicable")
    by_place = {(one["case"], one["solver"]): _hard_verdict(one) for one in cells}
    rows = [(f"`{case}`", *(by_place[case, name] for name in programs)) for case in taken]
    return table("stress_programs", ("case", *(f"`{name}`" for name in programs)), rows)


def _hard_verdict(one: dict[str, Any]) -> str:
    if one["verdict"] == "not applicable":
        return "-"
    if one["verdict"] == "degraded":
        return (
            f"degraded: {one['quantity'].replace('_', ' ')} {one['value']:.2g} {one['unit']}, at most {one['bound']:g}"
        )
    return one["verdict"] if one["verdict"] == "ok" else f"{one['verdict']}: {one['sentence'].split(';')[0]}"


def _hard_programs_left_out() -> str:
    """By reason the cases that programs do not take."""
    found = dict[str, dict[str, list[str]]]()
    for one in kept("stress_programs")["measured"]:
        if one["verdict"] == "not applicable":
            found.setdefault(one["sentence"].partition(", want")[0], {}).setdefault(one["case"], []).append(
                one["solver"]
            )
    rows = []
    for reason, cases in found.items():
        names = dict.fromkeys(name.partition(".")[0] for name in cases)
        programs = dict.fromkeys(name for each in cases.values() for name in each)
        rows.append(
            (reason, len(cases), ", ".join(f"`{name}`" for name in names), ", ".join(f"`{name}`" for name in programs))
        )
    return table("stress_programs", ("reason", "cases", "folders", "programs"), rows)


def _stress_steps() -> str:
    rows = []
    for one in kept("stress")["measured"]["ends"]:
        off = (one["off"].get(count, "") for count in _STEPS)
        cells = (f"{share:.0e} %" if isinstance(share, float) else share for share in off)
        rows.append((f"`{one['case']}`", one["verdict"], one["frame"], *cells))
    return table("stress", ("case", "verdict", "to frame", "1 step", "10 steps", "40 steps"), rows)


def _jitters(found: dict[str, Any]) -> Any:
    """By case, the status on its own mesh, and runs on other meshes; none where a run takes too long."""
    rows = []
    for cell in (cell for one in found.values() for cell in one["cells"]):
        said = _MESHES.search(cell["sentence"])
        rows.append({key: cell[key] for key in ("case", "status")} | {"meshes": said and said.groups()})
    return rows


def _jitters_rows() -> str:
    rows = []
    for one in kept("stress_jitters")["measured"]:
        ended, frames, most, median = one["meshes"] or ("not measured: too long", "", "", "")
        shares = (f"{share} %" if share else "" for share in (most, median))
        rows.append((f"`{one['case'].partition('.')[2]}`", one["status"], ended, frames, *shares))
    head = ("case", "on its own mesh", "on ten other meshes", "up to frame", "greatest distance", "median distance")
    return table("stress_jitters", head, rows)


def _solvers(found: dict[str, Any]) -> Any:
    kept = ("surface_deviation.rms", "fibre_length.rms_percent", "volume.deviation")
    rows = []
    for one in found["results"]:
        worst = {name: one["worst"][name]["value"] for name in kept if one["worst"].get(name)}
        head = {key: one[key] for key in ("kind", "name", "case", "status")}
        counted = {"needs": sum(one["needs"].values()), _TIME: one[_TIME]}
        rows.append(head | counted | {"worst": worst})
    return rows


def _solvers_on_muscles(name: str, head: str) -> str:
    """A table of a time, or of one statistic in the worst frame, by solver and muscle; of the reference its error bars."""
    measured = kept("table_5_1")["measured"]
    cases = list(dict.fromkeys(one["case"] for one in measured))
    rows = []
    for kind, solver in dict.fromkeys((one["kind"], one["name"]) for one in measured):
        found = {one["case"]: one for one in measured if (one["kind"], one["name"]) == (kind, solver)}
        cells = [_cell(found.get(case), name) for case in cases]
        rows.append((kind, f"`{solver}`" + (", error bar" if solver == "reference" and name != _TIME else ""), *cells))
    return table("table_5_1", ("", head, *(f"`{case}`" for case in cases)), rows)


def _cell(one: dict[str, Any] | None, name: str) -> str:
    if one is None:
        return "not recorded"  # frames of the report's own program
    if one["status"] != "converged":
        return one["status"]
    value = one[name] if name in one else one["worst"].get(name)
    return "not applicable" if value is None else number(abs(value) if one["kind"] == "FEM" else value, 2)


def _standings(found: dict[str, Any]) -> Any:
    kept_keys = ("case", "group", "name", "version", "status", "unsound", "seconds_per_frame", "split", "time_limit")
    return [{key: row[key] for key in kept_keys} | {"rms": row["worst"].get(_SURFACE)} for row in found["rows"]]


def _standings_rows(file: str) -> str:
    """By solver its error on each case; in bold where it is no answer."""
    rows = [row for row in kept(file)["measured"] if row["rms"] is not None or _failed(row)]
    cases = list(dict.fromkeys(row["case"] for row in rows))
    found = []
    for group, name in dict.fromkeys((row["group"], row["name"]) for row in rows):
        own = {row["case"]: row for row in rows if row["name"] == name}
        times = [row["seconds_per_frame"] for row in own.values() if row["seconds_per_frame"] and not _failed(row)]
        time = f"{1e3 * median(times):.3g} ms" if times else "-"
        found.append((group, f"`{name}`", *(_standing(own.get(case)) for case in cases), time))
    return table(file, ("kind", "solver", *(f"`{case}`" for case in cases), "time per frame, median"), sorted(found))


def _standing(row: dict[str, Any] | None) -> str:
    if row is None:
        return "-"
    late = f"not within {row['time_limit']:g} s" if row["status"] == "timed out" else row["status"]
    return f"**{row['unsound'].split(':')[0] or late}**" if _failed(row) else f"{row['rms']:.3g}"


def _failed(row: dict[str, Any]) -> bool:
    return bool(row["unsound"]) or row["status"] != "converged"


def _learned_rows() -> str:
    """By solver its mean distance on poses and on shapes that were not learned from."""
    rows = kept("learned")["measured"]
    counts = {row["split"]: f"{row['split']}s not seen in training, {row['muscles']} muscles" for row in rows}
    found = []
    for name in sorted(
        {row["solver"] for row in rows}, key=lambda name: [row["error"] for row in rows if row["solver"] == name]
    ):
        own = {row["split"]: row for row in rows if row["solver"] == name}
        lost = {split: f", {len(row['lost'])} not solved" for split, row in own.items() if row.get("lost")}
        cells = [
            f"{row['error']:.2f} mm, {number(row['seconds'] / row['muscles'], 2)} s{lost.get(split, '')}"
            for split, row in own.items()
        ]
        found.append(("Learned" if own["pose"]["learned"] else "Not learned", f"`{name}`", *cells))
    return table("learned", ("kind", "solver", *counts.values()), found)


def _standings_parts(file: str) -> str:
    """By program with a law of its own, the parts of its error on each case that could be split."""
    rows = [row for row in kept(file)["measured"] if row["split"]]
    names = list(dict.fromkeys(name for row in rows for name in row["split"]))
    found = [
        (f"`{row['name']}`", f"`{row['case']}`", f"{row['rms']:.3g}", *(f"{row['split'][name]:.2g}" for name in names))
        for row in rows
    ]
    return table(file, ("solver", "case", "error", *names), found)


MEASUREMENTS = {
    "verify": Measurement("./fem verify", _verify),
    "bodies": Measurement("./fem verify vastus_stretch indentation_tenth indentation_fifth", _bodies),
    "hip_flexion": Measurement("./fem compare hip_flexion", _comparison),
    "effects": Measurement("./fem effects hip_flexion --set muscle.refinements=0", _omissions),
    "collagen": Measurement(
        "./fem effects CASE --set muscle.refinements=0 --set frames.last=100 --set frames.every=20 "
        """--set candidate=[] --set expect=[] --set 'effect=[{name="neo_hooke",mu="10kPa"},{name="incompressible",bulk="10MPa"},"""
        """{name="contact",stiffness="500kPa/mm",smoothing="0.3mm"},{name="collagen_across",k1="200kPa",k2=1.5}]'""",
        _collagen,
        ("hip_flexion", "adductor_brevis", "gluteus_medius", "gluteus_medius_anatomical", "iliacus_anatomical"),
    ),
    "study": Measurement("./fem study hip_flexion --solver fenicsx", _study),
    "fibre_ends": Measurement(
        "./fem run CASE --set muscle.refinements=0 --set frames.last=100 --set frames.every=50 --set expect=[]",
        _fibre_ends,
        (
            *("hip_flexion", "hip_flexion_tendon", "adductor_brevis", "gluteus_medius", "gluteus_medius_anatomical"),
            *("iliacus", "iliacus_anatomical", "iliacus_in_situ"),
            *("gluteus_maximus", "gluteus_maximus_anatomical", "gluteus_maximus_tract"),
        ),
    ),
    "fibre_choice": Measurement(
        "./fem run CASE --set muscle.refinements=0 --set frames.last=60 --set frames.every=10 --set expect=[]",
        _fibre_choice,
        tuple(f"{case} {option}" for case, (*_, other) in _CHOICES.items() for option in (_SHIPPED, other)),
    ),
    "fronts": Measurement(
        "./fem study hip_flexion --set muscle.refinements=0 --set frames.last=100 --set frames.every=50 --solver fenicsx "
        "--solver xpbd --solver pbd --solver arap --solver arap_pbd --solver mass_spring --solver viper",
        _fronts,
    ),
    "stress": Measurement("./fem stress --steps", _stress),
    "stress_programs": Measurement(
        f"./fem stress {_HARD} " + " ".join(f"--program candidates/{name}" for name in _FAST_PROGRAMS), _hard_programs
    ),
    "stress_jitters": Measurement("./fem stress CASE --solver fenicsx --jitters 10", _jitters, _JITTERED),
    "uncertainty": Measurement("./fem uncertainty hip_flexion", _uncertainty),
    "uncertainty_iliacus": Measurement(
        "./fem uncertainty iliacus_anatomical --set muscle.tet_size=7mm --set frames.last=100", _uncertainty
    ),
    "arms_adduction": Measurement(_TURNED.format("[0,-1,0]"), _arms_about, _TURNING),
    "arms_rotation": Measurement(_TURNED.format("[0,0,1]"), _arms_about, _TURNING),
    "standings": Measurement(
        f"./fem standings {' '.join(_STANDING)} --quick --set frames.last=200 --set frames.every=25 {_LIMITED}",
        _standings,
    ),
    "standings_drawn": Measurement(f"./fem standings {_DRAWN} {_LIMITED}", _standings),
    "learned": Measurement("python examples/data_set/baselines.py my_data learned.json", list),
    "credibility": Measurement("./fem page credibility", _credibility),
    "table_5_1": Measurement(
        "./fem page table-5-1 --case hip_flexion --case gluteus_maximus --case gluteus_medius --case iliacus_anatomical "
        "--case adductor_brevis --quick --set frames.last=100 --set frames.every=50 --error-bar",
        _solvers,
    ),
}
TABLES = {
    "verify_groups": _verify_groups,
    "hip_flexion_worst": _comparison_worst,
    "bodies": _bodies_rows,
    "hip_flexion_reference": _reference,
    "effects_hip_flexion": _omission_rows,
    "collagen": _collagen_rows,
    "study_reference": _study_reference,
    "fronts_solvers": _fronts_rows,
    "fibre_ends": _fibre_ends_rows,
    "fibre_choice": _fibre_choice_rows,
    "stress_solvers": _stress_solvers,
    "stress_steps": _stress_steps,
    "stress_jitters": _jitters_rows,
    "stress_programs_verdicts": _hard_programs_rows,
    "stress_programs_left_out": _hard_programs_left_out,
    "uncertainty_bands": partial(_uncertainty_bands, "uncertainty"),
    "uncertainty_candidates": partial(_uncertainty_candidates, "uncertainty"),
    "uncertainty_iliacus_bands": partial(_uncertainty_bands, "uncertainty_iliacus"),
    "uncertainty_iliacus_candidates": partial(_uncertainty_candidates, "uncertainty_iliacus"),
    "credibility_grades": _credibility_grades,
    "credibility_verified": _credibility_verified,
    "credibility_sources": _credibility_sources,
    "credibility_cubes": _credibility_cubes,
    "credibility_arms": _credibility_arms,
    "arms_adduction": partial(_arms_about_rows, "arms_adduction"),
    "arms_rotation": partial(_arms_about_rows, "arms_rotation"),
    "standings_solvers": partial(_standings_rows, "standings"),
    "standings_parts": partial(_standings_parts, "standings"),
    "standings_drawn_solvers": partial(_standings_rows, "standings_drawn"),
    "standings_drawn_parts": partial(_standings_parts, "standings_drawn"),
    "learned_solvers": _learned_rows,
    "solvers_surface": partial(_solvers_on_muscles, "surface_deviation.rms", "surface, rms, mm"),
    "solvers_fibres": partial(_solvers_on_muscles, "fibre_length.rms_percent", "fibre length, rms, %"),
    "solvers_volume": partial(_solvers_on_muscles, "volume.deviation", "volume, %"),
    "solvers_time": partial(_solvers_on_muscles, _TIME, "processor time, s"),
}
