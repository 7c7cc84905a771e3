// SPDX-License-Identifier: Apache-2.0
// The core's answers about geometry, taken apart for drawing. Nothing about contact is computed here.
import type { Answer, Vec } from "./messages";

export const kNone = 0xffffffff;
/** Corners that lie so near to each other are drawn at one place. */
const kSame_m = 1e-9;

export interface Face {
  /** face of the user's mesh; kNone: a cut between pieces made it */
  source: number;
  corners: Vec[];
}

export interface Piece {
  body: number;
  faces: Face[];
}

class Reader {
  private count = 0;
  private number = 0;
  constructor(private readonly answer: Answer) {}
  next(): number {
    return this.answer.counts[this.count++];
  }
  get done(): boolean {
    return this.count >= this.answer.counts.length;
  }
  vector(): Vec {
    const at = this.number;
    this.number += 3;
    const n = this.answer.numbers;
    return [n[at], n[at + 1], n[at + 2]];
  }
  vectors(count: number): Vec[] {
    return Array.from({ length: count }, () => this.vector());
  }
}

export function piecesOf(answer: Answer): Piece[] {
  const reader = new Reader(answer);
  const pieces: Piece[] = [];
  while (!reader.done) {
    const body = reader.next(), vertexCount = reader.next(), faceCount = reader.next();
    const loops = Array.from({ length: faceCount }, () => {
      const source = reader.next(), count = reader.next();
      return { source, loop: Array.from({ length: count }, () => reader.next()) };
    });
    const vertices = reader.vectors(vertexCount);
    pieces.push({
      body,
      faces: loops.map(({ source, loop }) => ({ source, corners: loop.map((v) => vertices[v]) })),
    });
  }
  return pieces;
}

/** Kinds of a C-obstacle's face, by its number. */
export const kFaceKinds = ["A", "B", "C", "several"] as const;
export enum FaceRole {
  other,
  near,
  holds,
}

export interface ObstacleFace {
  kind: number;
  role: FaceRole;
  /** the part goes on behind it: it carries no force */
  hidden: boolean;
  /** the paper's number of a basic contact of this face that is near or holds; kNone */
  node: number;
  nodes: number;
  corners: Vec[];
}

export interface Obstacle {
  pair: number;
  body: number;
  faces: ObstacleFace[];
}

export function obstaclesOf(answer: Answer): { obstacles: Obstacle[]; leftOut: number } {
  const reader = new Reader(answer);
  if (reader.done) return { obstacles: [], leftOut: 0 };
  const count = reader.next(), leftOut = reader.next();
  const obstacles = Array.from({ length: count }, () => {
    const pair = reader.next(), body = reader.next(), faceCount = reader.next();
    const faces = Array.from({ length: faceCount }, () => {
      const kind = reader.next(), role = reader.next(), hidden = reader.next() === 1, node = reader.next();
      const nodes = reader.next(), corners = reader.next();
      return { kind, role, hidden, node, nodes, corners: reader.vectors(corners) };
    });
    return { pair, body, faces };
  });
  return { obstacles, leftOut };
}

export enum GraphRole {
  neighbor,
  near,
  holds,
}

/** A basic contact of the graph. */
export interface GraphNode {
  node: number;
  /** type A, B, C */
  kind: number;
  ofA: number;
  ofB: number;
  role: GraphRole;
  applies: boolean;
  /** value of its plane where the part is felt [m] */
  depth: number;
}

export interface Graph {
  pair: number;
  body: number;
  nodes: GraphNode[];
  /** places in the list of nodes */
  arcs: [number, number][];
  leftOut: number;
}

export function graphOf(answer: Answer): Graph | null {
  const reader = new Reader(answer);
  if (reader.done) return null;
  const pair = reader.next(), body = reader.next();
  const count = reader.next(), arcCount = reader.next(), leftOut = reader.next();
  const nodes = Array.from({ length: count }, (_, k) => {
    const node = reader.next(), kind = reader.next(), ofA = reader.next(), ofB = reader.next();
    const role = reader.next(), applies = reader.next() === 1;
    return { node, kind, ofA, ofB, role, applies, depth: answer.numbers[k] };
  });
  const arcs = Array.from({ length: arcCount }, (): [number, number] => [reader.next(), reader.next()]);
  return { pair, body, nodes, arcs, leftOut };
}

/** The two features of a basic contact and its face of the C-obstacle, in W; empty lists without one. */
export interface MarkedContact {
  ofA: Vec[];
  ofB: Vec[];
  face: Vec[];
}

export function markedOf(answer: Answer): MarkedContact {
  const reader = new Reader(answer);
  if (reader.done) return { ofA: [], ofB: [], face: [] };
  const a = reader.next(), b = reader.next(), face = reader.next();
  return { ofA: reader.vectors(a), ofB: reader.vectors(b), face: reader.vectors(face) };
}

