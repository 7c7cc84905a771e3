# SPDX-License-Identifier: Apache-2.0
"""The owner of moving parts is blocked for a second: what the simulated device is sent, tick by tick.

blocked_owner.py [FOLDER]: a block is pressed onto a plate that goes up and down, 50 poses a second; then none for a second;
then again. Ends with an error where the force jumps, goes on without poses, or does not come back. With FOLDER: the
profile as blocked_owner.csv and blocked_owner.svg.
"""

import pathlib
import sys
import time

import numpy as np

import haptic

SLEW_N_PER_S, PERIOD_S = 2000.0, 0.001  # of the simulated device
LATE_S, BLOCKED_S, LEAST_N = 0.1, 1.0, 6.0


def box(x, y, z):
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) * 2.0 - 1.0
    triangles = [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]  # fmt: skip
    return corners * [x / 2, y / 2, z / 2], triangles


def require(truth, text):
    if not truth:
        sys.exit(f"blocked_owner: {text}")


def move_plate(s, begin, wanted, least_s):
    """Poses of the plate until `wanted`, and for `least_s` at least; up and down by a millimetre each second."""
    first = time.monotonic()
    while True:
        now = time.monotonic()
        s.move_fixed((0, 0, 0.001 * np.sin(2 * np.pi * (now - begin))), fastest=0.05, late=LATE_S)
        if now - first > least_s and wanted(s.state()):
            return
        require(now - first < 60, "the force is not there within a minute")
        time.sleep(0.02)


plate = haptic.Part(box(0.1, 0.1, 0.08), unit="m", at=(0, 0, -0.035))  # its top is at 5 mm
scene = haptic.compile(box(0.02, 0.02, 0.02), plate, unit="m", start=(0, 0, 0.035), stiffness=500)
with haptic.Session(scene, history=300) as s:
    s.hand.move_to(z=-0.030, seconds=0.5)  # some 8 N: four ticks of the device's slew
    begin = time.monotonic()
    pressed = lambda state: state.arming == "armed" and state.sent_force[2] > LEAST_N  # noqa: E731
    move_plate(s, begin, pressed, 1.0)
    blocked = s.state().time
    time.sleep(BLOCKED_S)
    state = s.state()
    require(state.safety_faults & haptic.FAULT_FRAME, "a second without a pose is no fault")
    free = state.time
    move_plate(s, begin, pressed, 1.0)
ticks = s.history()

t, sent = ticks["time"], ticks["sent_force"]
steps = np.linalg.norm(np.diff(sent, axis=0), axis=1)
# A tick that comes late may use the time of two.
allowed = SLEW_N_PER_S * np.minimum(np.diff(t), 2 * PERIOD_S) + 1e-9
over = np.flatnonzero(steps > allowed)
require(len(over) == 0, f"the force jumps by {steps[over].max() if len(over) else 0:.3f} N in a tick")
# The newest pose is an interval of poses old when the owner stops; then LATE_S, then the ramp.
silent = (t > blocked + LATE_S + 0.1) & (t < free)
require(silent.any(), "the loop did not run while its owner was blocked")
require((sent[silent] == 0).all(), f"{abs(sent[silent]).max():.3f} N are sent while nobody says where the plate is")
gone = np.flatnonzero((t > blocked) & (abs(sent).max(axis=1) == 0))[0]
begun = np.flatnonzero((t < t[gone]) & (sent[:, 2] > sent[t <= blocked][-1][2] / 2) & (ticks["safety_faults"] & haptic.FAULT_FRAME == 0))[-1]
again = t[(t > free) & (sent[:, 2] > LEAST_N)][0]
print(
    f"{len(t)} ticks. The owner stops for {free - blocked:.2f} s at {sent[begun][2]:.2f} N. The force begins to fall {1e3 * (t[begun] - blocked):.0f} ms "
    f"later and is zero within {gone - begun} ticks ({', '.join(f'{x:.2f}' for x in sent[begun : gone + 1, 2])} N), until a pose comes; "
    f"{1e3 * (again - free):.0f} ms after that it is {LEAST_N:.0f} N again. Largest step {steps.max():.2f} N (slew: {SLEW_N_PER_S * PERIOD_S:.0f} N a tick)."
)
require(gone - begun >= sent[begun][2] / (2 * SLEW_N_PER_S * PERIOD_S), "the force is gone faster than the slew allows")

if len(sys.argv) > 1:
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    shown = (t > blocked - 0.5) & (t < free + 1.0)
    t, sent, faults = t[shown] - blocked, sent[shown], ticks["safety_faults"][shown] & haptic.FAULT_FRAME != 0
    np.savetxt(
        folder / "blocked_owner.csv", np.column_stack([t, sent, faults]), delimiter=",", fmt=["%.6f"] + 3 * ["%.9g"] + ["%d"],
        header="t_s,sent_x_n,sent_y_n,sent_z_n,frame_fault", comments="",
    )  # fmt: skip
    wide, high, left, top = 640, 240, 50, 20
    x = left + wide * (t - t[0]) / (t[-1] - t[0])
    most = sent[:, 2].max()
    y = top + high * (1 - sent[:, 2] / most)
    at = [left + wide * (moment - t[0]) / (t[-1] - t[0]) for moment in (0.0, free - blocked)]
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
    (folder / "blocked_owner.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + wide + 20}" height="{top + high + 50}" font-family="sans-serif" font-size="12">'
        f'<rect width="100%" height="100%" fill="white"/>'
        f'<rect x="{at[0]:.1f}" y="{top}" width="{at[1] - at[0]:.1f}" height="{high}" fill="#eee"/>'
        f'<text x="{at[0] + 4:.1f}" y="{top + 14}">the owner of the plate is blocked</text>'
        f'<polyline points="{line}" fill="none" stroke="#1f5fbf"/>'
        f'<text x="4" y="{top + 10}">{most:.1f} N</text><text x="4" y="{top + high}">0 N</text>'
        f'<text x="{left}" y="{top + high + 20}">{t[0]:.1f} s</text>'
        f'<text x="{left + wide - 30}" y="{top + high + 20}">{t[-1]:.1f} s</text>'
        f'<text x="{left + wide / 2 - 60}" y="{top + high + 40}">force sent to the device, z</text></svg>\n',
        encoding="utf-8",
    )
