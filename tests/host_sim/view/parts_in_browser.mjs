// SPDX-License-Identifier: Apache-2.0
// parts_in_browser.mjs PACKAGES BROWSER SEVEN_PARTS [PICTURES]: parts held one after another in their page: by the list, by keys, by a
// click. PACKAGES: folder with playwright-core. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { feltAt, forceAbove, kPatience, Pages } from "./browser_page.mjs";

const [packages, executablePath, sevenParts, pictures] = process.argv.slice(2);
const pages = await Pages.start(packages, executablePath, pictures);

const holds = (page, name) => page.waitForFunction((n) => document.body.dataset.held === n, name, kPatience);
const holdsOther = (page, names, timeout) =>
  page.waitForFunction((old) => document.body.dataset.held && !old.includes(document.body.dataset.held), names, { timeout });

/** Holds a key until the part is higher, or lower, than so many mm. */
async function lead(page, key, isThere) {
  await page.keyboard.down(key);
  for (let k = 0; k < 400 && !isThere(await feltAt(page)); ++k) await page.waitForTimeout(50);
  await page.keyboard.up(key);
  assert.ok(isThere(await feltAt(page)), `${key} has not led the part there: ${await feltAt(page)}`);
}

const cases = {
  async "a part is let go where it is, and the next is taken where it lies: list, keys, click"() {
    const page = await pages.open(sevenParts);
    await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    await holds(page, "peg");
    assert.ok(await page.locator("#parts").isVisible());
    await page.locator("#physical").focus();
    // The peg down until it presses on the rim of its socket, or into it.
    await lead(page, "ArrowDown", ([, , z]) => z < 50);
    const left = await feltAt(page);
    await page.locator("#hold").selectOption({ label: "ring" });
    await holds(page, "ring");
    const [x, y, z] = await feltAt(page);
    assert.ok(Math.abs(x - 50) < 0.2 && Math.abs(y) < 0.2 && Math.abs(z - 3) < 0.2, `the ring was moved: ${x} ${y} ${z}`);
    await pages.picture(page, "parts_ring_taken");
    await page.locator("#physical").focus();
    await lead(page, "ArrowUp", ([, , up]) => up > 20);
    await pages.picture(page, "parts_ring_lifted");
    await page.keyboard.press("g");
    await page.waitForFunction(() => document.body.dataset.held === "", null, kPatience);
    assert.equal(await page.locator("#release").isDisabled(), true);
    const [, , lies] = await feltAt(page);
    assert.ok(lies > 19.5, `the ring fell: ${lies}`);
    // The next of the list, in its order.
    await page.keyboard.press("h");
    await holds(page, "cover");
    await forceAbove(page, -1);
    // A click on something that lies there, whole and near; where, the picture alone knows.
    await page.keyboard.press("c");
    for (let k = 0; k < 5; ++k) await page.keyboard.press("+");
    await page.waitForTimeout(500);
    const box = await page.locator("#physical").boundingBox();
    const kColumns = 50, kRows = 40;
    let taken = false;
    for (let row = kRows / 4; row < (3 * kRows) / 4 && !taken; ++row) {
      for (let column = 1; column < kColumns && !taken; ++column) {
        await page.mouse.click(box.x + (box.width * column) / kColumns, box.y + (box.height * row) / kRows);
        taken = await holdsOther(page, ["cover"], 30).then(() => true, () => false);
      }
    }
    if (!taken) await holdsOther(page, ["cover"], 5000);
    await pages.picture(page, "parts_clicked");
    // Back to the start: the peg is in the hand, where it begins.
    await page.keyboard.press("Home");
    await holds(page, "peg");
    for (let k = 0; k < 100 && !((await feltAt(page))[2] > left[2] + 5); ++k) await page.waitForTimeout(50);
    const again = await feltAt(page);
    assert.ok(Math.abs(again[2] - 60) < 0.1, `the peg is not where it starts: ${again}`);
    await pages.close(page);
  },

  async "back to the start with the first part in the hand: the others are drawn where they start"() {
    const drawn = async (page) => {
      await page.waitForTimeout(2500);  // at rest it is drawn as finely as ever
      return page.locator("#physical").screenshot();
    };
    const page = await pages.open(sevenParts);
    await holds(page, "peg");
    await page.locator("#physical").focus();
    await page.keyboard.press("c");
    await page.keyboard.press("Home");
    const before = await drawn(page);
    await page.locator("#hold").selectOption({ label: "ring" });
    await holds(page, "ring");
    await page.locator("#physical").focus();
    await lead(page, "ArrowUp", ([, , z]) => z > 20);
    await page.locator("#hold").selectOption({ label: "peg" });
    await holds(page, "peg");
    assert.ok(!before.equals(await drawn(page)), "the ring is drawn where it was");
    await page.locator("#physical").focus();
    await page.keyboard.press("Home");
    assert.ok(before.equals(await drawn(page)), "something is drawn elsewhere than at the start");
    await pages.close(page);
  },
};

await pages.run(cases);
