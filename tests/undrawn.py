"""Pages without pictures: code for a subprocess, and a function for this process."""

from fem_reference.report import gallery

_NOBODY = ["/nowhere/python"]
UNDRAWN = f"from fem_reference.report import gallery\ngallery.program = lambda _job, _folder: {_NOBODY}\n"


def undraw() -> None:
    """Let this process write pages as where nothing can draw."""
    gallery.program = lambda _job, _folder: _NOBODY
