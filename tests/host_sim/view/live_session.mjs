// SPDX-License-Identifier: Apache-2.0
// Programs that serve a live session, for tests.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";

/** A program that serves; `address` once it says so. */
export async function serving(program, words) {
  const child = spawn(program, words, { stdio: ["ignore", "pipe", "pipe"] });
  const served = { child, said: "", ended: new Promise((done) => child.on("exit", (code, signal) => done({ code, signal }))) };
  const patience = Date.now() + 60000;
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (data) => (served.said += data));
  while (!/http:\S+/.test(served.said)) {
    assert.ok(Date.now() < patience && child.exitCode === null, `${program} serves nothing: ${served.said}`);
    await new Promise((next) => setTimeout(next, 20));
  }
  served.address = served.said.match(/http:\S+/)[0];
  return served;
}
