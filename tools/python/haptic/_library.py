# SPDX-License-Identifier: Apache-2.0
"""The shared library and the structures of haptic.h."""

from __future__ import annotations

import ctypes
import os
from ctypes import (
    POINTER,
    Structure,
    c_char,
    c_char_p,
    c_double,
    c_int,
    c_int32,
    c_size_t,
    c_uint32,
    c_uint64,
    c_void_p,
)
from dataclasses import dataclass
from typing import Any, Sequence

ALIGNMENT = 64
OK, SIZE, CLOSED, BUSY, POSE, INPUT, INTERNAL, NO_PART = 0, 2, 4, 6, 8, 11, 15, 17
MOST_CONTACTS = 48  #: of a tick
MOST_PARTS = 64  #: of a scene whose parts the hand holds one after another
RELEASE, HOLD, HOLD_AGAIN = 0, 1, 2


class _Sized(Structure):
    """A structure that begins with its size."""

    def __init__(self, **members: Any) -> None:
        super().__init__(**members)
        self.struct_size = ctypes.sizeof(type(self))


class SceneInfo(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("parts", c_uint32),
        ("pieces", c_uint32),
        ("pairs", c_uint32),
        ("memory_bytes", c_uint64),
        ("rate_hz", c_double),
        ("start_pose", c_double * 7),
        ("grip_m", c_double * 3),
        ("stiffness_n_per_m", c_double),
        ("name", c_char * 208),
        ("trouble", c_char * 96),
    ]


class VerdictOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("verdict", c_uint32),
        ("failures", c_uint32),
        ("started_inside", c_uint32),
        ("ticks", c_uint64),
        ("followed_ticks", c_uint64),
        ("contact_ticks", c_uint64),
        ("refused_ticks", c_uint64),
        ("inside_ticks", c_uint64),
        ("outside_ticks", c_uint64),
        ("stuck_ticks", c_uint64),
        ("list_full_ticks", c_uint64),
        ("behind_ticks", c_uint64),
        ("saturated_ticks", c_uint64),
        ("ramped_ticks", c_uint64),
        ("longest_open_ticks", c_uint64),
        ("longest_stuck_ticks", c_uint64),
        ("open_force_n", c_double),
        ("given_out_j", c_double),
        ("text", c_char * 768),
    ]


class StepInput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("clutched", c_uint32),
        ("time_s", c_double),
        ("pose", c_double * 7),
    ]


class StepOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("situation", c_uint32),
        ("wrench", c_double * 6),
        ("felt_pose", c_double * 7),
        ("gap_m", c_double),
        ("flags", c_uint32),
        ("near_count", c_uint32),
        ("state_hash", c_uint64),
    ]


class ReplayCall(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("count", c_size_t),
        ("poses", c_void_p),
        ("times_s", c_void_p),
        ("wrenches", c_void_p),
        ("felt_poses", c_void_p),
        ("gaps_m", c_void_p),
        ("situations", c_void_p),
        ("flags", c_void_p),
        ("state_hashes", c_void_p),
        ("done", c_size_t),
    ]


class PartInput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("may_be_held", c_uint32),
        ("file", c_char_p),
        ("name", c_char_p),
        ("vertices", c_void_p),
        ("vertex_count", c_size_t),
        ("triangles", c_void_p),
        ("triangle_count", c_size_t),
        ("scale_to_m", c_double),
        ("pose", c_double * 7),
        ("simplify_m", c_double),
    ]


class CompileInput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("has_grip", c_uint32),
        ("scene_file", c_char_p),
        ("name", c_char_p),
        ("moving", POINTER(PartInput)),
        ("fixed", POINTER(PartInput)),
        ("fixed_count", c_size_t),
        ("stiffness_n_per_m", c_double),
        ("friction", c_double),
        ("rate_hz", c_double),
        ("grip_m", c_double * 3),
    ]


class MessageOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("severity", c_uint32),
        ("file", c_char_p),
        ("place", c_char_p),
        ("cause", c_char_p),
        ("remedy", c_char_p),
        ("text", c_char_p),
    ]


class PlanInput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("has_start", c_uint32),
        ("start_pose", c_double * 7),
        ("goal_pose", c_double * 7),
        ("seconds", c_double),
        ("seed", c_uint64),
        ("shorten_work", c_uint64),
    ]


