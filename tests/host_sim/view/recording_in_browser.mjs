// SPDX-License-Identifier: Apache-2.0
// recording_in_browser.mjs PACKAGES BROWSER RECORDED RUN STACK PLAYED THREAD [PICTURES]: the page of a recorded session as a person
// uses it. PACKAGES: folder with playwright-core; RECORDED: page of the square peg and its motion; RUN: that of a closed loop;
// STACK, PLAYED: those of a device with its bus, as it ran and as its record was played; THREAD: that of a nut of facets.
// Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { gunzipSync, gzipSync } from "node:zlib";
import {
  feltAt, heldAt, kChosen, kContact, kForce, kPatience, kTypeB, lamp, Pages, pixelsAbove, pixelsNear, seek, settledLamp, situation,
} from "./browser_page.mjs";

const [packages, executablePath, recorded, run, stack, played, thread, pictures] = process.argv.slice(2);
const kTicks = 14601;
const folder = mkdtempSync(join(tmpdir(), "haptic_page_"));
const pages = await Pages.start(packages, executablePath, pictures);

const kAsTheyStand = ["haptic-module", "haptic-program"];
/** Where a byte of a recording lies: its head, then columns of words, of each first all lowest bytes. */
const recordedByte = (ticks, column, byte, tick) => 16 + (8 * column + byte) * ticks + tick;

/** Part `id` of a page with one bit of one byte changed, as another file. */
function changed(file, id, byte) {
  const text = readFileSync(file, "utf8");
  const begin = text.indexOf(`id="${id}">`) + id.length + 6, end = text.indexOf("</script>", begin);
  let bytes = Buffer.from(text.slice(begin, end), "base64");
  // Within what is zipped, so that it is whole; the core and the program as they stand.
  const inside = !kAsTheyStand.includes(id) && bytes[0] === 0x1f && bytes[1] === 0x8b;
  if (inside) bytes = gunzipSync(bytes);
  assert.ok(bytes.length > byte, `${id} is shorter than ${byte} bytes`);
  bytes[byte] ^= 1;
  if (inside) bytes = gzipSync(bytes);
  const path = join(folder, `${id}_${byte}.html`);
  writeFileSync(path, text.slice(0, begin) + bytes.toString("base64") + text.slice(end));
  return path;
}

