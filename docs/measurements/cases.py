"""Measurements of cases: comparison with candidates, omitted effects, uncertain parameters, and error against time."""

from dataclasses import fields
from functools import partial
from typing import Any

from fem_reference.assessment import cost_study, fronts
from fem_reference.assessment.recommendation import TIME
from fem_reference.foundations.records import parse
from measurements.tables import PROCESSOR, SURFACE, Measurement, kept, number, only, table


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
        ("surface_deviation", "rms"): "surface error, rms",
        ("fibre_length", "max"): "maximum error of a fibre's length",
        ("volume", "deviation"): "volume error",
        ("penetration", "deepest"): "maximum penetration",
    }
    rows = []
    for name, cost in measured["cost"].items():
        found = {(one["metric"], one["statistic"]): one for one in measured["worst"] if one["candidate"] == name}
        if name != "reference":
            cells = (f"{number(found[key]['value'])} {found[key]['unit']}" if key in found else "" for key in columns)
            rows.append((f"`{name}`", *cells, f"{number(cost['seconds_processor'], 2)} s"))
    return table("hip_flexion", ("candidate", *columns.values(), "processor time"), rows)


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


# Words for the headings of tables, for parameters and quantities whose own titles are too terse for readers of the page.
_PARAMETERS = {
    "fibres turned angle": "the fibre angle",
    "attachment origin outline shift by": "the position of the origin",
    "attachment insertion outline shift by": "the position of the insertion",
    "attachment origin stiffness": "the stiffness of the origin",
    "attachment insertion stiffness": "the stiffness of the insertion",
}
_QUANTITIES = {
    "surface_deviation.rms": "Distance of the surface from the nominal result, rms",
    "force on femur": "Force of the muscle on the femur",
}


def _uncertainty_bands(file: str) -> str:
    measured = kept(file)["measured"]
    keys, titles = zip(*((one["key"], one["title"]) for one in measured["parameters"]), strict=True)
    words = (_PARAMETERS.get(title, "`{1}` of `{0}`".format(*title.split())) for title in titles)
    rows = []
    for one in measured["bands"]:
        sizes = (f"{number(one[name])} {one['unit']}" if one[name] else "none" for name in ("width", "bar"))
        shares = (
            f"{100 * one['first'][key]:.0f} / {100 * one['total'][key]:.0f} %" if one["first"] else "" for key in keys
        )
        title = _QUANTITIES.get(one["quantity"], one["title"])
        rows.append((title, *sizes, f"{100 * (one['error'] or 0):.2g} %", *shares))
    head = ("quantity", "maximum width of the band", "maximum error bar", "variance missed by the surrogate")
    return table(file, (*head, *(f"variance due to {one}: alone / with interactions" for one in words)), rows)


def _uncertainty_candidates(file: str) -> str:
    measured = kept(file)["measured"]
    bands = [one for one in measured["bands"] if not one["refused"]]
    rows = dict[str, dict[str, str]]()
    for one in measured["placed"]:
        beyond = f" by {number(one['worst'], 2)}" if one["worst"] and one["word"] != "no answer" else ""
        rows.setdefault(one["candidate"], {})[one["quantity"]] = one["word"] + beyond
    head = ("candidate", *(f"{_QUANTITIES.get(one['quantity'], one['title'])}, {one['unit']}" for one in bands))
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
    "surface_deviation.max": "surface, maximum",
    "fibre_length.rms_percent": "fibre length, rms",
    "volume.deviation": "volume",
}


def _collagen(found: dict[str, Any]) -> Any:
    kept = {}
    for case, one in found.items():
        (left,) = (each for each in one["ablations"][0]["omissions"] if each["left_out"] == ["collagen_across"])
        kept[case] = {"changes": only(left["changes"], _MOVED), "bars": only(one["bars"], _MOVED)}
    return kept


def _collagen_rows() -> str:
    """For each case, the change of each statistic ± its error bar; KeyError if one is missing."""
    rows = []
    for case, one in kept("collagen")["measured"].items():
        found = ((one["changes"][key], one["bars"][key]) for key in _MOVED)
        cells = (
            f"{number(change, 2)} ± {number(bar, 2)} {unit}"
            for (change, bar), unit in zip(found, ("mm", "mm", "%", "%"), strict=True)
        )
        rows.append((f"`{case}`", *cells))
    return table("collagen", ("case: change ± error bar", *_MOVED.values()), rows)


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
    return table(
        "effects", ("omitted", "surface, rms", "fibre length, rms", "volume", "time without it", "result"), rows
    )


