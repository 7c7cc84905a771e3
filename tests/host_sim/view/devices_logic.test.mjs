// SPDX-License-Identifier: Apache-2.0
// The page's devices without a browser: SpaceMouse against the driver's golden poses, game pad, clutch of a controller, pulses, the hand that
// they move, words. Run by check_page after bundling.
import assert from "node:assert/strict";
import { test } from "node:test";
import golden from "../../golden/spacemouse_poses.txt";
import { gamePadText, headsetText, kInsecure, spaceMouseText } from "../../../host_sim/view/page/src/device_words";
import { gripOf, multiply, rotationOf, rotationVector } from "../../../host_sim/view/page/src/hand";
import { Buzz, kEvery_ms } from "../../../host_sim/view/page/src/inputs/buzz";
import { GamePad } from "../../../host_sim/view/page/src/inputs/game_pad";
import { beyond } from "../../../host_sim/view/page/src/inputs/hand_input";
import { Keys } from "../../../host_sim/view/page/src/inputs/keys";
import { LedHand } from "../../../host_sim/view/page/src/inputs/led_hand";
import { RoomController } from "../../../host_sim/view/page/src/inputs/room_controller";
import { SpaceMice, SpaceMouse } from "../../../host_sim/view/page/src/inputs/space_mouse";
import { decode, kModels, kRefused, layoutOf, modelOf, nothingReported } from "../../../host_sim/view/page/src/inputs/space_mouse_codec";
import { SpaceMousePose } from "../../../host_sim/view/page/src/inputs/space_mouse_pose";
import { inScene, placedBefore } from "../../../host_sim/view/page/src/room_view";

const near = (a, b, tolerance = 1e-12) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);
const nearAll = (a, b, tolerance) => a.forEach((x, k) => near(x, b[k], tolerance));
/** right is x, up z, away y */
const kView = { axes: [[1, 0, 0], [0, 0, 1], [0, 1, 0]], partRadius: 0.02, isFine: false };

const axisItem = (first, count, most) => ({
  usages: Array.from({ length: count }, (_, k) => 0x10030 + first + k), reportSize: 16, reportCount: count, logicalMinimum: -most, logicalMaximum: most,
});
/** As WebHID gives the descriptor of a six-axis device: its axes are in collections within. */
function collectionsOf(layout, range) {
  const physical = (...inputReports) => ({ usagePage: 1, usage: 0, inputReports });
  const children = {
    none: [],
    joined: [physical({ reportId: 1, items: [axisItem(0, 6, range)] })],
    split: [physical({ reportId: 1, items: [axisItem(0, 3, range)] }), physical({ reportId: 2, items: [axisItem(3, 3, range)] })],
  }[layout];
  return [{ usagePage: 1, usage: 8, inputReports: [], children }];
}
const viewOf = (bytes) => new DataView(Uint8Array.from(bytes).buffer);
const bytesOf = (hex) => hex.match(/../g).map((byte) => parseInt(byte, 16));
/** Axes from `first` on, in a report. */
const shorts = (...values) => {
  const view = new DataView(new ArrayBuffer(2 * values.length));
  values.forEach((value, k) => view.setInt16(2 * k, value, true));
  return view;
};

/** Plays the golden sessions; `spoil` makes of a pose's settings what they are not. @returns the largest difference and how many states. */
function playGolden(spoil = (settings) => settings) {
  let pose = null, most = 0, states = 0;
  for (const line of golden.trim().split("\n")) {
    const [kind, ...words] = line.split(" ");
    if (kind === "session") {
      const [vendor, product, layout, range, fullSpeed, fullTurn, deadZone, reach, longestStep_ns] = words;
      const model = modelOf(parseInt(vendor, 16), parseInt(product, 16));
      const settings = { fullSpeed: +fullSpeed, fullTurn: +fullTurn, deadZone: +deadZone, reach: +reach, longestStep_ns: +longestStep_ns };
      pose = new SpaceMousePose(layoutOf(collectionsOf(layout, +range)), model.axes, spoil(settings));
      pose.rest(1e9);
      continue;
    }
    if (kind !== "rest" && kind !== "report") continue;
    const stamp = Number(words.shift());
    if (kind === "rest") {
      pose.rest(stamp);
    } else {
      const [number, ...data] = bytesOf(words.shift());
      pose.read(number, viewOf(data), stamp);
    }
    const { p, q } = pose.now;
    [...p, ...q].forEach((x, k) => (most = Math.max(most, Math.abs(x - Number(words[k])))));
    assert.equal(pose.buttons, Number(words[7]), line);
    states += 1;
  }
  return { most, states };
}

