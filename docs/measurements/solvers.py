"""Solvers on several cases: Table 5.1, standings, and learned solvers."""

from functools import partial
from statistics import median
from typing import Any

from measurements.tables import PROCESSOR, SURFACE, Measurement, kept, number, table

_PROGRAMS = ("newton_vbd", "mujoco_flex", "pbat_vbd", "pbat_xpbd", "pypbd_xpbd", "drake_fem")
_STANDING = ("hip_flexion_tendon", "hip_flexion", "box_squeeze", "adductor_brevis", "gluteus_medius")
_DRAWN = " ".join(f"my_data/scenes/muscle_{number}" for number in ("0001", "0004", "0005"))
_LIMITED = "--time-limit '120 s' " + " ".join(f"--program candidates/{name}" for name in _PROGRAMS)


def _solvers(found: dict[str, Any]) -> Any:
    kept = ("surface_deviation.rms", "fibre_length.rms_percent", "volume.deviation")
    rows = []
    for one in found["results"]:
        worst = {name: one["worst"][name]["value"] for name in kept if one["worst"].get(name)}
        head = {key: one[key] for key in ("kind", "name", "case", "status")}
        counted = {"needs": sum(one["needs"].values()), PROCESSOR: one[PROCESSOR]}
        rows.append(head | counted | {"worst": worst})
    return rows


def _solvers_on_muscles(name: str) -> str:
    """A table by solver and muscle of a time, or of one statistic in the worst frame; for the reference, its error bars."""
    measured = kept("table_5_1")["measured"]
    cases = list(dict.fromkeys(one["case"] for one in measured))
    rows = []
    for kind, solver in dict.fromkeys((one["kind"], one["name"]) for one in measured):
        found = {one["case"]: one for one in measured if (one["kind"], one["name"]) == (kind, solver)}
        cells = [_cell(found.get(case), name) for case in cases]
        rows.append(
            (kind, f"`{solver}`" + (", error bar" if solver == "reference" and name != PROCESSOR else ""), *cells)
        )
    return table("table_5_1", ("kind", "solver", *(f"`{case}`" for case in cases)), rows)


def _cell(one: dict[str, Any] | None, name: str) -> str:
    if one is None:
        return "not recorded"  # frames of the report's own program
    if one["status"] != "converged":
        return one["status"]
    value = one[name] if name in one else one["worst"].get(name)
    return "not applicable" if value is None else number(abs(value) if one["kind"] == "FEM" else value, 2)


def _standings(found: dict[str, Any]) -> Any:
    kept_keys = ("case", "group", "name", "version", "status", "unsound", "seconds_per_frame", "split", "time_limit")
    return [{key: row[key] for key in kept_keys} | {"rms": row["worst"].get(SURFACE)} for row in found["rows"]]


def _standings_rows(file: str) -> str:
    """The error of each solver on each case; in bold the reason if there is no answer."""
    rows = [row for row in kept(file)["measured"] if row["rms"] is not None or _failed(row)]
    cases = list(dict.fromkeys(row["case"] for row in rows))
    found = []
    for group, name in dict.fromkeys((row["group"], row["name"]) for row in rows):
        own = {row["case"]: row for row in rows if row["name"] == name}
        times = [row["seconds_per_frame"] for row in own.values() if row["seconds_per_frame"] and not _failed(row)]
        time = f"{1e3 * median(times):.3g} ms" if times else "-"
        found.append((group, f"`{name}`", *(_standing(own.get(case)) for case in cases), time))
    head = ("kind of method", "solver", *(f"`{case}`, mm" for case in cases), "median time per frame")
    return table(file, head, sorted(found))


def _standing(row: dict[str, Any] | None) -> str:
    if row is None:
        return "-"
    late = f"not within {row['time_limit']:g} s" if row["status"] == "timed out" else row["status"]
    return f"**{row['unsound'].split(':')[0] or late}**" if _failed(row) else f"{row['rms']:.3g}"


def _failed(row: dict[str, Any]) -> bool:
    return bool(row["unsound"]) or row["status"] != "converged"


def _learned_rows() -> str:
    """The mean error of each solver on poses and on shapes that were not used in training."""
    rows = kept("learned")["measured"]
    counts = {
        row["split"]: f"new {row['split']}s, {row['muscles']} muscles: mean error, processor time per muscle"
        for row in rows
    }
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
    return table("learned", ("kind of solver", "solver", *counts.values()), found)


_PART_NAMES = {"left out": "omitted effects"}


def _standings_parts(file: str) -> str:
    """For each program that states its law, the parts of its error on each case where it could be split."""
    rows = [row for row in kept(file)["measured"] if row["split"]]
    names = list(dict.fromkeys(name for row in rows for name in row["split"]))
    found = [
        (f"`{row['name']}`", f"`{row['case']}`", f"{row['rms']:.3g}", *(f"{row['split'][name]:.2g}" for name in names))
        for row in rows
    ]
    parts = (f"{_PART_NAMES.get(name, name)}, mm" for name in names)
    return table(file, ("solver", "case", "total error, mm", *parts), found)


MEASUREMENTS = {
    "standings": Measurement(
        f"./fem standings {' '.join(_STANDING)} --quick --set frames.last=200 --set frames.every=25 {_LIMITED}",
        _standings,
    ),
    "standings_drawn": Measurement(f"./fem standings {_DRAWN} {_LIMITED}", _standings),
    "learned": Measurement("python examples/data_set/baselines.py my_data learned.json", list),
    "table_5_1": Measurement(
        "./fem page table-5-1 --case hip_flexion --case gluteus_maximus --case gluteus_medius --case iliacus_anatomical "
        "--case adductor_brevis --quick --set frames.last=100 --set frames.every=50 --error-bar",
        _solvers,
    ),
}
TABLES = {
    "standings_solvers": partial(_standings_rows, "standings"),
    "standings_parts": partial(_standings_parts, "standings"),
    "standings_drawn_solvers": partial(_standings_rows, "standings_drawn"),
    "standings_drawn_parts": partial(_standings_parts, "standings_drawn"),
    "learned_solvers": _learned_rows,
    "solvers_surface": partial(_solvers_on_muscles, "surface_deviation.rms"),
    "solvers_fibres": partial(_solvers_on_muscles, "fibre_length.rms_percent"),
    "solvers_volume": partial(_solvers_on_muscles, "volume.deviation"),
    "solvers_time": partial(_solvers_on_muscles, PROCESSOR),
}
