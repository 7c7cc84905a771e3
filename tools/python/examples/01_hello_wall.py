# SPDX-License-Identifier: Apache-2.0
"""A block is pushed 5 mm into a plate: what the hand feels."""

import numpy as np

import haptic


def box(x, y, z):
    """Vertices and triangles of a box about its centre."""
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) * 2.0 - 1.0
    triangles = [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]  # fmt: skip
    return corners * [x / 2, y / 2, z / 2], triangles


# The block stands 20 mm above the plate; a spring of 500 N/m between hand and part.
scene = haptic.compile(
    box(0.02, 0.02, 0.02), box(0.1, 0.1, 0.01), unit="m", start=(0, 0, 0.035), stiffness=500
)
print(scene)

# A second of motion, a row for each millisecond: 25 mm down.
heights = np.linspace(0.035, 0.010, 1000)
result = scene.replay(np.column_stack([np.zeros(1000), np.zeros(1000), heights]))

for height in (0.020, 0.015, 0.0125, 0.010):
    k = np.argmin(abs(heights - height))
    print(f"hand at {1e3 * heights[k]:5.2f} mm: part at {1e3 * result.felt_poses[k, 2]:5.2f} mm, "
          f"{abs(result.forces[k, 2]):5.2f} N up")  # fmt: skip

assert abs(result.forces[-1, 2] - 2.5) < 0.05  # 5 mm at 500 N/m
