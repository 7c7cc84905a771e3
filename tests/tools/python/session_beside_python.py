# SPDX-License-Identifier: Apache-2.0
"""How late the servo thread of a session wakes while its owner sleeps, computes or collects garbage, against run_device
on its simulated device, in turn.

session_beside_python.py [SECONDS [ROUNDS [LIMIT]]]: SECONDS for each (default 2). With LIMIT the exit code is 1 where the
99.9 % of a session are later than LIMIT times a quarter of the period and than LIMIT times those of run_device.
Both ask for SCHED_FIFO 80 and go on without it where it is not granted. Tells of this machine and of its load.
HAPTIC_LIBRARY, HAPTIC_RUN_DEVICE: files of the build.
"""

import gc
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

import haptic

seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 2.0
rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 1
limit = float(sys.argv[3]) if len(sys.argv) > 3 else None
RATE_HZ, PRIORITY = 1000.0, 80
PERIOD_S = 1.0 / RATE_HZ
scene = haptic.compile(pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "square_peg_five" / "scene.toml")


def sleep(until):
    while time.monotonic() < until:
        time.sleep(0.01)


def compute(until):
    total, matrix = 0, np.random.default_rng(1).random((300, 300))
    while time.monotonic() < until:
        total += sum(k * k for k in range(20_000))
        matrix = np.tanh(matrix @ matrix.T / 300)


def collect_garbage(until):
    while time.monotonic() < until:
        links = [[k] for k in range(100_000)]
        for a, b in zip(links, links[1:]):
            a.append(b)
        links[-1].append(links[0])  # a ring: only the collector frees it
        del links, a, b
        gc.collect()


def lateness(times):
    """Of each tick after its deadline; deadlines are a period apart, and one that has passed is left out.

    Where the deadlines are within the period is not recorded: just before the earliest of the ticks that come together.
    """
    within = times % PERIOD_S
    bins = np.bincount((within / PERIOD_S * 100).astype(int) % 100, minlength=100)
    after = (within - (bins.argmax() - 4.5) / 100 * PERIOD_S) % PERIOD_S  # so that these are some 5 % after a zero
    phase = (bins.argmax() - 4.5) / 100 * PERIOD_S + after[after < 0.06 * PERIOD_S].min()
    slot = np.floor((times - phase) / PERIOD_S + 1e-6)
    return times[1:] - (phase + (slot[:-1] + 1) * PERIOD_S)


def session(load):
    options = {"priority": PRIORITY}
    try:
        s = haptic.Session(scene, rate=RATE_HZ, history=seconds + 10, **options)
    except haptic.HapticError as error:
        if error.name != "HAPTIC_ERROR_SYSTEM":
            raise
        s = haptic.Session(scene, rate=RATE_HZ, history=seconds + 10)
    with s:
        s.hand.move_to(z=scene.start[2] - 0.012, seconds=seconds / 2, wait=False)
        load(time.monotonic() + seconds)
        state = s.state()
    late = lateness(s.history()["time"])
    return len(late) + 1, state.late_ticks, np.quantile(late, [0.5, 0.99, 0.999, 1.0])


def run_device(folder):
    scene.save(folder / "scene.rtscene")
    config = folder / "sim.toml"
    config.write_text('scene = "scene.rtscene"\n[device]\ndriver = "sim"\n[loop]\nstrict = false\n', encoding="utf-8")
    lines = subprocess.run(
        [os.environ["HAPTIC_RUN_DEVICE"], "run", config, "--seconds", str(seconds), "--json", "--accept-unbudgeted"],
        check=True, capture_output=True, text=True,
    ).stdout.splitlines()  # fmt: skip
    summary = next(x for x in map(json.loads, lines) if x["kind"] == "summary")
    times = summary["wakeups"]
    late = np.array([times[key] for key in ("p50_ns", "p99_ns", "p99_9_ns", "largest_ns")]) * 1e-9
    return summary["ticks"], summary["late"]["held"] + summary["late"]["beyond"], late


print(f"{'':16s} {'ticks':>8s} {'late':>6s} {'p50':>8s} {'p99':>8s} {'p99.9':>8s} {'largest':>8s}   [us]")
worst = {}
with tempfile.TemporaryDirectory() as work:
    calls = {"run_device": lambda: run_device(pathlib.Path(work))}
    calls.update({load.__name__: lambda load=load: session(load) for load in (sleep, compute, collect_garbage)})
    for _ in range(rounds):
        for name, call in calls.items():
            ticks, late, quantiles = call()
            print(f"{name:16s} {ticks:8d} {late:6d} " + " ".join(f"{1e6 * q:8.1f}" for q in quantiles))
            worst.setdefault(name, []).append(quantiles[2])
own = np.median(worst.pop("run_device"))
for name, values in worst.items():
    p999 = np.median(values)
    if limit is not None and p999 > limit * PERIOD_S / 4 and p999 > limit * own:
        sys.exit(f"beside '{name}' 99.9 % are within {1e6 * p999:.0f} us; with run_device within {1e6 * own:.0f} us")
