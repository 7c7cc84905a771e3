// SPDX-License-Identifier: Apache-2.0
// The page's own logic, without a browser: strips, hand, shapes, recording, words. Run by check_page after bundling.
import assert from "node:assert/strict";
import { test } from "node:test";
import { gzipSync } from "node:zlib";
import { gripOf, Hand, multiply, poseOf, rotate, rotationOf, rotationVector, upright } from "../../../host_sim/view/page/src/hand";
import { DelayMeter, FrameMeter } from "../../../host_sim/view/page/src/delay";
import { Fineness, kCoarsest } from "../../../host_sim/view/page/src/fineness";
import { Account, askMessage, Chunk, handMessage, Next } from "../../../host_sim/view/page/src/live";
import { placeOf, placeText } from "../../../host_sim/view/page/src/place";
import { Pyramid } from "../../../host_sim/view/page/src/pyramid";
import { bytesOf, DamagedPage, Recording, unzipped } from "../../../host_sim/view/page/src/recording";
import { layoutOf, nodeText } from "../../../host_sim/view/page/src/graph_pane";
import { contactsOf, dashesOf, graphOf, kNone, markedOf, obstaclesOf, piecesOf, sameAnswer, surfaceOf, trianglesOf } from "../../../host_sim/view/page/src/shapes";
import { flagTexts, isMarked, lengthText, roundBelow } from "../../../host_sim/view/page/src/words";

const near = (a, b, tolerance = 1e-12) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);

test("strips: a peak of one tick stays visible at every length", () => {
  const pyramid = new Pyramid(2, 5000);
  const samples = new Float32Array(2 * 4000);
  samples[2 * 1234] = 7;
  samples[2 * 3999 + 1] = -3;
  pyramid.push(samples);
  for (const most of [10, 100, 700, 4000]) {
    const first = pyramid.range(0, 0, 4000, most);
    assert.equal(Math.max(...first.largest), 7);
    assert.ok(first.index.length <= most);
    assert.equal(Math.min(...pyramid.range(1, 0, 4000, most).least), -3);
  }
  const at = pyramid.range(0, 0, 4000, 700);
  const peak = at.largest.indexOf(7);
  assert.ok(at.index[peak] <= 1234 && 1234 < (at.index[peak + 1] ?? Infinity));
});

test("strips: memory is fixed and the oldest samples go", () => {
  const pyramid = new Pyramid(1, 1000);
  const { capacity } = pyramid;
  for (let k = 0; k < 3 * capacity + 17; ++k) pyramid.push(new Float32Array([k]));
  assert.equal(pyramid.count, capacity);
  assert.equal(pyramid.end, 3 * capacity + 17);
  assert.equal(pyramid.at(0, pyramid.begin), pyramid.begin);
  const all = pyramid.range(0, 0, pyramid.end, 50);
  assert.ok(Math.min(...all.least) >= pyramid.begin);
  assert.equal(Math.max(...all.largest), pyramid.end - 1);
  pyramid.clear();
  assert.equal(pyramid.range(0, 0, 10, 5).index.length, 0);
});

test("hand: rotations go there and back", () => {
  const q = rotationOf([0.3, -0.2, 1.1]);
  rotationVector(q).forEach((x, k) => near(x, [0.3, -0.2, 1.1][k]));
  rotationVector(q.map((x) => -x)).forEach((x, k) => near(x, [0.3, -0.2, 1.1][k]));
  const pose = poseOf([1, 2, 3], q, [0.01, 0.02, 0.05]);
  gripOf(pose, [0.01, 0.02, 0.05]).forEach((x, k) => near(x, k + 1));
});

test("hand: upright is the nearest axis-aligned orientation", () => {
  for (const base of [[0, 0, 0], [Math.PI / 2, 0, 0], [0, Math.PI, 0], [0, 0, -Math.PI / 2]]) {
    const exact = rotationOf(base);
    const found = upright(multiply(rotationOf([0.1, -0.15, 0.12]), exact));
    const apart = rotationVector(multiply(found, [-exact[0], -exact[1], -exact[2], exact[3]]));
    near(Math.hypot(...apart), 0, 1e-7);
    rotate(found, [1, 0, 0]).forEach((x) => near(Math.abs(x - Math.round(x)), 0, 1e-9));
  }
});

