"""Ends of fibres, and the results of cases with other fibres."""

import re
from collections.abc import Iterator
from typing import Any

from measurements.tables import Measurement, kept, number, table

# Ends of fibres by name, each with its distance from its attachment, as in the facts of a mesh.
_FAR = re.compile(r"(first|last) end of fibre (\d+), [^:]*: ([\d.]+) mm")
_ARMS = ("mean", "least", "greatest")
_QUARTER = 50  # the frame at 0.5 rad


def _traced(count: int, flux: str = "") -> str:
    """The setting of ``count`` traced fibres."""
    return f"""--set 'fibres.traced={{count={count},start="origin",end="insertion"{flux}}}'"""


_POTENTIAL, _LENGTH = _traced(20), ("fibre_length", "mean", _QUARTER)
_NO_TENDON = (
    """--set fibres.complete=false --set 'attachment[2]={name="insertion",bone="femur",stiffness="100kPa/mm",outline={"""
    """file="data:hip/landmarks.csv",unit="mm",clouds=["LC_SET_Ins_1_R_M081_Glut_Max"],reach="5mm"}}'"""
)
_SHIPPED = "--error-bar"  # the option of runs with the shipped fibres only
# For each case, its shipped fibres, other fibres, and the setting of the latter.
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
        named = [f"{end} point of fibre {fibre}: {float(far):.0f} mm" for end, fibre, far in _FAR.findall(words)]
        far = ("with a tendon: " if "fibre_ends_continued_by" in facts else "") + (", ".join(named) or "none")
        off = [one["status"] if value is None else f"{value:.1f}" for value in one["off"].values()] or [one["status"]]
        rows.append((f"`{one['case']}`", covered, f"{facts['fibre_ends']:.0f}", far, ", ".join(off)))
    beside, off_bone = (
        "ends more than 2 mm from their attachment",
        "maximum lag of an end behind its bone at 0.5, 1 rad, mm",
    )
    return table("fibre_ends", ("case", "covered area of attachments, %", "number of ends", beside, off_bone), rows)


def _fibre_choice(found: dict[str, Any]) -> Any:
    """For each case and its fibres, the mean length at rest, its change and the moment arms; error bars of the shipped fibres."""
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
    """The values of the reference's own change, by metric, statistic and frame."""
    return {
        (one["metric"], one["statistic"], one["frame"]): one["value"]
        for one in rows
        if one[of] in ("reference", "change")
    }


def _fibre_choice_rows() -> str:
    """A row for each case: its shipped fibres and other fibres."""
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
    head = ("case", "fibres: shipped / other", "mean length at rest, mm", "change of mean length at 0.5 rad, mm")
    return table("fibre_choice", (*head, "moment arm at rest, mm", "moment arm at 0.5 rad, mm"), rows)


def _choice_cells(one: dict[str, Any]) -> Iterator[str]:
    """The change of the mean length, and the mean arms (least to greatest), each ± its error bar."""
    for values, bar in zip(([one["change"]], *one["arms"]), one["bars"], strict=True):
        if None in values:
            yield one["status"]
            continue
        between = f" ({values[1]:.1f} to {values[2]:.1f})" if len(values) > 1 else ""
        yield f"{values[0]:.1f}" + ("" if bar is None else f" ± {number(bar, 2)}") + between


MEASUREMENTS = {
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
}
TABLES = {
    "fibre_ends": _fibre_ends_rows,
    "fibre_choice": _fibre_choice_rows,
}
