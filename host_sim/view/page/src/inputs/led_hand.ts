// SPDX-License-Identifier: Apache-2.0
// Where a hand of the page wants its part: the sum of what its inputs do. A page moves this simulated hand alone.
import * as THREE from "three";
import { conjugate, multiply, normalised, poseOf, rotationOf, rotationVector, upright } from "../hand";
import type { Pose, Quat, Vec } from "../messages";
import { rightOf, towardsEye } from "../stage";
import type { Side } from "../stage";
import type { HandInput, HandView } from "./hand_input";

/** The hand wants the part at most this far from where it is felt [radii of the part; rad], so that it is at hand again and its force
 * has a largest value. */
const kLeash = 0.5;
const kTurnLeash_rad = 0.6;
/** A firm hold remembers no more than this: half a turn from the part, the way back would be the other way round. */
const kMostTurn_rad = 2.5;
/** Time in which the part is turned upright [s]. */
const kUpright_s = 0.8;

/** `q` turned towards `to` until it is at most `most` from there [rad]. */
function leashed(q: Quat, to: Quat, most: number): Quat {
  const apart = rotationVector(multiply(q, conjugate(to)));
  const angle = Math.hypot(...apart);
  return angle <= most ? q : multiply(rotationOf(apart.map((x) => (x * most) / angle) as Vec), to);
}

/** Directions in which inputs move the part, as the page looks at it. */
function axesOf(side: Side): HandView["axes"] {
  const away = towardsEye({ azimuth: side.azimuth, elevation: 0 }).negate();
  return [rightOf(side).toArray() as Vec, [0, 0, 1], away.toArray() as Vec];
}

export class LedHand {
  isFine = false;
  private grip: Vec = [0, 0, 0];
  private q: Quat = [0, 0, 0, 1];
  private active = false;
  private turning: { from: THREE.Quaternion; to: THREE.Quaternion; done: number } | null = null;
  private felt: Vec = [0, 0, 0];
  private feltQ: Quat = [0, 0, 0, 1];
  /** which moved the part last: it feels the force */
  private leader: HandInput | null = null;

  constructor(
    private readonly inputs: HandInput[],
    private readonly side: Side,
    private readonly gripA: Vec,
    /** of the part [m] */
    public partRadius: number,
    /** of the springs of hand and part, one behind the other [N/m] */
    public stiffness: number,
    /** `at`: when the move was made [ms] */
    private readonly want: (target: Pose, at: number) => void,
  ) {}

  /** Where the device is while nobody moves it, its grip point and how it is turned: a hand takes it up from there. And where the part is
   * felt. */
  follow(device: Pose, felt: Pose, byHand: boolean): void {
    this.felt = felt.p;
    this.feltQ = felt.q;
    if (byHand && this.active) return;
    this.grip = device.p;
    this.q = device.q;
    this.active = byHand;
  }

  /** The part is somewhere else by itself: the next move begins there. */
  forget(): void {
    this.active = false;
    this.turning = null;
  }

  makeUpright(): void {
    this.turning = { from: new THREE.Quaternion(...this.q), to: new THREE.Quaternion(...upright(this.q)), done: 0 };
  }

  /** All inputs, and a turn that is under way, over `seconds` up to `now` [ms]. */
  advance(seconds: number, now: number): void {
    for (const input of this.inputs) this.takeFrom(input, seconds, now);
    if (!this.turning) return;
    this.turning.done = Math.min(1, this.turning.done + seconds / kUpright_s);
    const { from, to, done } = this.turning;
    const q = from.clone().slerp(to, done * done * (3 - 2 * done));
    this.q = [q.x, q.y, q.z, q.w];
    if (done === 1) this.turning = null;
    this.send(now);
  }

  /** One input at once: its motion is not to wait for the next picture. */
  takeFrom(input: HandInput, seconds: number, now: number): void {
    const { side, partRadius, isFine } = this;
    const motion = input.take({ axes: axesOf(side), partRadius, isFine }, seconds, now);
    if (!motion || ![...motion.shift, ...motion.turn].every(Number.isFinite)) return;
    this.leader = input;
    const { shift, turn, hold, at } = motion;
    if (turn.some((x, k) => x !== [0, 0, 0, 1][k])) this.turning = null;
    this.grip = this.grip.map((x, k) => x + shift[k]) as Vec;
    this.q = leashed(normalised(multiply(turn, this.q)), this.feltQ, kMostTurn_rad);
    if (hold === "left") {
      this.grip = this.felt;
      this.q = this.feltQ;
    } else if (hold === "near") {
      ({ grip: this.grip, q: this.q } = this.within());
    }
    this.send(at);
  }

  /** The contact force on this hand [N]: the input that moved it last feels it while it holds the part. */
  feel(force: number, now: number): void {
    const share = Math.min(1, force / (this.stiffness * kLeash * this.partRadius));
    for (const input of this.inputs) input.feel(input === this.leader && input.holds(now) ? share : 0, now);
  }

  /** What it wants, near enough to the part. */
  private within(): { grip: Vec; q: Quat } {
    const from = new THREE.Vector3(...this.felt);
    const to = new THREE.Vector3(...this.grip).sub(from).clampLength(0, kLeash * this.partRadius).add(from);
    return { grip: to.toArray() as Vec, q: this.turning ? this.q : leashed(this.q, this.feltQ, kTurnLeash_rad) };
  }

  private send(at: number): void {
    this.active = true;
    const { grip, q } = this.within();
    this.want(poseOf(grip, q, this.gripA), at);
  }
}
