// SPDX-License-Identifier: Apache-2.0
// The recorded session inside a page: the input and the state hash of each tick, as host_sim wrote them
// (host_sim/view/page_file.hpp).
import type { Quat, Vec } from "./messages";

const kMagic = "RTVIEW1\0";
const kHeaderBytes = 16;
const kTickBytes = 72;
/** of the wrench that acted on the device, in recordings that have it */
const kAcceptedBytes = 48;

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

export class Recording {
  private readonly view: DataView;
  readonly ticks: number;
  /** each tick has the wrench that acted on the device before it */
  readonly hasAccepted: boolean;
  private readonly tickBytes: number;

  constructor(bytes: Uint8Array) {
    const magic = String.fromCharCode(...bytes.slice(0, 8));
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    if (bytes.length < kHeaderBytes || magic !== kMagic)
      throw new DamagedPage("the recording in this page is damaged; make the page again");
    this.ticks = this.view.getUint32(8, true);
    this.hasAccepted = this.view.getUint32(12, true) === 1;
    this.tickBytes = kTickBytes + (this.hasAccepted ? kAcceptedBytes : 0);
    if (this.ticks === 0 || bytes.length !== kHeaderBytes + this.ticks * this.tickBytes)
      throw new DamagedPage("the recording in this page is not whole; make the page again");
  }

  private double(tick: number, index: number): number {
    return this.view.getFloat64(kHeaderBytes + tick * this.tickBytes + 8 * index, true);
  }
  /** Force and torque, six numbers. */
  accepted(tick: number): number[] {
    return Array.from({ length: 6 }, (_, k) => this.double(tick, kTickBytes / 8 + k));
  }
  stampNs(tick: number): bigint {
    return this.view.getBigInt64(kHeaderBytes + tick * this.tickBytes, true);
  }
  place(tick: number): Vec {
    return [this.double(tick, 1), this.double(tick, 2), this.double(tick, 3)];
  }
  orientation(tick: number): Quat {
    return [4, 5, 6, 7].map((k) => this.double(tick, k)) as Quat;
  }
  hash(tick: number): bigint {
    return this.view.getBigUint64(kHeaderBytes + tick * this.tickBytes + 64, true);
  }
}
