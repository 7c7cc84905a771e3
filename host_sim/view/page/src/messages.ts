// SPDX-License-Identifier: Apache-2.0
// What the page and the worker that runs the core say to each other. The newest picture replaces the one before: there is
// no queue.

import type { LiveFacts } from "./live";

export type Vec = [number, number, number];
/** x, y, z, w */
export type Quat = [number, number, number, number];

/** A pose of the part's mesh frame in W. */
export interface Pose {
  p: Vec;
  q: Quat;
}

export interface Answer {
  numbers: Float64Array;
  counts: Uint32Array;
}

/** The parts of a scene that the hand holds one after another. */
export interface PartFacts {
  names: string[];
  mayBeHeld: boolean[];
  /** number of the part that each body is; body 0 is the one that is held, or was last */
  bodies: number[];
}

/** The parts that their owners move. */
export interface DrivenFacts {
  names: string[];
  /** bodies by their numbers in `names`, vertices about their mesh frames */
  pieces: Answer;
  starts: Pose[];
}

/** A driven part: where its owner has it, where it is, how far it is behind, and what pushes it. */
export interface DrivenPicture {
  commanded: Pose;
  felt: Pose;
  lag_m: number;
  lag_rad: number;
  push_n: number[];
  push_nm: number[];
  /** its stream of poses is late, too fast or none; undefined: not known */
  isLost?: boolean;
}

export interface SceneFacts {
  name: string;
  law: string;
  bodies: string[];
  kT: number;
  kR: number;
  kF: number;
  hand: { k: number; kR: number };
  start: Pose;
  grip: Vec;
  /** work after which a tick begins nothing more, and the most that a tick can do [units] */
  workBudget: number;
  workBound: number;
  single: boolean;
  pairCount: number;
  pieceCount: number;
  situations: string[];
  pieces: Answer;
  /** null: the scene has one moving part */
  parts: PartFacts | null;
  /** they, and behind them the part of a second hand; null: the scene has none */
  driven: DrivenFacts | null;
  /** a second hand: where it holds its part, and which of `driven` that is */
  second: { grip: Vec; mover: number } | null;
  recordedTicks: number;
}

export type Mode = "hand" | "play" | "pause" | "live";

/** The judgement of a session: a line, and whether it is a failure. */
export interface Verdict {
  text: string;
  failed: boolean;
}

/** What is drawn: the newest tick. */
export interface Picture {
  kind: "picture";
  mode: Mode;
  tick: number;
  /** of a recording: ticks from its begin; by hand: from the page's begin [s] */
  time: number;
  device: Pose;
  felt: Pose;
  deviceGrip: Vec;
  feltGrip: Vec;
  force: Vec;
  torque: Vec;
  /** of a scene with a guide: what leads the hand besides the contact, and where on the plan the part is */
  guide: { force: Vec; torque: Vec; place: string; toGo: number } | null;
  gap: number;
  dNear: number;
  energy: number;
  situation: number;
  flags: number;
  status: number;
  /** units */
  work: number;
  /** of the session so far; of a recording the whole of it */
  verdict: Verdict;
  feltPlanes: number;
  /** in the order of the scene's driven parts; behind them the part of a second hand, pushed by what that feels */
  driven: DrivenPicture[];
  obstacles: Answer;
  contacts: Answer;
  /** contact graph round the active pair */
  graph: Answer;
  /** features of the chosen basic contact */
  marked: Answer;
  /** number of the part that the hand holds; -1: none, or the scene has one moving part */
  held: number;
  /** share of real time that the core keeps up with */
  pace: number;
  /** when the page had the hand's move that this tick followed, by its own clock [ms]; 0: there was none */
  handAt: number;
  /** of a live session: ticks that are there and not yet computed */
  behind: number;
  /** kChannels numbers for each tick since the picture before */
  samples: Float32Array;
  /** the samples before are of another time: after a jump */
  cut: boolean;
}

/** Channels of a sample. */
export const kChannels = 7;
/** Force [N], torque [N m], distance of device and felt part [m], situation, share of the bound of its work, energy of the observer [J],
 * and whether the core has flagged something that a person should see. */
export enum Channel {
  force,
  torque,
  apart,
  situation,
  work,
  energy,
  marked,
}

export interface Lamp {
  kind: "lamp";
  checked: number;
  total: number;
  /** first tick whose state hash is not the recorded one; -1: none */
  differs: number;
  /** of a live session */
  live?: { isOpen: boolean; isOver: boolean; why: string };
}

/** How to follow a session that runs. */
export interface LiveOrder extends LiveFacts {
  url: string;
}

export type ToWorker =
  | { kind: "load"; module: ArrayBuffer; scene: Uint8Array; recording: Uint8Array | null; live: LiveOrder | null }
  /** `second`: of the second hand */
  | { kind: "hand"; target: Pose; at: number; second?: boolean }
  | { kind: "mode"; mode: Mode }
  | { kind: "seek"; tick: number }
  | { kind: "select"; selected: { pair: number; node: number } | null }
  | { kind: "restart" }
  /** -1: the hand lets go */
  | { kind: "hold"; part: number }
  | { kind: "taken" };

export type FromWorker =
  | { kind: "loaded"; scene: SceneFacts }
  /** another part is held, or all are where they start */
  | { kind: "held"; scene: SceneFacts }
  | { kind: "refused"; text: string }
  | { kind: "strips"; samples: Float32Array }
  | Lamp
  | Picture;