class PlanFacts(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("steps", c_uint64),
        ("stations", c_uint64),
        ("length_m", c_double),
        ("least_m", c_double),
        ("search_s", c_double),
        ("nearest_m", c_double),
        ("text", c_char * 512),
    ]


class SessionOptions(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("hold", c_uint32),
        ("device", c_char_p),
        ("rate_hz", c_double),
        ("history_s", c_double),
        ("priority", c_int32),
        ("hands", c_int32),
    ]


class StateOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("link", c_uint32),
        ("tick", c_uint64),
        ("time_s", c_double),
        ("hand_pose", c_double * 7),
        ("felt_pose", c_double * 7),
        ("wrench", c_double * 6),
        ("sent_wrench", c_double * 6),
        ("gap_m", c_double),
        ("state_hash", c_uint64),
        ("situation", c_uint32),
        ("flags", c_uint32),
        ("arming", c_uint32),
        ("safety_faults", c_uint32),
        ("device_faults", c_uint32),
        ("hand_held", c_uint32),
        ("armings", c_uint32),
        ("reserved", c_uint32),
        ("goals_reached", c_uint64),
        ("late_ticks", c_uint64),
        ("missed_periods", c_uint64),
        ("longest_tick_s", c_double),
    ]


class GainsOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("lowered", c_uint32),
        ("stiffness_n_per_m", c_double),
        ("stiffness_nm_per_rad", c_double),
        ("asked_n_per_m", c_double),
        ("asked_nm_per_rad", c_double),
        ("text", c_char * 512),
    ]


class HandGoal(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("hand", c_uint32),
        ("pose", c_double * 7),
        ("seconds", c_double),
    ]


class Frame(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("stands", c_uint32),
        ("pose", c_double * 7),
        ("fastest_m_per_s", c_double),
        ("fastest_rad_per_s", c_double),
        ("late_s", c_double),
    ]


class BodyOutput(Structure):
    _fields_ = [
        ("pose", c_double * 7),
        ("part", c_uint32),
        ("role", c_uint32),
        ("held_by", c_uint32),
        ("reserved", c_uint32),
        ("name", c_char * 64),
    ]


class DrivenOutput(Structure):
    _fields_ = [
        ("pose", c_double * 7),
        ("commanded", c_double * 7),
        ("lag_m", c_double),
        ("lag_rad", c_double),
        ("wrench", c_double * 6),
        ("part", c_uint32),
        ("touches", c_uint32),
        ("lost", c_uint32),
        ("reserved", c_uint32),
    ]


class DeviceStatusOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("phase", c_uint32),
        ("link", c_uint32),
        ("faults", c_uint32),
        ("is_silent", c_uint32),
        ("exit_code", c_int32),
        ("connects", c_uint64),
        ("reports", c_uint64),
        ("force_n", c_double),
        ("torque_nm", c_double),
        ("waits_for", c_char * 256),
        ("trouble", c_char * 256),
        ("why", c_char * 512),
    ]


class EventOutput(Structure):
    _fields_ = [
        ("number", c_uint64),
        ("time_s", c_double),
        ("device", c_uint32),
        ("level", c_uint32),
        ("name", c_char * 24),
        ("text", c_char * 464),
    ]


class ContactOutput(Structure):
    _fields_ = [
        ("point_m", c_double * 3),
        ("normal", c_double * 3),
        ("force_n", c_double * 3),
        ("part", c_uint32),
        ("situation", c_uint32),
    ]


class ServoOptions(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("deadman", c_uint32),
        ("clutch", c_uint32),
        ("emergency_stop", c_uint32),
        ("driven_axes", c_uint32),
        ("is_absolute", c_uint32),
        ("rate_hz", c_double),
        ("scale", c_double),
        ("rotation", c_double * 4),
        ("offset_m", c_double * 3),
        ("part_rotation", c_double * 4),
        ("max_force_n", c_double),
        ("max_torque_nm", c_double),
        ("slew_n_per_s", c_double),
        ("slew_nm_per_s", c_double),
        ("ramp_in_s", c_double),
        ("jump_speed_m_per_s", c_double),
        ("jump_turn_rad_per_s", c_double),
    ]


