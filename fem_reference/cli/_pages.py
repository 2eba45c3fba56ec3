"""Pages of the command line: the parts of a command that determine them, and where they are written."""

import argparse
from collections.abc import Iterable
from pathlib import Path

from fem_reference.cli._printing import out
from fem_reference.report.asked import Asked, Part
from fem_reference.report.asked import written as written_as
from fem_reference.report.pages import Page
from fem_reference.scenes.case import HOME, Candidate, Case


def case_part(case: Case) -> Part:
    """The case of a page: by its name where it is a shipped one, else by its folder."""
    return Part((case.name if case.folder.parent == HOME / "cases" else str(case.folder),))


def changes(options: argparse.Namespace) -> tuple[Part, ...]:
    """The changes of a case by ``--set`` and ``--negative-control``."""
    control = (Part(("--negative-control",), "negative_control"),) if options.negative_control is True else ()
    return (*(Part(("--set", text), text) for text in getattr(options, "set", ())), *control)


def candidates(case: Case, chosen: Iterable[Candidate]) -> tuple[Part, ...]:
    """The candidates of a page; nothing where they are the case's own."""
    found = tuple(chosen)
    if found == case.candidate:
        return ()
    folders = [
        one.settings["folder"] if one.solver == "recorded" and one not in case.candidate else "" for one in found
    ]
    return tuple(
        Part(("--candidate", folder or one.name), one.name) for one, folder in zip(found, folders, strict=True)
    )


def written(options: argparse.Namespace, asked: Asked, page: Page) -> tuple[Path, list[str]]:
    """Write a page into ``--out``, by the name of ``--name`` where that is given; its path and what is printed."""
    return written_as(asked, page, out(options), options.page_name)
