# SPDX-License-Identifier: Apache-2.0
"""A device, and the servo loop: in a thread of the library, or of run_device."""

from __future__ import annotations

import ctypes
import os
import time
import warnings
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Dict, Optional, Sequence, Tuple, Type, Union

import numpy as np

from . import _library as c
from .scene import (
    SITUATIONS,
    Array,
    Body,
    Contacts,
    Driven,
    Scene,
    Verdict,
    bodies_of,
    contacts_of,
    driven_of,
    driven_part,
    frame_of,
    part_of,
    pose_of,
    verdict_of,
)

ARMING = ("disarmed", "arming", "armed", "disarming", "faulted")
LINK = ("absent", "starting", "ready")
PHASES = ("starts", "runs", "ended")
#: A bit of State.safety_faults: the fixed parts move too fast, or their pose is late or none.
FAULT_FRAME = 1 << 13
TICK = np.dtype(
    [
        ("tick", np.uint64),
        ("time", np.float64),
        ("hand_pose", np.float64, 7),
        ("force", np.float64, 3),
        ("torque", np.float64, 3),
        ("sent_force", np.float64, 3),
        ("sent_torque", np.float64, 3),
        ("situation", np.uint32),
        ("flags", np.uint32),
        ("arming", np.uint32),
        ("safety_faults", np.uint32),
    ]
)


@dataclass(frozen=True)
class State:
    """The newest tick of the loop."""

    tick: int
    time: float  #: since the session was opened [s]
    hand_pose: Array  #: as the handle stands
    felt_pose: Array  #: where the part is held, free of obstacles
    force: Array  #: rendered [N]
    torque: Array  #: [N m], about the grip point
    sent_force: Array  #: after arming, limits and ramps: what the device gets
    sent_torque: Array
    gap: float  #: smallest gap of the felt pose to a fixed part [m]
    situation: str
    flags: int
    link: str
    arming: str
    armings: int  #: so far
    safety_faults: int
    device_faults: int
    hand_held: bool
    goals_reached: int
    late_ticks: int
    missed_periods: int
    longest_tick: float  #: [s]
    hash: int


@dataclass(frozen=True)
class DeviceStatus:
    """The device of a hand."""

    phase: str  #: "starts", "runs", "ended"
    link: str  #: "absent", "starting", "ready"
    faults: int
    silent: bool  #: the process that renders does not answer; the force ramps to zero
    exit_code: int  #: of run_device, once it has ended
    connects: int  #: so far
    reports: int  #: so far
    force: float  #: that the device may have now [N]: never less than it has
    torque: float  #: [N m]
    waits_for: str  #: why it does not arm
    trouble: str  #: of the link
    why: str  #: it has ended


@dataclass(frozen=True)
class Event:
    """Something that has happened, as run_device says it."""

    number: int  #: from 1 on; one that is missing was overwritten
    time: float  #: since the device is held [s]
    device: int  #: 1 and 2 of two; 0: of the run, or of the only one
    level: int  #: 3 error, 4 warning, 5 notice
    name: str  #: "connected", "armed", "fault", ..
    text: str

    def __str__(self) -> str:
        return self.text


#: The lowest bit of Tick.waits, in words.
_WAITS = (
    "the device is not ready, or has given no report",
    "the device is not calibrated",
    "no pose that can be used has come yet",
    "reports or ticks come too late",
    "the part is being led out of an obstacle",
    "the cause of a fault is there",
    "the force ramps to zero",
    "release the deadman switch, then press it",
    "press the deadman switch",
)


@dataclass(frozen=True)
class Limits:
    """What an external device may exert, and what its switches mean. None: the library's default, in brackets.

    deadman, clutch, emergency_stop: masks of switches. axes: that have motors, bits x y z and turns about x y z. absolute: the
    part is where the handle is; else it begins where the scene has it start.
    """

    max_force: Optional[float] = None  #: (3) [N]
    max_torque: Optional[float] = None  #: (0.05) [N m]
    slew_force: Optional[float] = None  #: (600) [N/s]
    slew_torque: Optional[float] = None  #: (10) [N m/s]
    ramp_in: Optional[float] = None  #: (0.1) [s]
    deadman: int = 1
    clutch: int = 0
    emergency_stop: int = 0
    axes: int = 0x3F
    absolute: bool = False
    scale: float = 1.0  #: metres in the scene per metre at the device