class ServoInput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("ready", c_uint32),
        ("switches", c_uint32),
        ("has_twist", c_uint32),
        ("emergency_stop", c_uint32),
        ("device_faults", c_uint32),
        ("report", c_uint64),
        ("report_time_s", c_double),
        ("time_s", c_double),
        ("pose", c_double * 7),
        ("twist", c_double * 6),
    ]


class ServoOutput(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("arming", c_uint32),
        ("wrench", c_double * 6),
        ("rendered", c_double * 6),
        ("felt_pose", c_double * 7),
        ("goal_pose", c_double * 7),
        ("gap_m", c_double),
        ("state_hash", c_uint64),
        ("safety_faults", c_uint32),
        ("present_faults", c_uint32),
        ("waits", c_uint32),
        ("limited", c_uint32),
        ("situation", c_uint32),
        ("flags", c_uint32),
        ("near_count", c_uint32),
        ("armings", c_uint32),
        ("work", c_uint32),
        ("reserved", c_uint32),
    ]


MOST_EVENTS = 64  #: that a session keeps

_HANDLE, _OUT = c_void_p, POINTER(c_void_p)
_CALLS: dict[str, tuple[Any, list[Any]]] = {
    "haptic_version": (c_char_p, []),
    "haptic_error_name": (c_char_p, [c_int]),
    "haptic_error_text": (c_char_p, [c_int]),
    "haptic_scene_read": (c_int, [c_void_p, c_size_t, POINTER(SceneInfo)]),
    "haptic_core_create": (c_int, [c_void_p, c_size_t, c_void_p, c_size_t, _OUT]),
    "haptic_core_step": (c_int, [_HANDLE, POINTER(StepInput), POINTER(StepOutput)]),
    "haptic_core_replay": (c_int, [_HANDLE, POINTER(ReplayCall)]),
    "haptic_core_verdict": (c_int, [_HANDLE, POINTER(VerdictOutput)]),
    "haptic_core_reset": (c_int, [_HANDLE]),
    "haptic_core_hold_part": (c_int, [_HANDLE, c_uint32, c_uint32]),
    "haptic_core_release_part": (c_int, [_HANDLE, c_uint32]),
    "haptic_core_bodies": (c_int, [_HANDLE, POINTER(BodyOutput), c_size_t, c_size_t, POINTER(c_size_t)]),
    "haptic_core_step_hands": (
        c_int,
        [_HANDLE, POINTER(StepInput), POINTER(StepInput), POINTER(StepOutput), POINTER(StepOutput)],
    ),
    "haptic_core_drive": (c_int, [_HANDLE, c_uint32, POINTER(Frame), c_double]),
    "haptic_core_driven": (c_int, [_HANDLE, POINTER(DrivenOutput), c_size_t, c_size_t, POINTER(c_size_t)]),
    "haptic_core_contacts": (
        c_int,
        [_HANDLE, POINTER(ContactOutput), c_size_t, c_size_t, POINTER(c_size_t), POINTER(c_double)],
    ),
    "haptic_core_save": (c_int, [_HANDLE, c_void_p, c_size_t, POINTER(c_size_t)]),
    "haptic_core_load": (c_int, [_HANDLE, c_void_p, c_size_t, c_char_p, c_size_t]),
    "haptic_core_close": (c_int, [_HANDLE]),
    "haptic_compile": (c_int, [POINTER(CompileInput), _OUT]),
    "haptic_compiled_bytes": (c_int, [_HANDLE, _OUT, POINTER(c_size_t)]),
    "haptic_compiled_message_count": (c_int, [_HANDLE, POINTER(c_size_t)]),
    "haptic_compiled_message": (c_int, [_HANDLE, c_size_t, POINTER(MessageOutput)]),
    "haptic_compiled_free": (c_int, [_OUT]),
    "haptic_plan": (c_int, [c_void_p, c_size_t, POINTER(PlanInput), _OUT]),
    "haptic_planned_bytes": (c_int, [_HANDLE, _OUT, POINTER(c_size_t)]),
    "haptic_planned_poses": (c_int, [_HANDLE, _OUT, POINTER(c_size_t)]),
    "haptic_planned_facts": (c_int, [_HANDLE, POINTER(PlanFacts)]),
    "haptic_planned_free": (c_int, [_OUT]),
    "haptic_session_open_text": (
        c_int,
        [c_void_p, c_size_t, POINTER(SessionOptions), _OUT, c_char_p, c_size_t],
    ),
    "haptic_session_open_external": (
        c_int,
        [c_void_p, c_size_t, POINTER(SessionOptions), POINTER(ServoOptions), _OUT, c_char_p, c_size_t],
    ),
    "haptic_session_tick": (c_int, [_HANDLE, POINTER(ServoInput), POINTER(ServoOutput)]),
    "haptic_session_contacts": (
        c_int,
        [_HANDLE, POINTER(ContactOutput), c_size_t, c_size_t, POINTER(c_size_t), POINTER(c_double)],
    ),
    "haptic_session_device": (c_int, [_HANDLE, c_uint32, POINTER(DeviceStatusOutput)]),
    "haptic_session_events": (c_int, [_HANDLE, POINTER(EventOutput), c_size_t, c_size_t, POINTER(c_size_t)]),
    "haptic_session_state_of": (c_int, [_HANDLE, c_uint32, POINTER(StateOutput)]),
    "haptic_session_gains": (c_int, [_HANDLE, POINTER(GainsOutput)]),
    "haptic_session_verdict_of": (c_int, [_HANDLE, c_uint32, POINTER(VerdictOutput)]),
    "haptic_session_history_of": (
        c_int,
        [_HANDLE, c_uint32, c_void_p, c_size_t, c_size_t, POINTER(c_size_t)],
    ),
    "haptic_session_move_hand": (c_int, [_HANDLE, POINTER(HandGoal), POINTER(c_uint64)]),
    "haptic_session_hold_of": (c_int, [_HANDLE, c_uint32, c_int]),
    "haptic_session_hold_part": (c_int, [_HANDLE, c_uint32, c_uint32]),
    "haptic_session_release_part": (c_int, [_HANDLE, c_uint32]),
    "haptic_session_bodies": (c_int, [_HANDLE, POINTER(BodyOutput), c_size_t, c_size_t, POINTER(c_size_t)]),
    "haptic_session_frame": (c_int, [_HANDLE, POINTER(Frame)]),
    "haptic_session_drive": (c_int, [_HANDLE, c_uint32, POINTER(Frame)]),
    "haptic_session_driven": (c_int, [_HANDLE, POINTER(DrivenOutput), c_size_t, c_size_t, POINTER(c_size_t)]),
    "haptic_session_stop": (c_int, [_HANDLE]),
    "haptic_session_close": (c_int, [_HANDLE]),
    "haptic_session_free": (c_int, [_OUT]),
}


