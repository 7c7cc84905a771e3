// SPDX-License-Identifier: Apache-2.0
// The one interface between the hand of the page and the devices that move it: mouse, keys, game pad, SpaceMouse and the controllers
// of a headset.
import type { Quat, Vec } from "../messages";

/** How an input holds the part.
 *  "near": as a mouse does. Where a wall holds the part back, the hand stays near to it, and the way back begins at once.
 *  "firm": as a hand in the room does. Behind a wall the part is where the hand has it again once the hand is back.
 *  "left": the input has let go. The part stays where it is felt, and no force is on it. */
export type Hold = "near" | "firm" | "left";

/** What an input did since it was last asked, in W. */
export interface Motion {
  /** of the grip point [m] */
  shift: Vec;
  /** about the grip point */
  turn: Quat;
  hold: Hold;
  /** when it was made, by performance.now() [ms] */
  at: number;
}

/** The view in which an input moves the part. */
export interface HandView {
  /** unit vectors in W: right, up and away from the eye */
  axes: [Vec, Vec, Vec];
  /** [m] */
  partRadius: number;
  /** all motion is ten times finer */
  isFine: boolean;
}

export interface HandInput {
  /** The motion over `seconds` up to `now` [ms]; null: none. Each motion is given once. */
  take(view: HandView, seconds: number, now: number): Motion | null;
  /** Whether its hand is on the part: only then it feels the force. */
  holds(now: number): boolean;
  /** The contact force, as a share of the largest with which a hand of this page presses, 0 to 1. */
  feel(share: number, now: number): void;
}

/** By this factor motion is finer. */
export const kFine = 0.1;
/** An input that gives velocities holds the part for so long after its last motion [ms]. */
export const kHolds_ms = 1000;
export const kNoTurn: Quat = [0, 0, 0, 1];

/** A vector given along right, up and away of the view, in W. */
export function inW({ axes }: HandView, [right, up, away]: Vec): Vec {
  const at = (k: number) => right * axes[0][k] + up * axes[1][k] + away * axes[2][k];
  return [at(0), at(1), at(2)];
}

/** A deflection from -1 to 1 without its dead zone: none inside, then rising from none to 1. What is no number is at rest. */
export function beyond(value: number, deadZone: number): number {
  if (!Number.isFinite(value)) return 0;
  const size = Math.min(1, Math.abs(value)) - deadZone;
  return size > 0 ? (Math.sign(value) * size) / (1 - deadZone) : 0;
}
