// SPDX-License-Identifier: Apache-2.0
// How fast the page draws, by its own clock: pictures a second, and the time from a move of the hand to the picture that
// shows the tick which followed it.

const kKept = 512;
const kCounted_ms = 2000;

/** Pictures drawn in the last two seconds. */
export class FrameMeter {
  private times: number[] = [];

  drawn(now: number): void {
    this.times.push(now);
    this.forget(now);
  }
  private forget(now: number): void {
    while (this.times.length > 0 && this.times[0] < now - kCounted_ms) this.times.shift();
  }
  /** A second; 0: it stands still. */
  rate(now: number): number {
    this.forget(now);
    const span = this.times.length > 1 ? this.times[this.times.length - 1] - this.times[0] : 0;
    return span > 0 ? (1000 * (this.times.length - 1)) / span : 0;
  }
  text(now: number): string {
    const rate = this.rate(now);
    return rate > 0 ? `${rate.toFixed(0)} a second` : "-";
  }
}

export class DelayMeter {
  private readonly waiting: number[] = [];
  private readonly delays: number[] = [];

  /** A move of this time was sent. */
  sent(at: number): void {
    this.waiting.push(at);
    if (this.waiting.length > kKept) this.waiting.shift();
  }

  /** A picture of the tick that followed the move of time `at` is drawn; moves of others, and one that was shown, do not count. */
  shown(at: number, now: number): void {
    const place = this.waiting.indexOf(at);
    if (place < 0) return;
    this.waiting.splice(0, place + 1);
    this.delays.push(now - at);
    if (this.delays.length > kKept) this.delays.shift();
  }

  get count(): number {
    return this.delays.length;
  }
  /** [ms]; not a number where nothing was measured. */
  quantile(share: number): number {
    const sorted = [...this.delays].sort((a, b) => a - b);
    return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? NaN;
  }
  get text(): string {
    return this.count === 0 ? "-" : `${this.quantile(0.5).toFixed(0)} ms, p99 ${this.quantile(0.99).toFixed(0)} ms`;
  }
}
