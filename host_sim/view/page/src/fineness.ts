// SPDX-License-Identifier: Apache-2.0
// How finely the spaces are drawn: coarser while pictures come too slowly, finely again once nothing moves.

/** A picture that takes longer is drawn with fewer pixels; one that takes less, with more [ms]. */
const kSlow_ms = 36, kQuick_ms = 21;
/** Pictures over which the time of one is judged. */
const kJudged = 12;
/** From one step to the next: a third fewer pixels. */
const kStep = 0.82;
export const kCoarsest = 0.5;
/** Nothing has moved for so long: the picture is drawn once more, finely. */
export const kStill_ms = 250;
/** Pixels may grow again after so long, and twice as long after each time that they were too many. */
const kPatience_ms = 3000, kMostPatience_ms = 60000;

/** Whether this browser's WebGL is computed by the processor, where each pixel is dear. */
export function isDrawnByProcessor(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return false;
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/** Pixels of a canvas for each pixel of the page, in one direction. */
export class Fineness {
  private readonly most: number;
  private readonly still: number;
  /** the present one, while things move */
  moving: number;
  private sum = 0;
  private count = 0;
  private changed = 0;
  /** the last change was to more pixels */
  private hasGrown = false;
  private patience = kPatience_ms;

  /** `ratio`: of the screen. */
  constructor(byProcessor: boolean, ratio: number) {
    this.still = byProcessor ? 2 : Math.min(2, ratio);
    this.moving = this.most = byProcessor ? 1 : this.still;
  }

  /** Where nothing moves. */
  get resting(): number {
    return this.still;
  }

  /** A picture took so long, from the begin of its drawing to the next that could begin [ms]. `now` [ms]. */
  took(time: number, now: number): void {
    this.sum += Math.min(time, 4 * kSlow_ms);
    if (++this.count < kJudged) return;
    const mean = this.sum / this.count;
    this.sum = this.count = 0;
    if (mean > kSlow_ms && this.moving > kCoarsest) {
      this.moving = Math.max(kCoarsest, kStep * this.moving);
      if (this.hasGrown) this.patience = Math.min(kMostPatience_ms, 2 * this.patience);
      this.hasGrown = false;
      this.changed = now;
    } else if (mean < kQuick_ms && this.moving < this.most && now - this.changed > this.patience) {
      this.moving = Math.min(this.most, this.moving / kStep);
      this.hasGrown = true;
      this.changed = now;
    }
  }
}
