# SPDX-License-Identifier: Apache-2.0
"""A motion of the part in the hand to a goal, with a proof that each step of it is free."""

from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Optional, Sequence, Union

import numpy as np

from . import _library as c
from .scene import Array, Scene, pose_of


class PlanError(c.HapticError):
    """There is no plan; its text says why.

    nearest [m]: where no way was found, how near poses came that were reached from both ends.
    """

    def __init__(self, number: int, what: str = "", nearest: float = 0.0) -> None:
        super().__init__(number, what)
        self.nearest = nearest


@dataclass(frozen=True)
class Plan:
    """A proved motion. `bytes` is a plan file: `scene_inspect --plan` proves it again, [guide] leads along it."""

    bytes: bytes
    poses: Array  #: n x 7, from start to goal; straight and at constant speed from each to the next
    stations: int  #: that a guide leads along
    length: float  #: [m]; a turn of 1 rad counts as the largest distance from the grip point
    least: float  #: least distance that the proof leaves [m]; below 0: depth that counts as free
    seconds: float  #: that the search took
    text: str  #: one line

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the plan file."""
        with open(path, "wb") as file:
            file.write(self.bytes)

    def __str__(self) -> str:
        return self.text


def _taken(handle: ctypes.c_void_p, facts: c.PlanFacts) -> Plan:
    address, count = ctypes.c_void_p(), ctypes.c_size_t()
    out = ctypes.byref(address), ctypes.byref(count)
    c.require(c.library.haptic_planned_bytes(handle, *out))
    data = ctypes.string_at(address.value, count.value)
    c.require(c.library.haptic_planned_poses(handle, *out))
    numbers = (ctypes.c_double * (7 * count.value)).from_address(address.value)
    poses = np.array(numbers).reshape(-1, 7)
    text = facts.text.decode(errors="replace")
    return Plan(
        data, poses, facts.stations, facts.length_m, facts.least_m, facts.search_s, text
    )


def plan(
    scene: Scene,
    goal: Sequence[float],
    start: Optional[Sequence[float]] = None,
    seconds: float = 120.0,
    seed: int = 1,
    shorten_work: Optional[int] = None,
) -> Plan:
    """Finds a motion of the part in the hand to a goal, and proves every step of it free.

    goal, start: poses of A's mesh frame in W, 3 or 7 numbers; three numbers do not turn the mesh frame. start: None: the
    scene's. seconds: for the search. seed: the same one gives the same plan. shorten_work: on making the plan shorter,
    counted in vertices that it may look at; None: about half a minute. Blocks meanwhile; other threads of Python run.

    Raises PlanError: no way was found (HAPTIC_ERROR_NO_PLAN), or start or goal is not free (HAPTIC_ERROR_INPUT).
    """
    given = c.PlanInput()
    given.goal_pose = (ctypes.c_double * 7)(*pose_of(goal))
    if start is not None:
        given.has_start = 1
        given.start_pose = (ctypes.c_double * 7)(*pose_of(start))
    given.seconds = seconds
    given.seed = seed
    given.shorten_work = 6_000_000_000 if shorten_work is None else shorten_work
    handle = ctypes.c_void_p()
    error = c.library.haptic_plan(
        scene.bytes.ctypes.data, len(scene.bytes), ctypes.byref(given), ctypes.byref(handle)
    )
    if not handle:
        raise PlanError(error)
    try:
        facts = c.PlanFacts()
        c.require(c.library.haptic_planned_facts(handle, ctypes.byref(facts)))
        if error != c.OK:
            raise PlanError(error, facts.text.decode(errors="replace"), facts.nearest_m)
        return _taken(handle, facts)
    finally:
        c.library.haptic_planned_free(ctypes.byref(handle))
