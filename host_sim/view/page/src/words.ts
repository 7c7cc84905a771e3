// SPDX-License-Identifier: Apache-2.0
// The core's numbers in words.
import type { DrivenPicture } from "./messages";

const kSituations: Record<string, string> = {
  none: "free: nothing touches",
  face_vertex: "a face of the part on a vertex",
  vertex_face: "a vertex of the part on a face",
  edge_edge: "edge on edge",
  edge_face: "edge on face",
  face_face: "face on face",
  several_planes: "contact on several planes",
};

export function situationText(name: string): string {
  return kSituations[name] ?? name;
}

const kLaws: Record<string, string> = {
  proxy: "proxy: the part is held outside of every obstacle, a spring joins it to the hand",
  paper: "paper: equations (1) to (6) as published",
};

export function lawText(law: string): string {
  return kLaws[law] ?? law;
}

/** Name and meaning of each bit of StepFlag (rt_core/tick/step.hpp), from bit 0 on; those without a text are not shown. */
const kFlags: ([string, string] | null)[] = [
  null, // first tick of a pair
  null, // searched again after a jump
  null, // bound beyond the exact band
  null, // touching within rounding
  ["undecided", "no proof found whether a pair overlaps"],
  ["near set cut", "a near set had no room for all nodes"],
  null, // inexact distance
  null, // not all pairs searched at the goal
  ["fast", "more motion than the scene's speed certificate allows"],
  ["several planes", "the law was applied to the deepest of several planes"],
  ["pose refused", "the pose is not usable; no force"],
  ["recovery", "the part is inside an obstacle and is led out; force ramped out"],
  ["saturated", "the pull has met its limit of force or torque"],
  ["clutched", "the goal is frozen"],
  ["limited", "a pass of the proxy was cut short"],
  ["stuck", "the part is pulled, free to move, and has not moved"],
  ["hooked", "the hand is out of reach: an obstacle stands between hand and part"],
  ["passivity", "the passivity controller took energy out"],
  ["ramp", "the force is ramped out or in"],
  ["outside", "the scene's envelope was left"],
  ["behind", "the work budget was spent before the part got as far as it could"],
  ["list full", "more pairs are near than near_pairs: one without a slot has cut the part's step"],
  ["held", "the force is held below the spring's: the part has not caught up since its budget was spent"],
  ["driven behind", "a driven part is not where its owner has it: something holds it"],
  ["driven lost", "the poses of a driven part are late, too fast or none: it stands; force ramped out"],
];

/** Flags that are marked over the strips: no pose, a part that is led out, does not follow or is out of reach, a limit, a ramp. */
const kMarked = [10, 11, 12, 13, 15, 16, 18, 19, 20, 21, 22, 23, 24].reduce((bits, bit) => bits | (1 << bit), 0);

export function isMarked(flags: number): boolean {
  return (flags & kMarked) !== 0;
}

/** Whether D_near is a lower bound: beyond the exact band, not exact, or of a pair that was not searched. */
export function isBound(flags: number): boolean {
  return [2, 6, 7].some((bit) => ((flags >>> bit) & 1) === 1);
}

export function flagTexts(flags: number): [string, string][] {
  const texts: [string, string][] = [];
  kFlags.forEach((text, bit) => {
    if (text && ((flags >>> bit) & 1) === 1) texts.push(text);
  });
  return texts;
}

/** Three or four digits with a unit prefix: 1.23 mm. */
export function lengthText(metres: number): string {
  const size = Math.abs(metres);
  if (!Number.isFinite(metres)) return "-";
  if (size >= 0.01) return `${(metres * 1e3).toFixed(1)} mm`;
  if (size < 5e-9) return "0 µm";
  if (size >= 1e-5) return `${(metres * 1e3).toFixed(3)} mm`;
  return `${(metres * 1e6).toFixed(2)} µm`;
}

/** Lag and push of a driven part, in two lines. */
export function drivenText(name: string, { lag_m, lag_rad, push_n, isLost }: DrivenPicture): string {
  const lag = lag_m < kSame_m && lag_rad < kSame_rad ? "where its owner has it" : `behind by ${lengthText(lag_m)}, ${(lag_rad * 1e3).toFixed(2)} mrad`;
  const lost = isLost ? "; its poses are lost, it stands" : "";
  return `${name}: ${lag}${lost}\n  pushed by ${numberText(Math.hypot(...push_n))} N`;
}
/** A driven part is told to be behind by more than rounding alone. */
const kSame_m = 1e-8, kSame_rad = 5e-6;

export function numberText(value: number): string {
  if (!Number.isFinite(value)) return "-";
  const size = Math.abs(value);
  if (size !== 0 && size < 0.01) return value.toFixed(4);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : 2);
}

/** A round number of 1, 2, 5 times a power of ten, at most `value`. */
export function roundBelow(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const lead = value / power;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}
