"""python run_notebook.py NOTEBOOK: execute it where we are, and print what its last cell prints."""

import sys

import nbformat
from nbclient import NotebookClient

notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
print(notebook.cells[-1].outputs[0].text)  # noqa: T201