def _study(found: dict[str, Any]) -> Any:
    study = parse(cost_study.CaseStudy, found["cases"][0], "study")
    own = [one for one in study.points if one.name == "reference" and not one.is_truth and one.status == "converged"]
    keys = ("unknowns", PROCESSOR)
    reference = [{"setting": one.label} | {key: one.costs[key] for key in keys} | _errors(one) for one in own]
    return {"bar": study.bars[SURFACE], "reference": reference}


def _errors(point: fronts.Point) -> dict[str, float]:
    return {name: point.errors[name] for name in (SURFACE, "fibre_length.rms_percent")}


def _study_reference() -> str:
    rows = []
    for one in kept("study")["measured"]["reference"]:
        surface, fibres = number(one[SURFACE], 2), number(one["fibre_length.rms_percent"], 2)
        setting = one["setting"].replace("volume by a penalty", "with `incompressible_penalty`")
        rows.append((setting, f"{one['unknowns']:.0f}", f"{surface} mm", f"{fibres} %", number(one[PROCESSOR], 2)))
    errors = ("surface error, rms", "error of fibre lengths, rms")
    return table("study", ("changed setting", "unknowns", *errors, "processor time, s"), rows)


def _fronts(found: dict[str, Any]) -> Any:
    """A study of all solvers, with the errors and costs that are drawn."""
    case = found["cases"][0]
    errors, costs = (SURFACE, "fibre_length.rms_percent"), (TIME, PROCESSOR, "unknowns", fronts.LOAD)
    points = [
        one | {"errors": only(one["errors"], errors), "costs": only(one["costs"], costs)} for one in case["points"]
    ]
    drawn = {"points": points, "claims": [one for one in case["claims"] if one["metric"] == "surface_deviation"]}
    names = (field.name for field in fields(cost_study.CaseStudy))
    return {name: case[name] for name in names} | drawn | {name: only(case[name], errors) for name in ("units", "bars")}


def _fronts_rows() -> str:
    case = parse(cost_study.CaseStudy, kept("fronts")["measured"], "fronts")
    rows = []
    for solver in fronts.solvers(case.counted):
        price = fronts.price(case.counted, solver, SURFACE, TIME)
        own = next((one for one in case.counted if one.solver == solver and one.is_default), None)
        if price is None:
            continue
        half = "more time hardly reduces the error"
        if price.factor > 1:
            half = f"{number(price.factor, 2)} times as long{'' if price.is_measured else ' (extrapolated)'}"
        rows.append((f"`{solver}`", _error_and_time(own), _error_and_time(price.nearest), _set(price.nearest), half))
    times = ("error and time with the settings of the case", "smallest error, and its time")
    return table("fronts", ("solver", *times, "setting of the smallest error", "time if the error is halved"), rows)


def _set(point: fronts.Point) -> str:
    return "settings of the case" if point.is_default else point.label.replace(" times", " times those of the case")


def _error_and_time(point: fronts.Point | None) -> str:
    pair = point.at(SURFACE, TIME) if point else None
    return f"{number(pair[0], 2)} mm, {number(pair[1], 2)} s" if pair else "no result"


MEASUREMENTS = {
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
    "fronts": Measurement(
        "./fem study hip_flexion --set muscle.refinements=0 --set frames.last=100 --set frames.every=50 --solver fenicsx "
        "--solver xpbd --solver pbd --solver arap --solver arap_pbd --solver mass_spring --solver viper",
        _fronts,
    ),
    "uncertainty": Measurement("./fem uncertainty hip_flexion", _uncertainty),
    "uncertainty_iliacus": Measurement(
        "./fem uncertainty iliacus_anatomical --set muscle.tet_size=7mm --set frames.last=100", _uncertainty
    ),
}
TABLES = {
    "hip_flexion_worst": _comparison_worst,
    "hip_flexion_reference": _reference,
    "effects_hip_flexion": _omission_rows,
    "collagen": _collagen_rows,
    "study_reference": _study_reference,
    "fronts_solvers": _fronts_rows,
    "uncertainty_bands": partial(_uncertainty_bands, "uncertainty"),
    "uncertainty_candidates": partial(_uncertainty_candidates, "uncertainty"),
    "uncertainty_iliacus_bands": partial(_uncertainty_bands, "uncertainty_iliacus"),
    "uncertainty_iliacus_candidates": partial(_uncertainty_candidates, "uncertainty_iliacus"),
}
