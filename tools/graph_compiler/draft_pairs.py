#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How well `graph_compiler init` guesses: the unit and the start of many pairs of meshes.

draft_pairs.py FOLDER [--program graph_compiler] [--out DIR] [--seconds N] [--json]

FOLDER has pairs.txt: a line a pair, `MOVING FIXED.. [= METRES_PER_UNIT]`, paths from FOLDER; # begins a comment. Each pair is
drafted by `init`, and the draft is compiled, each within N seconds (default 120). A start is found where the draft
compiles: the compiler refuses a start that is not free. DIR gets the drafts and scenes; default: nothing is kept.
--json: a line a pair, and one of the counts.
Exit code: 0 every start was found and every unit that is stated was guessed, 1 not, 2 usage.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time


def run(command, seconds):
    """Exit code (None: not done in time), output, seconds."""
    begin = time.monotonic()
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return None, f"not done within {seconds:.0f} s", time.monotonic() - begin
    return done.returncode, done.stdout, time.monotonic() - begin


def pairs_of(folder):
    try:
        lines = (folder / "pairs.txt").read_text(encoding="utf-8").splitlines()
    except OSError as error:
        sys.exit(f"draft_pairs: {error}; it has a line for each pair: MOVING FIXED.. [= METRES_PER_UNIT]")
    for number, line in enumerate(lines, 1):
        words, _, unit = line.partition("#")[0].partition("=")
        meshes = words.split()
        if not meshes:
            continue
        if len(meshes) < 2:
            sys.exit(f"draft_pairs: pairs.txt:{number}: names one mesh; a pair has a moving and a fixed one")
        yield meshes, float(unit) if unit.strip() else None


def drafted(program, folder, meshes, name, out, seconds):
    """(metres per unit or None, what was found, seconds of init, of the compiler)."""
    draft, scene = out / f"{name}.toml", out / f"{name}.rtscene"
    draft.unlink(missing_ok=True)
    code, said, drafting = run([program, "init", *(folder / m for m in meshes), "-o", draft], seconds)
    if code != 0:
        return None, "no draft: " + said.strip().splitlines()[-1], drafting, 0.0
    unit = re.search(r"^scale_to_m = (\S+)", draft.read_text(encoding="utf-8"), re.MULTILINE)
    where = re.search(r"^start: (.*?)[;,]", said, re.MULTILINE)
    code, said, compiling = run([program, draft, "-o", scene, "--quiet"], seconds)
    if code != 0:
        return unit and float(unit[1]), "no scene: " + said.strip().splitlines()[-1], drafting, compiling
    return unit and float(unit[1]), "start " + (where[1] if where else "apart by boxes"), drafting, compiling


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--program", default="graph_compiler")
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    pairs = list(pairs_of(given.folder))
    found, right, stated, longest = 0, 0, 0, 0.0
    with tempfile.TemporaryDirectory() as work:
        out = given.out or pathlib.Path(work)
        out.mkdir(parents=True, exist_ok=True)
        for index, (meshes, truth) in enumerate(pairs, 1):
            unit, text, drafting, compiling = drafted(given.program, given.folder, meshes, f"pair{index:02d}", out, given.seconds)
            found += text.startswith("start ")
            stated += truth is not None
            guessed = unit is not None and truth is not None and abs(unit / truth - 1) < 1e-6
            right += guessed
            longest = max(longest, drafting)
            if given.json:
                row = {"meshes": meshes, "metres_per_unit": unit, "stated": truth, "found": text}
                print(json.dumps({**row, "draft_s": drafting, "compile_s": compiling}), flush=True)
                continue
            mark = "" if truth is None or unit is None else " right" if guessed else f" WRONG ({truth:g})"
            print(
                f"{index:3d} of {len(pairs)} {drafting:6.1f} s {compiling:6.1f} s  "
                f"{'unit ' + format(unit, 'g') if unit is not None else 'unit stated by the file':24s}{mark:6s}  {' '.join(meshes)}: {text}",
                flush=True,
            )
    if given.json:
        print(json.dumps({"pairs": len(pairs), "starts": found, "units_stated": stated, "units_right": right}))
        return 0 if found == len(pairs) and right == stated else 1
    print(f"starts found: {found} of {len(pairs)}; units guessed right: {right} of {stated}; longest draft {longest:.1f} s")
    return 0 if found == len(pairs) and right == stated else 1


if __name__ == "__main__":
    sys.exit(main())
