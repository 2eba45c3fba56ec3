"""Tables of the pages, made from measurements that are kept in ``docs/measured`` with their commit, date and machine.

``python docs/measured.py`` writes each table into its place on the pages; ``python docs/measured.py NAME ...`` measures these anew
before (minutes to an hour each), ``--from FOLDER`` takes what is already measured there. A place is ``<!-- measured: NAME -->``
up to ``<!-- end -->``.
"""

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
KEPT = Path(__file__).with_suffix("")
_PLACE = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


class Measurement(NamedTuple):
    """A verb's ``words``; ``keep`` picks from its JSON what tables need."""

    words: str
    keep: Callable[[Any], Any]


def write_pages(*, check: bool = False) -> list[str]:
    """Write every table into its place; with ``check`` write nothing. The pages that differ."""
    stale = []
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = path.read_text(encoding="utf-8")
        new = _PLACE.sub(lambda place: place[1] + TABLES[place[2]]() + place[3], text)
        if new != text:
            stale.append(path.name)
            if not check:
                path.write_text(new, encoding="utf-8")
    return stale


def measure(name: str, folder: Path | None) -> None:
    """Keep the measurement ``name``: made now, or taken from the ``folder`` where it was made."""
    measurement = MEASUREMENTS[name]
    with tempfile.TemporaryDirectory() as scratch:
        found = (folder or Path(scratch)) / f"{name}.json"
        if folder is None:
            words = [*measurement.words.split(), "--out", scratch, "--json", str(found)]
            subprocess.run([sys.executable, "-m", "fem_reference", *words], cwd=ROOT, check=True)
        measured = measurement.keep(json.loads(found.read_text(encoding="utf-8")))
        when = datetime.fromtimestamp(found.stat().st_mtime, UTC)
    commit = subprocess.run(["git", "log", "-1", "--format=%h"], cwd=ROOT, capture_output=True, text=True, check=True)
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    head = {"command": f"./fem {measurement.words}", "commit": commit.stdout.strip(), "date": f"{when:%Y-%m-%d}"}
    lines = json.dumps(head | {"machine": machine, "measured": measured}, indent=1, allow_nan=False)
    KEPT.mkdir(exist_ok=True)
    (KEPT / f"{name}.json").write_text(_short(lines) + "\n", encoding="utf-8")


def kept(name: str) -> dict[str, Any]:
    """A kept measurement."""
    return json.loads((KEPT / f"{name}.json").read_text(encoding="utf-8"))


def table(name: str, head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown, and below it where its numbers come from."""
    lines = [list(head), ["---"] * len(list(head)), *([str(cell) for cell in row] for row in rows)]
    file = kept(name)
    origin = f"`{file['command']}`, {file['date']}, commit `{file['commit']}`, {file['machine']}"
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + f"\n\n<small>{origin}</small>\n"


def number(value: float | None, digits: int = 3) -> str:
    """A number as people read it."""
    return "not known" if value is None else f"{value:.{digits}g}"


def _short(text: str) -> str:
    """JSON with each innermost list or record on a line of its own."""
    return re.sub(r"([\[{])\n\s+([^\[\]{}]*?)\n\s+([\]}])", lambda m: m[1] + re.sub(r"\n\s+", " ", m[2]) + m[3], text)


def _verify(found: dict[str, Any]) -> Any:
    keys = ("group", "name", "kind", "verdict", "value", "truth", "error", "within", "unit")
    return [{key: one[key] for key in keys} for one in found["entries"]]


def _verify_groups() -> str:
    groups = dict[str, list[dict[str, Any]]]()
    for one in kept("verify")["measured"]:
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
    return table("effects", ("left out", "surface, rms", "fibre length, rms", "volume", "time", ""), rows)


MEASUREMENTS = {
    "verify": Measurement("verify", _verify),
    "hip_flexion": Measurement("compare hip_flexion", _comparison),
    "effects": Measurement("effects hip_flexion --set muscle.refinements=0", _omissions),
}
TABLES = {
    "verify_groups": _verify_groups,
    "hip_flexion_worst": _comparison_worst,
    "hip_flexion_reference": _reference,
    "effects_hip_flexion": _omission_rows,
}


def main() -> int:
    """Measure what is named, and write the tables; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[[], *MEASUREMENTS], metavar="NAME", help=", ".join(MEASUREMENTS))
    parser.add_argument("--from", dest="folder", type=Path, help="where NAME.json is, as the verb's --json wrote it")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 where a page is stale")
    given = parser.parse_args()
    for name in given.names:
        measure(name, given.folder)
    stale = write_pages(check=given.check)
    sys.stdout.writelines(f"{name}\n" for name in stale)
    return 1 if given.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
