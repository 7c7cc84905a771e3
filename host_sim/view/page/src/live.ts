// SPDX-License-Identifier: Apache-2.0
// A session that runs while the page is open: the messages of the live server (tools/live/live_protocol.hpp,
// live_board.hpp), and what of the ticks can be computed again and compared.
import { bytesOf, fieldsAt } from "./core.mjs";
import type { Pose, Quat, Vec } from "./messages";
import { givenPose } from "./recording";
import type { GivenPose } from "./recording";

export const kLiveProtocol = "haptic.live.v1";

const kMagic = 0x33564c48;
const kHeadBytes = 32;
const kTickBytes = 208;
const kGivenBytes = 120;
const kMarkReset = 1n, kMarkAccepted = 2n, kMarkTwist = 4n, kMarkClutched = 8n, kMarkDriven = 16n, kMarkFelt = 32n;
/** A page that was up to date and is so far behind gives up the ticks between. */
const kMostBehind = 2000;
const kUpToDate = 100;

/** How the page follows a session, as host_sim wrote it into the page (tools/live/page_file.hpp). */
export interface LiveFacts {
  takesHand: boolean;
  whyNotCompared: string;
}

/** Members of the newest tick (LiveState of tools/live/live_state.hpp), as the core's module states their layout. */
export type LiveLayout = Record<string, { offset: number; type: string; count: number }>;

export class Chunk {
  readonly ticks: number;
  readonly first: number;
  /** ticks of the session so far */
  readonly written: number;
  private readonly view: DataView;
  private readonly begin: number;
  /** poses of driven parts, by tick */
  private readonly givenAt = new Map<number, GivenPose[]>();

  constructor(bytes: ArrayBuffer, private readonly layout: LiveLayout) {
    this.view = new DataView(bytes);
    this.begin = kHeadBytes + bytesOf(layout);
    const whole = bytes.byteLength >= this.begin && this.view.getUint32(0, true) === kMagic;
    this.ticks = whole ? this.view.getUint32(4, true) : -1;
    const end = this.begin + this.ticks * kTickBytes;
    const given = whole ? Number(this.view.getBigUint64(24, true)) : 0;
    if (bytes.byteLength !== end + given * kGivenBytes)
      throw new Error("the server sent what this page cannot read; load the page again");
    this.first = Number(this.view.getBigUint64(8, true));
    this.written = Number(this.view.getBigUint64(16, true));
    for (let k = 0; k < given; ++k) this.addGiven(bytes.slice(end + k * kGivenBytes, end + (k + 1) * kGivenBytes));
  }

  private addGiven(bytes: ArrayBuffer): void {
    const words = new BigUint64Array(bytes);
    const tick = Number(words[0]);
    this.givenAt.set(tick, [...(this.givenAt.get(tick) ?? []), givenPose(words, new Float64Array(bytes), 0)]);
  }

  private doubles(at: number, count: number): number[] {
    return Array.from({ length: count }, (_, k) => this.view.getFloat64(at + 8 * k, true));
  }
  /** The newest tick in the words of the core that ran it. */
  get state(): Record<string, any> {
    return fieldsAt(this.view, kHeadBytes, this.layout);
  }

  private at(k: number): number {
    return this.begin + k * kTickBytes;
  }
  stampNs(k: number): bigint {
    return this.view.getBigInt64(this.at(k), true);
  }
  pose(k: number): Pose {
    return { p: this.doubles(this.at(k) + 8, 3) as Vec, q: this.doubles(this.at(k) + 32, 4) as Quat };
  }
  /** Force and torque that acted before the tick; undefined: not known. */
  accepted(k: number): number[] | undefined {
    return (this.marks(k) & kMarkAccepted) !== 0n ? this.doubles(this.at(k) + 64, 6) : undefined;
  }
  /** Six numbers; undefined: the device did not say it. */
  twist(k: number): number[] | undefined {
    return (this.marks(k) & kMarkTwist) !== 0n ? this.doubles(this.at(k) + 112, 6) : undefined;
  }
  clutched(k: number): boolean {
    return (this.marks(k) & kMarkClutched) !== 0n;
  }
  hash(k: number): bigint {
    return this.view.getBigUint64(this.at(k) + 160, true);
  }
  private marks(k: number): bigint {
    return this.view.getBigUint64(this.at(k) + 168, true);
  }
  sequence(k: number): bigint {
    return this.view.getBigUint64(this.at(k) + 184, true);
  }
  /** Poses that driven parts were given in this tick for the first time. */
  given(k: number): GivenPose[] {
    return this.givenAt.get(this.first + k) ?? [];
  }
  /** Clock of the driven parts, and whether the hand feels what they do; undefined: the scene has none. */
  driven(k: number): { now_ns: bigint; isFelt: boolean } | undefined {
    const marks = this.marks(k);
    if ((marks & kMarkDriven) === 0n) return undefined;
    return { now_ns: this.view.getBigInt64(this.at(k) + 176, true), isFelt: (marks & kMarkFelt) !== 0n };
  }
  /** The core forgot before this tick all that was. */
  resets(k: number): boolean {
    return (this.marks(k) & kMarkReset) !== 0n;
  }
}