test("SpaceMouse: the pose after each report is that of the driver to 1e-9", () => {
  const { most, states } = playGolden();
  assert.ok(states > 200, `${states} states`);
  assert.ok(most < 1e-9, `${most} m or of a quaternion`);
  // The comparison sees what is a little different.
  for (const other of [{ deadZone: 0.051 }, { fullTurn: 1.0001 }, { longestStep_ns: 49e6 }, { reach: 0.0199 }])
    assert.ok(playGolden((settings) => ({ ...settings, ...other })).most > 1e-6, JSON.stringify(other));
});

test("SpaceMouse: the models and their axes are those of the driver", () => {
  const rows = golden.split("\n");
  const models = rows.filter((row) => row.startsWith("model ")).map((row) => row.match(/^model (\w+) (\w+) (\w+) (.*)$/).slice(1));
  assert.deepEqual(kModels.map(({ vendor, product, axes, name }) => [vendor.toString(16).padStart(4, "0"), product.toString(16), axes, name]), models);
  const refused = rows.filter((row) => row.startsWith("refused ")).map((row) => parseInt(row.slice(8), 16));
  assert.deepEqual(kRefused, refused);
  for (const product of refused) assert.equal(modelOf(0x256f, product), null);
  assert.equal(modelOf(0x046d, 0xc077), null);
  assert.equal(modelOf(0x256f, 0xc6ff).axes, "current");
});

test("SpaceMouse: reports of six and of twelve bytes are read, garbage changes nothing", () => {
  const reported = nothingReported();
  assert.deepEqual([decode(1, shorts(350, -175, 1), true, reported), decode(2, shorts(-1, 2, -32768), true, reported)], ["axes", "axes"]);
  assert.deepEqual(reported.axes, [350, -175, 1, -1, 2, -32768]);
  assert.equal(decode(1, shorts(1, 2, 3, 4, 5, 6), true, reported), "axes");
  assert.deepEqual(reported.axes, [1, 2, 3, 4, 5, 6]);
  // Where the descriptor splits the axes, bytes behind three mean nothing.
  assert.equal(decode(1, shorts(7, 8, 9, 99, 99, 99), false, reported), "axes");
  assert.deepEqual(reported.axes, [7, 8, 9, 4, 5, 6]);
  assert.equal(decode(3, viewOf([5, 0, 0, 128]), true, reported), "buttons");
  assert.equal(reported.buttons, 0x80000005);
  // Any number and length, from a seed: no error, and only whole reports of known numbers change anything.
  let seed = 12345;
  const random = (below) => (seed = (Math.imul(seed, 1103515245) + 12345) >>> 0) % below;
  let taken = 0;
  for (let k = 0; k < 20000; ++k) {
    const number = [0, 1, 2, 3, 4, 23, 255][random(7)];
    const bytes = Array.from({ length: random(16) }, () => random(256));
    const before = JSON.stringify(reported);
    const isWhole = ((number === 1 || number === 2) && bytes.length >= 6) || (number === 3 && bytes.length >= 1);
    assert.equal(decode(number, viewOf(bytes), random(2) === 1, reported), !isWhole ? "nothing" : number === 3 ? "buttons" : "axes");
    if (!isWhole) assert.equal(JSON.stringify(reported), before);
    taken += isWhole ? 1 : 0;
    assert.ok(reported.axes.every((x) => Number.isInteger(x) && Math.abs(x) <= 32768));
  }
  assert.ok(taken > 1000);
  // A descriptor that makes no sense: the stated full scale.
  for (const most of [0, -1, 1e9, NaN]) assert.deepEqual(layoutOf(collectionsOf("joined", most)).scales, new Array(6).fill(350));
});

