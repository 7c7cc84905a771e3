// SPDX-License-Identifier: Apache-2.0
// figures_in_browser.mjs PACKAGES BROWSER HOST_SIM SCENE RECORDED BY_HAND [MORE..]: figures of the page in Chromium, to be read
// and not judged: ticks equal, delay from input to picture, pictures a second. MORE: pages by hand whose drawing is timed, too.
import { kPatience, Pages, settledLamp } from "./browser_page.mjs";
import { serving } from "./live_session.mjs";

const [packages, executablePath, hostSim, scene, recorded, byHand, ...more] = process.argv.slice(2);
const kMoves = 400;
const pages = await Pages.start(packages, executablePath);
const row = (what, value) => console.log(`  ${what.padEnd(46)} ${value}`);

/** Moves of the mouse at any time of a frame, as a hand makes them; then what the page says of its own delay. */
async function delayOf(page) {
  await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
  const box = await page.locator("#physical").boundingBox();
  let x = box.x + box.width / 2, y = box.y + box.height * 0.42;
  // The part fills the middle of the pane.
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let k = 0; k < kMoves; ++k) {
    await page.mouse.move(x + 12 * Math.sin(k / 9), y + 6 * Math.sin(k / 7));
    await page.waitForTimeout(20 + 40 * Math.random());
  }
  await page.mouse.up();
  return `${await page.innerText("#delay")}, ${await page.innerText("#frames")}`;
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
    row("input to picture, the page alone", await delayOf(page));
    await pages.close(page);
  },
  async "live"() {
    const served = await serving(hostSim, ["serve", scene]);
    const page = await pages.open(served.address);
    row("input to picture, live", await delayOf(page));
    await pages.close(page);
    served.child.kill("SIGINT");
    await served.ended;
  },
};
for (const file of more)
  cases[file] = async () => {
    const page = await pages.open(file);
    await page.waitForFunction(() => document.body.dataset.tick > 0, null, kPatience);
    row(file, await delayOf(page));
    row(`${file}, pace of the core`, await page.evaluate(() => [...document.querySelectorAll("#facts dt")].find((d) => d.textContent === "pace").nextElementSibling.textContent));
    await pages.close(page);
  };
await pages.run(cases);
