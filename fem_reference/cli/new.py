"""The verb ``new``: a scene to start from."""

import argparse
import os
import shlex
from pathlib import Path

from fem_reference.cli import DONE, write_output
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.units import LENGTH_UNITS
from fem_reference.studies import new_scene

HELP = "write a scene to start from: a copy of a case, or a scene of your own muscle and bones"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options; the verb writes nothing into ``--out``."""
    parser.set_defaults(writes=False)
    parser.add_argument("name", metavar="NAME", type=Path, help="the folder to create; its name is the scene's name")
    parser.add_argument("--from", dest="case", metavar="CASE", help="the case to copy (default: hip_flexion)")
    muscle = "closed triangle surface of a muscle (STL, PLY, OBJ, VTP, ...)"
    parser.add_argument("--muscle", type=Path, metavar="FILE", help=muscle)
    bones = "triangle surface of a bone, named after the file; give --bone at least twice"
    parser.add_argument("--bone", type=Path, action="append", default=[], metavar="FILE", help=bones)
    unit = f"unit of length of these files: {', '.join(LENGTH_UNITS)} (default: guessed from the sizes of all files, and printed)"
    parser.add_argument("--unit", metavar="UNIT", help=unit)


def run(options: argparse.Namespace) -> int:
    """Write the scene, and print the commands that follow."""
    if options.muscle is None and options.bone:
        raise InputError("--bone", "a bone without --muscle", "the muscle too")
    if options.muscle is None and options.unit is not None:
        raise InputError("--unit", f'"{options.unit}" without --muscle', "files with this unit")
    if options.muscle is not None and options.case is not None:
        raise InputError("--from", f'"{options.case}" with --muscle', "only one of the two")
    folder, unit, said = options.name, {}, ""
    if options.muscle is None:
        new_scene.copied(options.case or "hip_flexion", folder)
    else:
        found = new_scene.of_surfaces(folder, options.muscle, options.bone, options.unit)
        unit = {"unit": found.name} | ({"unit_guessed": found.why} if found.why else {})
        said = f"lengths are in {found.name} (guessed: {found.why}); --unit sets the unit\n" if found.why else ""
    place = shlex.quote(str(folder if len(folder.parts) > 1 else f"./{folder}"))
    call = os.environ.get("FEM_REFERENCE_COMMAND", "fem-reference")  # the name by which the command was called
    text = f"{said}{folder / 'case.toml'}: edit it, then\n  {call} validate {place}\n  {call} run {place}"
    write_output({"folder": str(folder), "scene": str(folder / "case.toml"), **unit}, text, options)
    return DONE
