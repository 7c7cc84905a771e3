// SPDX-License-Identifier: Apache-2.0
// devices_in_browser.mjs PACKAGES BROWSER BY_HAND [PICTURES]: the square peg moved by people's devices, in its page without a recording: the
// controller of a headset (emulated by iwer), a SpaceMouse and a game pad (the browser's interfaces, played).
// PACKAGES: folder with playwright-core and iwer. Exit code 1 where something is not as it should be.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { feltAt, forceAbove, kPatience, Pages, pixelsOf } from "./browser_page.mjs";

const [packages, executablePath, byHand, pictures] = process.argv.slice(2);
const pages = await Pages.start(packages, executablePath, pictures);

/** Where the peg starts, tilted by this rotation vector [rad]; see scene.toml. */
const kTilt = [0.0536656, 0.1073312, 0];

/** The page with what is played, looked at along +y: to the right is +x. */
async function opened(...played) {
  const page = await pages.open(byHand, { played });
  page.on("console", (message) => message.type() === "error" && page.faults.push(message.text()));
  await page.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
  await page.locator("#physical").focus();
  for (let k = 0; k < 5; ++k) await page.keyboard.press("]");
  return page;
}
const newtons = async (page) => parseFloat(await page.locator("#facts dd").first().innerText());
const ticks = (page) => page.evaluate(() => Number(document.body.dataset.tick));
/** Waits until the core has run on by so much. */
const passed = async (page, ms) => page.waitForFunction((to) => document.body.dataset.tick > to, (await ticks(page)) + ms, kPatience);
const says = (page, id, words) =>
  page.waitForFunction(([id, words]) => new RegExp(words).test(document.getElementById(id).textContent), [id, words], kPatience);
/** Waits until the part is at rest; where it is then [mm]. */
async function settled(page) {
  let before = await feltAt(page);
  for (let k = 0; k < 100; ++k) {
    await passed(page, 120);
    const now = await feltAt(page);
    if (Math.hypot(...now.map((x, i) => x - before[i])) < 0.02) return now;
    before = now;
  }
  return before;
}
/** A picture of the list of devices, which says `words` of one. */
async function list(page, id, words, name) {
  await page.locator("#show-devices").click();
  await says(page, id, words);
  await pages.picture(page, name);
  await page.locator("#devices button", { hasText: "Close" }).click();
}

/** Over the hole, down to its floor, and pressed on it, by `move(right, away, up)` in mm. @returns where the part is [mm]. */
async function insert(page, move) {
  for (let k = 0; k < 12; ++k) {
    const [x, y] = await settled(page);
    if (Math.hypot(x, y) < 0.15) break;
    await move(-x, -y, 0);
  }
  const [x, y, z] = await settled(page);
  assert.ok(Math.hypot(x, y) < 0.2 && z > 2, `not over the hole: ${x}, ${y}, ${z} mm`);
  for (let k = 0; k < 40 && (await feltAt(page))[2] > -39.99; ++k) {
    await move(0, 0, -4);
    await passed(page, 60);
  }
  await move(0, 0, -4);
  await forceAbove(page, 0.4);
  const end = await settled(page);
  assert.ok(Math.abs(end[2] + 40) < 0.01 && Math.abs(end[0]) <= 0.31 && Math.abs(end[1]) <= 0.31, `not inserted: ${end} mm`);
  return end;
}
/** Two forces and what a motor did with each: the one is in proportion to the other. */
function inProportion(...pairs) {
  const [[f1, s1], [f2, s2]] = pairs;
  assert.ok(f1 > 0.3 && f2 > 1.2 * f1 && s1 > 0, `forces ${f1} N and ${f2} N, strengths ${s1} and ${s2}`);
  assert.ok(Math.abs(s2 / s1 - f2 / f1) < 0.15 * (f2 / f1), `${f1} N gave ${s1}, ${f2} N gave ${s2}`);
}

/** A headset as people own it, in the place of the browser's. */
const headset = () => {
  const device = new IWER.XRDevice(IWER.metaQuest3, { stereoEnabled: true });
  device.installRuntime({ forceInstall: true });
  const { right } = device.controllers;
  const [motor] = right.inputSource.gamepad.hapticActuators;
  window.pulses = [];
  motor.pulse = async (strength, ms) => window.pulses.push({ strength, ms, at: performance.now() });
  window.headset = device;
};