test("hand: the device comes to where it is wanted, and gives way to a force by the spring", () => {
  for (const stiffness of [10, 800, 1e5]) {
    const hand = new Hand(stiffness, stiffness * 0.05, 0, [0, 0, 0.05], 1e-3);
    const start = { p: [0, 0, 0], q: [0, 0, 0, 1] };
    hand.place(start);
    hand.want({ p: [0.01, 0, 0], q: rotationOf([0, 0, 0.2]) });
    let pose = start;
    for (let k = 0; k < 4000; ++k) pose = hand.advance([0, 0, 0], [0, 0, 0]);
    near(pose.p[0], 0.01, 1e-9);
    near(rotationVector(pose.q)[2], 0.2, 1e-9);
    // A wall as stiff as the scene, at 4 mm: neither swings.
    let largest = 0;
    for (let k = 0; k < 4000; ++k) {
      const x = gripOf(pose, [0, 0, 0.05])[0];
      const force = -stiffness * Math.max(0, x - 0.004);
      pose = hand.advance([force, 0, 0], [0, 0, 0]);
      if (k > 3900) largest = Math.max(largest, Math.abs(gripOf(pose, [0, 0, 0.05])[0] - x));
    }
    near(gripOf(pose, [0, 0, 0.05])[0], 0.004 + (hand.k * 0.006) / (hand.k + stiffness), 1e-9);
    near(largest, 0, 1e-12);
  }
});

test("hand: a damping of the scene that its own damper would not hold does not make it swing", () => {
  const [stiffness, period] = [800, 1e-3];
  for (const damping of [0, 4, 40]) {
    const hand = new Hand(stiffness, stiffness * 0.05, damping, [0, 0, 0.05], period);
    hand.place({ p: [0.01, 0, 0], q: [0, 0, 0, 1] });
    hand.want({ p: [0, 0, 0], q: [0, 0, 0, 1] });
    let pose = { p: [0.01, 0, 0], q: [0, 0, 0, 1] };
    let before = pose;
    for (let k = 0; k < 4000; ++k) {
      const speed = (pose.p[0] - before.p[0]) / period;
      before = pose;
      pose = hand.advance([-damping * speed, 0, 0], [0, 0, 0]);
    }
    near(pose.p[0], 0, 1e-6);
  }
});

test("shapes: pieces, obstacles and contacts are read as they are written", () => {
  const [piece] = piecesOf({
    counts: new Uint32Array([1, 4, 2, 7, 3, 0, 1, 2, kNone, 3, 0, 2, 3]),
    numbers: new Float64Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]),
  });
  assert.equal(piece.body, 1);
  assert.deepEqual(piece.faces.map((face) => face.source), [7, kNone]);
  assert.deepEqual(piece.faces[1].corners, [[0, 0, 0], [0, 1, 0], [0, 0, 1]]);
  assert.equal(trianglesOf(piece.faces).length, 2 * 9);

  const { obstacles, leftOut } = obstaclesOf({
    counts: new Uint32Array([1, 3, 5, 1, 2, 0, 2, 0, 44, 1, 3, 3, 0, 1, kNone, 4, 4]),
    numbers: new Float64Array(Array.from({ length: 21 }, (_, k) => k)),
  });
  assert.equal(leftOut, 3);
  assert.equal(obstacles[0].pair, 5);
  assert.equal(obstacles[0].faces[0].node, 44);
  assert.deepEqual(obstacles[0].faces.map((face) => face.hidden), [false, true]);
  assert.deepEqual(obstacles[0].faces[1].corners[3], [18, 19, 20]);

  const [contact] = contactsOf({
    counts: new Uint32Array([1, 1, 5, 2, 2, 0, 2, 3, 3, 0, 5, 5, 2, 1, 0, 3, 1, 4, kNone]),
    numbers: new Float64Array([0, 0, 1, 1, 2, 3, 4, 5, 6]),
  });
  assert.deepEqual(contact.ids, ["A:f3/v5", "C:e0-3/e4-*"]);
  assert.deepEqual(contact.polygon, [[1, 2, 3], [4, 5, 6]]);
  assert.deepEqual(contactsOf({ counts: new Uint32Array(), numbers: new Float64Array() }), []);
});