test("SpaceMouse: what is taken in portions adds up to the pose", () => {
  const layout = layoutOf(collectionsOf("joined", 350));
  const whole = new SpaceMousePose(layout, "current"), portions = new SpaceMousePose(layout, "current");
  let p = [0, 0, 0], q = [0, 0, 0, 1];
  for (let k = 0; k < 60; ++k) {
    const data = shorts(300 - 7 * k, 20 * k - 350, 100, 5 * k, -200, 250);
    for (const one of [whole, portions]) one.read(1, data, 1e9 + 8e6 * k);
    const part = portions.take();
    p = p.map((x, i) => x + part.p[i]);
    q = multiply(part.q, q);
  }
  nearAll(p, whole.now.p, 1e-12);
  nearAll(q, whole.now.q, 1e-12);
  assert.ok(Math.hypot(...p) > 0.01 && Math.hypot(...rotationVector(q)) > 0.1);
});

/** A WebHID of devices that are played. */
function playedHid(devices) {
  const takers = { connect: [], disconnect: [] };
  return {
    takers,
    filters: null,
    getDevices: async () => [],
    requestDevice: async ({ filters }) => ((hid.filters = filters), devices),
    addEventListener: (kind, take) => takers[kind].push(take),
    tell: (kind, device) => takers[kind].forEach((take) => take({ device })),
  };
}
let hid;
const playedCap = (more = {}) => ({
  vendorId: 0x256f, productId: 0xc635, productName: "cap", opened: false, oninputreport: null, collections: collectionsOf("joined", 350),
  async open() { this.opened = true; }, ...more,
});
const settle = () => new Promise((done) => setTimeout(done, 0));

test("SpaceMouse: unplugged, nothing moves; plugged in again it goes on; what cannot be used says why", async () => {
  const cap = playedCap(), hands = [new SpaceMouse()];
  hid = playedHid([cap]);
  const mice = new SpaceMice(hid, hands);
  assert.equal(hands[0].take(kView, 0.01, 100), null);
  await mice.choose();
  assert.deepEqual(hid.filters.map(({ vendorId, usagePage, usage }) => [vendorId, usagePage, usage]), [[0x256f, 1, 8], [0x046d, 1, 8]]);
  assert.equal(hands[0].name, "SpaceMouse Compact");
  const report = (timeStamp, ...axes) => cap.oninputreport({ reportId: 1, data: shorts(...axes), timeStamp });
  report(100, 350, -350, -350, 0, 0, 0);
  const { shift, hold } = hands[0].take(kView, 0.016, 110);
  nearAll(shift, [0.001, 0.001, 0.001], 1e-9);  // right, away, up: ten milliseconds at 0.1 m/s
  assert.equal(hold, "near");
  report(120, 350, 0, 0, 0, 0, 0);
  nearAll(hands[0].take({ ...kView, isFine: true }, 0.016, 130).shift, [0.0002, 0.0001, 0.0001], 1e-9);
  report(130, 0, 0, 0, 0, 0, -350);
  nearAll(rotationVector(hands[0].take(kView, 0.016, 150).turn), [0, 0, 0.02], 1e-9);  // raw z points down
  // Pulled out while it is turned.
  const { oninputreport } = cap;
  hid.tell("disconnect", cap);
  oninputreport({ reportId: 1, data: shorts(350, 350, 350, 350, 350, 350), timeStamp: 160 });
  assert.deepEqual([hands[0].take(kView, 0.016, 170), hands[0].name, mice.isGone, cap.oninputreport], [null, "", true, null]);
  hid.tell("connect", cap);
  await settle();
  assert.deepEqual([hands[0].name, mice.isGone], ["SpaceMouse Compact", false]);
  // A second one finds no hand.
  hid = playedHid([playedCap()]);
  const others = new SpaceMice(hid, hands);
  await others.choose();
  assert.match(others.trouble, /unplug one/);
  hid = playedHid([playedCap({ productId: 0xc650, productName: "key pad" })]);
  const foreign = new SpaceMice(hid, [new SpaceMouse()]);
  await foreign.choose();
  assert.match(foreign.trouble, /key pad is no six-axis device/);
  hid = playedHid([playedCap({ open: async () => { throw new Error("Failed to open the device."); } })]);
  const held = new SpaceMice(hid, [new SpaceMouse()]);
  await held.choose();
  assert.match(held.trouble, /cannot be opened: Failed to open the device\. Close the program/);
  hid.requestDevice = async () => { throw new Error("not allowed"); };
  await held.choose();
  assert.match(held.trouble, /gives no SpaceMouse: not allowed/);
});