function message(kind: number, bytes: number): DataView {
  const view = new DataView(new ArrayBuffer(bytes));
  view.setUint32(0, kind, true);
  return view;
}
/** Asks for the ticks from `first` on. */
export function askMessage(first: number): ArrayBuffer {
  const view = message(1, 16);
  view.setBigUint64(8, BigInt(first), true);
  return view.buffer as ArrayBuffer;
}
/** `stamp`: of the page's clock; it comes back with the tick that followed. */
export function handMessage(pose: Pose, stamp: number): ArrayBuffer {
  const view = message(2, 72);
  [...pose.p, ...pose.q, stamp].forEach((value, k) => view.setFloat64(8 + 8 * k, value, true));
  return view.buffer as ArrayBuffer;
}
export function restartMessage(): ArrayBuffer {
  return message(3, 8).buffer as ArrayBuffer;
}

/** What is to be done with a tick. */
export enum Next {
  /** it goes on from the tick before */
  step,
  /** the core forgets, then takes it */
  reset,
  /** it does not go on from the tick before: the core starts again where the part is felt now */
  lost,
}

/** Keeps account of which ticks came, and whether what the core knows is all that the session's core knew. */
export class Account {
  /** number of the tick that is to come */
  expected = 0;
  /** since the last reset */
  checked = 0;
  differs = -1;
  /** why nothing is compared; empty: all is */
  why = "";
  private begun = false;
  private upToDate = false;

  constructor(private readonly whyNotCompared: string) {}

  tick(number: number, resets: boolean): Next {
    const goesOn = number === this.expected && (this.begun || resets);
    if (resets) {
      this.why = this.whyNotCompared;
      this.checked = 0;
      this.differs = -1;
    } else if (!goesOn) {
      this.lose(number);
    }
    this.begun = true;
    this.expected = number + 1;
    return resets ? Next.reset : goesOn ? Next.step : Next.lost;
  }

  private lose(number: number): void {
    this.why = this.whyNotCompared || (this.begun
      ? `ticks ${this.expected} to ${number - 1} did not get here in time`
      : `attached at tick ${number}: what the core had met before is not known here`);
  }

  compare(equal: boolean): void {
    if (this.why) return;
    if (!equal && this.differs < 0) this.differs = this.expected - 1;
    this.checked += 1;
  }

  /** The tick to ask for next, when `written` are there. A page that cannot keep up goes to the newest one. */
  ask(written: number): number {
    const behind = written - this.expected;
    if (behind < kUpToDate) this.upToDate = true;
    return this.upToDate && behind > kMostBehind ? written - 1 : this.expected;
  }
  /** Whether the ticks of a message are worth nothing: they do not go on from those before, and none is a new begin. */
  skips(chunk: Chunk): boolean {
    if (chunk.ticks === 0 || (this.begun && chunk.first === this.expected)) return false;
    for (let k = 0; k < chunk.ticks; ++k) if (chunk.resets(k)) return false;
    return chunk.written - chunk.first > kMostBehind / 4;
  }
}

/** The connection; it is made again where it is lost. */
export class LiveLink {
  private socket: WebSocket | null = null;
  isOpen = false;

  constructor(
    private readonly url: string,
    private readonly layout: LiveLayout,
    private readonly first: () => number,
    private readonly take: (chunk: Chunk) => number,
    private readonly tell: (isOpen: boolean) => void,
  ) {
    this.connect();
  }

  private connect(): void {
    const socket = new WebSocket(this.url, kLiveProtocol);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => {
      this.isOpen = true;
      this.tell(true);
      socket.send(askMessage(this.first()));
    };
    socket.onmessage = (event: MessageEvent<ArrayBuffer>) => socket.send(askMessage(this.take(new Chunk(event.data, this.layout))));
    socket.onclose = () => {
      this.isOpen = false;
      this.tell(false);
      setTimeout(() => this.connect(), kAgain_ms);
    };
  }

  send(message: ArrayBuffer): void {
    if (this.isOpen) this.socket!.send(message);
  }
}
const kAgain_ms = 1000;
