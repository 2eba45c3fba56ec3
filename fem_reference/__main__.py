"""Command ``python -m fem_reference``, the same as ``fem-reference``."""

from fem_reference.cli import entry

if __name__ == "__main__":
    entry()
