// SPDX-License-Identifier: Apache-2.0
// The core as a WebAssembly module (host_sim/view/wasm): one scene, one core. JavaScript and not TypeScript, so that node
// runs the very same file without a build.

/** @typedef {Record<string, number | bigint | number[]>} Fields */
/** @typedef {{offset: number, type: string, count: number}} Member */
/** @typedef {{numbers: Float64Array, counts: Uint32Array}} Answer */

const kReaders = {
  f64: { bytes: 8, get: "getFloat64", set: "setFloat64" },
  i64: { bytes: 8, get: "getBigInt64", set: "setBigInt64" },
  u64: { bytes: 8, get: "getBigUint64", set: "setBigUint64" },
  u32: { bytes: 4, get: "getUint32", set: "setUint32" },
};

/** The members of a structure that begins at byte `at`. @param {DataView} view @param {number} at
 *  @param {Record<string, Member>} members @returns {Fields} */
export function fieldsAt(view, at, members) {
  /** @type {Fields} */
  const fields = {};
  for (const [name, member] of Object.entries(members)) {
    const reader = /** @type {any} */ (kReaders)[member.type];
    const value = (/** @type {number} */ k) =>
      /** @type {any} */ (view)[reader.get](at + member.offset + k * reader.bytes, true);
    fields[name] = member.count === 1 ? value(0) : Array.from({ length: member.count }, (_, k) => value(k));
  }
  return fields;
}

/** Bytes of a structure without gaps. @param {Record<string, Member>} members */
export function bytesOf(members) {
  return Object.values(members).reduce((bytes, { type, count }) => bytes + count * /** @type {any} */ (kReaders)[type].bytes, 0);
}

/** Numbers of a driven part (DrivenTick of tools/live/driven_tick.hpp). */
const kDrivenNumbers = 22;
/** A part that its owner moves: where the owner has it, where it is, how far it is behind, and what pushes it.
 *  @typedef {{p: [number, number, number], q: [number, number, number, number]}} Pose
 *  @typedef {{commanded: Pose, felt: Pose, lag_m: number, lag_rad: number, push_n: number[], push_nm: number[]}} DrivenTick
 *  @typedef {DrivenTick & {name: string, touches: boolean, isLost: boolean}} Driven */
/** @param {ArrayLike<number>} numbers  of all driven parts @param {number} k @returns {DrivenTick} */
export function drivenTick(numbers, k) {
  const at = (/** @type {number} */ begin, /** @type {number} */ count) =>
    /** @type {any} */ (Array.from({ length: count }, (_, i) => numbers[kDrivenNumbers * k + begin + i]));
  return {
    commanded: { p: at(0, 3), q: at(3, 4) },
    felt: { p: at(7, 3), q: at(10, 4) },
    lag_m: at(14, 1)[0],
    lag_rad: at(15, 1)[0],
    push_n: at(16, 3),
    push_nm: at(19, 3),
  };
}

/** A scene that the core refuses, in words for people. */
export class SceneRefused extends Error {}

export class Core {
  /** @param {BufferSource} module  bytes of view_core.wasm */
  static async load(module) {
    const loaded = await WebAssembly.instantiate(module, {});
    return new Core(/** @type {any} */ (loaded).instance.exports);
  }

  /** @param {any} exports */
  constructor(exports) {
    this.wasm = exports;
    exports._initialize();
    /** @type {Record<string, Record<string, Member>>} */
    this.layout = { input: {}, drive: {}, result: {}, scene: {}, live: {} };
    for (const line of this.text(exports.view_layout()).trim().split("\n")) {
      const [structure, name, offset, type, count] = line.split(" ");
      this.layout[structure][name] = { offset: Number(offset), type, count: Number(count) };
    }
    this.opened = 0;
  }

  /** @param {number} at  address of a C string */
  text(at) {
    const bytes = new Uint8Array(this.wasm.memory.buffer);
    let end = at;
    while (bytes[end] !== 0) end += 1;
    return new TextDecoder().decode(bytes.slice(at, end));
  }

  /** @param {Uint8Array} bytes  of a compiled scene */
  open(bytes) {
    const at = this.wasm.view_reserve(bytes.length);
    if (at === 0) throw new SceneRefused("there is no memory for a scene of this size");
    new Uint8Array(this.wasm.memory.buffer).set(bytes, at);
    const status = this.wasm.view_open(bytes.length);
    if (status !== 0) throw new SceneRefused(this.text(this.wasm.view_status_text(status)));
    this.opened += 1;
  }

  /** @param {"input" | "result" | "scene"} structure @returns {Fields} */
  read(structure) {
    const at = this.wasm[`view_${structure}`]();
    return fieldsAt(new DataView(this.wasm.memory.buffer), at, this.layout[structure]);
  }

  /** One member of the result without the others. @param {string} name */
  one(name) {
    const member = this.layout.result[name];
    const reader = /** @type {any} */ (kReaders)[member.type];
    const view = new DataView(this.wasm.memory.buffer);
    return /** @type {any} */ (view)[reader.get](this.wasm.view_result() + member.offset, true);
  }

  /** A member of the result that is a list of doubles. @param {string} name */
  list(name) {
    const member = this.layout.result[name];
    const at = this.wasm.view_result() + member.offset;
    return new Float64Array(this.wasm.memory.buffer.slice(at, at + 8 * member.count));
  }

