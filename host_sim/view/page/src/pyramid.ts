// SPDX-License-Identifier: Apache-2.0
// The newest samples of some channels, in memory of fixed size, with least and largest values by groups: a strip of any
// length is drawn with about as many points as it has pixels, and no peak of a single tick is lost.

const kGroup = 8;
const kLevels = 4;

export class Pyramid {
  /** levels[0]: the samples; levels[k]: least and largest of kGroup of the level below */
  private readonly levels: { least: Float32Array; largest: Float32Array }[][] = [];
  private readonly sizes: number[] = [];
  private written = 0;

  /** `capacity` samples of `channels` numbers; rounded up to whole groups of the highest level. */
  constructor(
    readonly channels: number,
    capacity: number,
  ) {
    const largest = kGroup ** (kLevels - 1);
    for (let level = 0; level < kLevels; ++level) {
      const size = (Math.ceil(capacity / largest) * largest) / kGroup ** level;
      this.sizes.push(size);
      this.levels.push(
        Array.from({ length: channels }, () => ({
          least: new Float32Array(size),
          largest: new Float32Array(size),
        })),
      );
    }
  }

  get capacity(): number {
    return this.sizes[0];
  }
  /** Samples that are there. */
  get count(): number {
    return Math.min(this.written, this.capacity);
  }
  /** Number of the oldest that is there, counted from the first ever. */
  get begin(): number {
    return this.written - this.count;
  }
  get end(): number {
    return this.written;
  }

  clear(): void {
    this.written = 0;
  }

  push(samples: Float32Array): void {
    for (let at = 0; at < samples.length; at += this.channels) {
      for (let channel = 0; channel < this.channels; ++channel)
        this.put(channel, samples[at + channel]);
      this.written += 1;
    }
  }

  private put(channel: number, value: number): void {
    let index = this.written;
    for (let level = 0; level < this.levels.length; ++level) {
      const { least, largest } = this.levels[level][channel];
      const slot = index % this.sizes[level];
      const first = level === 0 || this.written % kGroup ** level === 0;
      least[slot] = first ? value : Math.min(least[slot], value);
      largest[slot] = first ? value : Math.max(largest[slot], value);
      index = Math.floor(index / kGroup);
    }
  }

  at(channel: number, index: number): number {
    return this.levels[0][channel].least[index % this.capacity];
  }

  /** Least and largest values of samples [begin, end), in at most `most` groups of equal size. */
  range(channel: number, begin: number, end: number, most: number) {
    let level = 0;
    while (level + 1 < this.levels.length && (end - begin) / kGroup ** (level + 1) >= most / 2) level += 1;
    const group = kGroup ** level;
    const from = Math.ceil(Math.max(begin, this.begin) / group);
    const to = Math.ceil(Math.min(end, this.end) / group);
    const { least, largest } = this.levels[level][channel];
    // Groups of the level are joined where there are more than wanted.
    const join = Math.max(1, Math.ceil((to - from) / most));
    const count = Math.max(0, Math.ceil((to - from) / join));
    const out = { index: new Float64Array(count), least: new Float64Array(count), largest: new Float64Array(count) };
    for (let k = 0; k < count; ++k) {
      let low = Infinity, high = -Infinity;
      for (let i = from + k * join; i < Math.min(to, from + (k + 1) * join); ++i) {
        low = Math.min(low, least[i % this.sizes[level]]);
        high = Math.max(high, largest[i % this.sizes[level]]);
      }
      out.index[k] = (from + k * join) * group;
      out.least[k] = low;
      out.largest[k] = high;
    }
    return out;
  }
}