test("graph: read as written, those that hold in the middle, laid out the same way each time", () => {
  const answer = {
    counts: new Uint32Array([3, 1, 4, 3, 7, 44, 1, 2, 0, 2, 1, 12, 0, 1, 5, 0, 0, 60, 2, 3, 4, 0, 1, 61, 2, 3, 5, 0, 1, 0, 1, 0, 2, 2, 3]),
    numbers: new Float64Array([0, -0.001, -0.002, -0.003]),
  };
  const graph = graphOf(answer);
  assert.deepEqual([graph.pair, graph.body, graph.leftOut], [3, 1, 7]);
  assert.equal(nodeText(graph.nodes[0]), "44 B (v2, f0)");
  assert.equal(nodeText(graph.nodes[2]), "60 C (e3, e4)");
  assert.equal(graph.nodes[1].applies, false);
  assert.equal(graph.nodes[3].depth, -0.003);
  assert.deepEqual(graph.arcs, [[0, 1], [0, 2], [2, 3]]);
  const places = layoutOf(graph);
  assert.deepEqual(places, layoutOf(graphOf(answer)));
  assert.deepEqual(places[0].map(Math.abs), [0, 0]);
  for (let k = 1; k < 4; ++k) near(Math.hypot(...places[k]), 0.9);
  for (let k = 1; k < 4; ++k) for (let i = 1; i < k; ++i) assert.ok(Math.hypot(places[k][0] - places[i][0], places[k][1] - places[i][1]) > 0.5);
  assert.equal(graphOf({ counts: new Uint32Array(), numbers: new Float64Array() }), null);
  const marked = markedOf({ counts: new Uint32Array([1, 2, 0]), numbers: new Float64Array([1, 2, 3, 4, 5, 6, 7, 8, 9]) });
  assert.deepEqual(marked, { ofA: [[1, 2, 3]], ofB: [[4, 5, 6], [7, 8, 9]], face: [] });
});

test("shapes: dashes lie on their edges and leave gaps", () => {
  const square = { corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]] };
  const dashes = dashesOf([square], 0.05);
  assert.equal(dashes.length, 4 * 10 * 6);
  let length = 0;
  for (let k = 0; k < dashes.length; k += 6) length += Math.hypot(dashes[k + 3] - dashes[k], dashes[k + 4] - dashes[k + 1]);
  near(length, 4 * 0.55, 1e-5);
});

test("shapes: edges between coplanar faces are not drawn", () => {
  const square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];
  const triangles = [[0, 1, 2], [0, 2, 3]].map((loop) => ({ source: 0, corners: loop.map((k) => square[k]) }));
  assert.equal(surfaceOf(triangles).edges.length, 4 * 6);
  triangles[1].corners = [[0, 0, 0], [1, 1, 0], [0, 1, 1]];
  assert.equal(surfaceOf(triangles).edges.length, 5 * 6);
});

test("shapes: a surface of many triangles shares its corners where it is not sharp, and draws sharp edges alone", () => {
  const faces = [];
  const place = (i, k) => [Math.cos(i / 50), Math.sin(i / 50), k / 100];
  for (let i = 0; i < 100; ++i) {
    for (let k = 0; k < 80; ++k) {
      faces.push({ source: 0, corners: [place(i, k), place(i + 1, k), place(i + 1, k + 1)] });
      faces.push({ source: 0, corners: [place(i, k), place(i + 1, k + 1), place(i, k + 1)] });
    }
  }
  const surface = surfaceOf(faces);
  assert.equal(surface.triangles.length, 3 * 16000);
  assert.equal(surface.corners.length, 3 * 101 * 81);
  assert.equal(surface.edges.length, 6 * 2 * (100 + 80));  // its rim
  for (let k = 0; k < surface.corners.length; k += 3) {
    near(surface.normals[k], surface.corners[k], 0.02);
    near(Math.hypot(surface.normals[k], surface.normals[k + 1], surface.normals[k + 2]), 1, 1e-6);
  }
  // Of fewer triangles each has its own corners, and the light of its own plane.
  const few = surfaceOf(faces.slice(0, 100));
  assert.equal(few.corners.length, 3 * 3 * 100);
});

test("shapes: of a facet with two sides one is drawn, lit on both", () => {
  const corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
  const facet = surfaceOf([{ source: 0, corners }, { source: 0, corners: [...corners].reverse() }]);
  assert.equal(facet.triangles.length, 3);
  assert.deepEqual([...facet.sheets], [1, 1, 1]);
  assert.equal(facet.edges.length, 3 * 6);
  assert.deepEqual([...surfaceOf([{ source: 0, corners }]).sheets], [0, 0, 0]);
});

