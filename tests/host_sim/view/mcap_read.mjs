// SPDX-License-Identifier: Apache-2.0
// mcap_read.mjs PACKAGES MCAP CSV [DRIVEN | --second NAME CSV2]: an MCAP file of `host_sim run`, read by the format's official package (@mcap/core), holds the
// ticks of the run's CSV: counts, order, times, schemas and values, those of a guide where there is one, and those of driven parts by
// DRIVEN, a run's driven.csv, or of a second hand's part by its CSV. Exit code 1 where it does not.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [packages, mcap, csv, ...others] = process.argv.slice(2);
const [second, secondCsv] = others[0] === "--second" ? others.slice(1) : [];
const drivenCsv = second ? undefined : others[0];
const { McapStreamReader } = createRequire(join(packages, "x.js"))("@mcap/core");

/** Words between commas; those in quotation marks may hold commas. */
const words = (line) => [...line.matchAll(/"([^"]*)"|([^,"]+)/g)].map(([, quoted, plain]) => quoted ?? plain);
function table(path) {
  const [head, ...lines] = readFileSync(path, "utf8").trim().split("\n");
  const columns = head.split(",");
  return { columns, rows: lines.map((line) => Object.fromEntries(words(line).map((word, k) => [columns[k], word]))) };
}
const { columns, rows } = table(csv);
const driven = drivenCsv ? table(drivenCsv).rows : [];
const drivenFrames = [...new Set(driven.map(({ part }) => `driven/${part}`))];
const frames = second ? [...drivenFrames, `hand2/${second}`] : drivenFrames;

const reader = new McapStreamReader({ validateCrcs: true });
reader.append(readFileSync(mcap));
const schemas = new Map(), channels = new Map(), messages = new Map();
let last = 0n;
for (let record; (record = reader.nextRecord()); ) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") {
    channels.set(record.id, record);
    messages.set(record.topic, []);
  }
  if (record.type !== "Message") continue;
  const { topic, messageEncoding, schemaId } = channels.get(record.channelId);
  assert.equal(messageEncoding, "json");
  const schema = JSON.parse(new TextDecoder().decode(schemas.get(schemaId).data));
  const value = JSON.parse(new TextDecoder().decode(record.data));
  for (const key of Object.keys(value)) assert.ok(key in schema.properties, `${topic}: ${key} is not in its schema`);
  assert.ok(record.logTime >= last, "messages out of order");
  last = record.logTime;
  const list = messages.get(topic);
  assert.equal(record.sequence, list.length);
  list.push({ time: record.logTime, value });
}
assert.ok(reader.done() && reader.bytesRemaining() === 0, "the file is not whole");

const transforms = new Map(["part", ...frames].map((frame) => [frame, []]));
for (const message of messages.get("/tf")) transforms.get(message.value.child_frame_id).push(message);
messages.set("/tf", transforms.get("part"));
for (const topic of ["/tf", "/pose", "/felt_pose", "/wrench", "/contact", "/counters"])
  assert.equal(messages.get(topic).length, rows.length, topic);
const isGuided = columns.includes("guide_place");
assert.equal(messages.get("/guide").length, isGuided ? rows.length : 0);
assert.equal(messages.get("/scene").length, 1);
const { entities } = messages.get("/scene")[0].value;
assert.deepEqual(entities.map((entity) => entity.frame_id), ["part", "w", ...frames]);
for (const entity of entities) {
  const { points } = entity.triangles[0];
  assert.ok(points.length >= 36 && points.length % 3 === 0);
}

rows.forEach((row, k) => {
  const at = (topic) => messages.get(topic)[k];
  assert.equal(at("/wrench").time, BigInt(Math.round(Number(row.t_s) * 1e9)));
  const { force_n, torque_nm } = at("/wrench").value;
  assert.deepEqual([force_n.x, force_n.y, force_n.z], [row.fx_n, row.fy_n, row.fz_n].map(Number));
  assert.deepEqual([torque_nm.x, torque_nm.y, torque_nm.z], [row.tx_nm, row.ty_nm, row.tz_nm].map(Number));
  assert.equal(at("/contact").value.situation, row.state);
  assert.equal(at("/counters").value.state_hash, row.state_hash);
  const { position } = at("/felt_pose").value.pose;
  assert.deepEqual([position.x, position.y, position.z], [row.proxy_x_m, row.proxy_y_m, row.proxy_z_m].map(Number));
  assert.deepEqual(at("/tf").value.translation, position);
  if (!isGuided) return;
  const { state, place, force_n: led } = at("/guide").value;
  assert.deepEqual([state, place], [row.guide, row.guide_place]);
  assert.deepEqual([led.x, led.y, led.z], [row.guide_fx_n, row.guide_fy_n, row.guide_fz_n].map(Number));
});
const ofFrame = new Map(drivenFrames.map((frame) => [frame, 0]));
for (const row of driven) {
  const frame = `driven/${row.part}`, k = ofFrame.get(frame);
  const { translation, rotation } = transforms.get(frame)[k].value;
  assert.deepEqual([translation.x, translation.y, translation.z], [row.felt_x_m, row.felt_y_m, row.felt_z_m].map(Number));
  assert.deepEqual([rotation.x, rotation.y, rotation.z, rotation.w], [row.felt_qx, row.felt_qy, row.felt_qz, row.felt_qw].map(Number));
  ofFrame.set(frame, k + 1);
}
for (const [frame, count] of ofFrame) assert.deepEqual([count, transforms.get(frame).length], [rows.length, rows.length]);
if (second) {
  const ofSecond = transforms.get(`hand2/${second}`);
  table(secondCsv).rows.forEach((row, k) => {
    const { x, y, z } = ofSecond[k].value.translation;
    assert.deepEqual([x, y, z], [row.proxy_x_m, row.proxy_y_m, row.proxy_z_m].map(Number));
  });
  assert.equal(ofSecond.length, rows.length);
}
if (isGuided) assert.ok(rows.some((row) => /^\d of \d+: .+, then .+$/.test(row.guide_place)), "nobody is told which contact comes next");
const changes = rows.filter((row, k) => row.state !== (k > 0 ? rows[k - 1].state : "none")).length;
assert.equal(messages.get("/log").filter(({ value }) => value.level === 2).length, changes);
// A way that keeps away from the walls may touch nothing.
assert.ok(isGuided || changes > 2, "the run touches nothing");
console.log(`MCAP: ${rows.length} ticks, ${[...messages.values()].reduce((sum, list) => sum + list.length, 0)} messages read by @mcap/core, equal to the CSV`);