  /** @param {Fields} fields  those that change @param {"input" | "drive"} [structure] */
  write(fields, structure = "input") {
    const at = this.wasm[`view_${structure}`]();
    const view = new DataView(this.wasm.memory.buffer);
    for (const [name, value] of Object.entries(fields)) {
      const member = this.layout[structure][name];
      if (!member) throw new Error(`the core's ${structure} has no '${name}'`);
      const reader = /** @type {any} */ (kReaders)[member.type];
      const values = Array.isArray(value) ? value : [value];
      values.forEach((v, k) => {
        /** @type {any} */ (view)[reader.set](at + member.offset + k * reader.bytes, v, true);
      });
    }
  }

  /** The newest pose of a driven part. @param {Fields} pose  all members of the structure "drive" */
  give(pose) {
    this.write(pose, "drive");
    this.wasm.view_give();
  }
  /** Before a step: the driven parts follow their poses. @param {bigint} now_ns @param {boolean} isFelt */
  follow(now_ns, isFelt) {
    this.wasm.view_follow(now_ns, isFelt ? 1 : 0);
  }
  /** The parts that their owners move. @returns {Driven[]} */
  driven() {
    const { numbers, counts } = this.describe("driven");
    if (counts.length === 0) return [];
    const names = this.text(this.wasm.view_text()).trimEnd().split("\n");
    return names.map((name, k) => ({
      name,
      ...drivenTick(numbers, k),
      touches: counts[2 * k] === 1,
      isLost: counts[2 * k + 1] === 1,
    }));
  }

  step() {
    this.wasm.view_step();
  }
  reset() {
    this.wasm.view_reset();
  }

  /** The hand lets go of what it holds, and then takes a part of the scene. @param {number} part
   *  @returns {{p: [number, number, number], q: [number, number, number, number]} | "waits" | "refused"}  a pose: the next step takes the
   *  part, which the hand leads where it is from there; "waits": step, and ask again */
  hold(part) {
    const state = this.wasm.view_hold(part);
    if (state !== 2) return state === 1 ? "waits" : "refused";
    const [x, y, z, a, b, c, w] = this.numbers();
    return { p: [x, y, z], q: [a, b, c, w] };
  }
  release() {
    this.wasm.view_release();
  }
  /** The parts that the hand holds one after another, which of them is held (-1: none), and which each body is; null: the scene has one
   *  moving part. @returns {{names: string[], mayBeHeld: boolean[], bodies: number[], held: number} | null} */
  parts() {
    const { counts } = this.describe("parts");
    if (counts.length === 0) return null;
    const names = this.text(this.wasm.view_text()).trimEnd().split("\n");
    const [held, shown, ...rest] = counts;
    return {
      names,
      mayBeHeld: rest.slice(0, names.length).map((may) => may === 1),
      bodies: [shown, ...rest.slice(names.length)],
      held: held === 0xffffffff ? -1 : held,
    };
  }

  /** What is judged begins with the next tick. */
  beginVerdict() {
    this.wasm.view_begin_verdict();
  }
  /** The judgement of the ticks since then, as the programs end with it. @returns {{text: string, failed: boolean}} */
  verdict() {
    const { counts } = this.describe("verdict");
    return { text: this.text(this.wasm.view_text()), failed: counts[0] === 1 };
  }

  /** All mutable memory of the core. */
  save() {
    const pieces = this.statePieces();
    const state = new Uint8Array(pieces.reduce((bytes, piece) => bytes + piece.length, 0));
    let at = 0;
    for (const piece of pieces) {
      state.set(piece, at);
      at += piece.length;
    }
    return state.buffer;
  }
  /** Continues from a saved state of this scene. @param {ArrayBuffer} state */
  restore(state) {
    let at = 0;
    for (const piece of this.statePieces()) {
      piece.set(new Uint8Array(state, at, piece.length));
      at += piece.length;
    }
  }
  /** Where they lie. @returns {Uint8Array[]} */
  statePieces() {
    const piece = (/** @type {number} */ k) =>
      new Uint8Array(this.wasm.memory.buffer, this.wasm.view_state(k), this.wasm.view_state_bytes(k));
    return Array.from({ length: this.wasm.view_state_count() }, (_, k) => piece(k));
  }

  /** The numbers of the last answer. */
  numbers() {
    const at = this.wasm.view_numbers();
    return new Float64Array(this.wasm.memory.buffer.slice(at, at + 8 * this.wasm.view_number_count()));
  }

  /** What a `describe` function answers. @param {string} what @param {...number} limits @returns {Answer} */
  describe(what, ...limits) {
    this.wasm[`view_describe_${what}`](...limits);
    const { buffer } = this.wasm.memory;
    const counts = this.wasm.view_counts();
    return {
      numbers: this.numbers(),
      counts: new Uint32Array(buffer.slice(counts, counts + 4 * this.wasm.view_count_count())),
    };
  }

  /** Name and law of the scene, and the names of its bodies. */
  names() {
    this.wasm.view_describe_scene();
    const [name, law, ...bodies] = this.text(this.wasm.view_text()).split("\n");
    return { name, law, bodies: bodies.slice(0, -1) };
  }

  /** Where on the plan of the scene's guide the part is; empty: there is no guide. */
  guide() {
    this.wasm.view_describe_guide();
    return this.text(this.wasm.view_text());
  }

  /** @param {number} situation */
  situation(situation) {
    return this.text(this.wasm.view_situation_text(situation));
  }
}
