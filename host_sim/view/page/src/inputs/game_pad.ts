// SPDX-License-Identifier: Apache-2.0
// A game pad with the browser's standard layout: sticks, triggers and shoulder buttons are velocities, and its motors say the force.
import { rotationOf } from "../hand";
import type { Vec } from "../messages";
import { Buzz } from "./buzz";
import { beyond, inW, kFine, kHolds_ms } from "./hand_input";
import type { HandInput, HandView, Motion } from "./hand_input";
import { kSpeed, kTurn } from "./keys";

const kStickDeadZone = 0.14;
const kTriggerDeadZone = 0.06;
/** Where there is none, one is looked for this often: asking takes time, and one is plugged in by hand. */
const kLooksFor_ms = 500;

/** Numbers of buttons in the standard layout. */
const kA = 0, kLeftShoulder = 4, kRightShoulder = 5, kLeftTrigger = 6, kRightTrigger = 7;

export class GamePad implements HandInput {
  /** of the pad that moves the part; empty: there is none */
  name = "";
  /** of one that is there and has another layout; it is not used */
  foreign = "";
  /** one has moved the part before */
  wasThere = false;
  /** the browser refuses to tell: a page within another may not know */
  isRefused = false;
  private lookedAt = -Infinity;
  private movedAt = -Infinity;
  private actuator: GamepadHapticActuator | null = null;
  private hasRefused = false;
  private readonly buzz = new Buzz(
    (strength, duration) => {
      const effect = { startDelay: 0, duration, strongMagnitude: strength, weakMagnitude: strength };
      void this.ask((motor) => motor.playEffect("dual-rumble", effect));
    },
    () => void this.ask((motor) => motor.reset()),
  );

  /** `number`: of the pad that it reads, of those that are there. `pads`: what the browser has. */
  constructor(
    private readonly number: number,
    private readonly pads: () => (Gamepad | null)[] = () => [...(navigator.getGamepads?.() ?? [])],
  ) {}

  get canRumble(): boolean {
    return this.actuator !== null && !this.hasRefused;
  }

  private all(): (Gamepad | null)[] {
    try {
      this.isRefused = false;
      return this.pads();
    } catch {
      this.isRefused = true;
      return [];
    }
  }

  private find(now: number): Gamepad | undefined {
    if (this.name === "" && now - this.lookedAt < kLooksFor_ms) return undefined;
    this.lookedAt = now;
    const there = this.all().filter((pad): pad is Gamepad => pad?.connected ?? false);
    const pad = there.filter(({ mapping }) => mapping === "standard")[this.number];
    this.foreign = pad ? "" : there.find(({ mapping }) => mapping !== "standard")?.id ?? "";
    if ((pad?.id ?? "") !== this.name) this.hasRefused = false;
    this.name = pad?.id ?? "";
    this.wasThere ||= pad !== undefined;
    const motor = pad?.vibrationActuator as GamepadHapticActuator | null | undefined;
    this.actuator = typeof motor?.playEffect === "function" ? motor : null;
    return pad;
  }

  take(view: HandView, seconds: number, now: number): Motion | null {
    const pad = this.find(now);
    if (!pad) return null;
    const scale = seconds * (pad.buttons[kA]?.pressed || view.isFine ? kFine : 1);
    const stick = (k: number) => beyond(pad.axes[k] ?? 0, kStickDeadZone);
    const button = (k: number) => beyond(pad.buttons[k]?.value ?? 0, kTriggerDeadZone);
    const push: Vec = [stick(0), -stick(3), -stick(1)];
    const turn: Vec = [
      button(kRightTrigger) - button(kLeftTrigger),
      -stick(2),
      button(kRightShoulder) - button(kLeftShoulder),
    ];
    if ([...push, ...turn].every((x) => x === 0)) return null;
    this.movedAt = now;
    const by = (v: Vec, factor: number) => v.map((x) => x * factor) as Vec;
    return {
      shift: inW(view, by(push, kSpeed * view.partRadius * scale)),
      turn: rotationOf(inW(view, by(turn, kTurn * scale))),
      hold: "near",
      at: now,
    };
  }

  holds(now: number): boolean {
    return this.name !== "" && now - this.movedAt < kHolds_ms;
  }

  feel(share: number, now: number): void {
    this.buzz.feel(share, now);
  }

  /** A browser may know the motors and have no such effect for them: then it is asked no more, and the page says so. After any other
   * refusal, as of a page that is not visible, the next pulse asks again. */
  private async ask(of: (motor: GamepadHapticActuator) => Promise<unknown>): Promise<void> {
    const { actuator } = this;
    if (!actuator || this.hasRefused) return;
    try {
      await of(actuator);
    } catch (error) {
      if (this.actuator === actuator && (error as Error)?.name === "NotSupportedError") this.hasRefused = true;
    }
  }
}
