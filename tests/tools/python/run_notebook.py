# SPDX-License-Identifier: Apache-2.0
"""Runs the code cells of a notebook one after the other, in its folder: run_notebook.py NOTEBOOK.ipynb."""

import json
import os
import sys

path = os.path.abspath(sys.argv[1])
with open(path, encoding="utf-8") as file:
    notebook = json.load(file)
os.chdir(os.path.dirname(path))
names = {"__name__": "__main__"}
cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
for number, cell in enumerate(cells, 1):
    exec(compile("".join(cell["source"]), f"{path}, code cell {number}", "exec"), names)
    if cell["outputs"] or cell["execution_count"] is not None:
        raise SystemExit(f"{path}: code cell {number} is stored with its output; clear it")
print(f"{len(cells)} cells")
