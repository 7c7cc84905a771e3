# SPDX-License-Identifier: Apache-2.0
"""Many motions without a device: force and depth of 100 presses, each of 200 ticks, in one call each."""

import pathlib
import time

import numpy as np

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "tetrahedron_on_box"
scene = haptic.compile(scenes / "scene.toml")
random = np.random.default_rng(1)
motions = []
for _ in range(100):
    poses = np.tile(scene.start, (200, 1))
    poses[:, :2] += random.uniform(-0.01, 0.01, 2)
    poses[:, 2] -= np.linspace(0, random.uniform(0.03, 0.06), 200)
    motions.append(poses)

begin = time.perf_counter()
results = [scene.replay(poses) for poses in motions]
seconds = time.perf_counter() - begin

largest = [np.linalg.norm(r.forces, axis=1).max() for r in results]
print(f"largest forces: from {min(largest):.2f} N to {max(largest):.2f} N")
print(f"{200 * len(motions)} ticks in {seconds:.2f} s: {1e6 * seconds / (200 * len(motions)):.1f} us each")
assert all((a.hashes == b.hashes).all() for a, b in zip(results, map(scene.replay, motions[:5])))
