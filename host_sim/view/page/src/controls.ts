// SPDX-License-Identifier: Apache-2.0
// Mouse, keys, gamepad and SpaceMouse, turned into where the hand wants the part. A page moves this simulated hand alone.
import * as THREE from "three";
import { multiply, normalised, poseOf, rotationOf, upright } from "./hand";
import type { Pose, Quat, Vec } from "./messages";
import type { SixAxes } from "./space_mouse";
import { rightOf, towardsEye } from "./stage";
import type { Side } from "./stage";

/** Of keys and sticks, in radii of the part a second, and rad a second. */
const kSpeed = 0.9;
const kTurn = 0.5;
const kFine = 0.1;
/** The hand wants the part at most this far from where it is felt [radii of the part], so that it is at hand again. */
const kLeash = 0.5;
const kDeadZone = 0.14;
/** Where there is no gamepad one is looked for this often. */
const kGamepad_ms = 500;
/** Time in which the part is turned upright [s]. */
const kUpright_s = 0.8;

/** Keys that move and turn: axis of the view (right, up, away) or of the turn, and sign. */
const kMoves: Record<string, [number, number]> = {
  ArrowRight: [0, 1],
  ArrowLeft: [0, -1],
  ArrowUp: [1, 1],
  ArrowDown: [1, -1],
  KeyW: [2, 1],
  KeyS: [2, -1],
};
const kTurns: Record<string, [number, number]> = {
  KeyA: [1, 1],
  KeyD: [1, -1],
  KeyQ: [2, -1],
  KeyE: [2, 1],
  KeyR: [0, -1],
  KeyF: [0, 1],
};

export class Controls {
  private readonly down = new Set<string>();
  /** pressed since the last picture, so that a short press is not lost */
  private readonly tapped = new Set<string>();
  private fine = false;
  private grip: Vec = [0, 0, 0];
  private q: Quat = [0, 0, 0, 1];
  private active = false;
  private turning: { from: THREE.Quaternion; to: THREE.Quaternion; done: number } | null = null;
  private felt: Vec = [0, 0, 0];
  gamepad = "";
  private gamepadAsked = -Infinity;
  /** a SpaceMouse that the user has chosen */
  sixAxes: SixAxes | null = null;

  constructor(
    private readonly side: Side,
    private readonly gripA: Vec,
    public partRadius: number,
    /** number of the gamepad that it reads, of those that are there */
    private readonly pad: number,
    /** `at`: when the move was made [ms] */
    private readonly want: (target: Pose, at: number) => void,
  ) {}

  /** Where the device is while nobody moves it, its grip point and how it is turned: a hand takes it up from there. */
  follow(grip: Vec, q: Quat, felt: Vec, byHand: boolean): void {
    this.felt = felt;
    if (byHand && this.active) return;
    this.grip = grip;
    this.q = q;
    this.active = byHand;
  }

  key(event: KeyboardEvent, down: boolean): boolean {
    this.fine = event.shiftKey;
    if (!(event.code in kMoves) && !(event.code in kTurns)) return false;
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    if (down) {
      this.down.add(event.code);
      this.tapped.add(event.code);
    } else {
      this.down.delete(event.code);
    }
    return true;
  }
  release(): void {
    this.down.clear();
  }
  /** The part is somewhere else by itself: the next move begins there. */
  forget(): void {
    this.active = false;
    this.turning = null;
  }

  private axes(): THREE.Vector3[] {
    const right = rightOf(this.side), up = new THREE.Vector3(0, 0, 1);
    const away = towardsEye({ azimuth: this.side.azimuth, elevation: 0 }).negate();
    return [right, up, away];
  }

