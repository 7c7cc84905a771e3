# SPDX-License-Identifier: Apache-2.0
"""What the command line of LeRobot may say of it."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig


@TeleoperatorConfig.register_subclass("haptic")
@dataclass
class HapticTeleoperatorConfig(TeleoperatorConfig):
    """scene: a compiled scene (.rtscene), or a scene file (.toml) that is compiled at the start."""

    scene: str = ""
    device: str = "sim"
    hold: bool = True  #: the simulated hand holds the deadman switch
    fastest: float = 0.25  #: the fixed parts move no faster [m/s]
    fastest_turn: float = 1.0  #: [rad/s]
    late: float = 0.2  #: feedback comes within this time, once there was one [s]; 0.005 to 0.5
