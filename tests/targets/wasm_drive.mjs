// SPDX-License-Identifier: Apache-2.0
// wasm_drive.mjs WASM SCENE POSES RESULTS: the drive of an image (linker/pose_drive.hpp) by the module that the page loads, in
// node: the counterpart of the program hosted_drive, file by file. Between ticks it asks for everything that the page
// draws, and it puts a saved state back once, so that neither may change a bit.
// Exit codes: 0 done, 1 the scene or a tick was refused, 2 usage, 3 a file cannot be read.
import { readFileSync, writeFileSync } from "node:fs";
import { Core, SceneRefused } from "../../host_sim/view/page/src/core.mjs";

const kPoseBytes = 64, kTickBytes = 64;
const [wasm, scene, poses, results] = process.argv.slice(2);
if (!results) {
  console.error("usage: wasm_drive.mjs WASM SCENE POSES RESULTS");
  process.exit(2);
}

function read(path) {
  try {
    return readFileSync(path);
  } catch (error) {
    console.error(`wasm_drive.mjs: ${path}: ${error.message}`);
    process.exit(3);
  }
}

const core = await Core.load(read(wasm));
const bytes = read(scene), input = read(poses);
try {
  core.open(bytes);
} catch (error) {
  if (!(error instanceof SceneRefused)) throw error;
  console.error(`wasm_drive.mjs: ${scene}: ${error.message}`);
  process.exit(1);
}

const count = Math.floor(input.length / kPoseBytes);
const out = Buffer.alloc((count + 1) * kTickBytes);

function tick(k) {
  const at = k * kPoseBytes;
  const double = (index) => input.readDoubleLE(at + 8 + 8 * index);
  core.write({
    stamp_ns: input.readBigInt64LE(at),
    sequence: BigInt(k),
    p_wa_m: [double(0), double(1), double(2)],
    q_wa_xyzw: [double(4), double(5), double(6), double(3)],
  });
  core.step();
  if (core.one("status") !== 0) {
    console.error(`wasm_drive.mjs: tick ${k} was refused: status ${core.one("status")}`);
    process.exit(1);
  }
  const to = k * kTickBytes;
  out.writeBigUInt64LE(core.one("state_hash"), to);
  core.list("force_w_n").forEach((value, axis) => out.writeDoubleLE(value, to + 8 + 8 * axis));
  core.list("torque_w_nm").forEach((value, axis) => out.writeDoubleLE(value, to + 32 + 8 * axis));
  out.writeUInt32LE(core.one("flags"), to + 60);
}

let state;
const saved = Math.floor(count / 2);
for (let k = 0; k < count; ++k) {
  tick(k);
  if (k % 16 === 0) {
    core.describe("obstacles", 8, 20000);
    core.describe("contacts");
    core.describe("graph", 64);
    core.describe("marked", 0, k % 7);
  }
  if (k + 1 === saved) state = core.save();
}
if (state) {
  core.restore(state);
  for (let k = saved; k < count; ++k) tick(k);
}

// The summary, last.
const to = count * kTickBytes;
out.write("RTDRIVE1", to, "latin1");
out.writeUInt32LE(0, to + 8);
out.writeUInt32LE(count, to + 12);
out.writeUInt32LE(core.read("scene").scalar_bytes, to + 16);
out.writeUInt32LE(4, to + 20);
out.writeBigUInt64LE(core.read("scene").content_hash, to + 24);
out.writeBigUInt64LE(core.read("scene").state_bytes, to + 32);
out.writeBigUInt64LE(BigInt(bytes.length), to + 40);
writeFileSync(results, out);
