// SPDX-License-Identifier: Apache-2.0
// The recorded session inside a page: the input and the state hash of each tick, as host_sim wrote them
// (tools/live/page_file.hpp).
import type { Quat, Vec } from "./messages";

const kMagic = "RTVIEW3\0";
const kHeaderBytes = 16;
/** Columns of a tick: stamp, position, orientation, hash. */
const kColumns = 9;
const kHashColumn = 8;
/** of the wrench that acted on the device, in recordings that have it */
const kAcceptedColumns = 6;
/** twist and marks, of a device that has more to say than where it is */
const kDeviceColumns = 7;
/** clock of the driven parts, and whether the hand feels them */
const kDrivenColumns = 2;
/** of a pose that a driven part was given: tick, part, record */
const kGivenColumns = 15;
const kHasAccepted = 1, kHasDevice = 2, kHasDriven = 4;
const kMarkReset = 1n, kMarkTwist = 4n, kMarkClutched = 8n;

/** A part of the page that cannot be read, in words for people. */
export class DamagedPage extends Error {}

export function bytesOf(base64: string): Uint8Array {
  let text: string;
  try {
    text = atob(base64.trim());
  } catch {
    throw new DamagedPage("a part of this file is not what was written; make the page again");
  }
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
  return bytes;
}

/** What was zipped, unzipped; other bytes as they are. */
export async function unzipped(bytes: Uint8Array): Promise<Uint8Array> {
  if (bytes[0] !== 0x1f || bytes[1] !== 0x8b) return bytes;
  const stream = new Blob([bytes as BlobPart]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A pose that a driven part was given: members of the structure "drive" of the core's module. */
export type GivenPose = Record<string, number | bigint | number[]>;

/** Of the words of a GivenPose (tools/live/page_file.hpp). */
export function givenPose(words: ArrayLike<bigint>, doubles: ArrayLike<number>, at: number, stride = 1): GivenPose {
  const word = (k: number) => words[at + stride * k];
  const list = (begin: number, count: number) => Array.from({ length: count }, (_, k) => doubles[at + stride * (begin + k)]);
  return {
    driven: word(1),
    number: word(2),
    stamp_ns: BigInt.asIntN(64, word(3)),
    p_m: list(4, 3),
    q_xyzw: list(7, 4),
    fastest_m_per_s: list(11, 1)[0],
    fastest_rad_per_s: list(12, 1)[0],
    late_ns: BigInt.asIntN(64, word(13)),
    stands: word(14),
  };
}

/** Columns of 64-bit words, whose bytes lie apart in a file. */
class Columns {
  readonly words: BigUint64Array;
  readonly doubles: Float64Array;

  /** `plain`: column whose words are as they were; the others are of differences to what goes on straight. */
  constructor(bytes: Uint8Array, from: number, count: number, readonly rows: number, plain: number) {
    this.words = new BigUint64Array(count * rows);
    this.doubles = new Float64Array(this.words.buffer);
    const scattered = new Uint8Array(this.words.buffer);
    for (let column = 0; column < count; ++column) {
      for (let byte = 0; byte < 8; ++byte) {
        const begin = from + (8 * column + byte) * rows;
        for (let k = 0; k < rows; ++k) scattered[8 * (column * rows + k) + byte] = bytes[begin + k];
      }
      if (column !== plain) this.add(column);
    }
  }

  private add(column: number): void {
    let before = 0n, beforeThat = 0n;
    for (let at = column * this.rows; at < (column + 1) * this.rows; ++at) {
      const word = this.words[at];
      const difference = (word & 1n) === 1n ? ~(word >> 1n) : word >> 1n;
      this.words[at] = difference + 2n * before - beforeThat;
      beforeThat = before;
      before = this.words[at];
    }
  }
}

export class Recording {
  readonly ticks: number;
  /** each tick has the wrench that acted on the device before it */
  readonly hasAccepted: boolean;
  /** the scene has driven parts */
  readonly hasDriven: boolean;
  private readonly deviceColumn: number;
  private readonly drivenColumn: number;
  /** by columns */
  private readonly words: BigUint64Array;
  private readonly doubles: Float64Array;
  /** poses that driven parts were given, by tick */
  private readonly givenAt = new Map<number, GivenPose[]>();

  constructor(bytes: Uint8Array) {
    const magic = String.fromCharCode(...bytes.slice(0, 8));
    if (bytes.length < kHeaderBytes || magic !== kMagic)
      throw new DamagedPage("the recording in this page is damaged; make the page again");
    const head = new DataView(bytes.buffer, bytes.byteOffset, kHeaderBytes);
    this.ticks = head.getUint32(8, true);
    const has = head.getUint32(12, true);
    this.hasAccepted = (has & kHasAccepted) !== 0;
    this.hasDriven = (has & kHasDriven) !== 0;
    let columns = kColumns + (this.hasAccepted ? kAcceptedColumns : 0);
    this.deviceColumn = (has & kHasDevice) !== 0 ? columns : 0;
    if (this.deviceColumn > 0) columns += kDeviceColumns;
    this.drivenColumn = columns;
    if (this.hasDriven) columns += kDrivenColumns;
    const end = kHeaderBytes + 8 * columns * this.ticks;
    const given = this.hasDriven && bytes.length >= end + 8 ? new DataView(bytes.buffer, bytes.byteOffset + end).getUint32(0, true) : 0;
    if (this.ticks === 0 || bytes.length !== end + (this.hasDriven ? 8 + 8 * kGivenColumns * given : 0))
      throw new DamagedPage("the recording in this page is not whole; make the page again");
    const ofTicks = new Columns(bytes, kHeaderBytes, columns, this.ticks, kHashColumn);
    this.words = ofTicks.words;
    this.doubles = ofTicks.doubles;
    if (this.hasDriven) this.readGiven(new Columns(bytes, end + 8, kGivenColumns, given, -1));
  }

  private readGiven({ words, doubles, rows }: Columns): void {
    for (let k = 0; k < rows; ++k) {
      const tick = Number(words[k]), pose = givenPose(words, doubles, k, rows);
      const others = this.givenAt.get(tick);
      if (others) others.push(pose);
      else this.givenAt.set(tick, [pose]);
    }
  }

  /** Poses that driven parts were given in this tick for the first time. */
  given(tick: number): GivenPose[] {
    return this.givenAt.get(tick) ?? [];
  }
  /** Clock of the driven parts. */
  drivenNs(tick: number): bigint {
    return BigInt.asIntN(64, this.words[this.drivenColumn * this.ticks + tick]);
  }
  /** The hand feels what they do. */
  feelsDriven(tick: number): boolean {
    return this.words[(this.drivenColumn + 1) * this.ticks + tick] !== 0n;
  }

  private marks(tick: number): bigint {
    return this.deviceColumn > 0 ? this.words[(this.deviceColumn + kDeviceColumns - 1) * this.ticks + tick] : 0n;
  }
  /** The core forgot before this tick all that was. */
  resets(tick: number): boolean {
    return (this.marks(tick) & kMarkReset) !== 0n;
  }
  clutched(tick: number): boolean {
    return (this.marks(tick) & kMarkClutched) !== 0n;
  }
  /** Six numbers; undefined: the device did not say it. */
  twist(tick: number): number[] | undefined {
    return (this.marks(tick) & kMarkTwist) !== 0n ? this.list(tick, this.deviceColumn, 6) : undefined;
  }
  private list(tick: number, column: number, count: number): number[] {
    return Array.from({ length: count }, (_, k) => this.doubles[(column + k) * this.ticks + tick]);
  }
  /** Force and torque, six numbers. */
  accepted(tick: number): number[] {
    return this.list(tick, kColumns, kAcceptedColumns);
  }
  stampNs(tick: number): bigint {
    return BigInt.asIntN(64, this.words[tick]);
  }
  place(tick: number): Vec {
    return this.list(tick, 1, 3) as Vec;
  }
  orientation(tick: number): Quat {
    return this.list(tick, 4, 4) as Quat;
  }
  hash(tick: number): bigint {
    return this.words[kHashColumn * this.ticks + tick];
  }
}
