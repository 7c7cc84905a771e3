# SPDX-License-Identifier: Apache-2.0
"""Scenes: compiled from meshes, stored, read, and rendered without a device."""

from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _library as c

Array = np.ndarray
MeshArrays = Tuple[Any, Any]
Mesh = Union[str, "os.PathLike[str]", MeshArrays]

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "um": 1e-6, "inch": 0.0254}
SITUATIONS = (
    "none",
    "face_vertex",
    "vertex_face",
    "edge_edge",
    "edge_face",
    "face_face",
    "several_planes",
)
_SEVERITIES = ("note", "warning", "error")


class CompileError(c.HapticError):
    """A scene that cannot be compiled; `messages` says what is wrong, where, and how to fix it."""


@dataclass
class Part:
    """One part of a scene.

    mesh: path of an STL, OBJ or OFF file, or arrays (vertices n x 3, triangles m x 3, counter-clockwise seen from
    outside). unit: "m", "cm", "mm", "um", "inch", or metres per unit; None: that of `compile`. at, turn: position [m]
    and quaternion x y z w of the mesh frame in W. simplify: bevels, fillets and small rounds below this [m] are removed.
    name: for messages. role: "hand" (held at the start), "placed" (may be held after it, and stays where it is let go),
    "hand2" (a second hand holds it all the time: `Core.step_hands`), "driven" (its owner moves it: `drive`), "loose" (what moves
    pushes it) or "fixed" (never held); None: by its place in the call.
    """

    mesh: Mesh
    unit: Union[str, float, None] = None
    at: Sequence[float] = (0.0, 0.0, 0.0)
    turn: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    simplify: float = 0.0
    name: str = ""
    role: Optional[str] = None


ROLES = ("", "fixed", "hand", "placed", "driven", "hand2", "loose")
_ROLE_NUMBERS = {"placed": 1, "driven": 2, "hand2": 3, "loose": 4}  # haptic_role


@dataclass(frozen=True)
class Body:
    """A part of a scene whose parts the hand holds one after another."""

    name: str
    role: str  #: as it was compiled
    pose: Array  #: of its mesh frame in W, where it is felt
    held: bool  #: by the hand, now


def bodies_of(call: Any, handle: ctypes.c_void_p) -> Dict[str, Body]:
    """What haptic_core_bodies or haptic_session_bodies says, by name."""
    given = (c.BodyOutput * c.MOST_PARTS)()
    count = ctypes.c_size_t()
    error = call(handle, given, c.MOST_PARTS, ctypes.sizeof(c.BodyOutput), ctypes.byref(count))
    if error == c.NO_PART:
        return {}
    c.require(error)
    bodies = {}
    for b in given[: count.value]:
        name = b.name.decode(errors="replace")
        bodies[name] = Body(name, ROLES[b.role], np.array(b.pose), b.held_by != 0)
    return bodies


def part_of(bodies: Dict[str, Body], name: str) -> int:
    """The number of a part that the hand may hold. Raises ValueError with the names of those that it may."""
    for number, body in enumerate(bodies.values()):
        if body.name == name and body.role in ("hand", "placed"):
            return number
    names = ", ".join(b.name for b in bodies.values() if b.role in ("hand", "placed"))
    raise ValueError(f"no part '{name}' may be held; " + (f"those are: {names}" if names else "the scene has one moving part"))


@dataclass(frozen=True)
class Driven:
    """A part that its owner moves, after a tick."""

    name: str
    pose: Array  #: of its mesh frame in W, where it is felt
    commanded: Array  #: the same, where its owner has it
    lag: float  #: between the two [m]
    lag_turn: float  #: [rad]
    force: Array  #: on it by what it touches [N], W axes
    torque: Array  #: about its mesh frame's origin [N m]
    touches: bool  #: the part in the hand
    lost: bool  #: its poses are late, too fast or none, and it stands


