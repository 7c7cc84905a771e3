// SPDX-License-Identifier: Apache-2.0
// A motor that shakes while there is contact: as strongly as the force is large, and asked no more often than it can follow.

/** Time between two pulses, and of one pulse, so that they join [ms]. */
export const kEvery_ms = 50;
export const kPulse_ms = 80;
/** A weaker pulse turns no motor. */
const kLeast = 0.01;

export class Buzz {
  private pulsedAt = -Infinity;
  private isOn = false;

  /** `pulse`: of a strength from 0 to 1, for so long [ms]. `stop`: at once. */
  constructor(
    private readonly pulse: (strength: number, ms: number) => void,
    private readonly stop: () => void,
  ) {}

  /** `share`: of the strongest pulse. `now` [ms]. */
  feel(share: number, now: number): void {
    if (!(share >= kLeast)) {
      if (this.isOn) this.stop();
      this.isOn = false;
      return;
    }
    if (now - this.pulsedAt < kEvery_ms) return;
    this.pulsedAt = now;
    this.isOn = true;
    this.pulse(Math.min(1, share), kPulse_ms);
  }
}
