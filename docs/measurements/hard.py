"""Hard cases."""

import re
from collections import Counter
from typing import Any

from fem_reference.assessment.stress import VERDICTS
from measurements.tables import Measurement, kept, table

# Final states of the reference with other numbers of load steps, as in the sentences of the verb stress.
_ENDS = re.compile(r"end state at frame (\d+) by number of load steps: (.*?)(?:$|;)")
_END = re.compile(r"(\d+): (?:([\d.e+-]+) % of the body's size from the end state with (\d+) load steps|([a-z ]+))")
_STEPS = ("1", "10", "40")
# Runs on other meshes, as in the sentences of the verb stress.
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
_FAST_PROGRAMS = ("mujoco_flex", "pypbd_xpbd")
_HARD = "at_rest bones degenerate fibres hip incompressible moved_away round_edge squeeze_bonded squeeze_sliding start twist"


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
    """For each case that a program accepts, the verdict on each program."""
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
        return f"degraded: `{one['quantity']}` {one['value']:.2g} {one['unit']}, bound {one['bound']:g} {one['unit']}"
    return one["verdict"] if one["verdict"] == "ok" else f"{one['verdict']}: {one['sentence'].split(';')[0]}"


def _hard_programs_left_out() -> str:
    """For each reason, the cases that programs do not accept."""
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
    head = ("reason why cases do not apply", "number of cases", "folders of the cases", "programs")
    return table("stress_programs", head, rows)


def _stress_steps() -> str:
    rows = []
    for one in kept("stress")["measured"]["ends"]:
        # The only completed run has no other to be compared with.
        alone = "" if "finest" in one["off"].values() else "finest"
        off = (one["off"].get(count, alone) for count in _STEPS)
        cells = (f"{share:.0e} %" if isinstance(share, float) else share for share in off)
        rows.append((f"`{one['case']}`", one["verdict"], one["frame"], *cells))
    return table("stress", ("case", "verdict", "final frame", "1 step", "10 steps", "40 steps"), rows)


def _jitters(found: dict[str, Any]) -> Any:
    """For each case, the status on its own mesh and the runs on other meshes; None if a run takes too long."""
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
    head = (
        "case",
        "on its own mesh",
        "on ten other meshes",
        "last frame reached",
        "maximum distance",
        "median distance",
    )
    return table("stress_jitters", head, rows)


MEASUREMENTS = {
    "stress": Measurement("./fem stress --steps", _stress),
    "stress_programs": Measurement(
        f"./fem stress {_HARD} " + " ".join(f"--program candidates/{name}" for name in _FAST_PROGRAMS), _hard_programs
    ),
    "stress_jitters": Measurement("./fem stress CASE --solver fenicsx --jitters 10", _jitters, _JITTERED),
}
TABLES = {
    "stress_solvers": _stress_solvers,
    "stress_steps": _stress_steps,
    "stress_jitters": _jitters_rows,
    "stress_programs_verdicts": _hard_programs_rows,
    "stress_programs_left_out": _hard_programs_left_out,
}
