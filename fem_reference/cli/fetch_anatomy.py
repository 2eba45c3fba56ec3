"""The verb ``fetch-anatomy``: the anatomy that some cases need, from downloaded files."""

import argparse
import shlex
from collections import Counter
from pathlib import Path

from fem_reference.cli import DONE, write_output
from fem_reference.scenes.case import DATA_SETTING
from fem_reference.studies import fetching

HELP = "write the anatomy that some cases need into a folder, from downloaded folders or archives; downloads nothing"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the downloads and the folder; the verb writes nothing into ``--out``."""
    about = "a folder or an archive (zip, tar) that you have downloaded; several are searched together"
    parser.add_argument("sources", nargs="+", metavar="FOLDER_OR_ARCHIVE", type=Path, help=about)
    parser.add_argument("--to", type=Path, required=True, metavar="DIR", help="a new or empty folder")
    parser.set_defaults(writes=False)


def run(options: argparse.Namespace) -> int:
    """Write the known files, and print the missing files, the cases that can be solved and the licence."""
    wanted = fetching.known()
    found = fetching.fetch(options.sources, options.to, wanted)
    kept, made = (sorted({*files} - {*found}) for files in (wanted.published, wanted.made))
    parts = ", ".join(
        f"{many} in {folder}" for folder, many in Counter(str(Path(name).parent) for name in made).items()
    )
    cases, count = fetching.cases_with(found), len(wanted.published) + len(wanted.made)
    lines = [f"{options.to}: {len(found)} of {count} files found, by their content"]
    lines += [f"missing files that are published in this form: {', '.join(kept)}"] if kept else []
    lines += [f"missing files that were cleaned, converted or computed, not published: {parts}"] if made else []
    lines += [f"cases that can be solved with them: {', '.join(cases) or 'none'}", f"licence: {wanted.licence}"]
    lines.append(f"export {DATA_SETTING}={shlex.quote(str(options.to.resolve()))}")
    facts = {"folder": str(options.to), "found": found, "missing": kept + made, "cases": cases}
    write_output(facts, "\n".join(lines), options)
    return DONE