export interface Contact {
  body: number;
  situation: number;
  normal: Vec;
  polygon: Vec[];
  ids: string[];
}

const kLetters = ["v", "e", "f"];

function featureText(kind: number, first: number, second: number): string {
  const text = (n: number) => (n === kNone ? "*" : String(n));
  return kLetters[kind] + text(first) + (kind === 1 ? `-${text(second)}` : "");
}

export function contactsOf(answer: Answer): Contact[] {
  const reader = new Reader(answer);
  if (reader.done) return [];
  return Array.from({ length: reader.next() }, () => {
    const body = reader.next(), situation = reader.next();
    const corners = reader.next(), idCount = reader.next();
    const ids = Array.from({ length: idCount }, () => {
      const type = "ABC"[reader.next()];
      const a = featureText(reader.next(), reader.next(), reader.next());
      return `${type}:${a}/${featureText(reader.next(), reader.next(), reader.next())}`;
    });
    const normal = reader.vector();
    return { body, situation, normal, polygon: reader.vectors(corners), ids };
  });
}

/** Outlines in dashes of about `dash` [m]. */
export function dashesOf(faces: { corners: Vec[] }[], dash: number): Float32Array {
  const most = 200;
  const piecesOf = (from: Vec, to: Vec) => {
    const length = Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    return Math.max(1, Math.min(most, Math.round(length / (2 * dash))));
  };
  let count = 0;
  eachEdge(faces, (from, to) => (count += piecesOf(from, to)));
  const out = new Float32Array(6 * count);
  let at = 0;
  eachEdge(faces, (from, to) => {
    const pieces = piecesOf(from, to);
    for (let i = 0; i < pieces; ++i) {
      const begin = (i + 0.2) / pieces, end = (i + 0.75) / pieces;
      for (let axis = 0; axis < 3; ++axis, ++at) {
        out[at] = from[axis] + begin * (to[axis] - from[axis]);
        out[at + 3] = from[axis] + end * (to[axis] - from[axis]);
      }
      at += 3;
    }
  });
  return out;
}

function eachEdge(faces: { corners: Vec[] }[], take: (from: Vec, to: Vec) => void): void {
  for (const { corners } of faces) for (let k = 0; k < corners.length; ++k) take(corners[k], corners[(k + 1) % corners.length]);
}

/** Triangles of convex faces, three corners each. */
export function trianglesOf(faces: { corners: Vec[] }[]): Float32Array {
  const out: number[] = [];
  for (const { corners } of faces) {
    for (let k = 2; k < corners.length; ++k) out.push(...corners[0], ...corners[k - 1], ...corners[k]);
  }
  return new Float32Array(out);
}

/** Outlines of faces as segments. */
export function outlinesOf(faces: { corners: Vec[] }[]): Float32Array {
  const out = new Float32Array(6 * faces.reduce((sum, { corners }) => sum + corners.length, 0));
  let at = 0;
  eachEdge(faces, (from, to) => {
    out.set(from, at);
    out.set(to, at + 3);
    at += 6;
  });
  return out;
}

/** Unit normal of a plane face; of one without area it is 0. */
export function normalOf({ corners }: { corners: Vec[] }): Vec {
  const n: Vec = [0, 0, 0];
  for (let k = 0; k < corners.length; ++k) {
    const a = corners[k], b = corners[(k + 1) % corners.length];
    n[0] += (a[1] - b[1]) * (a[2] + b[2]);
    n[1] += (a[2] - b[2]) * (a[0] + b[0]);
    n[2] += (a[0] - b[0]) * (a[1] + b[1]);
  }
  const length = Math.hypot(...n) || 1;
  return [n[0] / length, n[1] / length, n[2] / length];
}

/** Whether two answers say the same, numbers but for rounding. */
export function sameAnswer(a: Answer, b: Answer): boolean {
  if (a.counts.length !== b.counts.length || a.numbers.length !== b.numbers.length) return false;
  for (let k = 0; k < a.counts.length; ++k) if (a.counts[k] !== b.counts[k]) return false;
  for (let k = 0; k < a.numbers.length; ++k) if (Math.abs(a.numbers[k] - b.numbers[k]) > kSame_m) return false;
  return true;
}

/** A surface of more triangles is drawn as a curved one: corners are shared where faces meet at less than a sharp bend, and only
 * sharp edges are drawn. It has a sixth of the corners, and its edges would be a blot. */
const kDense = 15000;
/** Cosine of the least bend that is sharp. */
const kSharp = 0.86;