test("shapes: answers that differ by rounding alone are the same", () => {
  const answer = (count, number) => ({ counts: new Uint32Array([1, count]), numbers: new Float64Array([number, 2]) });
  assert.ok(sameAnswer(answer(3, 0.1), answer(3, 0.1 + 1e-12)));
  assert.ok(!sameAnswer(answer(3, 0.1), answer(3, 0.1 + 1e-6)));
  assert.ok(!sameAnswer(answer(3, 0.1), answer(4, 0.1)));
  assert.ok(!sameAnswer(answer(3, 0.1), { counts: new Uint32Array([1]), numbers: new Float64Array([0.1, 2]) }));
});

test("drawing: coarser where pictures are slow, finer again after a while, never beyond its limits", () => {
  const screen = new Fineness(false, 1.5);
  assert.deepEqual([screen.moving, screen.resting], [1.5, 1.5]);
  let now = 0;
  const draws = (count, time) => {
    for (let k = 0; k < count; ++k) screen.took(time, (now += time));
  };
  draws(100, 16);
  assert.equal(screen.moving, 1.5);
  draws(200, 60);
  assert.equal(screen.moving, kCoarsest);
  assert.equal(screen.resting, 1.5);
  draws(100, 30);
  assert.equal(screen.moving, kCoarsest, "neither slow nor quick");
  draws(20000, 10);
  assert.equal(screen.moving, 1.5);
  const processor = new Fineness(true, 1);
  assert.deepEqual([processor.moving, processor.resting], [1, 2]);
});

/** A recording of rows of words (bigint): stamp, position, orientation, hash, and six more where there are; with clock and feeling of
 *  driven parts at the end of each row where these were `given` poses. */
function recordingOf(rows, given) {
  const columns = rows[0].length - (given ? 2 : 0);
  const head = new DataView(new ArrayBuffer(16));
  new Uint8Array(head.buffer).set(new TextEncoder().encode("RTVIEW3\0"));
  head.setUint32(8, rows.length, true);
  head.setUint32(12, (columns > 15 ? 3 : columns > 9 ? 1 : 0) | (given ? 4 : 0), true);
  const parts = [new Uint8Array(head.buffer), columnsOf(rows, 8)];
  if (given) parts.push(new Uint8Array(new BigUint64Array([BigInt(given.length)]).buffer), columnsOf(given, -1));
  return new Uint8Array(Buffer.concat(parts));
}
/** Words of a pose that a driven part was given: tick, part, record. */
const givenWords = (tick, driven, number) => [
  BigInt(tick), BigInt(driven), BigInt(number), 7000n, ...[1, 2, 3, 0, 0, 0.6, 0.8, 0, 0].map((x) => wordOf(x)), 5n, 1n];
/** Rows of words as columns, as in a recording. */
function columnsOf(rows, plain) {
  const columns = rows[0].length;
  const bytes = new Uint8Array(8 * columns * rows.length);
  for (let column = 0; column < columns; ++column) {
    rows.forEach((row, k) => {
      const before = rows[k - 1]?.[column] ?? 0n, beforeThat = rows[k - 2]?.[column] ?? 0n;
      const difference = BigInt.asIntN(64, row[column] - 2n * before + beforeThat);
      const folded = difference < 0n ? -2n * difference - 1n : 2n * difference;
      const word = BigInt.asUintN(64, column === plain ? row[column] : folded);
      for (let byte = 0; byte < 8; ++byte)
        bytes[(8 * column + byte) * rows.length + k] = Number((word >> BigInt(8 * byte)) & 255n);
    });
  }
  return bytes;
}
const wordOf = (x) => new BigUint64Array(new Float64Array([x]).buffer)[0];

