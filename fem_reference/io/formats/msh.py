"""The MSH format of gmsh, read with meshio."""

import io
import re
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup, of_meshio

# The declared number of nodes or elements after the name of a section, as text or as up to four binary numbers.
_DECLARED = re.compile(rb"\$(Nodes|Elements)\r?\n([\d \t]+(?=[\r\n])|.{32}|.{4})", re.DOTALL)
# The number of reads beyond the end of a file that meshio needs in order to detect the end.
_PAST_END = 2


class _Ending(io.BufferedReader):
    """A file that limits reads beyond its end: meshio loops up to the declared numbers, whatever the file contains."""

    past = 0

    def readline(self, size: int | None = -1, /) -> bytes:
        """The next line. Raises ValueError after repeated reads beyond the end."""
        line = super().readline(size)
        self.past += not line
        if self.past > _PAST_END:
            raise ValueError("a section that extends beyond the end of the file")
        return line


def _read(path: Path) -> Soup:
    """The triangles of a mesh; vertex and line cells are skipped."""
    mesh = read_mesh(path)
    return of_meshio(mesh.points, mesh.cells)


def read_mesh(path: Path) -> Any:
    """The mesh in a file as a ``meshio.Mesh``."""
    from meshio.gmsh.main import read_buffer

    _check_declared(path.read_bytes())
    with redirect_stderr(io.StringIO()), _Ending(io.FileIO(path)) as file:  # meshio prints what it skips
        return read_buffer(file)


def _check_declared(data: bytes) -> None:
    """Raise ValueError if a section declares more nodes or elements, or more blocks of these, than the file has bytes."""
    header = data[:60].split()
    binary, old = header[2:3] == [b"1"], header[1:2] == [b"2.2"]
    for name, first in _DECLARED.findall(data):
        if binary and not old:
            numbers = [int.from_bytes(first[i : i + 8], "little") for i in (0, 8)]
        else:  # in old files this number is text, even if all other numbers are binary
            numbers = [int(word[:20]) for word in first.split()[: 1 if old else 2] if word.isdigit()]
        if max(numbers, default=0) > len(data):
            raise ValueError(f"more {name.decode()} than the file has bytes")


FORMAT = Format((".msh",), _read)
