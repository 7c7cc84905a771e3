# SPDX-License-Identifier: Apache-2.0
"""Haptic rendering of contact, in six degrees of freedom.

    import haptic

    scene = haptic.compile("peg.stl", "hole.stl", unit="mm", start=(0, 0, 0.05))
    with haptic.Session(scene, device="sim") as s:
        s.hand.move_to(z=-0.02, seconds=2)
        s.plot("force.png")

Units are SI: m, s, N, N m. Frames: W the workspace, A the part in the hand (the frame of its mesh). A pose is seven
numbers, x y z and the unit quaternion x y z w, of A's mesh frame in W; a wrench is six, force and torque on the hand about
the grip point, in W axes.

Pure Python over the C interface (haptic.h) by ctypes; the shared library is found as HAPTIC_LIBRARY says, or
by the system's loader.
"""

from ._library import HapticError, Message, version
from .planning import Plan, PlanError, plan
from .scene import Body, CompileError, Contact, Contacts, Core, Driven, Part, Replay, Scene, StepResult, Verdict, compile
from .session import FAULT_FRAME, DeviceStatus, Event, Hand, Limits, Session, State, Tick

__version__ = version()
__all__ = [
    "FAULT_FRAME",
    "Body",
    "CompileError",
    "Contact",
    "Contacts",
    "Core",
    "DeviceStatus",
    "Driven",
    "Event",
    "Hand",
    "HapticError",
    "Limits",
    "Message",
    "Part",
    "Plan",
    "PlanError",
    "Replay",
    "Scene",
    "Session",
    "State",
    "StepResult",
    "Tick",
    "Verdict",
    "compile",
    "plan",
    "version",
]
