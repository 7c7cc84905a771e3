# SPDX-License-Identifier: Apache-2.0
"""The version is that of project() in the top CMakeLists.txt."""

import pathlib
import re

from setuptools import setup

top = pathlib.Path(__file__).resolve().parents[3] / "CMakeLists.txt"
found = re.search(r"project\(\w+ VERSION ([0-9.]+)", top.read_text(encoding="utf-8"))
if found is None:
    raise SystemExit(f"{top}: no project version; install from the source tree of the project")
setup(version=found.group(1))
