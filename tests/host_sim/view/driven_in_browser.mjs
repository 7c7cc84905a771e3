// SPDX-License-Identifier: Apache-2.0
// driven_in_browser.mjs PACKAGES BROWSER HOST_SIM ROBOT SCENE FOLDER [PICTURES]: a run in which a hand puts a peg into a socket that a
// robot carries, in its page ROBOT and live. FOLDER: motions of hand and robot. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { join } from "node:path";
import { feltAt, forceAbove, kPatience, lamp, Pages, seek, settledLamp } from "./browser_page.mjs";
import { serving } from "./live_session.mjs";

const [packages, executablePath, hostSim, robot, scene, folder, pictures] = process.argv.slice(2);
const pages = await Pages.start(packages, executablePath, pictures);

/** Of the socket as it is felt [mm]. */
const socketAt = async (page) => (await page.evaluate(() => document.body.dataset.driven)).split(" ").map(Number);
const cases = {
  async "a recorded run: all ticks are equal, the socket is drawn where it is felt, also after a jump"() {
    const page = await pages.open(robot);
    await settledLamp(page);
    assert.equal(await lamp(page), "green", await page.innerText("#lamp"));
    assert.ok(await page.locator("#driven").isVisible());
    await seek(page, 100);
    const first = await socketAt(page);
    await pages.picture(page, "driven_begin");
    await seek(page, 4600);
    const last = await socketAt(page);
    assert.ok(Math.abs(first[0] - 0.5) < 4 && last[0] > 60 && last[1] > 1, `the socket is at ${first}, then at ${last}`);
    const [x, , z] = await feltAt(page);
    assert.ok(Math.abs(x - last[0]) < 3 && z < 110, `the peg is not in the socket: ${x} ${z}`);
    assert.match(await page.innerText("#driven"), /^socket: .*\n {2}pushed by \d.* N$/);
    await pages.picture(page, "driven_inserted");
    // Back and forth again: the very same.
    await seek(page, 1800);
    await seek(page, 4600);
    assert.deepEqual(await socketAt(page), last);
    assert.equal(await lamp(page), "green", await page.innerText("#lamp"));
    await pages.close(page);
  },

  async "a hand that takes the peg over feels the socket where it stood"() {
    const page = await pages.open(robot);
    await settledLamp(page);
    await seek(page, 4600);
    const before = await socketAt(page);
    await page.locator("#physical").focus();
    await page.keyboard.down("ArrowRight");
    await forceAbove(page, 0.3);
    await page.keyboard.up("ArrowRight");
    await page.waitForTimeout(1000);
    const after = await socketAt(page);
    assert.ok(Math.hypot(...after.map((x, k) => x - before[k])) < 0.5, `the socket has gone from ${before} to ${after}`);
    assert.doesNotMatch(await page.innerText("#driven"), /lost/);
    await pages.picture(page, "driven_by_hand");
    await page.keyboard.press("Home");
    await page.waitForFunction(() => document.body.dataset.driven.startsWith("0.000 0.000"), null, kPatience);
    await pages.close(page);
  },

  async "a live run: compared from its first tick on, the socket moves"() {
    const drive = ["--script", join(folder, "motion.toml"), "--drive", `socket=${join(folder, "socket.toml")}`];
    const served = await serving(hostSim, ["run", scene, "--serve", ...drive]);
    const page = await pages.open(served.address);
    await page.waitForFunction(() => Number(document.body.dataset.driven?.split(" ")[0]) > 30, null, kPatience);
    assert.equal(await lamp(page), "green", await page.innerText("#lamp"));
    await page.waitForFunction(() => /the session is over: all \d+ ticks equal/.test(document.getElementById("lamp").textContent), null, kPatience);
    assert.ok((await socketAt(page))[0] > 60);
    await pages.picture(page, "driven_live");
    await pages.close(page);
    served.child.kill("SIGINT");
    await served.ended;
  },
};

await pages.run(cases);
