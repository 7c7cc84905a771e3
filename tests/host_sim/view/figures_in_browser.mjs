// SPDX-License-Identifier: Apache-2.0
// figures_in_browser.mjs PACKAGES BROWSER HOST_SIM SCENE RECORDED BY_HAND [MORE..]: figures of the page in Chromium, to be read
// and not judged: ticks equal, delay from input to picture, pictures a second, pace of the core. MORE: pages of large scenes,
// moved by hand.
import { basename } from "node:path";
import { kPatience, Pages, partAt, settledLamp } from "./browser_page.mjs";
import { serving } from "./live_session.mjs";

const [packages, executablePath, hostSim, scene, recorded, byHand, ...more] = process.argv.slice(2);
const kMoves = 400;
const pages = await Pages.start(packages, executablePath);
const row = (what, value) => console.log(`  ${what.padEnd(46)} ${value}`);

/** Moves of the mouse at any time of a picture, as a hand makes them; then what the page says of its own delay, of the pictures
 * while it is moved, and of the core. */
async function byMouse(page) {
  await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
  const box = await page.locator("#physical").boundingBox(), part = await partAt(page);
  const x = box.x + part.x, y = box.y + part.y;
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let k = 0; k < kMoves; ++k) {
    await page.mouse.move(x + 12 * Math.sin(k / 9), y + 6 * Math.sin(k / 7));
    await page.waitForTimeout(20 + 40 * Math.random());
  }
  const pace = page.locator("#facts dt", { hasText: /^pace$/ }).locator("xpath=following-sibling::dd[1]");
  const said = [await page.innerText("#delay"), `${await page.innerText("#frames")}`, await pace.innerText()];
  await page.mouse.up();
  return said;
}

function say(what, [delay, pictures, pace]) {
  row(`input to picture, ${what}`, delay);
  row(`pictures, ${what}`, pictures);
  row(`pace of the core, ${what}`, pace);
}

const cases = {
  async "the recorded session"() {
    const page = await pages.open(recorded);
    await settledLamp(page);
    row("Chromium, ticks of the quickstart", await page.innerText("#lamp"));
    await page.waitForTimeout(5000);
    row("pictures while it plays", await page.innerText("#frames"));
    await pages.close(page);
  },
  async "by hand"() {
    const page = await pages.open(byHand);
    say("the page alone", await byMouse(page));
    await pages.close(page);
  },
  async "live"() {
    const served = await serving(hostSim, ["serve", scene]);
    const page = await pages.open(served.address);
    say("live", await byMouse(page));
    await pages.close(page);
    served.child.kill("SIGINT");
    await served.ended;
  },
};
for (const file of more) {
  cases[file] = async () => {
    const begin = performance.now();
    const page = await pages.open(file);
    await page.waitForFunction(() => document.body.dataset.tick > 0, null, kPatience);
    row(`first picture, ${basename(file)}`, `${((performance.now() - begin) / 1000).toFixed(1)} s`);
    say(basename(file), await byMouse(page));
    await pages.close(page);
  };
}
await pages.run(cases);