def driven_of(call: Any, handle: ctypes.c_void_p, bodies: Dict[str, Body]) -> Dict[str, Driven]:
    """What haptic_core_driven or haptic_session_driven says, by name."""
    given = (c.DrivenOutput * c.MOST_PARTS)()
    count = ctypes.c_size_t()
    error = call(handle, given, c.MOST_PARTS, ctypes.sizeof(c.DrivenOutput), ctypes.byref(count))
    if error == c.NO_PART:
        return {}
    c.require(error)
    names = list(bodies)
    driven = {}
    for d in given[: count.value]:
        wrench = np.array(d.wrench)
        driven[names[d.part]] = Driven(
            names[d.part],
            np.array(d.pose),
            np.array(d.commanded),
            d.lag_m,
            d.lag_rad,
            wrench[:3],
            wrench[3:],
            d.touches != 0,
            d.lost != 0,
        )
    return driven


def driven_part(bodies: Dict[str, Body], name: str) -> int:
    """The number of a driven part. Raises ValueError with the names of those that are."""
    for number, body in enumerate(bodies.values()):
        if body.name == name and body.role == "driven":
            return number
    names = ", ".join(b.name for b in bodies.values() if b.role == "driven")
    raise ValueError(f"no part '{name}' is driven; " + (f"those are: {names}" if names else "the scene has none"))


def frame_of(
    pose: Sequence[float], fastest: float, fastest_turn: float, late: float, stands: bool
) -> c.Frame:
    """A pose of a frame that its owner moves, as the library takes it."""
    return c.Frame(
        stands=stands,
        pose=(ctypes.c_double * 7)(*pose_of(pose)),
        fastest_m_per_s=fastest,
        fastest_rad_per_s=fastest_turn,
        late_s=late,
    )


def _by_role(parts: Sequence[Part]) -> List[Part]:
    """The part with the hand's role first."""
    unknown = [part.role for part in parts if part.role not in (None, *ROLES[1:])]
    if unknown:
        raise ValueError(f"role '{unknown[0]}' is none of: hand, hand2, placed, driven, loose, fixed")
    hands = [part for part in parts if part.role == "hand"]
    if len(hands) > 1:
        raise ValueError("two parts have the role \"hand\"; the hand holds one at a time")
    if not hands and parts[0].role is not None:
        raise ValueError("no part has the role \"hand\"; give it to the one that is held at first")
    first = hands or [parts[0]]
    return first + [part for part in parts if part is not first[0]]


def _metres(unit: Union[str, float, None]) -> float:
    if unit is None:
        raise ValueError("the unit of the mesh is not known; give unit=\"mm\" or another one")
    if isinstance(unit, str):
        if unit not in UNITS_M:
            raise ValueError(f"no unit '{unit}'; the units are: {', '.join(UNITS_M)}")
        return UNITS_M[unit]
    return float(unit)


def pose_of(numbers: Sequence[float]) -> Tuple[float, ...]:
    """Three numbers (a position) or seven (and a quaternion x y z w) as a pose."""
    pose = tuple(float(x) for x in numbers)
    if len(pose) == 3:
        return pose + (0.0, 0.0, 0.0, 1.0)
    if len(pose) != 7:
        raise ValueError(f"a pose has 3 numbers (x y z) or 7 (x y z, x y z w), not {len(pose)}")
    return pose