@dataclass(frozen=True)
class Tick:
    """What one tick of an external device gives."""

    force: Array  #: for the device, in its axes [N]: after arming, limits and ramps
    torque: Array  #: [N m]
    arming: str
    safety_faults: int
    waits: str  #: why it does not arm; empty: it is armed or arming
    felt_pose: Array
    gap: float  #: [m]
    situation: str
    hash: int


class Hand:
    """A simulated hand of a session; `number` from 0 on."""

    def __init__(self, session: Session, number: int) -> None:
        self._session = session
        self.number = number
        self._goal: Optional[Array] = None if number > 0 else session.scene.start

    def _last_goal(self) -> Array:
        """The handle stands where the part starts until it is led elsewhere."""
        until = time.monotonic() + 2.0
        while self._goal is None:
            state = self._session.state(self.number)
            if state.link == "ready":
                self._goal = state.hand_pose
            elif time.monotonic() > until:
                raise RuntimeError("the device of this hand does not report; the session is closed")
            else:
                time.sleep(0.002)
        return self._goal

    def move_to(
        self,
        pose: Optional[Sequence[float]] = None,
        *,
        x: Optional[float] = None,
        y: Optional[float] = None,
        z: Optional[float] = None,
        seconds: float = 1.0,
        wait: bool = True,
    ) -> int:
        """The hand leads the part there: `pose` (3 or 7 numbers, in W), or some of x, y, z [m].

        What is not given stays as in the last goal. The hand is a spring: where the part is kept from going, it
        presses. wait: until the time is over. Returns the number of the goal.
        """
        goal = self._last_goal().copy()
        if pose is not None:
            goal[:] = pose_of(pose)
        for k, value in enumerate((x, y, z)):
            if value is not None:
                goal[k] = value
        given = c.HandGoal(hand=self.number, pose=(ctypes.c_double * 7)(*goal), seconds=seconds)
        number = ctypes.c_uint64()
        c.require(
            c.library.haptic_session_move_hand(
                self._session._handle, ctypes.byref(given), ctypes.byref(number)
            )
        )
        self._goal = goal
        if wait:
            self.wait(number.value)
        return number.value

    def wait(self, number: int) -> None:
        """Until the hand has come to the end of goal `number`. Raises RuntimeError where the loop has ended before."""
        tick, since = 0, time.monotonic()
        while True:
            state = self._session.state(self.number)
            if state.goals_reached >= number:
                return
            if state.tick != tick:
                tick, since = state.tick, time.monotonic()
            elif time.monotonic() > since + 2.0:
                raise RuntimeError("the servo loop has ended before the hand was there; the session is closed")
            time.sleep(0.002)

    def hold(self, again: bool = True) -> None:
        """Holds the deadman switch. again: presses it again after a fault that is no stop."""
        mode = c.HOLD_AGAIN if again else c.HOLD
        c.require(c.library.haptic_session_hold_of(self._session._handle, self.number, mode))

    def release(self) -> None:
        """Lets go of the deadman switch: the force ramps to zero."""
        c.require(c.library.haptic_session_hold_of(self._session._handle, self.number, c.RELEASE))


def _servo_options(limits: Limits) -> c.ServoOptions:
    return c.ServoOptions(
        deadman=limits.deadman,
        clutch=limits.clutch,
        emergency_stop=limits.emergency_stop,
        driven_axes=limits.axes,
        is_absolute=limits.absolute,
        scale=limits.scale,
        rotation=(ctypes.c_double * 4)(0, 0, 0, 1),
        part_rotation=(ctypes.c_double * 4)(0, 0, 0, 1),
        max_force_n=limits.max_force or 0.0,
        max_torque_nm=limits.max_torque or 0.0,
        slew_n_per_s=limits.slew_force or 0.0,
        slew_nm_per_s=limits.slew_torque or 0.0,
        ramp_in_s=limits.ramp_in or 0.0,
    )


