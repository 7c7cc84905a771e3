// SPDX-License-Identifier: Apache-2.0
// soak_in_browser.mjs PACKAGES BROWSER HOST_SIM SCENE TICKS: a live session of so many ticks, moved in a page all the time: the
// memory of the server and of the browser, written down every ten seconds.
// Exit code 1 where it grows: the last quarter needs more than the second, beyond kMostGrowth.
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { kPatience, Pages } from "./browser_page.mjs";
import { serving } from "./live_session.mjs";

const [packages, executablePath, hostSim, scene, ticks] = process.argv.slice(2);
const kEvery_ms = 10000;
const kMostGrowth = 1.05;
const kMB = 2 ** 20;

/** Proportional share of the memory of a process and of all that it has started [bytes]. */
function memoryOf(root) {
  const parents = new Map();
  for (const name of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${name}/stat`, "latin1");
      parents.set(Number(name), Number(stat.slice(stat.lastIndexOf(")") + 2).split(" ")[1]));
    } catch {
      // it has ended meanwhile
    }
  }
  const isOurs = (pid) => pid === root || (parents.has(pid) && isOurs(parents.get(pid)));
  let sum = 0;
  for (const pid of parents.keys()) {
    if (!isOurs(pid)) continue;
    try {
      sum += 1024 * Number(readFileSync(`/proc/${pid}/smaps_rollup`, "latin1").match(/^Pss: +(\d+)/m)[1]);
    } catch {
      // the same
    }
  }
  return sum;
}

const served = await serving(hostSim, ["serve", scene]);
const pages = await Pages.start(packages, executablePath);
const browserPid = readdirSync("/proc").filter((name) => /^\d+$/.test(name)).map(Number).find((pid) => {
  try {
    const stat = readFileSync(`/proc/${pid}/stat`, "latin1");
    return Number(stat.slice(stat.lastIndexOf(")") + 2).split(" ")[1]) === process.pid &&
      readFileSync(`/proc/${pid}/cmdline`, "latin1").includes(executablePath);
  } catch {
    return false;
  }
});

const cases = {
  async [`${ticks} ticks of a live session`]() {
    const page = await pages.open(served.address, { viewport: { width: 720, height: 480 } });
    await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    await page.locator("#physical").focus();
    // Down and up again, so that it touches and is free in turn.
    await page.evaluate(() => {
      let down = false;
      const key = (kind, code) => window.dispatchEvent(new KeyboardEvent(kind, { code, key: code }));
      setInterval(() => {
        key("keyup", down ? "ArrowDown" : "ArrowUp");
        down = !down;
        key("keydown", down ? "ArrowDown" : "ArrowUp");
      }, 2500);
    });
    // What the page has let go of is taken back before it is counted: else the numbers tell when the browser does so.
    const inspector = await page.context().newCDPSession(page);
    await inspector.send("Performance.enable");
    const rows = [];
    console.log("     ticks   server MB   browser MB   script MB of the page   nodes   pictures a second   lamp");
    for (let tick = 0; tick < Number(ticks); ) {
      await page.waitForTimeout(kEvery_ms);
      await inspector.send("HeapProfiler.collectGarbage");
      const { metrics } = await inspector.send("Performance.getMetrics");
      const metric = (name) => metrics.find((entry) => entry.name === name).value;
      const session = await page.evaluate(() => ({
        tick: Number(document.body.dataset.tick),
        frames: document.getElementById("frames").textContent,
        lamp: document.getElementById("lamp").textContent,
      }));
      ({ tick } = session);
      const row = { tick, server: memoryOf(served.child.pid), browser: memoryOf(browserPid), heap: metric("JSHeapUsedSize"), nodes: metric("Nodes") };
      rows.push(row);
      const mb = (bytes, width) => (bytes / kMB).toFixed(1).padStart(width);
      console.log(`${String(tick).padStart(10)} ${mb(row.server, 11)} ${mb(row.browser, 12)} ${mb(row.heap, 23)} ${String(row.nodes).padStart(7)} ${session.frames.padStart(19)}   ${session.lamp}`);
    }
    const quarter = Math.floor(rows.length / 4);
    const grown = [];
    for (const what of ["server", "browser"]) {
      const mean = (list) => list.reduce((sum, x) => sum + x, 0) / list.length;
      const [second, last] = [quarter, rows.length - quarter].map((from) => rows.slice(from, from + quarter).map((row) => row[what]));
      const said = (list) => `${[mean(list), Math.min(...list), Math.max(...list)].map((x) => (x / kMB).toFixed(1)).join(", ")} MB`;
      if (quarter > 0) console.log(`${what}, mean, least and most: ${said(second)} in the second quarter, ${said(last)} in the last`);
      if (quarter > 0 && mean(last) >= kMostGrowth * mean(second)) grown.push(what);
    }
    if (grown.length > 0) served.child.kill("SIGINT");
    assert.deepEqual(grown, [], "the memory grows");
    await pages.close(page);
    served.child.kill("SIGINT");
    assert.deepEqual(await served.ended, { code: 0, signal: null });
  },
};
await pages.run(cases);
