# SPDX-License-Identifier: Apache-2.0
"""The device: its thread renders at 1 kHz; LeRobot's loop asks for the newest and says where the fixed parts are."""

from __future__ import annotations

from typing import Any, Optional

import haptic
from lerobot.teleoperators.teleoperator import Teleoperator

from .config_haptic_teleoperator import HapticTeleoperatorConfig

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


class HapticTeleoperator(Teleoperator):
    """A part in the hand that feels a scene."""

    config_class = HapticTeleoperatorConfig
    name = "haptic"

    def __init__(self, config: HapticTeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        self.session: Optional[haptic.Session] = None

    @property
    def action_features(self) -> dict[str, type]:
        return {key: float for key in POSE + WRENCH}

    @property
    def feedback_features(self) -> dict[str, type]:
        return {f"fixed.{key}": float for key in POSE}

    @property
    def is_connected(self) -> bool:
        return self.session is not None

    @property
    def is_calibrated(self) -> bool:
        return True  # by the driver, which reports no pose before

    def connect(self, calibrate: bool = True) -> None:
        if self.session is not None:
            raise RuntimeError("the haptic device is connected already")
        if not self.config.scene:
            raise ValueError("no scene: give --teleop.scene=SCENE.rtscene, or a scene file (.toml)")
        if self.config.scene.endswith(".toml"):
            scene = haptic.compile(self.config.scene)
        else:
            scene = haptic.Scene.load(self.config.scene)
        self.session = haptic.Session(scene, device=self.config.device, hold=self.config.hold)
        self.configure()

    def calibrate(self) -> None:
        """Nothing: a driver calibrates its device as it connects."""

    def configure(self) -> None:
        """Nothing: limits are the device's own."""

    def get_action(self) -> dict[str, float]:
        state = self._connected().state()
        numbers = (*state.felt_pose, *state.sent_force, *state.sent_torque)
        return dict(zip(POSE + WRENCH, map(float, numbers)))

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Where the fixed parts are; a key that is missing is 0, or 1 of `fixed.qw`."""
        unknown = set(feedback) - set(self.feedback_features)
        if unknown:
            raise ValueError(f"no feedback '{min(unknown)}'; there is {', '.join(self.feedback_features)}")
        pose = [float(feedback.get(f"fixed.{key}", key == "qw")) for key in POSE]
        self._connected().move_fixed(
            pose,
            fastest=self.config.fastest,
            fastest_turn=self.config.fastest_turn,
            late=self.config.late,
        )

    def disconnect(self) -> None:
        self._connected().close()
        self.session = None

    def _connected(self) -> haptic.Session:
        if self.session is None:
            raise RuntimeError("the haptic device is not connected; call connect()")
        return self.session