class Session:
    """Opens a device and runs the servo loop, until it is closed or its `with` block ends.

    device: "sim", a simulated handle and hand; or the path of a configuration of run_device, which ends in ".toml". Then the
    library starts run_device, and the device, its limits, switches and rate are the configuration's; the scene must be the
    bytes of the configuration's scene file. If this process dies, the force ramps to zero at once. A process forked from
    this one does not have the session. rate [Hz]: of the loop; None: the scene's. history [s]: of ticks that are
    kept. priority: SCHED_FIFO of the servo thread, 1 to 99; 0: ordinary. hold: the hand holds the deadman switch
    from the start; without it no force is sent. hands: 2 in a scene with two hands, each with such a device of its own,
    both moved in one tick; with 1 the part of a second hand is held still; of a configuration as many as it has. A scene with one hand raises HapticError.

    hand is the first of `hands`; state, verdict and history take the number of the hand. After a fault each of two hands
    leads its part on from where that is.

    device="external": a device whose loop is yours. There is no thread: each call of `tick` is one, by the checks, limits and
    ramps of any device, which `limits` gives. `hold` counts for nothing then.

    All methods may be called from any thread, `tick` and `contacts` from one at a time. State and history can be read after
    the end too. A session that nothing refers to any more ends with the force at zero; a process forked from this one does not
    have it, and does not end it (HAPTIC_ERROR_CLOSED).
    """

    def __init__(
        self,
        scene: Scene,
        device: Union[str, "os.PathLike[str]"] = "sim",
        *,
        rate: Optional[float] = None,
        history: float = 60.0,
        priority: int = 0,
        hold: bool = True,
        hands: int = 1,
        limits: Optional[Limits] = None,
    ) -> None:
        is_external = os.fspath(device) == "external"
        if limits is not None and not is_external:
            raise ValueError("limits are those of device=\"external\"; a configuration has its own")
        self._handle = ctypes.c_void_p()
        self._free = c.library.haptic_session_free
        self.scene = scene
        options = c.SessionOptions(
            hold=c.HOLD_AGAIN if hold else c.RELEASE,
            device=os.fsencode(device),
            rate_hz=rate or 0.0,
            history_s=history,
            priority=priority,
            hands=hands if os.fspath(device) == "sim" or hands > 1 else 0,
        )
        servo = _servo_options(limits or Limits())
        text = ctypes.create_string_buffer(4096)
        opened = [ctypes.byref(self._handle), text, len(text)]
        given = [scene.bytes.ctypes.data, len(scene.bytes), ctypes.byref(options)]
        if is_external:
            error = c.library.haptic_session_open_external(*given, ctypes.byref(servo), *opened)
        else:
            error = c.library.haptic_session_open_text(*given, *opened)
        if error != c.OK:
            raise c.HapticError(error, text.value.decode(errors="replace"))
        # A configuration says its rate itself: room for the fastest there is, which costs nothing until it is used.
        is_simulated = os.fspath(device) in ("sim", "external")
        self._records = int(history * ((rate or scene.info.rate_hz) if is_simulated else 10000.0)) + 1
        gains = c.GainsOutput()
        c.require(c.library.haptic_session_gains(self._handle, ctypes.byref(gains)))
        #: that the hand feels [N/m]: the scene's, or less where the scene has no [device] (then a warning says so)
        self.stiffness: float = gains.stiffness_n_per_m
        if gains.lowered:
            warnings.warn(gains.text.decode(), stacklevel=2)
        self._report = 0
        self.hands = tuple(Hand(self, number) for number in range(max(hands, 1)))
        self.hand = self.hands[0]

    def tick(
        self,
        pose: Sequence[float],
        time: float,
        *,
        switches: int = 0,
        velocity: Optional[Sequence[float]] = None,
        report: Optional[int] = None,
        report_time: Optional[float] = None,
        ready: bool = True,
        faults: int = 0,
        emergency_stop: bool = False,
    ) -> Tick:
        """One tick of an external device, of its loop: what it reports in, what it may exert out.

        pose: of the handle in the device's frame, 3 or 7 numbers. time [s]: at the begin of the tick, by a clock that only goes
        forward. switches: pressed, as bits. velocity: 6 numbers, m/s and rad/s, where it is measured. report: counts the reports,
        from 1 on, the same again where none is newer; None: each call brings a new one. report_time: when it came, by the clock
        of time; None: now. faults: of the device. Any numbers are safe. Raises HapticError with the name HAPTIC_ERROR_CLOSED
        once the session is closed and the force is zero, HAPTIC_ERROR_BUSY while another thread is in here,
        HAPTIC_ERROR_DEVICE for another device: send no force then.
        """
        i, out = c.ServoInput(), c.ServoOutput()
        i.ready, i.switches, i.device_faults, i.emergency_stop = ready, switches, faults, emergency_stop
        i.pose = (ctypes.c_double * 7)(*pose_of(pose))
        if velocity is not None:
            i.twist = (ctypes.c_double * 6)(*velocity)
            i.has_twist = 1
        self._report = self._report + 1 if report is None else report
        i.report, i.time_s = self._report, time
        i.report_time_s = time if report_time is None else report_time
        c.require(c.library.haptic_session_tick(self._handle, ctypes.byref(i), ctypes.byref(out)))
        wrench = np.array(out.wrench)
        lowest = (out.waits & -out.waits).bit_length() - 1
        return Tick(
            wrench[:3],
            wrench[3:],
            ARMING[out.arming],
            out.safety_faults,
            "" if lowest < 0 else _WAITS[lowest],
            np.array(out.felt_pose),
            out.gap_m,
            SITUATIONS[out.situation],
            out.state_hash,
        )

    def contacts(self) -> Contacts:
        """Of the newest tick of an external device, as Core.contacts; raises HapticError for any other device."""
        return contacts_of(c.library.haptic_session_contacts, self._handle)

    def state(self, hand: int = 0) -> State:
        """The newest tick; never waits."""
        s = c.StateOutput()
        c.require(c.library.haptic_session_state_of(self._handle, hand, ctypes.byref(s)))
        wrench, sent = np.array(s.wrench), np.array(s.sent_wrench)
        return State(
            s.tick,
            s.time_s,
            np.array(s.hand_pose),
            np.array(s.felt_pose),
            wrench[:3],
            wrench[3:],
            sent[:3],
            sent[3:],
            s.gap_m,
            SITUATIONS[s.situation],
            s.flags,
            LINK[s.link],
            ARMING[s.arming],
            s.armings,
            s.safety_faults,
            s.device_faults,
            s.hand_held != 0,
            s.goals_reached,
            s.late_ticks,
            s.missed_periods,
            s.longest_tick_s,
            s.state_hash,
        )

    def device(self, hand: int = 0) -> DeviceStatus:
        """What the process that holds the device says of it; never waits."""
        s = c.DeviceStatusOutput()
        c.require(c.library.haptic_session_device(self._handle, hand, ctypes.byref(s)))
        return DeviceStatus(
            PHASES[s.phase],
            LINK[s.link],
            s.faults,
            s.is_silent != 0,
            s.exit_code,
            s.connects,
            s.reports,
            s.force_n,
            s.torque_nm,
            s.waits_for.decode(errors="replace"),
            s.trouble.decode(errors="replace"),
            s.why.decode(errors="replace"),
        )

    @property
    def events(self) -> Tuple[Event, ...]:
        """The newest 64 events at most, oldest first; none of "sim". Never waits."""
        found = (c.EventOutput * c.MOST_EVENTS)()
        count = ctypes.c_size_t()
        c.require(
            c.library.haptic_session_events(
                self._handle, found, c.MOST_EVENTS, ctypes.sizeof(c.EventOutput), ctypes.byref(count)
            )
        )
        return tuple(
            Event(e.number, e.time_s, e.device, e.level, e.name.decode(), e.text.decode(errors="replace"))
            for e in found[: count.value]
        )

    def verdict(self, hand: int = 0) -> Verdict:
        """The judgement of all ticks so far; after the end of the whole session. Never waits."""
        return verdict_of(lambda handle, text: c.library.haptic_session_verdict_of(handle, hand, text), self._handle)

    def history(self, hand: int = 0) -> Array:
        """The newest ticks, oldest first: an array with the fields of TICK."""
        ticks = np.empty(self._records, dtype=TICK)
        count = ctypes.c_size_t()
        c.require(
            c.library.haptic_session_history_of(
                self._handle, hand, ticks.ctypes.data, len(ticks), TICK.itemsize, ctypes.byref(count)
            )
        )
        return ticks[: count.value]

    def hold(self, part: str) -> None:
        """The hand holds this part of the scene: it lets go of what it holds, and takes the part where it is, with no force.

        The next tick takes it. `hand.move_to` stays about the first part: each part is led by its own grip point as the
        first one is by its. Raises ValueError where no such part may be held, HapticError where the device gives no pose.
        """
        c.require(c.library.haptic_session_hold_part(self._handle, 0, part_of(self.bodies, part)))

    def release(self, wait: bool = True) -> None:
        """The hand lets go: the force fades in some 50 ticks while the part stays. wait: until it has, 2 s at most."""
        c.require(c.library.haptic_session_release_part(self._handle, 0))
        until = time.monotonic() + 2.0
        while wait and any(body.held for body in self.bodies.values()) and time.monotonic() < until:
            time.sleep(0.002)

    @property
    def bodies(self) -> Dict[str, Body]:
        """Where the parts are, by name; empty for a scene of one moving part."""
        return bodies_of(c.library.haptic_session_bodies, self._handle)

    def move_fixed(
        self,
        pose: Sequence[float],
        *,
        fastest: float = 0.25,
        fastest_turn: float = 1.0,
        late: float = 0.1,
        stands: bool = False,
    ) -> None:
        """The fixed parts are at `pose` (3 or 7 numbers): of the frame in W in which the scene has them.

        For a robot or simulator that gives it 30 to 200 times a second; the library interpolates, an interval behind.
        fastest [m/s], fastest_turn [rad/s]: the caller moves them no faster. late [s]: a newer pose comes within it.
        stands: they stay there, and none is waited for. A pose that is too fast, late or not finite ramps the force to zero
        (FAULT_FRAME in State.safety_faults); the deadman switch must be pressed again. While a session's parts have moved,
        `force` of its history is in their axes, `sent_force` in those of W.
        """
        given = frame_of(pose, fastest, fastest_turn, late, stands)
        c.require(c.library.haptic_session_frame(self._handle, ctypes.byref(given)))

    def drive(
        self,
        part: str,
        pose: Sequence[float],
        *,
        fastest: float = 0.25,
        fastest_turn: float = 1.0,
        late: float = 0.1,
        stands: bool = False,
    ) -> None:
        """The owner of a driven part has its mesh frame at `pose` (3 or 7 numbers), in the frame of the fixed parts, now.

        As Core.drive. One that is too fast, late or not finite and touches the part in the hand ramps the force to zero
        (FAULT_FRAME in State.safety_faults); the deadman switch must be pressed again. Raises ValueError where no such part
        is driven.
        """
        given = frame_of(pose, fastest, fastest_turn, late, stands)
        number = driven_part(self.bodies, part)
        c.require(c.library.haptic_session_drive(self._handle, number, ctypes.byref(given)))

    @property
    def driven(self) -> Dict[str, Driven]:
        """The driven parts after the newest tick, by name."""
        return driven_of(c.library.haptic_session_driven, self._handle, self.bodies)

    def stop(self) -> None:
        """Stop by software: no force until hand.release() and hand.hold()."""
        c.require(c.library.haptic_session_stop(self._handle))

    def plot(self, path: Union[str, "os.PathLike[str]", None] = None) -> Any:
        """Draws force, torque and height of the hand over time; needs matplotlib.

        Writes `path` where one is given. Returns the figure.
        """
        try:
            from matplotlib.figure import Figure
        except ImportError as error:
            raise ImportError(
                "plot needs matplotlib; install it (Debian: apt-get install python3-matplotlib), or draw "
                "session.history() by other means"
            ) from error
        ticks = self.history()
        figure = Figure(figsize=(8, 7), layout="constrained")
        axes = figure.subplots(3, 1, sharex=True)
        for k, axis in enumerate("xyz"):
            axes[0].plot(ticks["time"], ticks["sent_force"][:, k], label=axis)
            axes[1].plot(ticks["time"], ticks["sent_torque"][:, k], label=axis)
        axes[2].plot(ticks["time"], ticks["hand_pose"][:, 2], label="z")
        for plot, label in zip(axes, ("force sent [N]", "torque sent [N m]", "hand [m]")):
            plot.set_ylabel(label)
            plot.legend(loc="upper left")
        axes[2].set_xlabel("time [s]")
        if path is not None:
            figure.savefig(path)
        return figure

    def close(self) -> None:
        """Orderly end: the force ramps to zero, the threads end. Closed already: nothing."""
        error = c.library.haptic_session_close(self._handle)
        if error != c.CLOSED:
            c.require(error)

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            self._free(ctypes.byref(self._handle))
