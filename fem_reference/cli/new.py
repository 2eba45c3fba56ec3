"""The verb ``new``: a scene to begin with."""

import argparse
import os
from pathlib import Path

from fem_reference.cli._printing import DONE, write_output
from fem_reference.foundations.errors import InputError
from fem_reference.studies import new_scene

HELP = "write a scene to begin with: a copy of a case, or one of your own muscle and bones"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options that this verb has; it writes nothing into ``--out``."""
    parser.set_defaults(writes=False)
    parser.add_argument("name", metavar="NAME", type=Path, help="the folder that is made; its name is the scene's name")
    parser.add_argument("--from", dest="case", metavar="CASE", help="a case that is copied (default: hip_flexion)")
    parser.add_argument(
        "--muscle", type=Path, metavar="FILE", help="triangles of a muscle, closed (STL, PLY, OBJ, VTP, ...)"
    )
    bones = "triangles of a bone, whose name is that of the file; at least two, each with its --bone"
    parser.add_argument("--bone", type=Path, action="append", default=[], metavar="FILE", help=bones)
    unit = "unit of length of these files (default: by the size of the muscle)"
    parser.add_argument("--unit", choices=sorted(new_scene.UNITS), help=unit)


def run(options: argparse.Namespace) -> int:
    """Write the scene, and say how to go on."""
    if options.muscle is None and options.bone:
        raise InputError("--bone", "a bone without --muscle", "the muscle too")
    if options.muscle is not None and options.case is not None:
        raise InputError("--from", f'"{options.case}" beside --muscle', "one of the two")
    if options.muscle is None:
        folder = new_scene.copied(options.case or "hip_flexion", options.name)
    else:
        folder = new_scene.of_surfaces(options.name, options.muscle, options.bone, options.unit)
    place = folder if len(folder.parts) > 1 else f"./{folder}"
    call = os.environ.get("FEM_REFERENCE_COMMAND", "fem-reference")  # as it was called
    text = f"{folder / 'case.toml'}: edit it, then\n  {call} validate {place}\n  {call} run {place}"
    write_output({"folder": str(folder), "scene": str(folder / "case.toml")}, text, options)
    return DONE
