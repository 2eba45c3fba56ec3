"""The version of the package, which pages, files and stored runs state."""

__version__ = "0.1.0"
