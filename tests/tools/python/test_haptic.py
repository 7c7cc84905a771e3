# SPDX-License-Identifier: Apache-2.0
"""The Python package against the shared library; the bits of a replay against those of host_sim."""

import csv
import gc
import os
import pathlib
import subprocess
import tempfile
import threading
import time
import unittest
import warnings

import numpy as np

import haptic

SCENES = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes"


def box(x, y, z):
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) * 2.0 - 1.0
    triangles = np.array(
        [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]]
        + [[2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
    )
    return corners * [x / 2, y / 2, z / 2], triangles


def block_scene():
    return haptic.compile(
        box(20, 20, 20), box(100, 100, 10), unit="mm", start=(0, 0, 0.035), stiffness=500
    )


def two_blocks():
    return haptic.compile(
        [
            haptic.Part(box(100, 100, 10), role="fixed", name="plate"),
            haptic.Part(box(20, 20, 20), role="hand", name="block", at=(0, 0, 0.035)),
            haptic.Part(box(20, 20, 20), role="placed", name="other", at=(0.03, 0, 0.0151)),
        ],
        unit="mm",
        stiffness=500,
    )


class Parts(unittest.TestCase):
    def test_a_core_holds_one_after_another(self):
        core = two_blocks().core()
        ticks = 0

        def step(x, z):
            nonlocal ticks
            ticks += 1
            return core.step((x, 0, z), 0.001 * ticks)

        for z in np.linspace(0.035, 0.010, 300):
            pressed = step(0, z)
        self.assertAlmostEqual(pressed.force[2], 2.5, delta=0.05)
        while not core.hold("other"):
            let_go = step(0, 0.010)
        self.assertEqual(let_go.force[2], 0)
        step(0, 0.010)
        self.assertEqual([b.name for b in core.bodies.values() if b.held], ["other"])
        for z in np.linspace(0.010, 0.030, 300):
            step(0, z)
        self.assertAlmostEqual(core.bodies["other"].pose[2], 0.0351, delta=1e-5)
        self.assertAlmostEqual(core.bodies["block"].pose[2], 0.015, delta=1e-5)
        core.release()
        for _ in range(100):
            step(0, 0.030)
        self.assertFalse(any(b.held for b in core.bodies.values()))

    def test_a_session_holds_one_after_another(self):
        with haptic.Session(two_blocks()) as s:
            s.hand.move_to(z=0.010, seconds=0.3)
            s.hold("other")
            s.hand.move_to(z=0.030, seconds=0.3)
            s.release()
            self.assertAlmostEqual(s.bodies["block"].pose[2], 0.015, delta=2e-5)
            self.assertGreater(s.bodies["other"].pose[2], 0.025)
            self.assertFalse(any(b.held for b in s.bodies.values()))

    def test_a_session_of_two_hands_feels_the_same_in_both(self):
        scene = haptic.compile(
            [
                haptic.Part(box(100, 100, 10), role="fixed", name="plate"),
                haptic.Part(box(20, 20, 20), role="hand", name="block", at=(0, 0, 0.035)),
                haptic.Part(box(20, 20, 20), role="hand2", name="other", at=(0.03, 0, 0.035)),
            ],
            unit="mm",
            stiffness=500,
        )
        with haptic.Session(scene, hands=2) as s:
            s.hands[0].move_to(x=0.010, seconds=0.3)
            s.hands[1].move_to(x=0.020, seconds=0.3)
            # The springs of both hands (400 N/m) and of both parts (334 N/m, which the device holds) one behind the
            # other, stretched by 10 mm: 0.91 N.
            until = time.monotonic() + 20
            while time.monotonic() < until:
                first, second = s.state(0), s.state(1)
                if first.force[0] < -0.8 and abs(first.force[0] + second.force[0]) < 0.05:
                    break
                time.sleep(0.01)
            self.assertAlmostEqual(first.force[0], -0.91, delta=0.11)
            self.assertAlmostEqual(first.force[0], -second.force[0], delta=0.05)
            self.assertAlmostEqual(second.felt_pose[0] - first.felt_pose[0], 0.020, delta=1e-4)
            s.hands[1].release()
        self.assertEqual([s.verdict(hand).outcome for hand in (0, 1)], ["followed", "followed"])
        self.assertGreater(len(s.history(1)), 500)
        with haptic.Session(scene) as s:
            self.assertEqual(len(s.hands), 1)
            with self.assertRaises((ValueError, haptic.HapticError)):
                s.state(1)
        with self.assertRaises((ValueError, haptic.HapticError)):
            haptic.Session(block_scene(), hands=2)

    def test_what_cannot_be_held_or_meant(self):
        core = two_blocks().core()
        for name in ("plate", "nut"):
            with self.assertRaisesRegex(ValueError, "those are: block, other"):
                core.hold(name)
        with self.assertRaisesRegex(ValueError, "one moving part"):
            block_scene().core().hold("block")
        self.assertEqual(block_scene().core().bodies, {})
        part = haptic.Part
        for parts, text in (
            ([part(box(1, 1, 1), role="hand")], "two at least"),
            ([part(box(1, 1, 1), role="hand"), part(box(1, 1, 1), role="hand")], "two parts have the role"),
            ([part(box(1, 1, 1), role="fixed"), part(box(1, 1, 1), role="placed")], "no part has the role"),
            ([part(box(1, 1, 1), role="hand"), part(box(1, 1, 1), role="lose")], "role 'lose' is none"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                haptic.compile(parts, unit="m")


class Compile(unittest.TestCase):
    def test_a_refusal_carries_file_place_cause_and_remedy(self):
        vertices, triangles = box(20, 20, 20)
        triangles[3, 1] = 99
        with self.assertRaises(haptic.CompileError) as caught:
            haptic.compile((vertices, triangles), box(1, 1, 1), unit="mm")
        (message,) = caught.exception.messages
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_INPUT")
        self.assertEqual(
            (message.severity, message.file, message.place, message.cause, message.remedy),
            ("error", "moving", "4", "names vertex 99 of 8", "vertices are counted from 0"),
        )

    def test_files_that_are_not_there(self):
        for call in (
            lambda: haptic.compile("/nowhere/scene.toml"),
            lambda: haptic.compile("/nowhere/peg.stl", "/nowhere/hole.stl", unit="mm"),
        ):
            with self.assertRaises(haptic.CompileError) as caught:
                call()
            self.assertIn("/nowhere/", str(caught.exception))
            self.assertEqual(caught.exception.messages[0].remedy, "check the path")

    def test_what_cannot_be_meant(self):
        for call, text in (
            (lambda: haptic.compile(box(1, 1, 1), box(1, 1, 1)), "the unit of the mesh"),
            (lambda: haptic.compile(box(1, 1, 1), box(1, 1, 1), unit="feet"), "no unit 'feet'"),
            (lambda: haptic.compile(box(1, 1, 1)), "no fixed part"),
            (lambda: haptic.compile((np.zeros(3), []), box(1, 1, 1), unit="m"), "n x 3"),
            (lambda: block_scene().replay(np.zeros((3, 5))), "n x 7"),
            (lambda: block_scene().replay(np.zeros((3, 3)), [0.0]), "3 poses"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                call()

    def test_the_bytes_outlive_the_scene_and_are_not_copied(self):
        scene = block_scene()
        data = scene.bytes
        before = data.tobytes()
        self.assertFalse(data.flags.writeable)
        del scene
        gc.collect()
        self.assertEqual(data.tobytes(), before)

    def test_a_scene_that_is_saved_and_loaded_is_the_same(self):
        scene = block_scene()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "block.rtscene"
            scene.save(path)
            again = haptic.Scene.load(path)
        self.assertEqual(again.bytes.tobytes(), scene.bytes.tobytes())
        with self.assertRaises(haptic.HapticError) as caught:
            haptic.Scene(b"nothing")
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_SCENE")


class Plans(unittest.TestCase):
    @staticmethod
    def peg():
        return haptic.compile(SCENES / "square_peg_five" / "scene.toml")

    def test_a_plan_into_the_hole_is_proved_again_and_can_be_played(self):
        scene = self.peg()
        made = haptic.plan(scene, (0, 0, -0.039), seconds=60, shorten_work=100_000_000)
        self.assertTrue(made.bytes.startswith(b"haptic-plan "))
        self.assertEqual(str(made), made.text)
        self.assertGreater(made.stations, 1)
        np.testing.assert_allclose(made.poses[0], scene.start, atol=1e-12)
        np.testing.assert_allclose(made.poses[-1], (0, 0, -0.039, 0, 0, 0, 1), atol=1e-12)
        felt = scene.replay(made.poses, np.arange(len(made.poses)) * 0.05).felt_poses
        np.testing.assert_allclose(felt[-1, :3], (0, 0, -0.039), atol=1e-6)
        with tempfile.TemporaryDirectory() as work:
            path = pathlib.Path(work)
            scene.save(path / "s.rtscene")
            made.save(path / "p.plan")
            inspect = pathlib.Path(os.environ["HAPTIC_HOST_SIM"]).with_name("scene_inspect")
            command = [inspect, path / "s.rtscene", "--plan", path / "p.plan"]
            said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        self.assertIn(f"{len(made.poses) - 1}", said)

    def test_no_plan_says_why(self):
        with self.assertRaisesRegex(haptic.PlanError, "goal: the part is not free there") as caught:
            haptic.plan(block_scene(), (0, 0, 0))
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_INPUT")
        with self.assertRaisesRegex(haptic.PlanError, "no plan was found in .* more seconds") as caught:
            haptic.plan(block_scene(), (0, 0, -0.035), seconds=0.001)
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_NO_PLAN")
        self.assertGreater(caught.exception.nearest, 0)


class Replays(unittest.TestCase):
    def test_a_replay_gives_the_bits_of_host_sim(self):
        program = os.environ["HAPTIC_HOST_SIM"]
        folder = SCENES / "tetrahedron_on_box"
        scene = haptic.compile(folder / "scene.toml")
        with tempfile.TemporaryDirectory() as work:
            path = pathlib.Path(work)
            scene.save(path / "s.rtscene")
            for arguments in (
                ["motion", folder / "motion.toml", "--out", path / "m.csv"],
                ["replay", path / "s.rtscene", "--motion", path / "m.csv", "--out", path / "o.csv"],
            ):
                subprocess.run([program, *arguments], check=True, stdout=subprocess.DEVNULL)
            motion = np.loadtxt(path / "m.csv", delimiter=",", skiprows=1)
            with open(path / "o.csv", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        w, x, y, z = motion[:, 4:].T  # the program makes them of unit length
        turns = motion[:, 4:] / np.sqrt(w * w + x * x + y * y + z * z)[:, None]
        poses = np.hstack([motion[:, 1:4], turns[:, [1, 2, 3, 0]]])
        result = scene.replay(poses, motion[:, 0])
        expected = np.array([int(row["state_hash"], 16) for row in rows], dtype=np.uint64)
        self.assertEqual(np.count_nonzero(result.hashes != expected), 0)
        self.assertEqual(len(expected), len(motion))
        self.assertGreater(abs(result.forces).max(), 0.1)

    def test_the_verdict_is_that_of_the_ticks(self):
        scene = block_scene()
        core = scene.core()
        self.assertEqual(core.verdict().outcome, "no_ticks")
        heights = np.linspace(0.02, 0.01, 50)
        poses = np.column_stack([np.zeros(50), np.zeros(50), heights])
        verdict = scene.replay(poses).verdict
        self.assertTrue(verdict)
        self.assertEqual((verdict.outcome, verdict.failures), ("followed", ()))
        self.assertEqual((verdict.ticks, verdict.followed_ticks), (50, 50))
        self.assertEqual(str(verdict), verdict.text)
        self.assertTrue(verdict.text.startswith("followed the hand in all 50 ticks"))
        inside = scene.replay(np.zeros((20, 3))).verdict  # in the plate from the first tick on
        self.assertTrue(inside.started_inside)
        self.assertEqual(inside.inside_ticks, 20)
        self.assertIn("inside an obstacle", inside.text)

    def test_a_refused_pose_is_named(self):
        poses = np.zeros((5, 7))
        poses[:, 6] = 1
        poses[3, 0] = np.nan
        with self.assertRaisesRegex(haptic.HapticError, "tick 3: .*HAPTIC_ERROR_POSE"):
            block_scene().replay(poses)
        with self.assertRaises(haptic.HapticError) as caught:
            block_scene().replay(np.zeros((0, 7)))
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_SIZE")

    def test_single_steps_give_the_bits_of_a_replay(self):
        scene = block_scene()
        core = scene.core()
        heights = np.linspace(0.02, 0.01, 50)
        hashes = [core.step((0, 0, z), 0.001 * k).hash for k, z in enumerate(heights)]
        poses = np.column_stack([np.zeros(50), np.zeros(50), heights])
        self.assertEqual(hashes, list(scene.replay(poses).hashes))
        core.reset()
        self.assertEqual(core.step((0, 0, heights[0]), 0.0).situation, "none")


class Sessions(unittest.TestCase):
    def test_a_fork_has_no_session_and_does_not_end_it(self):
        with haptic.Session(block_scene()) as session:
            session.hand.move_to(z=0.012, seconds=0.3)
            child = os.fork()
            if child == 0:
                name = ""
                try:
                    session.state()
                except haptic.HapticError as error:
                    name = error.name
                session = None
                gc.collect()
                os._exit(0 if name == "HAPTIC_ERROR_CLOSED" else 1)
            self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
            tick = session.state().tick
            time.sleep(0.05)
            self.assertGreater(session.state().tick, tick)
            self.assertEqual(session.state().link, "ready")
            self.assertEqual(session.device().phase, "runs")

    def test_a_session_that_nothing_refers_to_ends_with_its_threads(self):
        threads = len(os.listdir("/proc/self/task"))
        session = haptic.Session(block_scene())
        session.hand.move_to(z=0.012, seconds=0.3)
        self.assertGreater(len(os.listdir("/proc/self/task")), threads)
        circle = {"session": session}
        circle["circle"] = circle
        del session, circle
        gc.collect()
        self.assertEqual(len(os.listdir("/proc/self/task")), threads)

    def test_the_hand_presses_and_the_history_has_it(self):
        with haptic.Session(block_scene(), device="sim", history=30) as s:
            s.hand.move_to(z=0.005, seconds=0.3)
            state = s.state()
            self.assertEqual(state.link, "ready")
            self.assertGreater(state.force[2], 0.5)
            self.assertAlmostEqual(state.felt_pose[2], 0.015, delta=1e-4)
        ticks = s.history()
        self.assertTrue((np.diff(ticks["tick"].astype(int)) == 1).all())
        self.assertGreater(ticks["force"][:, 2].max(), 0.5)
        with self.assertRaises(haptic.HapticError) as caught:
            s.hand.move_to(z=0.0)
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_CLOSED")

    def test_a_stop_from_another_thread(self):
        with haptic.Session(block_scene()) as s:
            thread = threading.Thread(target=s.stop)
            thread.start()
            thread.join()
            begin = s.state().time
            while s.state().arming != "faulted" and s.state().time < begin + 10:
                pass
            self.assertEqual(s.state().arming, "faulted")

    def test_moving_fixed_parts_and_an_owner_that_is_blocked(self):
        with haptic.Session(block_scene(), history=120) as s:
            s.hand.move_to(z=0.010, seconds=0.3)

            def give_until(wanted, z):
                for k in range(6000):
                    s.move_fixed((0, 0, z(k)), fastest=0.05, late=0.3)
                    time.sleep(0.01)
                    if wanted(s.state()):
                        return
                self.fail("it did not come to that")

            give_until(lambda state: state.felt_pose[2] > 0.0168, lambda k: min(2e-5 * k, 0.002))
            time.sleep(1.0)  # a garbage collector, or a simulator that loads a file
            state = s.state()
            self.assertTrue(state.safety_faults & haptic.FAULT_FRAME)
            self.assertEqual(abs(state.sent_force).max(), 0.0)
            give_until(lambda state: state.arming == "armed" and state.sent_force[2] > 0.5, lambda k: 0.002)
            with self.assertRaises(haptic.HapticError) as caught:
                s.move_fixed((0, 0, float("nan")))
            self.assertEqual(caught.exception.name, "HAPTIC_ERROR_POSE")
        ticks = s.history()
        steps = np.linalg.norm(np.diff(ticks["sent_force"], axis=0), axis=1)
        self.assertLessEqual(steps.max(), 4.0)  # two periods of the device's slew, 2000 N/s

    def test_no_such_device(self):
        with self.assertRaises(haptic.HapticError) as caught:
            haptic.Session(block_scene(), device="falcon 9")
        self.assertEqual(caught.exception.name, "HAPTIC_ERROR_DEVICE")

    def test_a_configuration_of_run_device(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder)
            scene = block_scene()
            scene.save(path / "block.rtscene")
            config = path / "device.toml"
            config.write_text('scene = "block.rtscene"\n[device]\ndriver = "sim"\n')
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # what "sim" holds may be less
                session = haptic.Session(scene, device=config, history=20)
            with session as s:
                self.assertEqual(s.device().phase, "runs")
                end = time.monotonic() + 20  # the scripted hand presses every 4.5 s
                while s.state().sent_force[2] < 0.5 and time.monotonic() < end:
                    gc.collect()
                    time.sleep(0.01)
                self.assertGreater(s.state().sent_force[2], 0.5)
                self.assertIn("armed", [event.name for event in s.events])
                s.stop()
                while s.state().arming != "faulted" and time.monotonic() < end:
                    time.sleep(0.001)
                self.assertEqual(s.state().arming, "faulted")
                with self.assertRaises(haptic.HapticError) as caught:
                    s.hand.move_to(pose=(0, 0, 0.03))
                self.assertEqual(caught.exception.name, "HAPTIC_ERROR_DEVICE")
            self.assertEqual((s.device().phase, s.device().exit_code), ("ended", 0))
            self.assertEqual(abs(s.state().sent_force).max(), 0.0)
            self.assertGreater(s.history()["sent_force"][:, 2].max(), 0.5)

            config.write_text('scene = "block.rtscene"\n[device]\ndriver = "sum"\n')
            with self.assertRaisesRegex(haptic.HapticError, "device.toml:3.*sum.*HAPTIC_ERROR_INPUT"):
                haptic.Session(scene, device=config)

    def test_a_plot_or_a_sentence(self):
        with haptic.Session(block_scene()) as s:
            s.hand.move_to(z=0.03, seconds=0.05)
            try:
                import matplotlib  # noqa: F401
            except ImportError:
                with self.assertRaisesRegex(ImportError, "plot needs matplotlib"):
                    s.plot()
                return
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "force.png"
                s.plot(path)
                self.assertGreater(path.stat().st_size, 1000)


class External(unittest.TestCase):
    @staticmethod
    def pressed(session, ticks):
        """The handle goes 24 mm down in `ticks`, with the deadman switch held after the first 300."""
        for k in range(ticks):
            z = -0.024 * min(max(k - 400, 0) / 400, 1)
            tick = session.tick((0, 0, z), 0.001 * (k + 1), switches=int(k >= 300))
        return tick

    def test_a_loop_of_its_own_arms_presses_and_ends_at_zero(self):
        limits = haptic.Limits(max_force=1.5, axes=7)
        with haptic.Session(block_scene(), device="external", limits=limits) as session:
            self.assertEqual(session.device().phase, "starts")
            tick = self.pressed(session, 1200)
            self.assertEqual((tick.arming, tick.waits, tick.situation), ("armed", "", "face_face"))
            self.assertAlmostEqual(tick.force[2], 1.5, 6)
            contacts = session.contacts()
            self.assertEqual(len(contacts), 4)
            sums = sum(point.force for point in contacts) + contacts.rest[:3]
            np.testing.assert_allclose(sums, session.state().force, atol=1e-9)
            self.assertEqual(len(session.history()), 1200)
            session.stop()
            last = tick.force[2]
            for k in range(20):
                tick = session.tick((0, 0, -0.024), 1.201 + 0.001 * k, switches=1)
                self.assertLess(abs(tick.force[2] - last), 1.2 + 1e-9)
                last = tick.force[2]
            self.assertEqual((last, tick.arming), (0.0, "faulted"))
            session.close()
            with self.assertRaises(haptic.HapticError) as raised:
                for k in range(3):
                    tick = session.tick((0, 0, 0), 2 + 0.001 * k)
                    self.assertFalse(tick.force.any())
            self.assertEqual(raised.exception.name, "HAPTIC_ERROR_CLOSED")
        self.assertTrue(session.verdict())

    def test_two_threads_at_once_and_a_fork(self):
        session = haptic.Session(block_scene(), device="external")
        self.pressed(session, 1200)
        errors = []

        def loop():
            for k in range(400):
                try:
                    session.tick((0, 0, -0.024), 1.2, switches=1)
                    errors.append("")
                except haptic.HapticError as error:
                    errors.append(error.name)

        threads = [threading.Thread(target=loop) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(errors), 800)
        self.assertLessEqual(set(errors), {"", "HAPTIC_ERROR_BUSY"})
        child = os.fork()
        if child == 0:
            try:
                session.tick((0, 0, -0.024), 1.3, switches=1)
            except haptic.HapticError as error:
                os._exit(0 if error.name == "HAPTIC_ERROR_CLOSED" else 1)
            os._exit(2)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
        session.tick((0, 0, -0.024), 1.3, switches=1)

    def test_what_cannot_be_meant(self):
        with self.assertRaises(ValueError):
            haptic.Session(block_scene(), limits=haptic.Limits())
        with self.assertRaises(haptic.HapticError):
            haptic.Session(block_scene(), device="external", limits=haptic.Limits(max_force=-1.0))
        with haptic.Session(block_scene()) as session:
            for call in (session.contacts, lambda: session.tick((0, 0, 0), 0.0)):
                with self.assertRaises(haptic.HapticError) as raised:
                    call()
                self.assertEqual(raised.exception.name, "HAPTIC_ERROR_DEVICE")


class States(unittest.TestCase):
    def setUp(self):
        self.scene = block_scene()
        self.poses = np.tile(self.scene.start, (600, 1))
        self.poses[:, 2] -= np.minimum(np.arange(600) * 1e-4, 0.023)
        self.poses[:, 0] += np.maximum(np.arange(600) - 300, 0) * 1e-5

    def test_a_loaded_state_goes_on_with_the_same_bits(self):
        first, second = self.scene.core(), self.scene.core()
        first.step_many(self.poses[:350])
        state = first.save()
        second.load(state)
        self.assertEqual(second.save(), state)
        self.assertTrue((first.step_many(self.poses[350:]) == second.step_many(self.poses[350:])).all())
        self.assertEqual(repr(first.verdict()), repr(second.verdict()))  # one of its numbers may be none
        for bad, words in ((state[:-1], "cut off"), (state[:200] + b"?" + state[201:], "damaged"), (b"x" * 500, "no state")):
            with self.assertRaisesRegex(haptic.HapticError, words):
                second.load(bad)
        with self.assertRaisesRegex(haptic.HapticError, "another scene"):
            haptic.compile(box(20, 20, 20), box(90, 90, 10), unit="mm", start=(0, 0, 0.035)).core().load(state)
        with self.assertRaises(haptic.HapticError) as raised:
            two_blocks().core().save()
        self.assertEqual(raised.exception.name, "HAPTIC_ERROR_PART")

    def test_many_steps_are_single_ones_in_the_callers_array(self):
        many, single = self.scene.core(), self.scene.core()
        out = np.full((600, 6), np.nan)
        self.assertIs(many.step_many(self.poses, out=out), out)
        for k, pose in enumerate(self.poses):
            result = single.step(pose, k / 1000)
            self.assertTrue((np.concatenate([result.force, result.torque]) == out[k]).all())
        for bad in (self.poses[:, :6], self.poses[::2], self.poses.astype(np.float32), self.poses.tolist()):
            with self.assertRaisesRegex(ValueError, "contiguous array of float64"):
                many.step_many(bad)
        self.assertEqual(many.step_many(self.poses[:0]).shape, (0, 6))
        wrong = self.poses.copy()
        wrong[7, 3:] = 0
        with self.assertRaisesRegex(haptic.HapticError, "tick 7"):
            many.step_many(wrong)

    def test_other_threads_run_during_many_steps(self):
        core, poses, names = self.scene.core(), np.repeat(self.poses, 40, axis=0), []
        thread = threading.Thread(target=core.step_many, args=(poses,))
        thread.start()
        while thread.is_alive():
            try:
                core.verdict()
                names.append("")
            except haptic.HapticError as error:
                names.append(error.name)
        thread.join()
        self.assertIn("HAPTIC_ERROR_BUSY", names)
        self.assertLessEqual(set(names), {"", "HAPTIC_ERROR_BUSY"})

    def test_contacts_make_the_wrench(self):
        core = self.scene.core()
        self.assertFalse(core.contacts())
        for k, pose in enumerate(self.poses):
            result = core.step(pose, k / 1000)
        contacts = core.contacts()
        self.assertEqual(len(contacts), 4)
        np.testing.assert_allclose(sum(point.force for point in contacts), result.force, atol=1e-4 * result.force[2])
        for point in contacts:
            self.assertEqual((point.part, point.situation), (1, "face_face"))
            np.testing.assert_allclose(point.normal, [0, 0, 1], atol=1e-9)


class Interface(unittest.TestCase):
    def test_structures_have_the_size_of_the_header(self):
        # Each call above would answer HAPTIC_ERROR_VERSION; the history's has no size of its own.
        from haptic.session import TICK

        self.assertEqual(TICK.itemsize, 184)
        self.assertEqual(haptic.__version__, os.environ["HAPTIC_VERSION"])

    def test_everything_public_has_a_docstring(self):
        for name in haptic.__all__:
            if isinstance(getattr(haptic, name), int):
                continue  # a number has none of its own
            self.assertTrue(getattr(haptic, name).__doc__, name)


if __name__ == "__main__":
    unittest.main()
