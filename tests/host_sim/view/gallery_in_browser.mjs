// SPDX-License-Identifier: Apache-2.0
// gallery_in_browser.mjs PACKAGES BROWSER HOST_SIM WHOLE [PICTURES]: the eight scenes of the gallery, each as `host_sim view NUMBER`
// makes its page, in the present folder. WHOLE: "whole" for all of each motion, "begin" for as much of it as shows a contact, of
// every second scene.
// Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { kGallery, kPatience, lamp, Pages, seek, settledLamp, situation } from "./browser_page.mjs";

const [packages, executablePath, hostSim, whole, pictures] = process.argv.slice(2);
const isWhole = whole === "whole";

const pages = await Pages.start(packages, executablePath, pictures);

const cases = {};
kGallery.forEach(([name, later, soon], k) => {
  if (!isWhole && k % 2 === 1) return;
  cases[`gallery ${k + 1}, ${name}: its two sentences, its lamp green, its C-obstacles drawn`] = async () => {
    const tick = isWhole ? later : soon;
    execFileSync(hostSim, ["view", String(k + 1), ...(isWhole ? [] : ["--seconds", String((tick + 1) / 1000)])]);
    const page = await pages.open(`${name}.html`);
    await settledLamp(page);
    assert.equal(await lamp(page), "green");
    assert.match(await page.innerText("#about"), /^[^.]+\. .+\. ?.*\.$/);
    await seek(page, tick);
    assert.notEqual(await situation(page), "none");
    await page.waitForFunction(() => /^[1-8] C-obstacle/.test(document.getElementById("cspace-note").textContent), null, kPatience);
    assert.ok((await page.locator("#graph .node").count()) > 2);
    await pages.picture(page, `gallery_${k + 1}_${name}`);
    await pages.close(page);
  };
});
await pages.run(cases);