test("recording: every bit comes back; what is damaged is refused in words", () => {
  const rows = [0, 1, 2, 3, 4].map((k) => [
    BigInt(5000000 * (k + 1)), wordOf(0.1 * k), wordOf(-3 + k * k), wordOf(k % 2 ? -1e-300 : 1e300), wordOf(0), wordOf(-0),
    wordOf(0.6), wordOf(Math.cos(k)), 0xfedcba9876543210n + BigInt(k),
  ]);
  const bytes = recordingOf(rows);
  const recording = new Recording(bytes);
  assert.equal(recording.ticks, 5);
  for (let k = 0; k < 5; ++k) {
    assert.equal(recording.stampNs(k), rows[k][0]);
    assert.deepEqual(recording.place(k).map(wordOf), rows[k].slice(1, 4));
    assert.deepEqual(recording.orientation(k).map(wordOf), rows[k].slice(4, 8));
    assert.equal(recording.hash(k), rows[k][8]);
  }
  assert.equal(recording.hasAccepted, false);
  const longer = recordingOf(rows.map((row, k) => [...row, ...[1, 2, 3, 4, 5, 6].map((x) => wordOf(x * (k - 2)))]));
  assert.deepEqual(new Recording(longer).accepted(1), [-1, -2, -3, -4, -5, -6]);
  assert.equal(new Recording(longer).hash(4), 0xfedcba9876543214n);
  assert.deepEqual([recording.twist(1), recording.resets(1), recording.clutched(1)], [undefined, false, false]);
  const device = new Recording(recordingOf(rows.map((row, k) => [
    ...row, ...[1, 2, 3, 4, 5, 6].map((x) => wordOf(x * (k - 2))), ...[7, 8, 9, 10, 11, 12].map((x) => wordOf(x + k)), [2n, 3n, 6n, 10n, 14n][k]])));
  assert.deepEqual(device.accepted(0), [-2, -4, -6, -8, -10, -12]);
  assert.deepEqual([0, 1, 2, 3, 4].map((k) => device.resets(k)), [false, true, false, false, false]);
  assert.deepEqual([0, 1, 2, 3, 4].map((k) => device.clutched(k)), [false, false, false, true, true]);
  assert.deepEqual(device.twist(2), [9, 10, 11, 12, 13, 14]);
  assert.equal(device.twist(3), undefined);
  const driven = recordingOf(
    rows.map((row, k) => [...row, BigInt(2000 * k), k === 3 ? 0n : 1n]),
    [givenWords(1, 0, 4), givenWords(3, 0, 5), givenWords(3, 1, 1)],
  );
  const led = new Recording(driven);
  assert.deepEqual([recording.hasDriven, led.hasDriven, led.hash(4)], [false, true, rows[4][8]]);
  assert.deepEqual([led.drivenNs(2), led.feelsDriven(2), led.feelsDriven(3)], [4000n, true, false]);
  assert.deepEqual([0, 1, 2, 3].map((k) => led.given(k).map(({ driven, number }) => [driven, number])), [[], [[0n, 4n]], [], [[0n, 5n], [1n, 1n]]]);
  assert.deepEqual(led.given(1)[0], {
    driven: 0n, number: 4n, stamp_ns: 7000n, p_m: [1, 2, 3], q_xyzw: [0, 0, 0.6, 0.8], fastest_m_per_s: 0, fastest_rad_per_s: 0,
    late_ns: 5n, stands: 1n,
  });
  assert.throws(() => new Recording(driven.slice(0, -1)), DamagedPage);
  assert.throws(() => new Recording(longer.slice(0, -1)), DamagedPage);
  assert.throws(() => new Recording(bytes.slice(0, 50)), DamagedPage);
  assert.throws(() => new Recording(bytes.slice(0, 5)), DamagedPage);
  bytes[0] = 0;
  assert.throws(() => new Recording(bytes), DamagedPage);
  assert.throws(() => bytesOf("?"), DamagedPage);
  assert.deepEqual([...bytesOf("AQIDBA==")], [1, 2, 3, 4]);
});

test("parts of a page: zipped or not", async () => {
  const bytes = new Uint8Array([1, 2, 3, 4, 5]);
  assert.deepEqual(await unzipped(bytes), bytes);
  const zipped = new Uint8Array(gzipSync(bytes));
  assert.deepEqual(await unzipped(zipped), bytes);
  zipped[zipped.length - 6] ^= 1;
  await assert.rejects(unzipped(zipped));
});

test("words: flags, lengths and round numbers", () => {
  assert.deepEqual(flagTexts(0), []);
  assert.deepEqual(flagTexts((1 << 12) | (1 << 20)).map(([name]) => name), ["saturated", "behind"]);
  assert.ok(isMarked(1 << 16) && isMarked((1 << 20) | 1) && !isMarked(0) && !isMarked((1 << 17) | 0xff));
  assert.equal(lengthText(0.0123), "12.3 mm");
  assert.equal(lengthText(-1e-12), "0 µm");
  assert.equal(lengthText(2.5e-6), "2.50 µm");
  assert.equal(lengthText(NaN), "-");
  assert.equal(roundBelow(0.78), 0.5);
  near(roundBelow(25), 20);
});

