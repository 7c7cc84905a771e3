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
const kHasAccepted = 1, kHasDevice = 2;
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

export class Recording {
  readonly ticks: number;
  /** each tick has the wrench that acted on the device before it */
  readonly hasAccepted: boolean;
  private readonly deviceColumn: number;
  /** by columns */
  private readonly words: BigUint64Array;
  private readonly doubles: Float64Array;

  constructor(bytes: Uint8Array) {
    const magic = String.fromCharCode(...bytes.slice(0, 8));
    if (bytes.length < kHeaderBytes || magic !== kMagic)
      throw new DamagedPage("the recording in this page is damaged; make the page again");
    const head = new DataView(bytes.buffer, bytes.byteOffset, kHeaderBytes);
    this.ticks = head.getUint32(8, true);
    const has = head.getUint32(12, true);
    this.hasAccepted = (has & kHasAccepted) !== 0;
    const before = kColumns + (this.hasAccepted ? kAcceptedColumns : 0);
    this.deviceColumn = (has & kHasDevice) !== 0 ? before : 0;
    const columns = before + (this.deviceColumn > 0 ? kDeviceColumns : 0);
    if (this.ticks === 0 || bytes.length !== kHeaderBytes + 8 * columns * this.ticks)
      throw new DamagedPage("the recording in this page is not whole; make the page again");
    this.words = new BigUint64Array(columns * this.ticks);
    this.doubles = new Float64Array(this.words.buffer);
    // The bytes of a word lie apart.
    const scattered = new Uint8Array(this.words.buffer);
    for (let column = 0; column < columns; ++column) {
      for (let byte = 0; byte < 8; ++byte) {
        const from = kHeaderBytes + (8 * column + byte) * this.ticks;
        for (let k = 0; k < this.ticks; ++k) scattered[8 * (column * this.ticks + k) + byte] = bytes[from + k];
      }
      if (column !== kHashColumn) this.add(column);
    }
  }

  /** Makes the values of a column of their differences to what goes on straight. */
  private add(column: number): void {
    let before = 0n, beforeThat = 0n;
    for (let at = column * this.ticks; at < (column + 1) * this.ticks; ++at) {
      const word = this.words[at];
      const difference = (word & 1n) === 1n ? ~(word >> 1n) : word >> 1n;
      this.words[at] = difference + 2n * before - beforeThat;
      beforeThat = before;
      before = this.words[at];
    }
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