def _load() -> ctypes.CDLL:
    name = os.environ.get("HAPTIC_LIBRARY", "libhaptic.so.0")
    try:
        library = ctypes.CDLL(name)
    except OSError as error:
        raise ImportError(
            f"the shared library {name} cannot be loaded ({error}); install it with "
            "`cmake --install`, or set HAPTIC_LIBRARY to its path"
        ) from error
    for call, (result, arguments) in _CALLS.items():
        function = getattr(library, call)
        function.restype = result
        function.argtypes = arguments
    return library


library = _load()


@dataclass(frozen=True)
class Message:
    """One message of the compiler; a part that it does not have is empty."""

    severity: str  #: "note", "warning" or "error"
    file: str  #: file or part
    place: str  #: "41", "12:3" (line, column), "byte 812"
    cause: str
    remedy: str
    text: str  #: the whole

    def __str__(self) -> str:
        return self.text


class HapticError(Exception):
    """An error of the library.

    number, name: as in haptic.h. messages: what the compiler said, else empty.
    """

    def __init__(self, number: int, what: str = "", messages: Sequence[Message] = ()) -> None:
        self.number = number
        self.name = library.haptic_error_name(number).decode()
        self.messages = tuple(messages)
        text = what or library.haptic_error_text(number).decode()
        super().__init__(f"{text} ({self.name})")


def require(error: int) -> None:
    """Raises HapticError for any number but that of success."""
    if error != OK:
        raise HapticError(error)


def version() -> str:
    """Version of the shared library."""
    return library.haptic_version().decode()
