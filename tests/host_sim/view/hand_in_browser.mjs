// SPDX-License-Identifier: Apache-2.0
// hand_in_browser.mjs PACKAGES BROWSER BY_HAND GUIDED [PICTURES]: the square peg moved with the mouse, in its page without a recording;
// and one with a guide, which leads it.
// PACKAGES: folder with playwright-core. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import {
  feltAt, forceAbove, kForce, kGuide, kPatience, lamp, Pages, partAt, pixelsAbove, pixelsNear, situation,
} from "./browser_page.mjs";

const [packages, executablePath, byHand, guided, pictures] = process.argv.slice(2);
const pages = await Pages.start(packages, executablePath, pictures);

/** Waits until the core has run on for a while and the part is where it was. */
async function standsStill(page) {
  const look = () => page.evaluate(() => [document.getElementById("felt-position").textContent, Number(document.body.dataset.tick)]);
  let [before, tick] = await look();
  for (let k = 0; k < 200; ++k) {
    await page.waitForTimeout(60);
    const [now, newest] = await look();
    if (now !== before) [before, tick] = [now, newest];
    else if (newest > tick + 80) return;
  }
}

/** Middle of the part in the picture, once it and the view stand still. */
async function whereItStands(page) {
  let before = await partAt(page);
  for (let k = 0; k < 50; ++k) {
    await page.waitForTimeout(200);
    const now = await partAt(page);
    if (Math.hypot(now.x - before.x, now.y - before.y) < 0.5) return now;
    before = now;
  }
  return before;
}

/** Pixels of a square of the legend. */
const kSquare = 160;

