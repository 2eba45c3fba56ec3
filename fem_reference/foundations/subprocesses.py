"""Python processes of our own: they import this copy of the package and nothing from the folder that they are started in."""

import os
import sys
import threading
import time
from pathlib import Path

_STARTER = "FEM_REFERENCE_STARTER"
_ROOT = Path(__file__).resolve().parent.parent.parent


def command(*words: str) -> list[str]:
    """The command line of a Python that does not look for modules where it is started, with ``words`` behind it."""
    return [sys.executable, "-P", *words]


def environment(**settings: str) -> dict[str, str]:
    """Our environment with this copy of the package before any other, and with ``settings``."""
    theirs = [str(Path(path).absolute()) for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    paths = [str(_ROOT), *theirs]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), _STARTER: str(os.getpid()), **settings}


def end_with_starter() -> None:
    """End this process a second or two after the one that started it, directly or not, even if that is killed."""
    starter = os.environ.get(_STARTER)
    if starter is not None:
        threading.Thread(target=_watch, args=(int(starter),), daemon=True).start()


def _watch(process: int) -> None:
    while lives(process):
        time.sleep(1.0)
    os._exit(1)


def lives(process: int) -> bool:
    """True of a process that runs; one that ended and whose end nobody has taken note of does not live."""
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except ProcessLookupError:
        return False
    except (OSError, IndexError):  # it is another's, or there is no /proc
        return True
