// SPDX-License-Identifier: Apache-2.0
// The page in Chromium without a window, for tests: opened, read as a person reads it, counted in pixels.
import assert from "node:assert/strict";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

/** A machine under load may take its time; nothing here asserts a time. */
export const kPatience = { timeout: 240000 };

/** One browser. `pictures`: folder for a picture of each state, or none. */
export class Pages {
  /** `packages`: folder with playwright-core. */
  static async start(packages, executablePath, pictures) {
    const { chromium } = await import(pathToFileURL(join(packages, "playwright-core", "index.mjs")));
    const browser = await chromium.launch({
      executablePath,
      args: ["--headless", "--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking",
        "--disable-component-update", "--disable-default-apps", "--disable-sync", "--no-first-run"],
    });
    return new Pages(browser, pictures);
  }
  constructor(browser, pictures) {
    this.browser = browser;
    this.pictures = pictures;
  }

  /** A file, or the address of a live session; a request to anyone else is a fault. `played`: scripts that stand in for devices, before
   *  the page's own, each a function or { path }. */
  async open(place, { played = [], ...options } = {}) {
    const isLive = /^http:/.test(place);
    const own = isLive ? new RegExp(`^(blob:|data:|https?://${new URL(place).host}/)`) : /^(file|blob|data):/;
    const page = await this.browser.newPage({ viewport: { width: 1100, height: 700 }, colorScheme: "light", ...options });
    page.setDefaultTimeout(kPatience.timeout);
    page.foreign = [];
    page.on("request", (request) => {
      if (!own.test(request.url())) page.foreign.push(request.url());
    });
    page.faults = [];
    page.on("pageerror", (error) => page.faults.push(error.message));
    for (const script of played) await page.addInitScript(script);
    page.answer = await page.goto(isLive ? place : pathToFileURL(place).href);
    return page;
  }

  async close(page) {
    assert.deepEqual(page.foreign, [], "the page asks others");
    assert.deepEqual(page.faults, [], "the page has faults");
    await page.close();
  }

  /** Once the view stands still: the close-up of C-space follows the part. */
  async picture(page, name) {
    if (!this.pictures) return;
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(this.pictures, `${name}.png`) });
  }

  /** Runs named cases one after the other, says how each ended and how long it took, and ends the program. */
  async run(cases) {
    let failed = 0;
    for (const [name, test] of Object.entries(cases)) {
      const begin = performance.now();
      const time = () => `(${((performance.now() - begin) / 1000).toFixed(1)} s)`;
      try {
        await test();
        console.log(`passed: ${name} ${time()}`);
      } catch (error) {
        failed += 1;
        console.log(`FAILED: ${name} ${time()}\n${error.stack}`);
      }
    }
    await this.browser.close();
    process.exit(failed > 0 ? 1 : 0);
  }
}

export const lamp = (page) => page.locator("#lamp").getAttribute("data-state");
export const settledLamp = (page) =>
  page.waitForFunction(() => ["green", "red"].includes(document.getElementById("lamp").dataset.state), null, kPatience);
/** Of the part as it is felt, in mm, as the page says it in words. */
export const feltAt = async (page) => (await page.innerText("#felt-position")).split(/\s+/).slice(0, 3).map(Number);
export const situation = (page) => page.locator("#situation").getAttribute("data-situation");
/** Waits for a force of the core above `newtons`. */
export const forceAbove = (page, newtons) =>
  page.waitForFunction((n) => parseFloat(document.querySelector("#facts dd").textContent) > n, newtons, kPatience);

/** Held at a tick, which is drawn. */
export const heldAt = (page, tick) =>
  page.waitForFunction((to) => document.body.dataset.tick === String(to + 1) && document.body.dataset.mode === "pause", tick, kPatience);

export async function seek(page, tick) {
  await page.evaluate((to) => {
    const time = document.getElementById("time");
    time.value = to;
    time.dispatchEvent(new Event("input"));
  }, tick);
  await heldAt(page, tick);
}

/** What `look` says of the newest picture of a canvas, `shot` in the page; the page allows no other way to hand it over. */
export async function pixelsOf(page, canvas, look, words) {
  await page.evaluate(async (png) => {
    const image = new Image();
    image.src = `data:image/png;base64,${png}`;
    await image.decode();
    const flat = new OffscreenCanvas(image.width, image.height).getContext("2d");
    flat.drawImage(image, 0, 0);
    window.shot = flat.getImageData(0, 0, image.width, image.height);
  }, (await page.locator(canvas).screenshot()).toString("base64"));
  return page.evaluate(look, words);
}

/** Pixels of a canvas whose colour is near to `wanted`. */
export const pixelsNear = (page, canvas, wanted, within = 24) =>
  pixelsOf(
    page,
    canvas,
    ([[r, g, b], within]) => {
      const { data } = window.shot;
      let count = 0;
      for (let k = 0; k < data.length; k += 4)
        if (Math.hypot(data[k] - r, data[k + 1] - g, data[k + 2] - b) < within) count += 1;
      return count;
    },
    [wanted, within],
  );

/** Waits until so many pixels are near to `wanted`. */
export async function pixelsAbove(page, canvas, wanted, most, why) {
  const patience = Date.now() + 30000;
  let count = 0;
  do {
    count = await pixelsNear(page, canvas, wanted);
    if (count > most) return;
    await page.waitForTimeout(100);
  } while (Date.now() < patience);
  assert.fail(`${why}: ${count} pixels, and not more than ${most}`);
}

/** Middle of what has the part's own colour. */
export const partAt = (page) =>
  pixelsOf(page, "#physical", () => {
    const { data, width, height } = window.shot;
    let x = 0, y = 0, count = 0;
    for (let row = 0; row < height; ++row) {
      for (let column = 0; column < width; ++column) {
        const k = 4 * (row * width + column);
        if (data[k + 2] - data[k] > 35 && data[k + 2] > 90) (x += column), (y += row), (count += 1);
      }
    }
    return { x: x / count, y: y / count };
  });

export const kForce = [0xd5, 0x5e, 0x00], kContact = [0xc2, 0x18, 0x7f];
export const kGuide = [0x00, 0x79, 0x5a];
export const kChosen = [0x00, 0x61, 0xa8];
export const kTypeB = [0x56, 0xb4, 0xe9];

/** The scenes of the gallery, and ticks in contact: one of the whole motion that shows the scene's idea, and the first in which something happens. */
export const kGallery = [
  ["tetrahedron_on_box", 6000, 2400],
  ["square_peg_five", 6500, 2500],
  ["round_peg", 6500, 3600],
  ["ell_insert", 7000, 2500],
  ["dovetail", 4400, 4400],
  ["gear_on_shaft", 7400, 2000],
  ["nut_on_bolt", 7000, 6700],
  ["two_pins", 4600, 1500],
];