const cases = {
  async "headset: a controller puts the peg into its hole, feels the force as pulses, and leaves the part when it is lost"() {
    const page = await opened({ path: join(packages, "iwer", "build", "iwer.min.js") }, headset);
    await says(page, "headset-state", "Enter VR");
    await page.locator("#enter-vr").click();
    await says(page, "headset-state", "it shows the scene");
    const right = (act, value) => page.evaluate(([act, value]) => {
      const { right } = window.headset.controllers;
      if (act === "move") right.position.set(...[right.position.x, right.position.y, right.position.z].map((x, k) => x + value[k]));
      if (act === "turn") right.quaternion.set(...value);
      if (act === "squeeze") right.updateButtonValue("squeeze", value);
      if (act === "connected") right.connected = value;
    }, [act, value]);
    // Up in the room is up, away from the head is away.
    const move = (x, away, up) => right("move", [x / 1e3, up / 1e3, -away / 1e3]);
    const start = await settled(page);
    await move(30, 20, 10);
    await passed(page, 200);
    assert.deepEqual(await settled(page), start, "the part moves with an open clutch");
    await right("squeeze", 1);
    await passed(page, 200);
    const angle = Math.hypot(...kTilt), share = Math.sin(angle / 2) / angle;
    await right("turn", [-kTilt[0] * share, -kTilt[2] * share, kTilt[1] * share, Math.cos(angle / 2)]);
    await settled(page);
    await pages.picture(page, "headset_over_the_hole");
    assert.deepEqual(await page.evaluate(() => window.pulses), [], "pulses without a contact");
    const end = await insert(page, move);
    await pages.picture(page, "headset_inserted");
    const eyes = await pixelsOf(page, "#physical", () => {
      const { data, width, height } = window.shot, count = [0, 0];
      for (let k = 0; k < width * height; ++k) if (data[4 * k + 2] - data[4 * k] > 35) count[k % width < width / 2 ? 0 : 1] += 1;
      return count;
    });
    assert.ok(eyes.every((count) => count > 200), `the part has ${eyes} pixels for the two eyes`);
    const strength = async () => {
      await passed(page, 300);
      return [await newtons(page), await page.evaluate(() => window.pulses.at(-1).strength)];
    };
    const weak = await strength();
    await move(0, 0, -3);
    inProportion(weak, await strength());
    const gaps = await page.evaluate(() => window.pulses.map(({ at }, k, all) => at - (all[k - 1]?.at ?? -1e9)));
    assert.ok(gaps.length > 5 && Math.min(...gaps) > 45, `${gaps.length} pulses, ${Math.min(...gaps)} ms apart`);

    // Lost while it presses: the part stands, free of force, and nothing pulses; found again it is still open.
    await right("connected", false);
    await page.waitForFunction(() => parseFloat(document.querySelector("#facts dd").textContent) < 0.01, null, kPatience);
    const count = await page.evaluate(() => window.pulses.length);
    await right("connected", true);
    await move(10, 10, 20);
    await passed(page, 300);
    const left = await settled(page);
    assert.ok(Math.hypot(...left.map((x, k) => x - end[k])) < 0.35, `the part was left at ${left}, and pressed at ${end}`);
    assert.ok((await page.evaluate(() => window.pulses.length)) <= count + 1, "an open clutch pulses");
    // Pressed again it moves on; and the session ends in the middle of that.
    await right("squeeze", 0);
    await passed(page, 200);
    await right("squeeze", 1);
    await passed(page, 200);
    await move(0, 0, 8);
    const lifted = await settled(page);
    assert.ok(Math.abs(lifted[2] - left[2] - 8) < 0.5, `lifted from ${left} to ${lifted}`);
    await page.evaluate(() => window.headset.activeSession.end());
    await says(page, "headset-state", "Enter VR");
    assert.ok(Math.hypot(...(await settled(page)).map((x, k) => x - lifted[k])) < 0.1, "the part has moved at the end of the session");
    await page.waitForTimeout(500);
    await pages.picture(page, "headset_left");
    assert.ok(await page.locator("#enter-vr").isVisible());
    await page.keyboard.down("ArrowUp");
    await page.waitForFunction((z) => Number(document.getElementById("felt-position").textContent.split(/\s+/)[2]) > z + 2, lifted[2], kPatience);
    await page.keyboard.up("ArrowUp");
    await page.locator("#enter-vr").click();
    await says(page, "headset-state", "it shows the scene");
    await pages.close(page);
  },

  async "SpaceMouse: reports put the peg into its hole; garbage and an unplugged cap move nothing"() {
    const page = await opened(() => {
      const axes = (first) => ({ usages: [first, first + 1, first + 2], reportSize: 16, reportCount: 3, logicalMinimum: -350, logicalMaximum: 350 });
      const takers = { connect: [], disconnect: [] };
      const cap = {
        vendorId: 0x256f, productId: 0xc635, productName: "played cap", opened: false, oninputreport: null,
        collections: [{ usagePage: 1, usage: 8, inputReports: [{ reportId: 1, items: [axes(0x10030)] }, { reportId: 2, items: [axes(0x10033)] }] }],
        async open() { this.opened = true; },
      };
      window.report = (reportId, bytes) => cap.oninputreport?.({ reportId, data: new DataView(Uint8Array.from(bytes).buffer), timeStamp: performance.now() });
      window.plug = (kind) => takers[kind].forEach((take) => take({ device: cap }));
      Object.defineProperty(navigator, "hid", {
        value: {
          getDevices: async () => [],
          requestDevice: async ({ filters }) => ((window.filters = filters), [cap]),
          addEventListener: (kind, take) => takers[kind].push(take),
        },
      });
    });
    await page.locator("#show-devices").click();
    await says(page, "space-mouse-state", "choose it with this button");
    await page.locator("#space-mouse").click();
    await says(page, "space-mouse-state", "SpaceMouse Compact moves the part");
    await pages.picture(page, "space_mouse_list");
    await page.keyboard.press("Escape");
    assert.deepEqual(await page.evaluate(() => window.filters), [0x256f, 0x046d].map((vendorId) => ({ vendorId, usagePage: 1, usage: 8 })));
    const report = (number, values) => page.evaluate(([number, values]) => {
      window.report(number, [...new Uint8Array(Int16Array.from(values).buffer)]);
    }, [number, values]);
    // One report lasts for 50 ms where no other follows: 5 mm at full deflection, of which 5 % are rest.
    const raw = (mm) => Math.sign(mm) * Math.round(350 * (0.05 + 0.95 * Math.min(1, Math.abs(mm) / 5)));
    const move = async (right, away, up) => {
      await report(1, [raw(right), -raw(away), -raw(up)]);
      await passed(page, 80);
    };
    await page.keyboard.press("u");
    await passed(page, 1200);
    const end = await insert(page, move);
    await pages.picture(page, "space_mouse_inserted");
    // Turned in the hole: the walls hold it.
    for (let k = 0; k < 3; ++k) await report(2, [0, 0, 350]);
    await passed(page, 200);
    assert.ok((await newtons(page)) > 0.4);
    // Garbage: other numbers, cut short, none at all.
    const before = await settled(page);
    await page.evaluate(() => {
      for (const number of [0, 4, 23, 255]) window.report(number, [255, 127, 255, 127, 255, 127]);
      for (const number of [1, 2, 3]) window.report(number, []);
      window.report(1, [255, 127, 255]);
    });
    await passed(page, 200);
    assert.deepEqual(await settled(page), before);
    // Unplugged while it is pulled up: no report says that the cap is back.
    await report(1, [0, 0, -350]);
    await page.evaluate(() => window.plug("disconnect"));
    await passed(page, 100);
    const stands = await settled(page);
    await report(1, [0, 0, -350]);
    await passed(page, 200);
    assert.deepEqual(await settled(page), stands);
    assert.ok(Math.abs(stands[2] - end[2]) < 1, `the part went from ${end} to ${stands}`);
    await list(page, "space-mouse-state", "unplugged; the part stands", "space_mouse_unplugged");
    await page.evaluate(() => window.plug("connect"));
    await says(page, "space-mouse-state", "SpaceMouse Compact moves the part");
    for (let k = 0; k < 6; ++k) await move(0, 0, 5);
    assert.ok((await settled(page))[2] > end[2] + 4, "plugged in again it moves nothing");
    await pages.close(page);
  },

  async "game pad: a stick presses the peg on the rim, the motors shake as the force is large, unplugged the part stands"() {
    const page = await opened(() => {
      window.effects = [];
      const pad = {
        id: "played pad", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })),
        vibrationActuator: {
          playEffect: async (kind, effect) => (window.effects.push({ kind, at: performance.now(), ...effect }), "complete"),
          reset: async () => (window.effects.push({ kind: "reset", at: performance.now() }), "complete"),
        },
      };
      window.pad = null;
      window.plug = (isIn) => (window.pad = isIn ? pad : null);
      window.stick = (right, up, isFine) => {
        pad.axes = [right, 0, 0, -up];
        pad.buttons[0].pressed = isFine;
      };
      navigator.getGamepads = () => [window.pad];
    });
    await says(page, "game-pad-state", "press one of its buttons");
    await page.evaluate(() => window.plug(true));
    await list(page, "game-pad-state", "played pad moves the part; its motors say the force", "game_pad_list");
    assert.deepEqual(await page.evaluate(() => window.effects), [], "it shakes without a contact");
    const stick = (right, up, isFine = false) => page.evaluate((args) => window.stick(...args), [right, up, isFine]);
    const start = await feltAt(page);
    await stick(1, 0);  // away from the hole
    await page.waitForFunction((x) => Number(document.getElementById("felt-position").textContent.split(/\s+/)[0]) > x + 3, start[0], kPatience);
    await stick(0, -1);
    await page.waitForFunction((z) => Number(document.getElementById("felt-position").textContent.split(/\s+/)[2]) < z - 8, start[2], kPatience);
    // Button A: ten times finer.
    const press = async (force) => {
      await stick(0, -1, true);
      await forceAbove(page, force);
      await stick(0, 0);
    };
    await press(0.4);
    /** Force and strength while the stick is hardly moved: a motor shakes for who moves the part. */
    const strength = async () => {
      await stick(0.2, 0, true);
      await passed(page, 400);
      const pair = [await newtons(page), await page.evaluate(() => window.effects.findLast(({ kind }) => kind === "dual-rumble").strongMagnitude)];
      await stick(0, 0);
      return pair;
    };
    const weak = await strength();
    await press(1.6 * weak[0]);
    inProportion(weak, await strength());
    await pages.picture(page, "game_pad_pressed");
    const gaps = await page.evaluate(() => window.effects.filter(({ kind }) => kind === "dual-rumble").map(({ at }, k, all) => at - (all[k - 1]?.at ?? -1e9)));
    assert.ok(Math.min(...gaps) > 45, `effects ${Math.min(...gaps)} ms apart`);
    // Nobody moves it: the motors stop, the force stays.
    await page.waitForFunction(() => window.effects.at(-1).kind === "reset", null, kPatience);
    assert.ok((await newtons(page)) > 0.5);
    // Unplugged while the stick is up.
    await stick(0, 1);
    await page.waitForFunction((z) => Number(document.getElementById("felt-position").textContent.split(/\s+/)[2]) > z + 2, (await feltAt(page))[2], kPatience);
    await page.evaluate(() => window.plug(false));
    await passed(page, 200);
    const stands = await settled(page);
    await passed(page, 300);
    assert.deepEqual(await feltAt(page), stands, "the part moves without a pad");
    await list(page, "game-pad-state", "unplugged; the part stands", "game_pad_unplugged");
    await pages.close(page);
  },

  async "devices that are not here say why, as a file and on a page that is not secure"() {
    const page = await opened();
    await page.locator("#show-devices").click();
    await says(page, "game-pad-state", "none yet");
    await says(page, "headset-state", "none is found|this browser has no WebXR");
    await says(page, "space-mouse-state", "none yet|this browser has no WebHID");
    await pages.picture(page, "devices_none");
    assert.ok(!(await page.locator("#enter-vr").isVisible()));
    await pages.close(page);
    // Another machine's page by http: the browser keeps the devices to itself, and the rest works.
    const far = await pages.browser.newPage();
    const html = readFileSync(byHand, "utf8");
    await far.route("http://page.example/**", (route) => route.fulfill({ contentType: "text/html", body: html }));
    await far.goto("http://page.example/");
    await far.waitForFunction(() => document.body.dataset.tick > 100, null, kPatience);
    for (const id of ["headset-state", "space-mouse-state"]) await says(far, id, "secure pages alone.*adb reverse");
    assert.ok(!(await far.locator("#space-mouse").isVisible()));
    await far.close();
  },
};

await pages.run(cases);