test("SpaceMouse: one that several events bring at once is opened once, and leads one hand", async () => {
  let opens = 0;
  const cap = playedCap({
    async open() {
      assert.equal(++opens, 1, "a browser refuses a second open while the first is going on");
      await settle();
      this.opened = true;
    },
  });
  const hands = [new SpaceMouse(), new SpaceMouse()];
  hid = playedHid([cap]);
  const mice = new SpaceMice(hid, hands);
  hid.tell("connect", cap);
  await mice.choose();
  await settle();
  await settle();
  assert.deepEqual([opens, hands.map(({ name }) => name), mice.trouble], [1, ["SpaceMouse Compact", ""], ""]);
});

test("inputs: inside the dead zone rest, at its edge no jump, at the end all; what is no number is rest", () => {
  for (const value of [0, 0.1, -0.1, NaN, Infinity, undefined]) assert.equal(beyond(value, 0.1), 0);
  near(beyond(0.109, 0.1), 0.01);
  near(beyond(-0.55, 0.1), -0.5);
  assert.deepEqual([beyond(1, 0.1), beyond(-7, 0.1)], [1, -1]);
});

const playedPad = () => ({
  id: "pad", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })),
  effects: [],
  vibrationActuator: {
    playEffect(kind, effect) { playedPad.now.effects.push([kind, effect]); return playedPad.answer(); },
    reset() { playedPad.now.effects.push(["reset"]); return playedPad.answer(); },
  },
});

test("game pad: sticks and triggers move and turn, its motors say the force, unplugged it moves nothing", async () => {
  const pad = (playedPad.now = playedPad());
  playedPad.answer = async () => "complete";
  let there = [null, pad];
  const input = new GamePad(0, () => there);
  assert.equal(input.take(kView, 0.1, 1000), null);
  assert.equal(input.name, "pad");
  pad.axes = [1, 0.05, 0, -0.57];  // the second is within the dead zone
  const { shift } = input.take(kView, 0.1, 1100);
  nearAll(shift, [0.0018, 0, 0.0009], 1e-9);
  pad.axes = [0, 0, 1, 0];
  pad.buttons[7].value = 1;
  pad.buttons[4].value = 1;
  const { turn } = input.take(kView, 0.1, 1200);
  nearAll(rotationVector(turn), [0.05, -0.05, -0.05], 1e-9);
  pad.buttons[0].pressed = true;
  nearAll(rotationVector(input.take(kView, 0.1, 1300).turn), [0.005, -0.005, -0.005], 1e-9);
  // Motors: in proportion, seldom, and off at once.
  input.feel(0.25, 2000);
  input.feel(0.25, 2001);
  input.feel(0.5, 2000 + kEvery_ms);
  input.feel(0, 2000 + kEvery_ms + 1);
  input.feel(0, 2000 + kEvery_ms + 2);
  const strengths = pad.effects.map(([kind, effect]) => (kind === "reset" ? kind : [effect.strongMagnitude, effect.weakMagnitude]));
  assert.deepEqual(strengths, [[0.25, 0.25], [0.5, 0.5], "reset"]);
  assert.ok(input.holds(1400) && !input.holds(2500));
  // A browser that knows no such effect is asked once.
  playedPad.answer = async () => { throw Object.assign(new Error("no"), { name: "NotSupportedError" }); };
  assert.ok(input.canRumble);
  input.feel(1, 3000);
  await settle();
  input.feel(1, 4000);
  assert.deepEqual([input.canRumble, pad.effects.length], [false, 4]);
  pad.axes = [NaN, Infinity, undefined, 0];
  pad.buttons = [];
  assert.equal(input.take(kView, 0.1, 4100), null);
  // Pulled out, and one of another layout.
  pad.axes = [1, 1, 1, 1];
  there = [null, null];
  assert.equal(input.take(kView, 0.1, 4200), null);
  assert.deepEqual([input.name, input.wasThere, input.holds(4200)], ["", true, false]);
  there = [{ ...playedPad(), id: "wheel", mapping: "" }];
  assert.equal(input.take(kView, 0.1, 6000), null);
  assert.deepEqual([input.name, input.foreign], ["", "wheel"]);
  const refuses = new GamePad(0, () => { throw new Error("not allowed here"); });
  assert.deepEqual([refuses.take(kView, 0.1, 1), refuses.isRefused], [null, true]);
  there = [{ ...playedPad(), vibrationActuator: null, id: "old" }];
  input.take(kView, 0.1, 7000);
  assert.deepEqual([input.name, input.canRumble], ["old", false]);
  input.feel(1, 8000);
});