def _part_input(part: Part, unit: Union[str, float, None], alive: list) -> c.PartInput:
    given = c.PartInput()
    given.scale_to_m = _metres(part.unit if part.unit is not None else unit)
    given.pose = (ctypes.c_double * 7)(*pose_of((*part.at, *part.turn)))
    given.simplify_m = part.simplify
    given.may_be_held = _ROLE_NUMBERS.get(part.role or "fixed", 0)
    if part.name:
        given.name = part.name.encode()
    if isinstance(part.mesh, (str, os.PathLike)):
        given.file = os.fsencode(part.mesh)
        return given
    vertices = np.ascontiguousarray(part.mesh[0], dtype=np.float64)
    triangles = np.ascontiguousarray(part.mesh[1], dtype=np.uint32)
    for what, array in (("vertices", vertices), ("triangles", triangles)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{what} have the shape {array.shape}; give an array of n x 3")
    alive += [vertices, triangles]
    given.vertices = vertices.ctypes.data
    given.vertex_count = len(vertices)
    given.triangles = triangles.ctypes.data
    given.triangle_count = len(triangles)
    return given


class _Compiled:
    """Owns a handle of haptic_compile."""

    def __init__(self, handle: ctypes.c_void_p) -> None:
        self.handle = handle
        self._free = c.library.haptic_compiled_free

    def __del__(self) -> None:
        self._free(ctypes.byref(self.handle))

    def messages(self) -> Tuple[c.Message, ...]:
        count = ctypes.c_size_t()
        c.require(c.library.haptic_compiled_message_count(self.handle, ctypes.byref(count)))
        messages = []
        for index in range(count.value):
            m = c.MessageOutput()
            c.require(c.library.haptic_compiled_message(self.handle, index, ctypes.byref(m)))
            texts = [t.decode(errors="replace") for t in (m.file, m.place, m.cause, m.remedy, m.text)]
            messages.append(c.Message(_SEVERITIES[m.severity], *texts))
        return tuple(messages)

    def bytes(self) -> Array:
        """A view of the scene's bytes, without a copy; it keeps the handle alive."""
        address, count = ctypes.c_void_p(), ctypes.c_size_t()
        c.require(
            c.library.haptic_compiled_bytes(self.handle, ctypes.byref(address), ctypes.byref(count))
        )
        memory = (ctypes.c_uint8 * count.value).from_address(address.value)
        memory.owner = self
        view = np.frombuffer(memory, dtype=np.uint8)
        view.flags.writeable = False
        return view


def compile(  # noqa: A001
    moving: Union[Mesh, Part, List[Part]],
    *fixed: Union[Mesh, Part],
    unit: Union[str, float, None] = None,
    start: Optional[Sequence[float]] = None,
    stiffness: float = 800.0,
    friction: float = 0.0,
    grip: Optional[Sequence[float]] = None,
    rate: float = 1000.0,
    name: str = "scene",
) -> Scene:
    """Compiles a scene: the part in the hand, and one or more fixed parts.

    compile("scene.toml") compiles a scene file; nothing else is given then. compile([Part(.., role="hand"),
    Part(.., role="placed"), ..]) compiles parts that the hand holds one after another.

    unit: of meshes that have none of their own ("mm", "m", .. or metres per unit). start: where the part in the hand
    starts, 3 or 7 numbers; None: where its Part says. stiffness [N/m]: that the hand feels. friction: coefficient
    between the part in the hand and all others. grip [m]: grip point in its mesh frame; None: the centre of volume.
    rate [Hz]: of the loop.

    Raises CompileError, whose messages say what is wrong with which part, where, and how to fix it.
    """
    given = c.CompileInput()
    alive: list = []
    if isinstance(moving, list):
        if fixed or len(moving) < 2:
            raise ValueError("give compile([part, part, ..]) with all parts in the list, two at least")
        moving, *fixed = _by_role(moving)
    if not fixed:
        if not isinstance(moving, (str, os.PathLike)):
            raise ValueError("there is no fixed part; give compile(moving, fixed, ..)")
        given.scene_file = os.fsencode(moving)
    else:
        parts = [p if isinstance(p, Part) else Part(p) for p in (moving, *fixed)]
        inputs = [_part_input(part, unit, alive) for part in parts]
        if start is not None:
            inputs[0].pose = (ctypes.c_double * 7)(*pose_of(start))
        given.moving = ctypes.pointer(inputs[0])
        given.fixed = (c.PartInput * len(fixed))(*inputs[1:])
        given.fixed_count = len(fixed)
        given.name = name.encode()
        given.stiffness_n_per_m = stiffness
        given.friction = friction
        given.rate_hz = rate
        if grip is not None:
            given.has_grip = 1
            given.grip_m = (ctypes.c_double * 3)(*grip)
    handle = ctypes.c_void_p()
    error = c.library.haptic_compile(ctypes.byref(given), ctypes.byref(handle))
    if not handle:
        raise CompileError(error)
    compiled = _Compiled(handle)
    messages = compiled.messages()
    if error != c.OK:
        raise CompileError(error, "\n".join(str(m) for m in messages), messages)
    return Scene(compiled.bytes(), messages)


def _aligned(count: int) -> Array:
    """`count` bytes at a multiple of the alignment that the library asks for."""
    room = np.zeros(count + c.ALIGNMENT, dtype=np.uint8)
    skip = -room.ctypes.data % c.ALIGNMENT
    return room[skip : skip + count]


#: What a session came to, gravest first; from "energy_given_out" on it has failed.
OUTCOMES = (
    "followed",
    "no_ticks",
    "energy_given_out",
    "force_without_contact",
    "stuck",
    "inside",
    "behind",
)


@dataclass(frozen=True)
class Verdict:
    """The judgement of a session, the same that host_sim and run_device end with.

    A tick followed the hand where none of the counts from refused_ticks on has it; a tick may be in several. A verdict is
    true where the session has not failed.
    """

    outcome: str  #: of OUTCOMES, the gravest
    failures: Tuple[str, ...]  #: all that failed
    text: str  #: one line: what failed, and the key of the scene that helps
    started_inside: bool
    ticks: int
    followed_ticks: int
    contact_ticks: int  #: the part as it is felt touched something
    refused_ticks: int  #: pose not usable
    inside_ticks: int  #: inside an obstacle, led out without force
    outside_ticks: int  #: after the scene's limits of motion were left
    stuck_ticks: int  #: free to move and pulled, not moved
    list_full_ticks: int  #: more pairs near than the scene's near_pairs
    behind_ticks: int  #: ended for want of budget
    saturated_ticks: int  #: the pull at its limit
    ramped_ticks: int  #: the force ramped out or in
    longest_open_ticks: int  #: longest run with force and without contact
    longest_stuck_ticks: int
    open_force: float  #: largest force in a run without contact that fails [N]
    given_out: float  #: by the rendering [J]; nan: the scene has no observer of it

    def __bool__(self) -> bool:
        return not self.failures

    def __str__(self) -> str:
        return self.text


def verdict_of(call: Any, handle: ctypes.c_void_p) -> Verdict:
    """What haptic_core_verdict or haptic_session_verdict says."""
    v = c.VerdictOutput()
    c.require(call(handle, ctypes.byref(v)))
    failures = tuple(name for k, name in enumerate(OUTCOMES) if v.failures >> k & 1)
    return Verdict(
        OUTCOMES[v.verdict],
        failures,
        v.text.decode(errors="replace"),
        v.started_inside != 0,
        v.ticks,
        v.followed_ticks,
        v.contact_ticks,
        v.refused_ticks,
        v.inside_ticks,
        v.outside_ticks,
        v.stuck_ticks,
        v.list_full_ticks,
        v.behind_ticks,
        v.saturated_ticks,
        v.ramped_ticks,
        v.longest_open_ticks,
        v.longest_stuck_ticks,
        v.open_force_n,
        v.given_out_j,
    )


@dataclass(frozen=True)
class Replay:
    """What a motion gives, a row for each tick."""

    times: Array  #: [s]
    forces: Array  #: n x 3, on the hand, W axes [N]
    torques: Array  #: n x 3, about the grip point [N m]
    felt_poses: Array  #: n x 7: where the part is held, free of obstacles
    gaps: Array  #: smallest gap of the felt pose to a fixed part [m]
    situations: Array  #: index into SITUATIONS
    flags: Array  #: StepFlag of the C++ interface
    hashes: Array  #: equal runs have equal ones
    verdict: Verdict  #: of the core, these ticks and those before


@dataclass(frozen=True)
class StepResult:
    """What one tick gives; as in Replay."""

    force: Array
    torque: Array
    felt_pose: Array
    gap: float
    situation: str
    flags: int
    hash: int


@dataclass(frozen=True)
class Contact:
    """A point at which the part in the hand touches another."""

    point: Array  #: in W [m]
    normal: Array  #: unit, W axes, from the other part to the one in the hand
    force: Array  #: on the part in the hand [N]: its share of the wrench
    part: int  #: that it touches, by its number; the one in the hand is 0
    situation: str  #: of its pair of convex pieces


@dataclass(frozen=True)
class Contacts:
    """The contacts of a tick; false where there are none.

    Their forces, and the torques of these about the felt pose's grip point, make the wrench of the tick but for `rest`. How
    much each carries is the share of least squares among all that push: a table on four legs determines no more.
    """

    points: Tuple[Contact, ...]
    rest: Array  #: 6 numbers, force and torque: while the part moves, a ramp, what the planes do not hold

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[Contact]:
        return iter(self.points)


def contacts_of(call: Any, handle: ctypes.c_void_p) -> Contacts:
    """What haptic_core_contacts or haptic_session_contacts says."""
    given, rest = (c.ContactOutput * c.MOST_CONTACTS)(), (ctypes.c_double * 6)()
    count = ctypes.c_size_t()
    c.require(call(handle, given, c.MOST_CONTACTS, ctypes.sizeof(c.ContactOutput), ctypes.byref(count), rest))
    points = tuple(
        Contact(np.array(p.point_m), np.array(p.normal), np.array(p.force_n), p.part, SITUATIONS[p.situation])
        for p in given[: count.value]
    )
    return Contacts(points, np.array(rest))


def _result_of(out: Any) -> StepResult:
    wrench = np.array(out.wrench)
    return StepResult(
        wrench[:3],
        wrench[3:],
        np.array(out.felt_pose),
        out.gap_m,
        SITUATIONS[out.situation],
        out.flags,
        out.state_hash,
    )


class Core:
    """The tick by itself, for a loop of your own. Not for two threads at a time."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene  # its bytes stay where they are
        self._memory = _aligned(scene.info.memory_bytes)
        self._handle = ctypes.c_void_p()
        c.require(
            c.library.haptic_core_create(
                scene.bytes.ctypes.data,
                len(scene.bytes),
                self._memory.ctypes.data,
                len(self._memory),
                ctypes.byref(self._handle),
            )
        )
        self._input, self._output = c.StepInput(), c.StepOutput()
        self._second_input, self._second_output = c.StepInput(), c.StepOutput()

    def step(self, pose: Sequence[float], time: float, clutched: bool = False) -> StepResult:
        """One tick: the pose that the hand wants, sensed at `time` [s]."""
        self._input.pose = (ctypes.c_double * 7)(*pose_of(pose))
        self._input.time_s = time
        self._input.clutched = 1 if clutched else 0
        out = self._output
        c.require(
            c.library.haptic_core_step(self._handle, ctypes.byref(self._input), ctypes.byref(out))
        )
        return _result_of(out)

    def step_hands(
        self,
        first: Optional[Sequence[float]],
        second: Optional[Sequence[float]],
        time: float,
        clutched: Tuple[bool, bool] = (False, False),
    ) -> Tuple[Optional[StepResult], Optional[StepResult]]:
        """One tick of a scene with two hands: the pose that each wants, sensed at `time` [s].

        None: that hand keeps its goal, its part is held still, and it has no result. What one feels of the other is minus
        what that feels. Raises HapticError where the scene has one hand.
        """
        inputs, outputs = (self._input, self._second_input), (self._output, self._second_output)
        given, wanted = [], []
        for k, pose in enumerate((first, second)):
            if pose is None:
                given.append(None)
                wanted.append(None)
                continue
            inputs[k].pose = (ctypes.c_double * 7)(*pose_of(pose))
            inputs[k].time_s = time
            inputs[k].clutched = 1 if clutched[k] else 0
            given.append(ctypes.byref(inputs[k]))
            wanted.append(ctypes.byref(outputs[k]))
        c.require(c.library.haptic_core_step_hands(self._handle, *given, *wanted))
        return tuple(None if pose is None else _result_of(out) for pose, out in zip((first, second), outputs))

    def hold(self, part: str) -> bool:
        """The hand holds this part of the scene. False: it lets go of what it holds first; step on, and ask again.

        True: the next step takes the part where it is, with no force. The pose that a step is given stays that of the first
        part: each part is led by its own grip point as the first one is by its. Raises ValueError where no such part may
        be held.
        """
        error = c.library.haptic_core_hold_part(self._handle, 0, part_of(self.bodies, part))
        if error == c.BUSY:
            return False
        c.require(error)
        return True

    def release(self) -> None:
        """The hand lets go: the force fades in some 50 ticks while the part stays."""
        c.require(c.library.haptic_core_release_part(self._handle, 0))

    @property
    def bodies(self) -> Dict[str, Body]:
        """Where the parts are, by name; empty for a scene of one moving part."""
        return bodies_of(c.library.haptic_core_bodies, self._handle)

    def drive(
        self,
        part: str,
        pose: Sequence[float],
        time: float,
        *,
        fastest: float = 0.25,
        fastest_turn: float = 1.0,
        late: float = 0.1,
        stands: bool = False,
    ) -> None:
        """The owner of a driven part has its mesh frame at `pose` (3 or 7 numbers) at `time` [s], that of the steps.

        To be called 30 to 1000 times a second; between two poses it is interpolated, an interval behind. fastest [m/s],
        fastest_turn [rad/s]: the owner moves it no faster. late [s]: a newer pose comes within it. stands: it stays there,
        and none is waited for. A pose that is too fast, late or not finite stops it; where it touches the part in the hand
        the force fades meanwhile. Raises ValueError where no such part is driven.
        """
        given = frame_of(pose, fastest, fastest_turn, late, stands)
        number = driven_part(self.bodies, part)
        c.require(c.library.haptic_core_drive(self._handle, number, ctypes.byref(given), time))

    @property
    def driven(self) -> Dict[str, Driven]:
        """The driven parts after the last step, by name."""
        return driven_of(c.library.haptic_core_driven, self._handle, self.bodies)

    def contacts(self) -> Contacts:
        """The contacts of the last step, with their shares of its wrench; none where the part is free.

        Raises HapticError for a scene whose law is not proxy, or with parts that are held one after another, by a second hand,
        driven or loose.
        """
        return contacts_of(c.library.haptic_core_contacts, self._handle)

    def save(self) -> bytes:
        """All that this core knows: `load` of another core of the same scene goes on from here with the same bits.

        The bytes are of this build of the library. Raises HapticError for a scene with parts as `contacts` does.
        """
        count = ctypes.c_size_t()
        error = c.library.haptic_core_save(self._handle, None, 0, ctypes.byref(count))
        if error != c.SIZE:
            c.require(error)
        state = ctypes.create_string_buffer(count.value)
        c.require(c.library.haptic_core_save(self._handle, state, count.value, ctypes.byref(count)))
        return state.raw

    def load(self, state: bytes) -> None:
        """Goes on from what `save` has given. Load none from a stranger: it can do as much harm as a program.

        Raises HapticError with a sentence where the state is cut off, damaged, of another scene, version, precision or build;
        the core is then as before.
        """
        text = ctypes.create_string_buffer(256)
        error = c.library.haptic_core_load(self._handle, bytes(state), len(state), text, len(text))
        if error != c.OK:
            raise c.HapticError(error, text.value.decode(errors="replace"))

    def verdict(self) -> Verdict:
        """The judgement of all ticks since the core was made or reset."""
        return verdict_of(c.library.haptic_core_verdict, self._handle)

    def reset(self) -> None:
        """Forgets all contact and the verdict: the next tick is a first tick."""
        c.require(c.library.haptic_core_reset(self._handle))

    def step_many(self, poses: Array, times: Optional[Array] = None, out: Optional[Array] = None) -> Array:
        """Many ticks in one call, without a copy, other Python threads running meanwhile. Returns the wrenches, n x 6.

        poses: n x 7, float64, contiguous (a copy would be hidden work: anything else raises ValueError). times [s]: of each, the
        same; None: by the scene's rate, on from the last tick. out: n x 6 to write to, or None for a new one. Raises HapticError
        with the index of a pose that is refused: the ticks before it are done. Not for two threads at a time: the second
        gets HAPTIC_ERROR_BUSY. `replay` gives more of each tick.
        """
        count = len(poses)
        wrenches = np.empty((count, 6)) if out is None else out
        for what, array, shape in (("poses", poses, (count, 7)), ("times", times, (count,)), ("out", wrenches, (count, 6))):
            if array is None:
                continue
            right = isinstance(array, np.ndarray) and array.dtype == np.float64 and array.flags.c_contiguous
            if not right or array.shape != shape:
                raise ValueError(f"{what}: give a contiguous array of float64 with the shape {shape}")
        if not wrenches.flags.writeable:
            raise ValueError("out: give an array that can be written to")
        if count == 0:
            return wrenches
        self._replay(
            c.ReplayCall(
                count=count,
                poses=poses.ctypes.data,
                times_s=None if times is None else times.ctypes.data,
                wrenches=wrenches.ctypes.data,
            )
        )
        return wrenches

    def _replay(self, call: c.ReplayCall) -> None:
        error = c.library.haptic_core_replay(self._handle, ctypes.byref(call))
        if error == c.BUSY:
            c.require(error)
        if error != c.OK and call.count > 0:
            text = c.library.haptic_error_text(error).decode()
            raise c.HapticError(error, f"tick {call.done}: {text}")
        c.require(error)

    def replay(self, poses: Any, times: Any = None) -> Replay:
        """Many ticks in one call; goes on from the last one. See Scene.replay."""
        poses = np.ascontiguousarray(poses, dtype=np.float64)
        if poses.ndim != 2 or poses.shape[1] not in (3, 7):
            raise ValueError(f"poses have the shape {poses.shape}; give n x 7 or, for positions, n x 3")
        count = len(poses)
        if poses.shape[1] == 3:
            poses = np.hstack([poses, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))])
        if times is None:
            times = np.arange(count) / self.scene.info.rate_hz
        times = np.ascontiguousarray(times, dtype=np.float64)
        if times.shape != (count,):
            raise ValueError(f"there are {count} poses, and times have the shape {times.shape}")
        wrenches, felt, gaps = np.empty((count, 6)), np.empty((count, 7)), np.empty(count)
        situations, flags = np.empty(count, np.uint32), np.empty(count, np.uint32)
        hashes = np.empty(count, np.uint64)
        call = c.ReplayCall(
            count=count,
            poses=poses.ctypes.data,
            times_s=times.ctypes.data,
            wrenches=wrenches.ctypes.data,
            felt_poses=felt.ctypes.data,
            gaps_m=gaps.ctypes.data,
            situations=situations.ctypes.data,
            flags=flags.ctypes.data,
            state_hashes=hashes.ctypes.data,
        )
        self._replay(call)
        verdict = self.verdict()
        return Replay(
            times, wrenches[:, :3], wrenches[:, 3:], felt, gaps, situations, flags, hashes, verdict
        )


class Scene:
    """A compiled scene. `bytes` is what graph_compiler writes; `messages` what the compiler said."""

    def __init__(self, data: Any, messages: Sequence[c.Message] = ()) -> None:
        array = np.frombuffer(data, dtype=np.uint8)
        if array.ctypes.data % c.ALIGNMENT != 0:
            copied = _aligned(len(array))
            copied[:] = array
            array = copied
        self.bytes = array
        self.messages = tuple(messages)
        self.info = c.SceneInfo()
        error = c.library.haptic_scene_read(array.ctypes.data, len(array), ctypes.byref(self.info))
        if error != c.OK:
            raise c.HapticError(error, self.info.trouble.decode())

    @staticmethod
    def load(path: Union[str, "os.PathLike[str]"]) -> Scene:
        """Reads a scene that was saved, or written by graph_compiler."""
        with open(path, "rb") as file:
            return Scene(file.read())

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the scene, for example for host_sim or run_device."""
        with open(path, "wb") as file:
            file.write(self.bytes.tobytes())

    @property
    def name(self) -> str:
        return self.info.name.decode(errors="replace")

    @property
    def start(self) -> Array:
        """The pose at which the part in the hand starts, 7 numbers."""
        return np.array(self.info.start_pose)

    def core(self) -> Core:
        """A core of its own, for a loop of your own."""
        return Core(self)

    def replay(self, poses: Any, times: Any = None) -> Replay:
        """Runs a motion, from a forgotten history, at the speed of the C++ program.

        poses: n x 7 (x y z, quaternion x y z w of A's mesh frame in W) or n x 3 (positions). times [s]: of each;
        None: by the scene's rate. Raises HapticError with the index of a pose that is refused.
        """
        return Core(self).replay(poses, times)

    def __repr__(self) -> str:
        return f"<haptic.Scene '{self.name}', {self.info.parts} parts, {len(self.bytes)} bytes>"