  /** `shift` in W [m]. */
  private move(shift: THREE.Vector3, at: number): void {
    this.grip = [this.grip[0] + shift.x, this.grip[1] + shift.y, this.grip[2] + shift.z];
    const from = new THREE.Vector3(...this.felt);
    const to = new THREE.Vector3(...this.grip).sub(from).clampLength(0, kLeash * this.partRadius).add(from);
    this.grip = [to.x, to.y, to.z];
    this.send(at);
  }
  private turn(rotation: THREE.Vector3, at: number): void {
    this.turning = null;
    this.q = normalised(multiply(rotationOf([rotation.x, rotation.y, rotation.z]), this.q));
    this.send(at);
  }
  private send(at: number): void {
    this.active = true;
    this.want(poseOf(this.grip, this.q, this.gripA), at);
  }

  /** Dragged by so many metres to the right and up of the view; `flat`: up becomes away; `at` [ms]. */
  drag(right: number, up: number, flat: boolean, fine: boolean, at: number): void {
    const [x, z, y] = this.axes();
    const scale = fine ? kFine : 1;
    const shift = x.multiplyScalar(right * scale);
    this.move(shift.addScaledVector(flat ? y : z, up * scale), at);
  }

  makeUpright(): void {
    this.turning = { from: new THREE.Quaternion(...this.q), to: new THREE.Quaternion(...upright(this.q)), done: 0 };
  }

  /** Keys, gamepad and a turn that is under way, over `seconds` up to `now` [ms]. */
  advance(seconds: number, now: number): void {
    const axes = this.axes();
    const speed = kSpeed * this.partRadius * seconds * (this.fine ? kFine : 1);
    const angle = kTurn * seconds * (this.fine ? kFine : 1);
    const shift = new THREE.Vector3(), rotation = new THREE.Vector3();
    for (const code of new Set([...this.down, ...this.tapped])) {
      const move = kMoves[code], turn = kTurns[code];
      if (move) shift.addScaledVector(axes[move[0]], move[1] * speed);
      if (turn) rotation.addScaledVector(axes[turn[0]], turn[1] * angle);
    }
    this.tapped.clear();
    this.readGamepad(shift, rotation, axes, speed, angle, now);
    if (this.sixAxes) {
      const { push, turn } = this.sixAxes.cap;
      axes.forEach((axis, k) => {
        shift.addScaledVector(axis, push[k] * speed);
        rotation.addScaledVector(axis, turn[k] * angle);
      });
    }
    if (rotation.lengthSq() > 0) this.turn(rotation, now);
    if (shift.lengthSq() > 0) this.move(shift, now);
    if (this.turning) {
      this.turning.done = Math.min(1, this.turning.done + seconds / kUpright_s);
      const { from, to, done } = this.turning;
      const q = from.clone().slerp(to, done * done * (3 - 2 * done));
      this.q = [q.x, q.y, q.z, q.w];
      if (done === 1) this.turning = null;
      this.send(now);
    }
  }

  private readGamepad(
    shift: THREE.Vector3,
    rotation: THREE.Vector3,
    axes: THREE.Vector3[],
    speed: number,
    angle: number,
    now: number,
  ): void {
    // Asking takes time, and one that is not there is plugged in by hand.
    if (this.gamepad === "" && now - this.gamepadAsked < kGamepad_ms) return;
    this.gamepadAsked = now;
    const pads = [...(navigator.getGamepads?.() ?? [])].filter((p) => p?.connected && p.mapping === "standard");
    const pad = pads[this.pad];
    this.gamepad = pad?.id ?? "";
    if (!pad) return;
    const fine = pad.buttons[0]?.pressed ? kFine : 1;
    const stick = (k: number) => {
      const value = pad.axes[k] ?? 0;
      return Math.abs(value) < kDeadZone ? 0 : fine * (value - Math.sign(value) * kDeadZone) / (1 - kDeadZone);
    };
    shift.addScaledVector(axes[0], stick(0) * speed);
    shift.addScaledVector(axes[2], -stick(1) * speed);
    shift.addScaledVector(axes[1], -stick(3) * speed);
    rotation.addScaledVector(axes[1], -stick(2) * angle);
    const button = (k: number) => (pad.buttons[k]?.value ?? 0) * fine;
    rotation.addScaledVector(axes[2], (button(5) - button(4)) * angle);
    rotation.addScaledVector(axes[0], (button(7) - button(6)) * angle);
  }
}
