// SPDX-License-Identifier: Apache-2.0
// page_in_browser.mjs PACKAGES BROWSER RECORDED BY_HAND RUN GALLERY [PICTURES]: the page as a person uses it, in Chromium without a
// window. PACKAGES: folder with playwright-core; RECORDED, BY_HAND: pages of the square peg with and without a recording;
// RUN: that of a closed loop; GALLERY: folder with a page of each scene;
// PICTURES: folder for a picture of each state. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { mkdtempSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { gunzipSync, gzipSync } from "node:zlib";
import { runCases } from "./browser_cases.mjs";

const [packages, executablePath, recorded, byHand, run, gallery, pictures] = process.argv.slice(2);
const { chromium } = await import(pathToFileURL(join(packages, "playwright-core", "index.mjs")));
const kPatience = { timeout: 120000 };
const kTicks = 14601;
const folder = mkdtempSync(join(tmpdir(), "haptic_page_"));

const browser = await chromium.launch({
  executablePath,
  args: ["--headless", "--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking",
    "--disable-component-update", "--disable-default-apps", "--disable-sync", "--no-first-run"],
});

/** A page of `file`; every request but for its own bytes is a fault. */
async function open(file, options = {}) {
  const page = await browser.newPage({ viewport: { width: 1100, height: 700 }, ...options });
  page.setDefaultTimeout(kPatience.timeout);
  page.foreign = [];
  page.on("request", (request) => {
    if (!/^(file|blob|data):/.test(request.url())) page.foreign.push(request.url());
  });
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(error.message));
  await page.goto(pathToFileURL(file).href);
  return page;
}

async function close(page) {
  assert.deepEqual(page.foreign, [], "the page asks for something");
  assert.deepEqual(page.faults, [], "the page has faults");
  await page.close();
}