const cases = {
  async "by hand: the peg is dragged over the hole and down, and is in by the core's word"() {
    const page = await pages.open(byHand);
    await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    assert.equal(await lamp(page), "none");
    const box = await page.locator("#physical").boundingBox();
    const before = await pixelsNear(page, "#physical", kForce);
    await page.locator("#physical").focus();
    await page.keyboard.press("u");
    for (let k = 0; k < 5; ++k) await page.keyboard.press("]");  // to the right is +x, away is +y
    const at = await whereItStands(page);
    let x = box.x + at.x, y = box.y + at.y;
    await page.mouse.move(x, y);
    await page.mouse.down();
    const metresPerPixel = await page.evaluate(() => Number(document.body.dataset.millimetresPerPixel));

    /** Moves the mouse by so many mm of the part, with the keys that a person holds. */
    const drag = async (right, up, keys) => {
      for (const key of keys) await page.keyboard.down(key);
      const scale = keys.includes("Control") ? 0.1 : 1;
      x += Math.round(right / metresPerPixel / scale);
      y -= Math.round(up / metresPerPixel / scale);
      await page.mouse.move(x, y, { steps: 6 });
      await standsStill(page);
      for (const key of keys) await page.keyboard.up(key);
    };
    /** To a place over the hole, coarsely and then finely, looking at the words. */
    for (const keys of [[], [], ["Control"], ["Control"], ["Control"], ["Control"]]) {
      const [px, py] = await feltAt(page);
      await drag(-px, 0, keys);
      await drag(0, -py, [...keys, "Shift"]);
    }
    const [px, py, pz] = await feltAt(page);
    assert.ok(Math.abs(px) < 0.2 && Math.abs(py) < 0.2, `not over the hole: ${px}, ${py} mm`);
    assert.ok(pz > 2, `the peg is down already: ${pz} mm`);
    await pages.picture(page, "over_the_hole");
    let z = pz;
    for (let k = 0; k < 40 && z > -39.99; ++k) {
      await drag(0, -4, []);
      [, , z] = await feltAt(page);
      if (k === 8) await pages.picture(page, "on_the_way_down");
    }
    await drag(0, -4, []);  // presses on the floor
    await forceAbove(page, 0.4);
    const end = await feltAt(page);
    assert.ok(Math.abs(end[2] + 40) < 0.01, `not inserted: ${end[2]} mm`);
    assert.ok(Math.abs(end[0]) <= 0.31 && Math.abs(end[1]) <= 0.31, `not in the hole: ${end}`);
    assert.notEqual(await situation(page), "none");
    await pages.picture(page, "inserted");
    await pixelsAbove(page, "#physical", kForce, before + 150, "no force arrow");
    // Released: the hand stays where it is, and so does the force.
    await page.mouse.up();
    await page.mouse.move(x, y - 60);
    await page.waitForTimeout(300);
    assert.deepEqual(await feltAt(page), end, "a part that nobody drags has moved");
    await forceAbove(page, 0.4);
    // Pressed again: off the floor by 4 mm, and down again.
    const again = await whereItStands(page);
    x = box.x + again.x;
    y = box.y + again.y;
    await page.mouse.move(x, y);
    await page.mouse.down();
    for (let k = 0; k < 20 && (await feltAt(page))[2] < -36; ++k) await drag(0, 4, []);
    assert.ok((await feltAt(page))[2] >= -36, "not lifted");
    for (let k = 0; k < 20 && (await feltAt(page))[2] > -39.99; ++k) await drag(0, -4, []);
    await drag(0, -4, []);
    await forceAbove(page, 0.4);
    const pressed = await feltAt(page);
    assert.ok(Math.abs(pressed[2] + 40) < 0.01, `not on the floor again: ${pressed[2]} mm`);
    await page.mouse.up();
    await pages.close(page);
  },

  async "guided: the words say which contact comes next, an arrow of its own leads, and the hand feels it"() {
    const page = await pages.open(guided);
    await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    await page.waitForFunction(() => /^guide: 1 of \d+: free, then /.test(document.getElementById("guide").textContent), null, kPatience);
    assert.ok(await page.locator("#guide").isVisible() && await page.locator("#guide-key").isVisible());
    const key = await page.innerText("#guide-key-force");
    assert.match(key, /^force that leads along the plan: (0\.9\d|1\.0\d) N, .* mm to go$/);
    // The legend has a square of each colour.
    await pixelsAbove(page, "#physical", kGuide, kSquare + 100, "no arrow of the guide");
    assert.ok((await pixelsNear(page, "#physical", kForce)) <= kSquare, "nothing touches, and there is an arrow of contact");
    await pages.picture(page, "guided");
    await pages.close(page);
    // Without a guide there is no word and no arrow of one.
    const other = await pages.open(byHand);
    await other.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    assert.ok(!(await other.locator("#guide").isVisible()) && !(await other.locator("#guide-key").isVisible()));
    assert.equal(await pixelsNear(other, "#physical", kGuide), 0);
    await pages.close(other);
  },

  async "a picture is saved, and an address holds the pose of the part and the view"() {
    const page = await pages.open(byHand);
    await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    await page.locator("#physical").focus();
    await page.keyboard.press("]");
    await page.keyboard.down("ArrowUp");
    await page.waitForTimeout(700);
    await page.keyboard.up("ArrowUp");
    await page.waitForTimeout(500);
    const [download] = await Promise.all([page.waitForEvent("download", kPatience), page.keyboard.press("p")]);
    assert.match(download.suggestedFilename(), /^square_peg_five_\d+\.png$/);
    const png = readFileSync(await download.path());
    assert.equal(png.toString("latin1", 1, 4), "PNG");
    assert.ok(png.readUInt32BE(16) > 500 && png.length > 10000, `${png.length} bytes`);
    const there = await feltAt(page);
    await page.locator("#link").click();
    const address = page.url();
    assert.match(address, /#pose=[-0-9.,e]+&view=[-0-9.,]+$/);
    await pages.close(page);
    const other = await pages.browser.newPage();
    await other.goto(address);
    await other.waitForFunction(
      (z) => Math.abs(Number(document.getElementById("felt-position")?.textContent.split(/\s+/)[2]) - z) < 0.02,
      there[2],
      kPatience,
    );
    await other.close();
  },
};

await pages.run(cases);
