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
    this.layout = { input: {}, result: {}, scene: {}, live: {} };
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

  /** @param {Fields} fields  those that change */
  write(fields) {
    const at = this.wasm.view_input();
    const view = new DataView(this.wasm.memory.buffer);
    for (const [name, value] of Object.entries(fields)) {
      const member = this.layout.input[name];
      if (!member) throw new Error(`the core's input has no '${name}'`);
      const reader = /** @type {any} */ (kReaders)[member.type];
      const values = Array.isArray(value) ? value : [value];
      values.forEach((v, k) => {
        /** @type {any} */ (view)[reader.set](at + member.offset + k * reader.bytes, v, true);
      });
    }
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
    const at = this.wasm.view_state();
    return this.wasm.memory.buffer.slice(at, at + this.wasm.view_state_bytes());
  }
  /** Continues from a saved state of this scene. @param {ArrayBuffer} state */
  restore(state) {
    new Uint8Array(this.wasm.memory.buffer).set(new Uint8Array(state), this.wasm.view_state());
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