/** As the core's module states it; here of some members. */
const kLiveLayout = {
  force_w_n: { offset: 0, type: "f64", count: 3 },
  state_hash: { offset: 24, type: "u64", count: 1 },
  situation: { offset: 32, type: "u32", count: 1 },
  is_over: { offset: 36, type: "u32", count: 1 },
};
const kStateBytes = 40;

/** A message of the live server with `count` ticks from `first` on; those in `resets` start again. `given`: words of poses. */
function chunkOf(first, count, written, resets = [], given = []) {
  const end = 32 + kStateBytes + 208 * count;
  const view = new DataView(new ArrayBuffer(end + 120 * given.length));
  view.setUint32(0, 0x33564c48, true);
  view.setUint32(4, count, true);
  view.setBigUint64(8, BigInt(first), true);
  view.setBigUint64(16, BigInt(written), true);
  view.setBigUint64(24, BigInt(given.length), true);
  given.forEach((words, k) => words.forEach((word, i) => view.setBigUint64(end + 120 * k + 8 * i, word, true)));
  view.setFloat64(32, 5, true);  // force along x
  view.setUint32(32 + 32, 3, true);  // situation
  for (let k = 0; k < count; ++k) {
    const at = 32 + kStateBytes + 208 * k;
    [1, 2, 3, 0, 0, 0, 1, 7].forEach((value, i) => view.setFloat64(at + 8 + 8 * i, value, true));
    view.setFloat64(at + 112 + 40, 9, true);  // turn about z
    view.setBigUint64(at + 160, BigInt(first + k), true);
    view.setBigUint64(at + 168, (resets.includes(first + k) ? 7n : 2n) | (given.length > 0 ? 48n : 0n), true);
    view.setBigUint64(at + 176, BigInt(1000 * k), true);
    view.setBigUint64(at + 184, BigInt(100 + k), true);
  }
  return view.buffer;
}

test("live: a message is read, one that is cut or foreign is not", () => {
  const chunk = new Chunk(chunkOf(4, 2, 9), kLiveLayout);
  assert.deepEqual([chunk.ticks, chunk.first, chunk.written], [2, 4, 9]);
  assert.deepEqual(chunk.state.force_w_n, [5, 0, 0]);
  assert.equal(chunk.state.situation, 3);
  assert.deepEqual(chunk.pose(1), { p: [1, 2, 3], q: [0, 0, 0, 1] });
  assert.deepEqual(chunk.accepted(0), [7, 0, 0, 0, 0, 0]);
  assert.equal(chunk.hash(1), 5n);
  assert.equal(chunk.resets(0), false);
  assert.deepEqual([chunk.sequence(1), chunk.twist(0), chunk.clutched(0)], [101n, undefined, false]);
  assert.deepEqual(new Chunk(chunkOf(4, 2, 9, [5]), kLiveLayout).twist(1), [0, 0, 0, 0, 0, 9]);
  assert.throws(() => new Chunk(chunkOf(4, 2, 9).slice(0, 400), kLiveLayout), /load the page again/);
  assert.throws(() => new Chunk(new ArrayBuffer(10), kLiveLayout), /load the page again/);
  assert.throws(() => new Chunk(new ArrayBuffer(72), kLiveLayout), /load the page again/);
  assert.deepEqual([chunk.driven(0), chunk.given(0)], [undefined, []]);
  const driven = new Chunk(chunkOf(4, 2, 9, [], [givenWords(5, 1, 3), givenWords(5, 0, 8)]), kLiveLayout);
  assert.deepEqual(driven.driven(1), { now_ns: 1000n, isFelt: true });
  assert.deepEqual([driven.given(0), driven.given(1).map(({ driven, number }) => [driven, number])], [[], [[1n, 3n], [0n, 8n]]]);
  assert.throws(() => new Chunk(chunkOf(4, 2, 9, [], [givenWords(5, 1, 3)]).slice(0, -8), kLiveLayout), /load the page again/);
  assert.equal(new DataView(askMessage(7)).getBigUint64(8, true), 7n);
  const hand = new DataView(handMessage({ p: [1, 2, 3], q: [0, 0, 0.6, 0.8] }, 99));
  assert.deepEqual([8, 24, 56, 64].map((at) => hand.getFloat64(at, true)), [1, 3, 0.8, 99]);
});

