// SPDX-License-Identifier: Apache-2.0
// Keys that move and turn the part as long as they are pressed.
import { rotationOf } from "../hand";
import type { Vec } from "../messages";
import { inW, kFine } from "./hand_input";
import type { HandInput, HandView, Motion } from "./hand_input";

/** Radii of the part a second, and rad a second. */
export const kSpeed = 0.9;
export const kTurn = 0.5;

/** Keys: axis of the view (right, up, away) along or about which they move or turn, and sign. */
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

export class Keys implements HandInput {
  private readonly down = new Set<string>();
  /** pressed since it was last asked, so that a short press is not lost */
  private readonly tapped = new Set<string>();

  /** Whether the key is one of these. */
  key(event: KeyboardEvent, isDown: boolean): boolean {
    if (!(event.code in kMoves) && !(event.code in kTurns)) return false;
    if (isDown && (event.ctrlKey || event.metaKey || event.altKey)) return false;
    if (isDown) {
      this.down.add(event.code);
      this.tapped.add(event.code);
    } else {
      this.down.delete(event.code);
    }
    return true;
  }

  take(view: HandView, seconds: number, now: number): Motion | null {
    const codes = new Set([...this.down, ...this.tapped]);
    this.tapped.clear();
    if (codes.size === 0) return null;
    const scale = seconds * (view.isFine ? kFine : 1);
    const shift: Vec = [0, 0, 0], turn: Vec = [0, 0, 0];
    for (const code of codes) {
      const move = kMoves[code], rotation = kTurns[code];
      if (move) shift[move[0]] += move[1] * kSpeed * view.partRadius * scale;
      if (rotation) turn[rotation[0]] += rotation[1] * kTurn * scale;
    }
    return { shift: inW(view, shift), turn: rotationOf(inW(view, turn)), hold: "near", at: now };
  }

  /** They have no motor. */
  feel(): void {}
  holds(): boolean {
    return false;
  }
  /** The page is no longer looked at: nobody tells when a key goes up. */
  rest(): void {
    this.down.clear();
    this.tapped.clear();
  }
}
