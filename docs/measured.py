"""Tables of the pages, from measurements that are stored in ``docs/measured`` with their commit, date and machine.

``python docs/measured.py`` updates all tables on the pages. ``python docs/measured.py NAME ...`` first repeats the measurements
NAME (minutes to an hour each), or with ``--from FOLDER`` reads them from a folder. A table stands between
``<!-- measured: NAME -->`` and ``<!-- end -->``; after ``<!-- written: NAME -->`` it is made from the records that read files.
"""

import argparse
import json
import os
import platform
import re
import shlex
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

import reference_pages
from measurements import KEPT, MEASUREMENTS, TABLES, Measurement

ROOT = Path(__file__).resolve().parent.parent
WRITTEN = TABLES | {
    "cases": reference_pages.cases,
    "effect_parameters": reference_pages.parameters,
    "scene_keys": reference_pages.scenes,
    "file_keys": reference_pages.files,
    "solver_settings": reference_pages.settings,
}
_PLACE = re.compile(r"(<!-- (?:measured|written): (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def write_pages(*, check: bool = False) -> list[str]:
    """Update every table on the pages, or with ``check`` write nothing; the names of the pages that differ."""
    stale = []
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = path.read_text(encoding="utf-8")
        new = _PLACE.sub(lambda place: place[1] + WRITTEN[place[2]]() + place[3], text)
        if new != text:
            stale.append(path.name)
            if not check:
                path.write_text(new, encoding="utf-8")
    return stale


def measure(name: str, folder: Path | None, commit: str) -> None:
    """Store the measurement ``name``, made now or read from a ``folder``, with the ``commit`` at which it was made."""
    measurement = MEASUREMENTS[name]
    with tempfile.TemporaryDirectory() as scratch:
        found = (folder or Path(scratch)) / f"{name}.json"
        if folder is None:
            _make(measurement, found)
        measured = measurement.keep(json.loads(found.read_text(encoding="utf-8")))
        when = datetime.fromtimestamp(found.stat().st_mtime, UTC)
    words = ["git", "log", "-1", "--format=%h", commit]
    known = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, load {os.getloadavg()[2]:.0f}"
    head = {"command": measurement.command, "commit": known.stdout.strip(), "date": f"{when:%Y-%m-%d}"}
    lines = json.dumps(head | {"machine": machine, "measured": measured}, indent=1, allow_nan=False)
    KEPT.mkdir(exist_ok=True)
    (KEPT / f"{name}.json").write_text(_short(lines) + "\n", encoding="utf-8")


def _make(measurement: Measurement, path: Path) -> None:
    """Measure, and write the JSON of the verb to ``path``; for several cases by name, including cases without a solution."""
    if not measurement.command.startswith("./fem "):
        sys.exit(f"run {measurement.command} first, and then give its folder with --from")
    found = {}
    for case in measurement.cases or ("",):
        words = shlex.split(measurement.command.replace("CASE", case))[1:]
        words = [sys.executable, "-m", "fem_reference", *words, "--out", str(path.parent), "--json", str(path)]
        path.unlink(missing_ok=True)  # the JSON of the previous case
        subprocess.run(words, cwd=ROOT, check=not case)
        found[case] = json.loads(path.read_text(encoding="utf-8"))
    if measurement.cases:
        path.write_text(json.dumps(found), encoding="utf-8")


def _short(text: str) -> str:
    """``text`` in JSON with each innermost list or record on one line."""
    return re.sub(r"([\[{])\n\s+([^\[\]{}]*?)\n\s+([\]}])", lambda m: m[1] + re.sub(r"\n\s+", " ", m[2]) + m[3], text)


def main() -> int:
    """Repeat the named measurements and update the tables; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[[], *MEASUREMENTS], metavar="NAME", help=", ".join(MEASUREMENTS))
    parser.add_argument("--from", dest="folder", type=Path, help="folder with NAME.json, written by a verb's --json")
    parser.add_argument("--commit", default="HEAD", help="commit at which NAME.json was measured")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a page is stale")
    given = parser.parse_args()
    for name in given.names:
        measure(name, given.folder, given.commit)
    stale = write_pages(check=given.check)
    sys.stdout.writelines(f"{name}\n" for name in stale)
    return 1 if given.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
