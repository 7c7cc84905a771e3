// SPDX-License-Identifier: Apache-2.0
// live_in_browser.mjs PACKAGES BROWSER HOST_SIM RUN_DEVICE SCENE [PICTURES]: live sessions of a scene as a person watches and moves
// them, in Chromium without a window. RUN_DEVICE: empty where it is not built. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { feltAt, kPatience, Pages, situation } from "./browser_page.mjs";
import { serving } from "./live_session.mjs";

const [packages, executablePath, hostSim, runDevice, scene, pictures] = process.argv.slice(2);
const pages = await Pages.start(packages, executablePath, pictures);

async function lampIs(page, state, text) {
  try {
    await page.waitForFunction(
      ([state, text]) => {
        const box = document.getElementById("lamp");
        return box.dataset.state === state && new RegExp(text).test(box.textContent);
      },
      [state, text],
      kPatience,
    );
  } catch (error) {
    throw new Error(`the lamp is not ${state} (${text}) but '${await page.innerText("#lamp")}'`, { cause: error });
  }
}
const checked = async (page) => Number((await page.innerText("#lamp")).match(/all (\d+) ticks equal/)[1]);
const hold = async (page, key, until) => {
  await page.locator("#physical").focus();
  await page.keyboard.down(key);
  await page.waitForFunction(until, null, kPatience);
  await page.keyboard.up(key);
};

