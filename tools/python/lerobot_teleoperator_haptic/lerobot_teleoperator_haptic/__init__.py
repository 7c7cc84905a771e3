# SPDX-License-Identifier: Apache-2.0
"""A haptic device that feels a compiled scene, as a teleoperator of LeRobot."""

from .config_haptic_teleoperator import HapticTeleoperatorConfig
from .haptic_teleoperator import HapticTeleoperator

__all__ = ["HapticTeleoperator", "HapticTeleoperatorConfig"]
