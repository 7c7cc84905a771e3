# SPDX-License-Identifier: Apache-2.0
"""A session to arrays: 05_recording.py [FILE.npz]; the recorded motion is then rendered again without a device."""

import pathlib
import sys

import numpy as np

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "tetrahedron_on_box"
scene = haptic.compile(scenes / "scene.toml")

with haptic.Session(scene, device="sim", history=30) as s:
    below = scene.start[2] - 0.05
    s.hand.move_to(z=below, seconds=0.6)
    s.hand.move_to(x=scene.start[0] + 0.005, seconds=0.4)
    s.hand.move_to(scene.start, seconds=0.6)

ticks = s.history()  # a numpy array with a field for each quantity, a row for each tick
force = np.linalg.norm(ticks["force"], axis=1)
sent = np.linalg.norm(ticks["sent_force"], axis=1)
pressed = force > 0.01
print(f"{len(ticks)} ticks of {np.median(np.diff(ticks['time'])) * 1e3:.2f} ms; in contact {pressed.mean():.0%}")
print(f"largest force {force.max():.2f} N rendered, {sent.max():.2f} N sent")
impulse = np.trapz(ticks["sent_force"], ticks["time"], axis=0)
print(f"impulse on the hand {impulse.round(3)} N s")

# The same motion without a device: what the core alone makes of it.
again = scene.replay(ticks["hand_pose"], ticks["time"])
off = np.linalg.norm(again.forces - ticks["force"], axis=1)
print(f"rendered again: off by {np.median(off[pressed]):.2g} N (median)")
if len(sys.argv) > 1:
    np.savez_compressed(sys.argv[1], **{name: ticks[name] for name in ticks.dtype.names})
    print(f"{sys.argv[1]}: numpy.load() has {', '.join(ticks.dtype.names)}")

assert pressed.any() and not pressed.all()
assert np.median(off[pressed]) < 0.05