test("live: compared from the first tick on; a gap ends that until the next begin, and says why", () => {
  const account = new Account("");
  assert.equal(account.tick(0, true), Next.reset);
  account.compare(true);
  assert.equal(account.tick(1, false), Next.step);
  account.compare(true);
  assert.deepEqual([account.checked, account.differs, account.why], [2, -1, ""]);
  assert.equal(account.tick(5, false), Next.lost);
  account.compare(false);
  assert.match(account.why, /ticks 2 to 4 did not get here/);
  assert.deepEqual([account.checked, account.differs], [2, -1]);
  assert.equal(account.tick(6, true), Next.reset);
  assert.equal(account.why, "");
  account.compare(true);
  account.tick(7, false);
  account.compare(false);
  account.tick(8, false);
  account.compare(false);
  assert.deepEqual([account.checked, account.differs], [3, 7]);
  const held = new Account("a device");
  held.tick(0, true);
  assert.equal(held.why, "a device");
  held.compare(false);
  assert.deepEqual([held.checked, held.differs], [0, -1]);
});

test("live: who attaches late, or falls behind, goes to the newest tick; a begin on the way is taken", () => {
  const account = new Account("");
  const late = new Chunk(chunkOf(5000, 3, 70000), kLiveLayout);
  assert.ok(account.skips(late));
  assert.ok(!account.skips(new Chunk(chunkOf(69990, 3, 70000), kLiveLayout)));
  assert.ok(!account.skips(new Chunk(chunkOf(5000, 3, 70000, [5001]), kLiveLayout)));
  assert.ok(!account.skips(new Chunk(chunkOf(0, 3, 70000, [0]), kLiveLayout)));
  assert.equal(account.tick(70000, false), Next.lost);
  assert.match(account.why, /attached at tick 70000/);
  // Catching up with the last minute is no reason to skip; falling behind later is.
  const slow = new Account("");
  slow.tick(0, true);
  assert.equal(slow.ask(60000), 1);
  assert.equal(slow.ask(50), 1);
  assert.equal(slow.ask(1500), 1);
  assert.equal(slow.ask(5000), 4999);
});

test("delay: of the page's own moves, each once", () => {
  const meter = new DelayMeter();
  assert.equal(meter.text, "-");
  for (let k = 1; k <= 100; ++k) {
    meter.sent(1000 * k);
    meter.shown(1000 * k, 1000 * k + k);
    meter.shown(1000 * k, 1000 * k + 500);
    meter.shown(1000 * k + 1, 1000 * k + 500);
  }
  assert.equal(meter.count, 100);
  assert.equal(meter.quantile(0.5), 51);
  assert.equal(meter.text, "51 ms, p99 100 ms");
  // One that no picture has shown is left behind.
  meter.sent(1e6);
  meter.sent(1e6 + 1);
  meter.shown(1e6 + 1, 1e6 + 3);
  meter.shown(1e6, 1e6 + 9);
  assert.equal(meter.count, 101);
});

test("address: tick, pose and view go there and back; what makes no sense is left out", () => {
  const place = { tick: 6500, side: { azimuth: 0.5, elevation: -0.25 } };
  assert.deepEqual(placeOf(`#${placeText(place)}`), place);
  const pose = { p: [0.01, -0.02, 0.035], q: [0, 0, 0.6, 0.8] };
  assert.deepEqual(placeOf(placeText({ pose })), { pose });
  assert.deepEqual(placeOf(""), {});
  for (const text of ["#tick=-1", "#tick=1e3", "#tick=", "#pose=1,2,3", "#pose=0,0,0,0,0,0,2", "#pose=1e9,0,0,0,0,0,1", "#pose=,,,,,,",
    "#view=1", "#view=a,b", "#view=NaN,0", "#%", "#tick=99999999999"]) assert.deepEqual(placeOf(text), {}, text);
  near(placeOf("#view=0,9").side.elevation, 1.5);
});

test("pictures: counted over the last two seconds", () => {
  const meter = new FrameMeter();
  assert.equal(meter.rate(0), 0);
  for (let k = 0; k < 300; ++k) meter.drawn(20 * k);
  near(meter.rate(20 * 299), 50, 1e-9);
  assert.equal(meter.text(20 * 299), "50 a second");
  assert.equal(new FrameMeter().text(0), "-");
  assert.equal(meter.rate(20 * 299 + 5000), 0);
});
