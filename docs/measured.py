"""Tables of the pages, made from measurements that are kept in ``docs/measured`` with their commit, date and machine.

``python docs/measured.py`` writes each table into its place on the pages; ``python docs/measured.py NAME ...`` measures these anew
before (minutes to an hour each), ``--from FOLDER`` takes what is already measured there. A place is ``<!-- measured: NAME -->``
up to ``<!-- end -->``; ``<!-- written: NAME -->`` is that of a table made from the records that read files.
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
    """Write every table into its place; with ``check`` write nothing. The pages that differ."""
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
    """Keep the measurement ``name``: made now, or taken from the ``folder`` where it was made, at a ``commit``."""
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
    """Measure, and write the JSON of the verb to ``path``; that of several cases by their names, also where one has no solution."""
    if not measurement.command.startswith("./fem "):
        sys.exit(f"first {measurement.command}, and then --from its folder")
    found = {}
    for case in measurement.cases or ("",):
        words = shlex.split(measurement.command.replace("CASE", case))[1:]
        words = [sys.executable, "-m", "fem_reference", *words, "--out", str(path.parent), "--json", str(path)]
        path.unlink(missing_ok=True)  # that of another case
        subprocess.run(words, cwd=ROOT, check=not case)
        found[case] = json.loads(path.read_text(encoding="utf-8"))
    if measurement.cases:
        path.write_text(json.dumps(found), encoding="utf-8")


def _short(text: str) -> str:
    """JSON with each innermost list or record on a line of its own."""
    return re.sub(r"([\[{])\n\s+([^\[\]{}]*?)\n\s+([\]}])", lambda m: m[1] + re.sub(r"\n\s+", " ", m[2]) + m[3], text)


def main() -> int:
    """Measure what is named, and write the tables; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[[], *MEASUREMENTS], metavar="NAME", help=", ".join(MEASUREMENTS))
    parser.add_argument("--from", dest="folder", type=Path, help="where NAME.json is, as the verb's --json wrote it")
    parser.add_argument("--commit", default="HEAD", help="at which it was measured there")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 where a page is stale")
    given = parser.parse_args()
    for name in given.names:
        measure(name, given.folder, given.commit)
    stale = write_pages(check=given.check)
    sys.stdout.writelines(f"{name}\n" for name in stale)
    return 1 if given.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