/** What a surface is drawn from: corners with their normals, three numbers each, and the corners of triangles. */
export interface Surface {
  corners: Float32Array;
  normals: Float32Array;
  triangles: Uint32Array;
  /** by corner: 1 on a sheet, which is lit from both sides; 0 on a solid */
  sheets: Float32Array;
  /** segments, two corners each */
  edges: Float32Array;
}

/** Gives places the same number that are the same but for rounding. */
class Places {
  private readonly numbers = new Map<string, number>();
  readonly list: Vec[] = [];
  of(v: Vec): number {
    const key = `${Math.round(v[0] * 1e8)},${Math.round(v[1] * 1e8)},${Math.round(v[2] * 1e8)}`;
    let number = this.numbers.get(key);
    if (number === undefined) {
      number = this.list.length;
      this.numbers.set(key, number);
      this.list.push(v);
    }
    return number;
  }
}

const dot = (a: Vec, b: Vec) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export function surfaceOf(all: Face[]): Surface {
  const places = new Places();
  // A facet of a surface has two sides, of which one is enough.
  const faces: Face[] = [], loops: number[][] = [], isSheet: boolean[] = [];
  const known = new Map<string, number>();
  for (const face of all) {
    const loop = face.corners.map((corner) => places.of(corner));
    const key = [...loop].sort((a, b) => a - b).join();
    const other = known.get(key);
    if (other !== undefined) {
      isSheet[other] = true;
      continue;
    }
    known.set(key, faces.length);
    faces.push(face);
    loops.push(loop);
    isSheet.push(false);
  }
  const isDense = loops.reduce((sum, loop) => sum + loop.length - 2, 0) > kDense;
  const faceNormals = faces.map(normalOf);
  const corners: number[] = [], normals: number[] = [], sheets: number[] = [], triangles: number[] = [];
  const add = (place: number, normal: Vec, sheet: boolean) => {
    corners.push(...places.list[place]);
    normals.push(...normal);
    sheets.push(sheet ? 1 : 0);
    return corners.length / 3 - 1;
  };
  /** by place: corners that faces there may share, and the normal that each began with */
  const shared: { corner: number; normal: Vec }[][] = places.list.map(() => []);
  const cornerOf = (place: number, normal: Vec, sheet: boolean) => {
    if (!isDense) return add(place, normal, sheet);
    const there = shared[place].find((other) => dot(other.normal, normal) > kSharp);
    if (!there) {
      const corner = add(place, normal, sheet);
      shared[place].push({ corner, normal });
      return corner;
    }
    for (let axis = 0; axis < 3; ++axis) normals[3 * there.corner + axis] += normal[axis];
    return there.corner;
  };
  loops.forEach((loop, f) => {
    const own = loop.map((place) => cornerOf(place, faceNormals[f], isSheet[f]));
    for (let k = 2; k < own.length; ++k) triangles.push(own[0], own[k - 1], own[k]);
  });
  for (let k = 0; k < normals.length; k += 3) {
    const length = Math.hypot(normals[k], normals[k + 1], normals[k + 2]) || 1;
    for (let axis = 0; axis < 3; ++axis) normals[k + axis] /= length;
  }
  return {
    corners: new Float32Array(corners),
    normals: new Float32Array(normals),
    sheets: new Float32Array(sheets),
    triangles: new Uint32Array(triangles),
    edges: edgesOf(loops, faceNormals, places.list, isDense),
  };
}

/** Edges at which a surface bends, as segments: those between coplanar faces are left out, and where `isDense` all that are not sharp. */
function edgesOf(loops: number[][], normals: Vec[], places: Vec[], isDense: boolean): Float32Array {
  const kShift = 2 ** 26, kFlat = 2;
  // By the numbers of both ends: the first face there, and the cosine of the sharpest bend.
  const firsts = new Map<number, number>(), bends = new Map<number, number>();
  loops.forEach((loop, face) => {
    loop.forEach((from, k) => {
      const to = loop[(k + 1) % loop.length];
      const edge = Math.min(from, to) * kShift + Math.max(from, to);
      const first = firsts.get(edge);
      if (first === undefined) {
        firsts.set(edge, face);
        return;
      }
      const cosine = dot(normals[face], normals[first]);
      const before = bends.get(edge) ?? 1;
      bends.set(edge, Math.abs(cosine) > 1 - 1e-6 || before === kFlat ? kFlat : Math.min(before, cosine));
    });
  });
  const out: number[] = [];
  for (const edge of firsts.keys()) {
    const bend = bends.get(edge);
    if (bend !== undefined && (bend === kFlat || (isDense && bend > kSharp))) continue;
    const from = Math.floor(edge / kShift);
    out.push(...places[from], ...places[edge - from * kShift]);
  }
  return new Float32Array(out);
}