async function picture(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`) });
}

const lamp = (page) => page.locator("#lamp").getAttribute("data-state");
const settledLamp = (page) =>
  page.waitForFunction(() => ["green", "red"].includes(document.getElementById("lamp").dataset.state), null, kPatience);
/** Of the part as it is felt, in mm, as the page says it in words. */
const feltAt = async (page) => (await page.innerText("#felt-position")).split(/\s+/).slice(0, 3).map(Number);
const situation = (page) => page.locator("#situation").getAttribute("data-situation");

async function seek(page, tick) {
  await page.evaluate((to) => {
    const time = document.getElementById("time");
    time.value = to;
    time.dispatchEvent(new Event("input"));
  }, tick);
  await page.waitForFunction((to) => document.body.dataset.tick === String(to + 1) && document.body.dataset.mode === "pause", tick, kPatience);
}

/** Pixels of a canvas whose colour is near to `wanted`. */
async function pixelsNear(page, canvas, wanted, within = 24) {
  const data = (await page.locator(canvas).screenshot()).toString("base64");
  return page.evaluate(
    async ([png, [r, g, b], within]) => {
      const image = new Image();
      image.src = `data:image/png;base64,${png}`;
      await image.decode();
      const flat = new OffscreenCanvas(image.width, image.height).getContext("2d");
      flat.drawImage(image, 0, 0);
      const { data: rgba } = flat.getImageData(0, 0, image.width, image.height);
      let count = 0;
      for (let k = 0; k < rgba.length; k += 4)
        if (Math.hypot(rgba[k] - r, rgba[k + 1] - g, rgba[k + 2] - b) < within) count += 1;
      return count;
    },
    [data, wanted, within],
  );
}
const kForce = [0xd5, 0x5e, 0x00], kContact = [0xc2, 0x18, 0x7f];
const kChosen = [0x00, 0x61, 0xa8];
const kTypeB = [0x56, 0xb4, 0xe9];

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
  async "the recording: lamp green, words and pictures of its ticks"() {
    const page = await open(recorded, { colorScheme: "light" });
    await settledLamp(page);
    assert.equal(await lamp(page), "green");
    assert.match(await page.innerText("#lamp"), new RegExp(`all ${kTicks} ticks equal, bit for bit`));
    await seek(page, 100);
    assert.equal(await situation(page), "none");
    await picture(page, "free");
    // The legend is no part of the canvas but lies over it: its marks are what a free tick shows.
    const before = { force: await pixelsNear(page, "#physical", kForce), contact: await pixelsNear(page, "#physical", kContact) };
    await seek(page, 2500);
    assert.equal(await situation(page), "face_face");
    assert.match(await page.innerText("#contacts"), /A:f|B:v|C:e/);
    assert.ok((await pixelsNear(page, "#physical", kForce)) > before.force + 150, "no force arrow");
    assert.ok((await pixelsNear(page, "#physical", kContact)) > before.contact + 100, "no contact polygon");
    await picture(page, "rim");
    await seek(page, 6500);
    assert.equal(await situation(page), "several_planes");
    assert.match(await page.innerText(".inset-list"), /holds: \d+.*type B/);
    // In the light of the pane.
    assert.ok((await pixelsNear(page, "#cspace", kTypeB, 48)) > 1500, "no C-obstacle of type B");
    await picture(page, "walls");
    // The graph: the planes that hold are in its middle; a click names one and marks it in both spaces, a second ends that.
    const marked = { physical: await pixelsNear(page, "#physical", kChosen), cspace: await pixelsNear(page, "#cspace", kChosen) };
    assert.ok((await page.locator("#graph .node.holds").count()) >= 1, "no node holds");
    assert.ok((await page.locator("#graph .node.neighbor").count()) > 4, "no neighbours");
    const held = page.locator("#graph .node.holds").first();
    const name = (await held.getAttribute("aria-label")).replace("basic contact ", "");
    await held.click();
    await page.waitForFunction((text) => document.querySelector(".graph-words").textContent.includes(text), name, kPatience);
    assert.match(await page.innerText(".graph-words"), /holds the part/);
    await page.waitForTimeout(1500);
    assert.ok((await pixelsNear(page, "#physical", kChosen)) > marked.physical + 40, "no feature marked");
    assert.ok((await pixelsNear(page, "#cspace", kChosen)) > marked.cspace + 40, "no face marked");
    await picture(page, "graph");
    await held.focus();
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => /click one/.test(document.querySelector(".graph-words").textContent), null, kPatience);
    await seek(page, 9000);
    const [, , z] = await feltAt(page);
    assert.ok(Math.abs(z + 40) < 0.01, `the peg is not on the floor: ${z} mm`);
    await picture(page, "floor");
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
    await page.waitForTimeout(800);
    await picture(page, "dark");
    await close(page);
  },

  async "the recording with one changed byte of a pose: lamp red at its tick"() {
    const page = await open(changed(recorded, "haptic-recording", recordedByte(kTicks, 1, 3, 7000)));
    await settledLamp(page);
    assert.equal(await lamp(page), "red");
    assert.match(await page.innerText("#lamp"), /tick 7000 differs from the recorded one/);
    await picture(page, "red");
    await close(page);
  },

  async "damaged files: a sentence and not an empty page"() {
    for (const [id, byte, text] of [
      ["haptic-scene", 5000, /The core refuses the scene in this page: scene content does not match its hash/],
      ["haptic-scene", 0, /not a compiled scene/],
      ["haptic-recording", 1, /the recording in this page is damaged; make the page again/],
      ["haptic-module", 60000, /the core in this file is damaged; make the page again/],
      ["haptic-program", 60000, /the program in this file is damaged; make the page again/],
    ]) {
      const page = await open(changed(recorded, id, byte));
      await page.locator("#trouble").waitFor({ state: "visible", ...kPatience });
      assert.match(await page.innerText("#trouble"), text);
      await picture(page, `damaged_${id}_${byte}`);
      await close(page);
    }
  },

  async "a session of the simulated device: lamp green, red after one changed byte of a wrench that acted"() {
    const page = await open(run);
    await settledLamp(page);
    assert.equal(await lamp(page), "green");
    const runTicks = Number((await page.innerText("#lamp")).match(/all (\d+) ticks/)[1]);
    await close(page);
    const other = await open(changed(run, "haptic-recording", recordedByte(runTicks, 9, 7, 3473)));
    await settledLamp(other);
    assert.equal(await lamp(other), "red");
    assert.match(await other.innerText("#lamp"), /tick 34\d\d differs/);
    await close(other);
  },

  async "the gallery: each scene with its two sentences, its lamp green, C-obstacles drawn"() {
    const scenes = readdirSync(gallery).filter((name) => name.endsWith(".html"));
    assert.equal(scenes.length, 8);
    for (const name of scenes) {
      const page = await open(join(gallery, name), { colorScheme: "light" });
      await settledLamp(page);
      assert.equal(await lamp(page), "green", name);
      assert.match(await page.innerText("#about"), /^[^.]+\. .+\. ?.*\.$/, name);
      await seek(page, kGalleryTick[name.replace(".html", "")]);
      await page.waitForTimeout(1500);
      assert.notEqual(await situation(page), "none", name);
      assert.match(await page.innerText("#cspace-note"), /^[1-8] C-obstacle/, name);
      assert.ok((await page.locator("#graph .node").count()) > 2, name);
      await picture(page, `gallery_${name.replace(".html", "")}`);
      await close(page);
    }
  },

  async "by hand: the peg is dragged over the hole and down, and is in by the core's word"() {
    const page = await open(byHand, { colorScheme: "light" });
    await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    assert.equal(await lamp(page), "none");
    const box = await page.locator("#physical").boundingBox();
    const before = await pixelsNear(page, "#physical", kForce);
    await page.locator("#physical").focus();
    await page.keyboard.press("u");
    for (let k = 0; k < 5; ++k) await page.keyboard.press("]");  // to the right is +x, away is +y
    await page.waitForTimeout(2500);

    const partAt = async () => {
      // The part's own colour, where it is thickest.
      const data = (await page.locator("#physical").screenshot()).toString("base64");
      return page.evaluate(async (png) => {
        const image = new Image();
        image.src = `data:image/png;base64,${png}`;
        await image.decode();
        const flat = new OffscreenCanvas(image.width, image.height).getContext("2d");
        flat.drawImage(image, 0, 0);
        const { data: rgba } = flat.getImageData(0, 0, image.width, image.height);
        let x = 0, y = 0, count = 0;
        for (let row = 0; row < image.height; ++row) {
          for (let column = 0; column < image.width; ++column) {
            const k = 4 * (row * image.width + column);
            if (rgba[k + 2] - rgba[k] > 35 && rgba[k + 2] > 90) (x += column), (y += row), (count += 1);
          }
        }
        return { x: x / count, y: y / count };
      }, data);
    };
    const at = await partAt();
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
      await page.waitForTimeout(250);
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
    await picture(page, "over_the_hole");
    let z = pz;
    for (let k = 0; k < 40 && z > -39.99; ++k) {
      await drag(0, -4, []);
      [, , z] = await feltAt(page);
      if (k === 8) await picture(page, "on_the_way_down");
    }
    await drag(0, -4, []);  // presses on the floor
    await page.waitForFunction(() => parseFloat(document.querySelector("#facts dd").textContent) > 0.4, null, kPatience);
    await page.waitForTimeout(800);
    const end = await feltAt(page);
    assert.ok(Math.abs(end[2] + 40) < 0.01, `not inserted: ${end[2]} mm`);
    assert.ok(Math.abs(end[0]) <= 0.31 && Math.abs(end[1]) <= 0.31, `not in the hole: ${end}`);
    assert.notEqual(await situation(page), "none");
    await picture(page, "inserted");
    assert.ok((await pixelsNear(page, "#physical", kForce)) > before + 150, "no force arrow");
    await page.mouse.up();
    await close(page);
  },
};

/** Ticks in contact. */
const kGalleryTick = {
  tetrahedron_on_box: 6000, square_peg_five: 6500, round_peg: 6500, ell_insert: 7000, dovetail: 4400, gear_on_shaft: 7400,
  nut_on_bolt: 7000, two_pins: 4600,
};
const code = await runCases(cases);
await browser.close();
process.exit(code);