test("pulses: no force, none; a force that is no number, none; no more than twenty a second", () => {
  const pulses = [];
  const buzz = new Buzz((strength) => pulses.push(strength), () => pulses.push("stop"));
  for (const share of [0, NaN, -1, 0.001]) buzz.feel(share, 0);
  assert.deepEqual(pulses, []);
  for (let now = 0; now < 1000; ++now) buzz.feel(5, now);
  assert.deepEqual(pulses, new Array(20).fill(1));
  buzz.feel(NaN, 1001);
  assert.equal(pulses.at(-1), "stop");
});

const at = (x, y = 0, z = 0, q = [0, 0, 0, 1]) => ({ p: [x, y, z], q });
const state = (side, grip, isPressed, pulse = null) => ({ side, grip, isPressed, pulse });

test("controller: pressed, the part moves as it does; released, the part is left; what was pressed before takes nothing", () => {
  const hand = new RoomController(["right", "left"]);
  const track = (...states) => (hand.track(states), hand.take(null, 0, 5));
  // The trigger that pressed "Enter VR" is still down.
  assert.equal(track(state("right", at(0), true)), null);
  assert.equal(track(state("right", at(0.1), true)), null);
  assert.equal(hand.holding, null);
  assert.equal(track(state("right", at(0.1), false)), null);
  assert.equal(track(state("right", at(0.2), true)), null);  // taken here
  assert.equal(hand.holding, "right");
  const moved = track(state("right", at(0.21, 0.02, -0.03, rotationOf([0, 0.1, 0])), true));
  nearAll(moved.shift, [0.01, 0.02, -0.03]);
  nearAll(rotationVector(moved.turn), [0, 0.1, 0]);
  assert.equal(moved.hold, "firm");
  assert.equal(track(state("right", at(0.21, 0.02, -0.03, rotationOf([0, 0.1, 0])), true)), null);
  // The other one presses, too: the first goes on.
  track(state("right", at(0.21, 0.02, -0.03), true), state("left", at(5), false));
  assert.equal(track(state("left", at(5), true), state("right", at(0.21, 0.02, -0.03), true)), null);
  assert.equal(hand.holding, "right");
  assert.equal(track(state("right", at(0.3), false)).hold, "left");
  assert.deepEqual([hand.holding, hand.holds()], [null, false]);
  assert.equal(track(state("right", at(0.5), false)), null);
});

