"""The Geomview OFF format, with numpy alone."""

import re
from pathlib import Path

from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup, only_triangles, positions


def _read(path: Path) -> Soup:
    """The positions and faces in an OFF file in text form; colours are skipped."""
    text = re.sub(r"#[^\n]*", "", path.read_text(encoding="utf-8"))
    parts = re.match(r"\s*C?N?OFF\s+(\d+)\s+(\d+)\s+\d+\s+(.*)", text, re.DOTALL)
    if parts is None:
        raise ValueError("no OFF header")
    vertices, faces = int(parts[1]), int(parts[2])
    rows = [line.split() for line in parts[3].splitlines() if line.strip()]
    if len(rows) != vertices + faces:
        raise ValueError(f"{len(rows)} rows for {vertices} vertices and {faces} faces")
    only_triangles({size for row in rows[vertices:] for size in (int(row[0]), len(row[1:4]))})
    points = positions([[float(value) for value in row[:3]] for row in rows[:vertices]])
    return points, [[int(value) for value in row[1:4]] for row in rows[vertices:]]


FORMAT = Format((".off",), _read)