const cases = {
  async "serve: the lamp is green from the first tick on, and a hand in one page is felt in all"() {
    const served = await serving(hostSim, ["serve", scene]);
    const page = await pages.open(served.address);
    await lampIs(page, "green", "live: all \\d+ ticks equal, bit for bit");
    const before = await checked(page);
    await page.waitForFunction((from) => Number(document.getElementById("lamp").textContent.match(/\d+/)?.[0]) > from + 500, before, kPatience);
    const other = await pages.open(served.address);
    await lampIs(other, "green", "all");
    const [, , z] = await feltAt(page);
    // Down until the part presses on what is below it.
    await hold(page, "ArrowDown", () => parseFloat(document.querySelector("#facts dd").textContent) > 0.4);
    await lampIs(page, "green", "all");
    await page.waitForTimeout(300);
    const down = await feltAt(page);
    assert.ok(down[2] < z - 1, `the part has not moved: ${z} to ${down[2]} mm`);
    assert.notEqual(await situation(page), "none");
    await other.waitForFunction(() => document.getElementById("situation").dataset.situation !== "none", null, kPatience);
    await lampIs(other, "green", "all");
    const delay = (await page.innerText("#delay")).match(/^(\d+) ms, p99 (\d+) ms$/);
    assert.ok(delay, "no delay from input to picture is shown");
    console.log(`input to picture: ${delay[0]}`);
    await pages.picture(page, "live_pressing");
    // Restart: both go back, and go on being compared.
    await page.locator("#restart").click();
    await page.waitForFunction((top) => Math.abs(Number(document.getElementById("felt-position").textContent.split(/\s+/)[2]) - top) < 0.01, z, kPatience);
    await lampIs(other, "green", "all");
    await lampIs(page, "green", "all");
    await pages.close(other);
    // The session's end while it is watched.
    served.child.kill("SIGKILL");
    await lampIs(page, "grey", "the connection to the session is lost");
    await pages.picture(page, "live_lost");
    await page.close();
    await served.ended;
  },

  async "strangers: no token, a foreign page"() {
    const served = await serving(hostSim, ["serve", scene]);
    const page = await pages.open(served.address.replace(/token=.*/, "token=0"));
    assert.equal(page.answer.status(), 403);
    await pages.close(page);
    // A page of another site knows the token and the address, and still gets nothing.
    const foreign = await pages.browser.newPage();
    const file = resolve("foreign.html");
    writeFileSync(file, "<!doctype html><title>foreign</title>");
    await foreign.goto(pathToFileURL(file).href);
    const outcome = await foreign.evaluate(
      (url) =>
        new Promise((done) => {
          const socket = new WebSocket(url, "haptic.live.v1");
          socket.onopen = () => done("open");
          socket.onerror = () => done("refused");
        }),
      served.address.replace("http", "ws"),
    );
    assert.equal(outcome, "refused");
    await foreign.close();
    served.child.kill("SIGINT");
    assert.deepEqual(await served.ended, { code: 0, signal: null });
  },

  async "run --serve: watched alone; from its first tick on the lamp is green"() {
    const served = await serving(hostSim, ["run", scene, "--serve", "--seconds", "4"]);
    const page = await pages.open(served.address);
    await lampIs(page, "green", ": all \\d+ ticks equal");
    assert.ok(await page.locator("#restart").isDisabled());
    await page.locator("#physical").focus();
    await page.keyboard.press("ArrowRight");
    await lampIs(page, "green", "the session is over: all 4001 ticks equal");
    await page.waitForFunction(() => document.body.dataset.tick === "4001", null, kPatience);
    const [x] = await feltAt(page);
    await page.keyboard.press("ArrowRight");
    await page.waitForTimeout(500);
    assert.equal((await feltAt(page))[0], x, "a watched part was moved");
    assert.match(await page.innerText("#clock"), /view only/);
    // Opened after the end: all ticks are still there.
    const after = await pages.open(served.address);
    await lampIs(after, "green", "the session is over: all 4001 ticks equal");
    await pages.close(after);
    await pages.close(page);
    served.child.kill("SIGINT");
    assert.deepEqual(await served.ended, { code: 0, signal: null });
  },

  async "run --serve --carrier usb: the whole stack of a device, its core computed again: green"() {
    const served = await serving(hostSim, ["run", scene, "--serve", "--carrier", "usb", "--seconds", "3"]);
    const page = await pages.open(served.address);
    await lampIs(page, "green", "the session is over: all \\d+ ticks equal");
    assert.ok((await checked(page)) > 2900);
    await pages.close(page);
    served.child.kill("SIGINT");
    assert.deepEqual(await served.ended, { code: 0, signal: null });
  },

  async "attached late: the lamp is grey and says why"() {
    // More ticks than are kept.
    const served = await serving(hostSim, ["run", scene, "--serve", "--rate", "20000", "--seconds", "3.5"]);
    const patience = Date.now() + 120000;
    while (!/stays to be seen/.test(served.said)) {
      assert.ok(Date.now() < patience, served.said);
      await new Promise((next) => setTimeout(next, 50));
    }
    const late = await pages.open(served.address);
    await lampIs(late, "grey", "attached at tick \\d+: what the core had met before is not known here");
    await pages.picture(late, "live_late");
    await pages.close(late);
    served.child.kill("SIGINT");
    await served.ended;
  },

  async "run_device run --serve: a device is seen, and a page moves nothing"() {
    if (!runDevice) return;
    const config = resolve("live_device.toml");
    // The part begins 40 mm above the hole, and the hand goes 30 mm down.
    writeFileSync(config, `scene = "${resolve(scene)}"\n[device]\ndriver = "sim"\n`);
    const served = await serving(runDevice, ["run", config, "--serve", "--allow-degraded"]);
    const page = await pages.open(served.address);
    await lampIs(page, "grey", "a device is held");
    assert.ok(await page.locator("#restart").isDisabled());
    // The scripted hand presses: what the device's core says of it is shown.
    await page.waitForFunction(() => document.getElementById("situation").dataset.situation !== "none", null, kPatience);
    await pages.picture(page, "live_device");
    const outcome = await page.evaluate(
      () =>
        new Promise((done) => {
          const socket = new WebSocket(`ws://${location.host}/${location.search}`, "haptic.live.v1");
          socket.onopen = () => socket.send(new Uint8Array([3, 0, 0, 0, 0, 0, 0, 0]));
          socket.onclose = (event) => done(event.code);
        }),
    );
    assert.equal(outcome, 1008, "a restart of a device was not refused");
    await pages.close(page);
    served.child.kill("SIGINT");
    assert.deepEqual(await served.ended, { code: 0, signal: null });
  },
};

await pages.run(cases);