test("controller: lost, it lets go, and takes the part again only once it is released and pressed", () => {
  const lost = [null, at(NaN), at(0.9), at(0, 0, 0, [0, 0, 0, 0.5]), "gone"];
  for (const what of lost) {
    const hand = new RoomController(["right"]);
    const track = (...states) => (hand.track(states), hand.take(null, 0, 5));
    track(state("right", at(0), false));
    track(state("right", at(0), true));
    assert.equal(hand.holding, "right");
    assert.equal(track(...(what === "gone" ? [] : [state("right", what, true)])).hold, "left", JSON.stringify(what));
    assert.equal(track(state("right", at(0.05), true)), null);
    assert.equal(hand.holding, null);
    track(state("right", at(0.05), false));
    track(state("right", at(0.05), true));
    assert.equal(hand.holding, "right");
    // The session ends.
    hand.rest();
    assert.equal(hand.take(null, 0, 6).hold, "left");
    assert.equal(track(state("right", at(0.06), true)), null);
    assert.equal(hand.holding, null);
  }
  const second = new RoomController(["left"]);
  second.track([state("right", at(0), false)]);
  second.track([state("right", at(0), true)]);
  assert.equal(second.holding, null);
});

test("room: the part is in front of the head, away is away, up is up, a metre is a metre", () => {
  const head = { p: [1, 1.6, 2], q: rotationOf([0, Math.PI / 2, 0]) };  // looks along -x
  const placement = placedBefore(head, { azimuth: 0, elevation: 0.4 }, [0.1, 0.2, 0.3], 0.5, 0.1);
  nearAll(inScene(placement, at(0.5, 1.5, 2)).p, [0.1, 0.2, 0.3], 1e-9);
  nearAll(inScene(placement, at(0.4, 1.5, 2)).p, [0.1, 0.3, 0.3], 1e-9);  // ten centimetres farther away: y
  nearAll(inScene(placement, at(0.5, 1.6, 2)).p, [0.1, 0.2, 0.4], 1e-9);
  nearAll(inScene(placement, at(0.5, 1.5, 1.9)).p, [0.2, 0.2, 0.3], 1e-9);  // to the right of who looks along -x
  // Who looks down enters it all the same.
  const down = placedBefore({ p: [0, 0, 0], q: rotationOf([-Math.PI / 2, 0, 0]) }, { azimuth: 0, elevation: 0 }, [0, 0, 0], 0.5, 0);
  assert.ok([...down.turn.toArray(), ...down.shift.toArray()].every(Number.isFinite));
});

/** An input that gives one motion. */
const given = (motion) => ({
  felt: [],
  take: () => { const now = motion; motion = null; return now && { shift: [0, 0, 0], turn: [0, 0, 0, 1], at: 0, ...now }; },
  holds: () => true,
  feel(share) { this.felt.push(share); },
  give(next) { motion = next; },
});

test("hand: near holds slip at a wall, firm ones come back, one that leaves takes the force away", () => {
  const wanted = [];
  const stick = given(null), controller = given(null);
  const hand = new LedHand([stick, controller], { azimuth: 0, elevation: 0 }, [0, 0, 0.01], 0.02, 100, (pose) => wanted.push(gripOf(pose, [0, 0, 0.01])));
  const wall = at(0), moves = (input, x, hold) => {
    input.give({ shift: [x, 0, 0], hold });
    hand.advance(0.01, 1);
    hand.follow(at(0), wall, true);
    return wanted.at(-1)[0];
  };
  hand.follow(at(0), wall, true);
  near(moves(stick, 0.05, "near"), 0.01);  // half a radius from where it is felt
  near(moves(stick, -0.001, "near"), 0.009);
  near(moves(stick, -0.009, "near"), 0);
  near(moves(controller, 0.05, "firm"), 0.01);
  near(moves(controller, -0.035, "firm"), 0.01);
  near(moves(controller, -0.01, "firm"), 0.005);
  near(moves(controller, 0.04, "firm"), 0.01);
  near(moves(controller, 0, "left"), 0);
  // What is no number moves nothing, and turns are bounded.
  const count = wanted.length;
  moves(stick, NaN, "near");
  assert.equal(wanted.length, count);
  const poses = [];
  const turned = new LedHand([stick], { azimuth: 0, elevation: 0 }, [0, 0, 0], 0.02, 100, (pose) => poses.push(pose.q));
  turned.follow(at(0), wall, true);
  for (const [angle, hold, expected] of [[0.5, "near", 0.5], [0.5, "near", 0.6], [-0.3, "near", 0.3], [2, "firm", 0.6], [0.5, "firm", 0.6], [-2.2, "firm", 0.3]]) {
    stick.give({ turn: rotationOf([0, angle, 0]), hold });
    turned.advance(0.01, 1);
    near(rotationVector(poses.at(-1))[1], expected, 1e-9);
  }
  // The force goes to the input that moved last, as a share of the most with which this hand presses: 100 N/m times 10 mm.
  stick.felt.length = controller.felt.length = 0;
  moves(stick, 0.001, "near");
  hand.feel(0.25, 1);
  moves(controller, 0.001, "firm");
  hand.feel(0.5, 1);
  hand.feel(7, 1);
  assert.deepEqual([stick.felt, controller.felt], [[0.25, 0, 0], [0, 0.5, 1]]);
});