const cases = {
  async "facets screened eight at a time: every tick equal"() {
    const page = await pages.open(thread);
    await settledLamp(page);
    assert.equal(await lamp(page), "green");
    assert.match(await page.innerText("#lamp"), /all \d+ ticks equal, bit for bit/);
    await pages.close(page);
  },
  async "the recording: lamp green, words and pictures of its ticks"() {
    const page = await pages.open(recorded);
    await settledLamp(page);
    assert.equal(await lamp(page), "green");
    assert.match(await page.innerText("#lamp"), new RegExp(`all ${kTicks} ticks equal, bit for bit`));
    await seek(page, 100);
    assert.equal(await situation(page), "none");
    await pages.picture(page, "free");
    // The legend is no part of the canvas but lies over it: its marks are what a free tick shows.
    const before = { force: await pixelsNear(page, "#physical", kForce), contact: await pixelsNear(page, "#physical", kContact) };
    await seek(page, 2500);
    assert.equal(await situation(page), "face_face");
    assert.match(await page.innerText("#contacts"), /A:f|B:v|C:e/);
    assert.ok((await pixelsNear(page, "#physical", kForce)) > before.force + 150, "no force arrow");
    assert.ok((await pixelsNear(page, "#physical", kContact)) > before.contact + 100, "no contact polygon");
    await pages.picture(page, "rim");
    await seek(page, 6500);
    assert.equal(await situation(page), "several_planes");
    assert.match(await page.innerText(".inset-list"), /holds: \d+.*type B/);
    // In the light of the pane.
    assert.ok((await pixelsNear(page, "#cspace", kTypeB, 48)) > 1500, "no C-obstacle of type B");
    await pages.picture(page, "walls");
    // The graph: the planes that hold are in its middle; a click names one and marks it in both spaces, a second ends that.
    const marked = { physical: await pixelsNear(page, "#physical", kChosen), cspace: await pixelsNear(page, "#cspace", kChosen) };
    assert.ok((await page.locator("#graph .node.holds").count()) >= 1, "no node holds");
    assert.ok((await page.locator("#graph .node.neighbor").count()) > 4, "no neighbours");
    const held = page.locator("#graph .node.holds").first();
    const name = (await held.getAttribute("aria-label")).replace("basic contact ", "");
    await held.click();
    await page.waitForFunction((text) => document.querySelector(".graph-words").textContent.includes(text), name, kPatience);
    assert.match(await page.innerText(".graph-words"), /holds the part/);
    await pixelsAbove(page, "#physical", kChosen, marked.physical + 40, "no feature marked");
    await pixelsAbove(page, "#cspace", kChosen, marked.cspace + 40, "no face marked");
    await pages.picture(page, "graph");
    await held.focus();
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => /click one/.test(document.querySelector(".graph-words").textContent), null, kPatience);
    await seek(page, 9000);
    const [, , z] = await feltAt(page);
    assert.ok(Math.abs(z + 40) < 0.01, `the peg is not on the floor: ${z} mm`);
    await pages.picture(page, "floor");
    assert.equal(await lamp(page), "green");
    // By the keyboard alone.
    await page.locator("#physical").focus();
    await page.keyboard.press("Space");
    await page.waitForFunction(() => document.body.dataset.mode === "play", null, kPatience);
    await page.keyboard.press("Space");
    await page.waitForFunction(() => document.body.dataset.mode === "pause", null, kPatience);
    await page.keyboard.press("?");
    assert.ok(await page.locator("#help-text").isVisible());
    await page.keyboard.press("Escape");
    assert.ok(!(await page.locator("#help-text").isVisible()));
    await page.keyboard.press("ArrowDown");
    await page.waitForFunction(() => document.body.dataset.mode === "hand", null, kPatience);
    assert.equal(await lamp(page), "none");
    await page.keyboard.press("t");
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "dark");
    await pages.picture(page, "dark");
    await pages.close(page);
  },

  async "scrubbed with the mouse: along the time line, in the strips, and back: the same words for the same tick"() {
    const page = await pages.open(recorded);
    await settledLamp(page);
    const tick = async () => Number(await page.evaluate(() => document.body.dataset.tick)) - 1;
    /** Presses at a share of a box; @returns the tick at which it then stands still. */
    const press = async (place, share) => {
      const box = await page.locator(place).first().boundingBox();
      await page.mouse.move(box.x + share * box.width, box.y + box.height / 2);
      await page.mouse.down();
      await page.mouse.up();
      await page.waitForFunction(
        (share) => document.body.dataset.mode === "pause" && Math.abs(document.body.dataset.tick / 14601 - share) < 0.03,
        share,
        kPatience,
      );
      return tick();
    };
    const early = await press("#time", 0.62);
    const kWords = ["#situation", "#felt-position", "#flags", "#contacts", "#clock"];
    const said = async () => Promise.all(kWords.map((id) => page.innerText(id)));
    const words = await said();
    assert.ok(early > 0.58 * kTicks && early < 0.66 * kTicks, `tick ${early}`);
    // Dragged over the whole line, and to a strip.
    const box = await page.locator("#time").boundingBox();
    await page.mouse.move(box.x + 0.62 * box.width, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width - 2, box.y + box.height / 2, { steps: 12 });
    await page.mouse.move(box.x + 3, box.y + box.height / 2, { steps: 12 });
    await page.mouse.up();
    await page.waitForFunction(() => Number(document.body.dataset.tick) < 400, null, kPatience);
    const late = await press("#strips .u-over", 0.45);
    assert.ok(Math.abs(late - 0.45 * kTicks) < 0.03 * kTicks, `tick ${late}`);
    assert.notDeepEqual(await said(), words);
    await seek(page, early);
    assert.deepEqual(await said(), words);
    assert.equal(await lamp(page), "green");
    // An address holds the tick.
    await page.locator("#link").click();
    const address = page.url();
    assert.match(address, new RegExp(`#tick=${early}&view=`));
    await pages.close(page);
    const other = await pages.browser.newPage();
    await other.goto(address);
    await heldAt(other, early);
    assert.equal(await other.innerText("#contacts"), words[kWords.indexOf("#contacts")]);
    await other.close();
  },

  async "the recording with one changed byte of a pose: lamp red at its tick"() {
    const page = await pages.open(changed(recorded, "haptic-recording", recordedByte(kTicks, 1, 3, 7000)));
    await settledLamp(page);
    assert.equal(await lamp(page), "red");
    assert.match(await page.innerText("#lamp"), /tick 7000 differs from the recorded one/);
    await pages.picture(page, "red");
    await pages.close(page);
  },

  async "damaged files: a sentence and not an empty page"() {
    for (const [id, byte, text] of [
      ["haptic-scene", 5000, /The core refuses the scene in this page: scene content does not match its hash/],
      ["haptic-scene", 0, /not a compiled scene/],
      ["haptic-recording", 1, /the recording in this page is damaged; make the page again/],
      ["haptic-module", 60000, /the core in this file is damaged; make the page again/],
      ["haptic-program", 60000, /the program in this file is damaged; make the page again/],
    ]) {
      const page = await pages.open(changed(recorded, id, byte));
      await page.locator("#trouble").waitFor({ state: "visible", ...kPatience });
      assert.match(await page.innerText("#trouble"), text);
      await pages.picture(page, `damaged_${id}_${byte}`);
      await pages.close(page);
    }
  },

  async "a session of the simulated device: lamp green, red after one changed byte of a wrench that acted"() {
    const page = await pages.open(run);
    await settledLamp(page);
    assert.equal(await lamp(page), "green");
    const runTicks = Number((await page.innerText("#lamp")).match(/all (\d+) ticks/)[1]);
    await pages.close(page);
    const other = await pages.open(changed(run, "haptic-recording", recordedByte(runTicks, 9, 7, 3473)));
    await settledLamp(other);
    assert.equal(await lamp(other), "red");
    assert.match(await other.innerText("#lamp"), /tick 34\d\d differs/);
    await pages.close(other);
  },

  async "a device with its bus, as it ran and as its record was played: lamp green, red after one changed byte of a pose"() {
    let ticks = 0;
    for (const file of [stack, played]) {
      const page = await pages.open(file);
      await settledLamp(page);
      assert.equal(await lamp(page), "green", file);
      const all = Number((await page.innerText("#lamp")).match(/all (\d+) ticks/)[1]);
      assert.ok(all > 2900 && (ticks === 0 || all === ticks), `${all} ticks`);
      ticks = all;
      await pages.close(page);
    }
    const other = await pages.open(changed(played, "haptic-recording", recordedByte(ticks, 1, 3, 1500)));
    await settledLamp(other);
    assert.equal(await lamp(other), "red");
    await pages.close(other);
  },
};

await pages.run(cases);
