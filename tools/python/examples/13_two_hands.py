# SPDX-License-Identifier: Apache-2.0
"""A peg in one hand, a socket with a blind hole in the other: both move, and both feel each other.

What one hand feels of the other is minus what that feels. A hand without a pose holds its part still: here the second
one lets its arm rest for a while, and the first presses the peg to the bottom.
"""

import numpy as np

import haptic


def socket(inner: float, outer: float, height: float, floor: float, sides: int = 24):
    """A blind hole; its rim is at z = 0."""
    angles = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    rings = [(outer, -height), (outer, 0.0), (inner, floor - height), (inner, 0.0)]
    vertices = np.vstack([np.column_stack([r * ring, np.full(sides, z)]) for r, z in rings])
    middle = [(0, 0, floor - height), (0, 0, -height)]
    low_out, top_out, low_in, top_in = (k * sides for k in range(4))
    triangles = []
    for k in range(sides):
        n = (k + 1) % sides
        for a, b, c, d in (
            (low_out + k, low_out + n, top_out + n, top_out + k),
            (top_in + k, top_in + n, low_in + n, low_in + k),
            (top_out + k, top_out + n, top_in + n, top_in + k),
        ):
            triangles += [(a, b, c), (a, c, d)]
        triangles += [(4 * sides, low_in + k, low_in + n), (4 * sides + 1, low_out + n, low_out + k)]
    return np.vstack([vertices, middle]), np.array(triangles)


def peg(radius: float, height: float, sides: int = 24):
    angles = 2 * np.pi * np.arange(sides) / sides
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    vertices = np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, height)] + [(0, 0, 0), (0, 0, height)])
    triangles = []
    for k in range(sides):
        n = (k + 1) % sides
        triangles += [(k, n, sides + n), (k, sides + n, sides + k)]
        triangles += [(2 * sides, n, k), (2 * sides + 1, sides + k, sides + n)]
    return vertices, np.array(triangles)


def main() -> None:
    scene = haptic.compile(
        [
            haptic.Part(peg(0.01, 0.05), unit="m", at=(0, 0, 0.01), name="peg", role="hand"),
            haptic.Part(socket(0.0103, 0.02, 0.035, 0.005), unit="m", name="socket", role="hand2"),
        ],
        stiffness=800,
    )
    core = haptic.Core(scene)
    # The handles are where the parts are; after that each leads its part.
    for tick in range(3):
        core.step_hands((0, 0, 0.01), (0, 0, 0), 0.001 * tick)
    largest, unequal = 0.0, 0.0
    for tick in range(3, 3000):
        t = 0.001 * tick
        down = min(0.02 * t, 0.024)  # each goes half the way, and the peg is pressed to the bottom
        rests = 2.0 < t < 2.5
        second = None if rests else (0, 0.0004 * np.sin(3 * t), down)
        first, other = core.step_hands((0.0004 * np.sin(5 * t), 0, 0.01 - down), second, t)
        largest = max(largest, float(np.linalg.norm(first.force)))
        if other is not None and t > 2.9:
            unequal = max(unequal, abs(float(first.force[2] + other.force[2])))
    peg_z, socket_z = core.bodies["peg"].pose[2], core.bodies["socket"].pose[2]
    depth = socket_z - peg_z
    print(f"the peg is {1e3 * depth:.2f} mm deep of 30; at most {largest:.2f} N; F1 + F2 at rest {unequal:.1e} N along the hole")
    print(core.verdict())
    assert abs(depth - 0.030) < 1e-5
    assert unequal < 1e-3


main()
