# SPDX-License-Identifier: Apache-2.0
"""A block that a conveyor carries under a hand: 10_conveyor.py. A loop of your own, without a device.

The block in the hand is pressed on the belt. With friction the belt takes it along until the spring to the hand pulls as hard as
the belt can; without, it slides from the start. Both forces are known in closed form.
"""

import numpy as np

import haptic

PRESS, SPEED, STIFFNESS = 0.004, 0.05, 800.0


def box(x, y, z):
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) * 2.0 - 1.0
    triangles = [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]  # fmt: skip
    return corners * np.array([x, y, z]) / 2, triangles


def force_on_hand(friction):
    """Presses the block 4 mm into a belt that runs in x; the force on the hand after 0.6 s, and what the belt's drive feels."""
    scene = haptic.compile(
        [
            haptic.Part(box(0.04, 0.04, 0.02), unit="m", at=(0, 0, 0.021), name="block", role="hand"),
            haptic.Part(box(1.0, 0.2, 0.02), unit="m", name="belt", role="driven"),
        ],
        stiffness=STIFFNESS,
        friction=friction,
    )
    core = scene.core()
    for tick in range(1, 601):
        t = 1e-3 * tick
        if tick % 20 == 1:  # 50 poses a second, the first before the block is there
            core.drive("belt", (SPEED * t, 0.0, 0.0), t, fastest=0.1)
        down = min(PRESS, 0.02 * t) + 0.001
        result = core.step((0.0, 0.0, 0.021 - down), t)
    belt = core.driven["belt"]
    assert not belt.lost and belt.touches
    return result.force, belt.force


press = STIFFNESS * PRESS
for friction in (0.0, 0.3):
    hand, belt = force_on_hand(friction)
    print(f"friction {friction}: hand {hand.round(3)} N, belt {belt.round(3)} N; pressed by {press:.2f} N")
    assert abs(hand[2] - press) < 0.02 * press
    assert abs(hand[0] - friction * press) < 0.02 * press
    assert np.allclose(belt, -hand, atol=0.01 * press)
