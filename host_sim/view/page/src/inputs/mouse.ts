// SPDX-License-Identifier: Apache-2.0
// The mouse, or a finger: drags the part in the plane of the view, or along the ground.
import type { Vec } from "../messages";
import { inW, kFine, kNoTurn } from "./hand_input";
import type { HandInput, HandView, Motion } from "./hand_input";

export class Mouse implements HandInput {
  /** right, up, away since it was last asked [m] */
  private dragged: Vec = [0, 0, 0];
  private at = 0;

  /** By so many metres to the right and up of the view; `isFlat`: up becomes away; `at` [ms]. */
  drag(right: number, up: number, isFlat: boolean, isFine: boolean, at: number): void {
    const scale = isFine ? kFine : 1;
    this.dragged[0] += right * scale;
    this.dragged[isFlat ? 2 : 1] += up * scale;
    this.at = at;
  }

  take(view: HandView): Motion | null {
    if (this.dragged.every((x) => x === 0)) return null;
    const shift = inW(view, this.dragged);
    this.dragged = [0, 0, 0];
    return { shift, turn: kNoTurn, hold: "near", at: this.at };
  }

  /** It has no motor. */
  feel(): void {}
  holds(): boolean {
    return false;
  }
}
