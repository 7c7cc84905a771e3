// SPDX-License-Identifier: Apache-2.0
// live_read.mjs PACKAGES ADDRESS: the live view at ADDRESS (with its token), read by the official client of Foxglove's protocol
// (@foxglove/ws-protocol), under both names of the subprotocol: topics, schemas, messages that are new and in order; and who has no
// token, or comes from a foreign page, is refused. Exit code 1 where it is not so.
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { join } from "node:path";

const [packages, address] = process.argv.slice(2);
const require = createRequire(join(packages, "x.js"));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const live = address.replace(/^http/, "ws");
const kWanted = 200;
const kTopics = ["/scene", "/tf", "/pose", "/felt_pose", "/wrench", "/contact", "/counters", "/guide", "/log"];

/** Reads until kWanted messages of each topic that has one a tick were there. */
function readAll(protocol) {
  return new Promise((resolve, reject) => {
    const late = setTimeout(() => reject(new Error(`${protocol}: no messages`)), 60000);
    const client = new FoxgloveClient({ ws: new WebSocket(live, [protocol]) });
    const channels = new Map(), messages = new Map();
    client.on("error", reject);
    client.on("serverInfo", (info) => assert.equal(info.name, "haptic"));
    client.on("advertise", (all) => {
      assert.deepEqual(all.map((channel) => channel.topic), kTopics);
      for (const channel of all) {
        messages.set(channel.topic, []);
        channels.set(client.subscribe(channel.id), channel);
      }
    });
    client.on("message", ({ subscriptionId, timestamp, data }) => {
      const { topic, schema } = channels.get(subscriptionId);
      const value = JSON.parse(new TextDecoder().decode(data));
      const { properties } = JSON.parse(schema);
      for (const key of Object.keys(value)) assert.ok(key in properties, `${topic}: ${key} is not in its schema`);
      messages.get(topic).push({ time: timestamp, value });
      if (kTopics.slice(1, 7).some((name) => messages.get(name).length < kWanted)) return;
      clearTimeout(late);
      client.close();
      resolve(messages);
    });
  });
}

let count = 0;
for (const protocol of ["foxglove.websocket.v1", "foxglove.sdk.v1"]) {
  const messages = await readAll(protocol);
  assert.equal(messages.get("/scene").length, 1);
  assert.deepEqual(messages.get("/scene")[0].value.entities.map((entity) => entity.frame_id), ["part", "w"]);
  for (const name of kTopics.slice(1, 7)) {
    const list = messages.get(name);
    for (let k = 1; k < list.length; ++k) assert.ok(list[k].time > list[k - 1].time, `${name}: out of order`);
  }
  // Of one tick, whichever topic says it.
  const tick = messages.get("/counters").at(-1);
  assert.equal(tick.time, BigInt(tick.value.tick) * 1000000n);
  assert.match(tick.value.state_hash, /^[0-9a-f]{16}$/);
  for (const list of messages.values()) count += list.length;
}

/** The status with which a connection is refused. */
const refusal = (url, options) =>
  new Promise((resolve, reject) => {
    const socket = new WebSocket(url, ["foxglove.sdk.v1"], options);
    socket.on("unexpected-response", (_, response) => resolve(response.statusCode));
    socket.on("open", () => reject(new Error(`connected: ${url}`)));
    socket.on("error", () => {});
  });
assert.equal(await refusal(live.replace(/token=.*/, "token=0")), 403);
assert.equal(await refusal(live, { origin: "http://evil.example" }), 403);
assert.equal(await refusal(live, { headers: { Host: "evil.example" } }), 403);
console.log(`live view: ${count} messages read by @foxglove/ws-protocol under both names; strangers refused`);
process.exit(0);
