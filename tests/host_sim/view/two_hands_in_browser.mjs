// SPDX-License-Identifier: Apache-2.0
// two_hands_in_browser.mjs PACKAGES BROWSER HOST_SIM RUN BY_HAND SCENE FOLDER [PICTURES]: a peg in one hand and a socket in the other, in
// the page RUN of a run, by hand in the page BY_HAND, and live. FOLDER: motions of both. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { join } from "node:path";
import { feltAt, forceAbove, kPatience, lamp, Pages, seek, settledLamp } from "./browser_page.mjs";
import { serving } from "./live_session.mjs";

const [packages, executablePath, hostSim, run, byHand, scene, folder, pictures] = process.argv.slice(2);
const pages = await Pages.start(packages, executablePath, pictures);

/** Of the second hand's part as it is felt [mm]. */
const socketAt = async (page) => (await page.evaluate(() => document.body.dataset.driven)).split(" ").map(Number);
const cases = {
  async "a recorded run: all ticks are equal, both parts are drawn where they are felt, also after a jump"() {
    const page = await pages.open(run);
    await settledLamp(page);
    assert.equal(await lamp(page), "green", await page.innerText("#lamp"));
    await seek(page, 3600);
    const socket = await socketAt(page);
    const [, , z] = await feltAt(page);
    assert.ok(socket[2] > 8 && socket[2] < 22, `the socket is at ${socket}`);
    assert.ok(Math.abs(z - socket[2] + 5) < 1, `the peg is not at the bottom: ${z} over ${socket[2]}`);
    await pages.picture(page, "two_hands_bottom");
    // C-space is that of the pair that is felt: the socket holds the peg.
    const drawn = async (of) => {
      await page.selectOption("#cspace-of", { label: of });
      await page.waitForTimeout(400);
      return Number.parseInt(await page.innerText("#cspace-note"), 10);
    };
    const counts = [await drawn("all that is near"), await drawn("what stands"), await drawn("socket")];
    assert.ok(counts[1] > 0 && counts[2] > 0 && counts[0] === counts[1] + counts[2], `C-obstacles: ${counts}`);
    assert.match(await page.innerText("#cspace-overlay .inset-list"), /holds: /);
    await pages.picture(page, "two_hands_pair");
    await page.selectOption("#cspace-of", { label: "what stands" });
    await page.waitForTimeout(400);
    assert.doesNotMatch(await page.innerText("#cspace-overlay .inset-list"), /holds: /);
    await page.selectOption("#cspace-of", { label: "all that is near" });
    await seek(page, 900);
    await seek(page, 3600);
    assert.deepEqual(await socketAt(page), socket);
    await pages.close(page);
  },

  async "by hand: keys lead the second part, the mouse the first, and both feel each other"() {
    const page = await pages.open(byHand);
    await page.waitForFunction(() => document.body.dataset.driven !== undefined, null, kPatience);
    const peg = await feltAt(page), socket = await socketAt(page);
    await page.locator("#physical").focus();
    await page.keyboard.down("ArrowRight");
    await page.waitForFunction((x) => Math.abs(Number(document.body.dataset.driven.split(" ")[0]) - x) > 4, socket[0], kPatience);
    await page.keyboard.up("ArrowRight");
    const still = await feltAt(page);
    assert.ok(Math.hypot(...still.map((x, k) => x - peg[k])) < 0.5, `the peg went from ${peg} to ${still}`);
    // Beside the hole the rim comes up to the peg.
    await page.keyboard.down("ArrowUp");
    await forceAbove(page, 0.3);
    await page.keyboard.up("ArrowUp");
    assert.match(await page.innerText("#driven"), /^socket: [^]*pushed by \d/);
    await pages.picture(page, "two_hands_by_hand");
    await page.keyboard.press("Home");
    await page.waitForFunction(() => document.body.dataset.driven.startsWith("0.000 0.000 0.000"), null, kPatience);
    await pages.close(page);
  },

  async "a live run: compared from its first tick on, both move"() {
    const scripts = ["--script", join(folder, "motion.toml"), "--script2", join(folder, "socket.toml")];
    const served = await serving(hostSim, ["run", scene, "--serve", ...scripts]);
    const page = await pages.open(served.address);
    await page.waitForFunction(() => Number(document.body.dataset.driven?.split(" ")[2]) > 10, null, kPatience);
    assert.equal(await lamp(page), "green", await page.innerText("#lamp"));
    await page.waitForFunction(() => /the session is over: all \d+ ticks equal/.test(document.getElementById("lamp").textContent), null, kPatience);
    await pages.close(page);
    served.child.kill("SIGINT");
    await served.ended;
  },
};

await pages.run(cases);
