// SPDX-License-Identifier: Apache-2.0
// A controller of a headset as the hand that holds the part, with a clutch: while trigger or grip button is pressed the part moves and
// turns as the controller does; released, the part is left where it is.
import { conjugate, multiply, normalised } from "../hand";
import type { Pose, Quat, Vec } from "../messages";
import { Buzz } from "./buzz";
import { kNoTurn } from "./hand_input";
import type { HandInput, Motion } from "./hand_input";

/** A controller in one picture of the headset. */
export interface ControllerState {
  /** "left", "right" or "none" */
  side: string;
  /** of its grip in W; null: the headset does not see it */
  grip: Pose | null;
  isPressed: boolean;
  /** its motor, by strength (0 to 1) and duration [ms]; null: it has none */
  pulse: ((strength: number, ms: number) => void) | null;
}

/** Farther between two pictures no hand moves: the tracking has jumped [m]. */
const kJump_m = 0.3;

const isUsable = ({ p, q }: Pose) => [...p, ...q].every(Number.isFinite) && Math.abs(Math.hypot(...q) - 1) < 0.01;

export class RoomController implements HandInput {
  /** which of the controllers holds the part, and where its grip was last */
  private held: { side: string; at: Pose } | null = null;
  /** controllers seen with their buttons up since they were last lost: what was pressed before takes no part */
  private readonly ready = new Set<string>();
  private shift: Vec = [0, 0, 0];
  private turn: Quat = kNoTurn;
  private hasMoved = false;
  private hasLeft = false;
  private pulse: ControllerState["pulse"] = null;
  private readonly buzz = new Buzz(
    (strength, ms) => this.pulse?.(strength, ms),
    () => this.pulse?.(0, 0),
  );

  /** `sides`: of the controllers that may hold the part, the first is preferred. */
  constructor(private readonly sides: string[]) {}

  /** The side that holds the part; null: none. */
  get holding(): string | null {
    return this.held?.side ?? null;
  }

  /** All controllers that are there, in every picture of the headset. */
  track(states: ControllerState[]): void {
    const known = this.sides.flatMap((side) => states.filter((state) => state.side === side).slice(0, 1));
    for (const side of this.ready) if (!known.some((state) => state.side === side && state.grip)) this.ready.delete(side);
    if (this.held) this.follow(known.find(({ side }) => side === this.held!.side));
    for (const { side, grip, isPressed, pulse } of known) {
      const isSeen = grip !== null && isUsable(grip);
      if (!this.held && isSeen && isPressed && this.ready.has(side)) {
        this.held = { side, at: grip };
        this.pulse = pulse;
      }
      if (isSeen && !isPressed) this.ready.add(side);
      else this.ready.delete(side);
    }
  }

  private follow(state: ControllerState | undefined): void {
    const { at } = this.held!;
    const grip = state?.grip;
    const isSeen = grip != null && isUsable(grip) && Math.hypot(...grip.p.map((x, k) => x - at.p[k])) < kJump_m;
    if (!state?.isPressed || !isSeen) return this.letGo();
    this.pulse = state.pulse;
    const turned = multiply(grip.q, conjugate(at.q));
    const isSame = grip.p.every((x, k) => x === at.p[k]) && grip.q.every((x, k) => x === at.q[k]);
    if (isSame) return;
    this.shift = this.shift.map((x, k) => x + grip.p[k] - at.p[k]) as Vec;
    this.turn = normalised(multiply(turned, this.turn));
    this.hasMoved = true;
    this.held = { side: state.side, at: grip };
  }

  private letGo(): void {
    if (this.held) this.hasLeft = true;
    this.held = null;
  }

  take(_view: unknown, _seconds: number, now: number): Motion | null {
    if (!this.hasMoved && !this.hasLeft) return null;
    const motion: Motion = { shift: this.shift, turn: this.turn, hold: this.hasLeft ? "left" : "firm", at: now };
    this.shift = [0, 0, 0];
    this.turn = kNoTurn;
    this.hasMoved = this.hasLeft = false;
    return motion;
  }

  holds(): boolean {
    return this.held !== null;
  }
  feel(share: number, now: number): void {
    this.buzz.feel(share, now);
  }
  /** The session is over, or the scene is put elsewhere in the room. */
  rest(): void {
    this.letGo();
    this.ready.clear();
  }
}
