// SPDX-License-Identifier: Apache-2.0
// pictures_in_browser.mjs PACKAGES BROWSER HOST_SIM RECORDED OUT: the pictures of host_sim/view/README.md, as JPEG files in OUT and as
// PNG files in the present folder: the page and each of its panes with the square peg, and the scenes of the gallery.
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { kGallery, kPatience, Pages, seek, settledLamp } from "./browser_page.mjs";

const [packages, executablePath, hostSim, recorded, out] = process.argv.slice(2);
const kPanes = [
  ["physical_space", "main > .pane:nth-child(1)"],
  ["c_space", "main > .pane:nth-child(2)"],
  ["words", "aside"],
  ["graph", "#graph"],
  ["strips", "#strips"],
];
const pages = await Pages.start(packages, executablePath);

/** `what`: a page or a part of it. */
async function take(what, name, quality = 60) {
  await what.screenshot({ path: `${name}.png` });
  await what.screenshot({ path: join(out, `${name}.jpg`), type: "jpeg", quality });
}

const cases = {
  async "the square peg: the page and its panes"() {
    const page = await pages.open(recorded, { viewport: { width: 1400, height: 880 } });
    await settledLamp(page);
    await seek(page, 6500);
    await page.locator("#graph .node.holds").first().click();
    await page.waitForFunction(() => /holds the part/.test(document.querySelector(".graph-words").textContent), null, kPatience);
    await page.waitForTimeout(2500);
    await take(page, "page");
    for (const [name, place] of kPanes) await take(page.locator(place), name, 88);
    await page.keyboard.press("t");
    await page.waitForTimeout(1000);
    await take(page, "page_dark");
    await pages.close(page);
  },
};
kGallery.forEach(([name, tick], k) => {
  cases[`gallery ${k + 1}, ${name}`] = async () => {
    execFileSync(hostSim, ["view", String(k + 1)]);
    const page = await pages.open(`${name}.html`);
    await settledLamp(page);
    await seek(page, tick);
    await page.waitForTimeout(2500);
    await take(page, `${k + 1}_${name}`);
    await pages.close(page);
  };
});
await pages.run(cases);
