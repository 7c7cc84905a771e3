# SPDX-License-Identifier: Apache-2.0
"""The teleoperator against a stand-in of LeRobot's base class: names, features, feedback, refusals."""

import pathlib
import re
import unittest

from lerobot.teleoperators.config import TeleoperatorConfig
from lerobot.teleoperators.teleoperator import Teleoperator
from lerobot_teleoperator_haptic import HapticTeleoperator, HapticTeleoperatorConfig

import haptic

PROJECT = pathlib.Path(__file__).resolve().parents[3]
SCENE = str(PROJECT / "host_sim" / "scenes" / "tetrahedron_on_box" / "scene.toml")


class Conventions(unittest.TestCase):
    def test_the_names_by_which_lerobot_finds_it(self):
        self.assertIs(TeleoperatorConfig.known["haptic"], HapticTeleoperatorConfig)
        self.assertEqual(HapticTeleoperatorConfig.__name__, HapticTeleoperator.__name__ + "Config")
        self.assertTrue(issubclass(HapticTeleoperator, Teleoperator))
        self.assertIs(HapticTeleoperator.config_class, HapticTeleoperatorConfig)
        self.assertTrue(HapticTeleoperator.__module__.split(".")[0].startswith("lerobot_teleoperator_"))

    def test_its_dependencies_are_stated(self):
        text = (PROJECT / "tools/python/lerobot_teleoperator_haptic/pyproject.toml").read_text(encoding="utf-8")
        self.assertRegex(text, r'dependencies = \["haptic", "lerobot[^"]*"\]')
        self.assertIsNone(re.search(r"^version", text, re.MULTILINE))


class Device(unittest.TestCase):
    def test_actions_have_their_features_and_feedback_moves_the_parts(self):
        device = HapticTeleoperator(HapticTeleoperatorConfig(id="h", scene=SCENE))
        self.assertFalse(device.is_connected)
        device.connect()
        try:
            self.assertTrue(device.is_connected and device.is_calibrated)
            action = device.get_action()
            self.assertEqual(set(action), set(device.action_features))
            start = haptic.compile(SCENE).start
            for key, number in zip(("x", "y", "z"), start):
                self.assertAlmostEqual(action[key], number, delta=1e-3)
            device.send_feedback({"fixed.z": 0.0})
            with self.assertRaisesRegex(ValueError, "no feedback 'fixed.a'"):
                device.send_feedback({"fixed.a": 0.0})
            with self.assertRaises(haptic.HapticError):
                device.send_feedback({"fixed.qw": 0.0})
            with self.assertRaisesRegex(RuntimeError, "connected already"):
                device.connect()
        finally:
            device.disconnect()
        with self.assertRaisesRegex(RuntimeError, "not connected"):
            device.get_action()

    def test_no_scene(self):
        with self.assertRaisesRegex(ValueError, "give --teleop.scene="):
            HapticTeleoperator(HapticTeleoperatorConfig()).connect()
        with self.assertRaises((haptic.HapticError, OSError)):
            HapticTeleoperator(HapticTeleoperatorConfig(scene="/nowhere.rtscene")).connect()


if __name__ == "__main__":
    unittest.main()