test("keys: they go through the same interface", () => {
  const keys = new Keys();
  const press = (code, isDown) => keys.key({ code }, isDown);
  assert.ok(!press("KeyZ", true) && keys.take(kView, 0.1, 1) === null);
  assert.ok(press("ArrowUp", true) && press("ArrowUp", false) && press("KeyA", true));
  const { shift, turn } = keys.take(kView, 0.1, 1);
  nearAll(shift, [0, 0, 0.0018], 1e-9);
  nearAll(rotationVector(turn), [0, 0, 0.05], 1e-9);
  nearAll(keys.take(kView, 0.1, 1).shift, [0, 0, 0]);
  keys.rest();
  assert.equal(keys.take(kView, 0.1, 1), null);
});

test("words: each device says that it is used, or why it is not and what to do", () => {
  const here = { isSecure: true, takesHand: true }, far = { isSecure: false, takesHand: true }, watched = { isSecure: true, takesHand: false };
  const pad = { name: "", foreign: "", canRumble: false, wasThere: false, isRefused: false };
  assert.equal(gamePadText(far, false, []), kInsecure);
  assert.match(gamePadText(watched, true, [pad]), /only watched/);
  assert.match(gamePadText(here, true, [pad]), /press one of its buttons/);
  assert.match(gamePadText(here, true, [{ ...pad, wasThere: true }]), /unplugged; the part stands/);
  assert.match(gamePadText(here, true, [{ ...pad, isRefused: true }]), /within another/);
  assert.match(gamePadText(here, true, [{ ...pad, foreign: "wheel" }]), /wheel has a layout/);
  assert.match(gamePadText(here, true, [{ ...pad, name: "x", canRumble: true }]), /x moves the part; its motors say the force/);
  assert.match(spaceMouseText(here, null), /no WebHID/);
  assert.equal(spaceMouseText(far, null), kInsecure);
  assert.match(spaceMouseText(here, { names: [""], trouble: "", isGone: true }), /unplugged/);
  assert.match(spaceMouseText(here, { names: ["a", ""], trouble: "", isGone: false }), /^a moves the part/);
  assert.match(spaceMouseText(here, { names: ["", ""], trouble: "held", isGone: false }), /^held/);
  const xr = { hasApi: true, canDraw: true, headset: "none", trouble: "" };
  assert.equal(headsetText(far, { ...xr, hasApi: false }), kInsecure);
  assert.match(headsetText(here, { ...xr, hasApi: false }), /no WebXR/);
  assert.match(headsetText(here, { ...xr, canDraw: false }), /no WebGL/);
  assert.match(headsetText(here, xr), /none is found/);
  assert.match(headsetText(here, { ...xr, headset: "some" }), /Enter VR/);
  assert.match(headsetText(watched, { ...xr, headset: "in" }), /only watched/);
});
