// SPDX-License-Identifier: Apache-2.0
// The page: starts the worker that runs the core, and shows its newest picture.
import workerSource from "worker-source";
import { kDark, kLight } from "./colours";
import type { Colours } from "./colours";
import { CSpacePane } from "./cspace_pane";
import { DelayMeter, FrameMeter } from "./delay";
import { Devices } from "./devices";
import { Fineness, isDrawnByProcessor, kStill_ms } from "./fineness";
import { GraphPane } from "./graph_pane";
import { Hands } from "./inputs/hands";
import type { LiveFacts } from "./live";
import type { FromWorker, Lamp, LiveOrder, Mode, Picture, Pose, SceneFacts, ToWorker } from "./messages";
import { PhysicalPane } from "./physical_pane";
import { placeOf, placeText } from "./place";
import { bytesOf, DamagedPage, unzipped } from "./recording";
import { savePicture } from "./saved_picture";
import { contactsOf } from "./shapes";
import type { Side } from "./stage";
import { Strips } from "./strips";
import { drivenText, flagTexts, isBound, lawText, lengthText, numberText, situationText } from "./words";

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

/** Without a scene there is nothing to show but the sentence. */
function refuse(text: string): void {
  trouble(text);
  document.body.dataset.state = "refused";
}

function trouble(text: string): void {
  const box = element("trouble");
  box.textContent = text;
  box.hidden = false;
}

window.addEventListener("error", (event) => trouble(`This page has met a fault of its own: ${event.message}`));
window.addEventListener("unhandledrejection", (event) => trouble(`This page has met a fault of its own: ${String(event.reason)}`));

/** The text of an embedded part; empty where the page was made without it. */
function part(id: string): string {
  const text = element(id)?.textContent?.trim() ?? "";
  return text;
}

/** The bytes of an embedded part, unzipped. `name`: what is damaged where they are. */
async function unpacked(id: string, name: string): Promise<Uint8Array> {
  try {
    return await unzipped(bytesOf(part(id)));
  } catch {
    throw new DamagedPage(`the ${name} in this file is damaged; make the page again`);
  }
}

/** How to follow the session that the page was made for; null: there is none. */
function liveOrder(): LiveOrder | null {
  const text = part("haptic-live");
  if (text === "") return null;
  const facts = JSON.parse(text) as LiveFacts;
  return { ...facts, url: `ws://${location.host}/${location.search}` };
}

/** Ticks that a live page may lag without saying so. */
const kCatchingUp = 200;

/** A picture that takes longer is followed by a pause: the core and the rest of the machine need time, too. */
const kFrame_ms = 34;
/** Words and graph change no more often than an eye follows. */
const kWords_ms = 90;
/** Pictures that are being drawn at the same time; nobody waits longer for word that one is done. */
const kMostDrawn = 2;
const kMostWait_ms = 250;
/** A pointer that moves less before it goes up has clicked [pixels]. */
const kClick_px = 4;
/** Moves of a mouse may come more often than the core has ticks. */
const kHand_ms = 3;

/** Whether two pictures look alike in both spaces. */
function sameView(a: Picture, b: Picture): boolean {
  const alike = (u: number[], v: number[], within: number) => u.every((x, k) => Math.abs(x - v[k]) < within);
  const samePose = (u: Pose, v: Pose) => alike(u.p, v.p, kSame_m) && alike(u.q, v.q, kSame);
  return (
    samePose(a.felt, b.felt) &&
    samePose(a.device, b.device) &&
    alike(a.force, b.force, kSame_n) &&
    alike(a.torque, b.torque, kSame_n) &&
    alike(a.guide?.force ?? kNoForce, b.guide?.force ?? kNoForce, kSame_n) &&
    a.feltPlanes === b.feltPlanes &&
    a.driven.length === b.driven.length &&
    a.driven.every((one, k) => samePose(one.felt, b.driven[k].felt) && samePose(one.commanded, b.driven[k].commanded)) &&
    a.situation === b.situation &&
    a.obstacles.counts.length === b.obstacles.counts.length &&
    a.contacts.counts.length === b.contacts.counts.length &&
    a.marked.counts.join() === b.marked.counts.join() &&
    a.marked.numbers[0] === b.marked.numbers[0]
  );
}
/** The hand holds the part for so long after its last move. */
const kHeld_ms = 1000;
const kSame_m = 1e-9, kSame = 1e-9, kSame_n = 1e-6;
const kNoForce = [0, 0, 0];
const kByProcessor = isDrawnByProcessor();

class Page {
  private readonly worker: Worker;
  private readonly side: Side = { azimuth: 0.5, elevation: 0.42 };
  private colours: Colours = kLight;
  private physical: PhysicalPane | null = null;
  private cspace: CSpacePane | null = null;
  private readonly strips: Strips;
  private readonly graph = new GraphPane(element("graph"));
  private hands: Hands | null = null;
  private devices: Devices | null = null;
  private scene: SceneFacts | null = null;
  private picture: Picture | null = null;
  private lamp: Lamp | null = null;
  private readonly live = liveOrder();
  private readonly delay = new DelayMeter();
  private readonly frames = new FrameMeter();
  /** what was put into the address here */
  private ownAddress = "";
  /** when the hand was last moved here */
  private movedAt = -Infinity;
  /** drawn last */
  private viewed: Picture | null = null;
  private fresh = false;
  private looked = true;
  /** by hand */
  private wanted: (ToWorker | null)[] = [null, null];
  private sentAt = -Infinity;
  private last = performance.now();
  private readonly fineness = new Fineness(kByProcessor, window.devicePixelRatio || 1);
  /** the spaces are drawn as finely as they ever are */
  private isFine = false;
  /** when something moved last */
  private changedAt = 0;
  /** when the drawing of the last picture began; 0: the next may begin */
  private drawing = 0;
  private notBefore = 0;
  /** words and graph are not those of the newest picture, and when they were */
  private areWordsOld = false;
  private wordsAt = -Infinity;

  constructor() {
    const url = URL.createObjectURL(new Blob([workerSource], { type: "text/javascript" }));
    this.worker = new Worker(url);
    this.worker.onmessage = (event: MessageEvent<FromWorker>) => this.take(event.data);
    this.worker.onerror = (event) => trouble(`The core has stopped: ${event.message}. Load the page again.`);
    this.setTheme(window.matchMedia("(prefers-color-scheme: dark)").matches);
    this.strips = new Strips(element("strips"), this.colours);
    this.graph.onSelect = (selected) => this.send({ kind: "select", selected });
    this.strips.onSeek = (tick) => this.send({ kind: "seek", tick });
    try {
      this.physical = new PhysicalPane(element("physical"), element("physical-overlay"), this.colours, !kByProcessor);
      this.cspace = new CSpacePane(element("cspace"), element("cspace-overlay"), this.colours, !kByProcessor);
    } catch {
      this.physical = this.cspace = null;
      trouble("This browser offers no WebGL, so the two spaces are not drawn; words and strips work. Switch on hardware acceleration, or try another browser.");
    }
    this.bind();
    const watch = new ResizeObserver(() => this.resize());
    for (const id of ["physical", "cspace", "strips", "graph"]) watch.observe(element(id));
    this.resize();
    requestAnimationFrame(() => this.frame());
  }

  async load(): Promise<void> {
    const recording = part("haptic-recording") === "" ? null : await unpacked("haptic-recording", "recording");
    const scene = await unpacked("haptic-scene", "scene");
    const module = (await unpacked("haptic-module", "core")).buffer as ArrayBuffer;
    this.send({ kind: "load", module, scene, recording, live: this.live });
  }

  private send(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  /** At once, so that the core's answer is there when the next picture is drawn. */
  private sendHand(now: number): void {
    if (now - this.sentAt < kHand_ms) return;
    for (const wanted of this.wanted) {
      if (wanted?.kind !== "hand") continue;
      this.delay.sent(wanted.at);
      this.send(wanted);
      this.sentAt = now;
    }
    this.wanted = [null, null];
  }

  private take(message: FromWorker): void {
    if (message.kind === "refused") refuse(message.text);
    if (message.kind === "loaded") this.start(message.scene);
    if (message.kind === "held") this.showParts(message.scene);
    if (message.kind === "strips") {
      this.strips.setRecorded(message.samples);
      this.goToAddress();
    }
    if (message.kind === "lamp") {
      this.lamp = message;
      this.showLamp();
    }
    if (message.kind === "picture") {
      this.strips.update(this.byHand(message.mode), message.samples, message.cut, message.time);
      this.picture = message;
      this.fresh = true;
      this.send({ kind: "taken" });
    }
  }

  /** Whether the strips are those of the hand. Held, they stay what they were. */
  private byHand(mode: Mode): boolean {
    return mode === "hand" || !this.scene?.recordedTicks;
  }

  private start(scene: SceneFacts): void {
    this.scene = scene;
    document.title = `${scene.name}: physical space and C-space`;
    element("name").textContent = scene.name;
    this.graph.load(scene.bodies);
    this.physical?.load(scene);
    const radius = this.physical?.partRadius ?? 0.05;
    if (this.physical && this.cspace) {
      this.cspace.partRadius = radius;
      element("arrow-scale").textContent = this.physical.scaleText;
    }
    // A session elsewhere has its own second hand.
    const hasSecond = scene.second !== null && this.live === null;
    this.hands = new Hands(scene, this.side, radius, hasSecond, (hand, target, at) => {
      if (!this.takesHand) return;
      this.movedAt = performance.now();
      this.wanted[hand] = { kind: "hand", target, at, second: hand === 1 };
      this.sendHand(this.movedAt);
    });
    element("two-hands").hidden = !hasSecond;
    this.devices = new Devices(this.hands, this.physical, this.side, {
      takesHand: this.takesHand,
      turn: () => this.turn(performance.now()),
      drawsAgain: () => this.resize(),
    });
    element<HTMLButtonElement>("restart").disabled = element<HTMLButtonElement>("upright").disabled = !this.takesHand;
    this.bindParts(scene);
    this.bindPairs(scene);
    for (const one of document.querySelectorAll<HTMLElement>(".of-driven")) one.hidden = scene.driven === null;
    const time = element<HTMLInputElement>("time");
    time.max = String(Math.max(0, scene.recordedTicks - 1));
    time.disabled = element<HTMLButtonElement>("play").disabled = scene.recordedTicks === 0;
    this.looked = true;
    document.body.dataset.state = "loaded";
    // A recording is computed first.
    if (scene.recordedTicks === 0) this.goToAddress();
  }

  /** Where others move: whose C-obstacles are drawn. Those of movers are told behind the bodies. */
  private bindPairs(scene: SceneFacts): void {
    const names = scene.driven?.names ?? [];
    element("cspace-pair").hidden = names.length === 0;
    const list = element<HTMLSelectElement>("cspace-of");
    list.replaceChildren(
      new Option("all that is near", "all"),
      new Option("what stands", "standing"),
      ...names.map((name, k) => new Option(name, String(k))),
    );
    list.onchange = () => {
      const { value } = list;
      // Another part in the hand may stand among other bodies.
      const count = () => this.scene?.bodies.length ?? 0;
      const of = { all: null, standing: (body: number) => body < count() }[value];
      this.cspace?.drawOnly(of === undefined ? (body) => body === count() + Number(value) : of);
      this.looked = this.areWordsOld = true;
    };
  }

  /** Another part is in the hand. */
  private showParts(scene: SceneFacts): void {
    this.scene = scene;
    this.graph.load(scene.bodies);
    this.physical?.load(scene);
    if (this.physical && this.cspace) this.cspace.partRadius = this.physical.partRadius;
    this.hands?.hold(scene, this.physical?.partRadius ?? 0.05);
    if (this.physical) element("arrow-scale").textContent = this.physical.scaleText;
    this.viewed = null;
    this.looked = true;
  }

  /** The hand holds this part of the scene; -1: it lets go. */
  private hold(part: number): void {
    if (!this.takesHand || this.live) return;
    this.hands?.forget();
    this.send({ kind: "hold", part });
  }

  /** The part after the one that is held, of those that may be. */
  private holdNext(): void {
    const parts = this.scene?.parts;
    if (!parts) return;
    const count = parts.names.length;
    for (let k = 1; k <= count; ++k) {
      const part = (parts.bodies[0] + k) % count;
      if (parts.mayBeHeld[part]) return this.hold(part);
    }
  }

  private bindParts(scene: SceneFacts): void {
    const { parts } = scene;
    const mayHold = parts?.mayBeHeld.some((may) => may) ?? false;
    element("parts").hidden = !mayHold || !this.takesHand || this.live !== null;
    if (!parts) return;
    const list = element<HTMLSelectElement>("hold");
    const option = (text: string, value: number) => {
      const one = document.createElement("option");
      one.textContent = text;
      one.value = String(value);
      return one;
    };
    const held = parts.names.map((name, k) => ({ name, k })).filter(({ k }) => parts.mayBeHeld[k]);
    list.replaceChildren(option("nothing", -1), ...held.map(({ name, k }) => option(name, k)));
    list.onchange = () => {
      this.hold(Number(list.value));
      list.blur();  // the keys are the hand's
    };
    element("release").onclick = () => this.hold(-1);
  }

  /** Shows what the address of the page says: a view, and a tick or a pose of the hand. */
  private goToAddress(): void {
    const { tick, pose, side } = placeOf(location.hash);
    if (side) Object.assign(this.side, side);
    this.looked = true;
    if (pose && this.takesHand) {
      this.hands?.forget();
      this.send({ kind: "hand", target: pose, at: performance.now() });
    } else if (tick !== undefined && this.scene?.recordedTicks) {
      this.seek(tick);
    }
  }

  /** Puts what is shown into the address. */
  private writeAddress(): void {
    if (!this.picture) return;
    const { mode, tick, device } = this.picture;
    const place = this.byHand(mode) ? { pose: device } : { tick: Math.max(0, tick - 1) };
    this.ownAddress = `#${placeText({ ...place, side: this.side })}`;
    location.hash = this.ownAddress;
  }

  private seek(tick: number): void {
    this.send({ kind: "mode", mode: "pause" });
    this.send({ kind: "seek", tick });
  }

  private savePicture(): void {
    const { picture, scene, physical, cspace } = this;
    if (!picture || !scene || !physical || !cspace || this.devices?.isInRoom) return;
    this.drawFinely();
    const situation = situationText(scene.situations[picture.situation] ?? "none");
    const force = Math.hypot(...picture.force);
    const words = `${scene.name}, tick ${picture.tick}: ${situation}, ${numberText(force)} N; ${element("arrow-scale").textContent}`;
    savePicture([physical.canvas, cspace.canvas], words, this.colours, `${scene.name}_${picture.tick}.png`);
  }

  /** Whether a hand here moves the part. A session of a device is only watched. */
  private get takesHand(): boolean {
    return this.live === null || this.live.takesHand;
  }

  private setTheme(dark: boolean): void {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    this.colours = dark ? kDark : kLight;
    const root = document.documentElement.style;
    this.colours.kinds.forEach((colour, k) => root.setProperty(`--kind${k}`, colour));
    root.setProperty("--contact", this.colours.contact);
    this.physical?.paint(this.colours);
    this.cspace?.paint(this.colours);
    this.strips?.paint(this.colours);
    for (const mark of document.querySelectorAll<HTMLElement>("[data-colour]")) {
      const name = mark.dataset.colour!;
      const colour = name.startsWith("kinds")
        ? this.colours.kinds[Number(name.slice(5))]
        : (this.colours[name as keyof Colours] as string);
      if (mark.classList.contains("hollow")) mark.style.borderColor = colour;
      else mark.style.background = colour;
    }
    this.looked = true;
  }

  private setFineness(ratio: number): void {
    this.physical?.resize(ratio);
    this.cspace?.resize(ratio);
    this.isFine = ratio === this.fineness.resting;
  }

  private drawFinely(): void {
    if (this.devices?.isInRoom) return;
    this.setFineness(this.fineness.resting);
    this.physical?.render(this.side);
    this.cspace?.render(this.side);
  }

  private resize(): void {
    this.setFineness(this.fineness.moving);
    this.strips.resize();
    this.graph.resize();
    this.looked = true;
  }

  private restart(): void {
    this.hands?.forget();
    this.send({ kind: "restart" });
  }

  private togglePlay(): void {
    this.hands?.forget();
    const mode = this.picture?.mode;
    this.send({ kind: "mode", mode: mode === "play" ? "pause" : "play" });
  }

  private toggleCut(): void {
    for (const pane of [this.physical, this.cspace]) if (pane) pane.cutOpen = !pane.cutOpen;
    element("cut").setAttribute("aria-pressed", String(this.physical?.cutOpen ?? false));
    this.looked = true;
  }

  private turnView(right: number, up: number): void {
    this.side.azimuth -= right;
    this.side.elevation = Math.max(-1.5, Math.min(1.5, this.side.elevation + up));
    this.looked = true;
  }

  private zoom(factor: number, pane?: PhysicalPane | CSpacePane): void {
    for (const one of pane ? [pane] : [this.physical, this.cspace]) {
      if (one) one.halfHeight = Math.max(1e-4, Math.min(10, one.halfHeight * factor));
    }
    this.looked = true;
  }

  private bind(): void {
    element("play").onclick = () => this.togglePlay();
    element("restart").onclick = () => this.restart();
    element("upright").onclick = () => this.hands?.makeUpright();
    element("cut").onclick = () => this.toggleCut();
    element("theme").onclick = () => this.setTheme(document.documentElement.dataset.theme !== "dark");
    const help = element<HTMLDialogElement>("help-text");
    element("help").onclick = () => help.showModal();
    element<HTMLInputElement>("time").oninput = (event) => this.seek(Number((event.target as HTMLInputElement).value));
    element("picture").onclick = () => this.savePicture();
    element("link").onclick = () => this.writeAddress();
    window.addEventListener("hashchange", () => {
      if (location.hash !== this.ownAddress) this.goToAddress();
    });
    const devices = element<HTMLDialogElement>("devices");
    element("show-devices").onclick = () => devices.showModal();
    const keys: Record<string, () => void> = {
      Space: () => this.togglePlay(),
      Home: () => this.restart(),
      KeyU: () => this.hands?.makeUpright(),
      KeyH: () => this.holdNext(),
      KeyG: () => this.hold(-1),
      KeyC: () => this.toggleCut(),
      KeyP: () => this.savePicture(),
      KeyL: () => this.writeAddress(),
      KeyT: () => this.setTheme(document.documentElement.dataset.theme !== "dark"),
    };
    const signs: Record<string, () => void> = {
      "[": () => this.turnView(-0.1, 0),
      "]": () => this.turnView(0.1, 0),
      "{": () => this.turnView(0, -0.1),
      "}": () => this.turnView(0, 0.1),
      "+": () => this.zoom(0.9),
      "-": () => this.zoom(1 / 0.9),
      "?": () => help.showModal(),
    };
    window.addEventListener("keydown", (event) => {
      const own = event.target instanceof HTMLElement && event.target.closest("input, button, dialog");
      if (help.open || devices.open || event.ctrlKey || event.metaKey || event.altKey) return;
      if (own && (event.code === "Space" || event.code.startsWith("Arrow") || event.code === "Home")) return;
      const act = signs[event.key] ?? keys[event.code];
      if (act) act();
      else if (!this.hands?.key(event, true)) return;
      event.preventDefault();
    });
    window.addEventListener("keyup", (event) => this.hands?.key(event, false));
    window.addEventListener("blur", () => this.hands?.keys.rest());
    if (this.physical) this.bindPane(this.physical);
    if (this.cspace) this.bindPane(this.cspace);
  }

  private bindPane(pane: PhysicalPane | CSpacePane): void {
    const { canvas } = pane;
    let moves = false;
    let x = 0, y = 0;
    /** part under the pointer when it went down; -1: none, or it has been dragged since */
    let clicked = -1;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus();
      x = event.clientX;
      y = event.clientY;
      moves = this.takesHand && event.button === 0 && pane instanceof PhysicalPane && pane.hitsPart(event.offsetX, event.offsetY);
      clicked = !moves && event.button === 0 && pane instanceof PhysicalPane ? this.partAt(pane, event) : -1;
    });
    canvas.addEventListener("pointerup", () => {
      if (clicked >= 0) this.hold(clicked);
      clicked = -1;
    });
    // Where the browser has it, a move is known before the next picture is due.
    canvas.addEventListener("onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove", (raw) => {
      const event = raw as PointerEvent;
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      const right = event.clientX - x, down = event.clientY - y;
      if (right === 0 && down === 0) return;
      if (clicked >= 0 && Math.hypot(right, down) < kClick_px) return;
      clicked = -1;
      x = event.clientX;
      y = event.clientY;
      if (moves) {
        const metres = pane.metresPerPixel;
        this.hands?.drag(right * metres, -down * metres, event.shiftKey, event.ctrlKey, event.timeStamp);
      } else {
        this.turnView(right * 0.008, down * 0.008);
      }
    });
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.zoom(Math.exp(event.deltaY * 0.0012), pane);
      },
      { passive: false },
    );
  }

  /** Number of the part that lies under a point and may be held; -1: there is none. */
  private partAt(pane: PhysicalPane, event: PointerEvent): number {
    const parts = this.scene?.parts;
    if (!parts || this.live) return -1;
    const body = pane.bodyAt(event.offsetX, event.offsetY);
    const part = body < 0 ? -1 : parts.bodies[body];
    return part >= 0 && parts.mayBeHeld[part] ? part : -1;
  }

  private frame(): void {
    this.turn(performance.now());
    requestAnimationFrame(() => this.frame());
  }

  /** What is due: moves of the hands go to the core, and the newest picture is drawn. */
  private turn(now: number): void {
    const passed = Math.min(0.1, (now - this.last) / 1000);
    this.hands?.advance(passed, now);
    this.devices?.turn(now);
    this.last = now;
    this.sendHand(now);
    this.finish(now);
    if (this.picture && this.scene && this.drawing === 0 && now >= this.notBefore) {
      if (this.fresh || this.looked) this.show(this.picture, now);
      else if (!this.isFine && now - this.changedAt > kStill_ms) this.drawFinely();
    }
    if (this.areWordsOld && now - this.wordsAt > kWords_ms) {
      this.wordsAt = now;
      this.areWordsOld = false;
      if (this.viewed && this.scene) this.showWords(this.viewed, this.scene);
    } else {
      this.strips.render(now);
    }
  }

  /** Sees whether the next picture may begin: while two are being drawn none does, so that none waits in a queue. */
  private finish(now: number): void {
    if (this.drawing === 0) return;
    const time = now - this.drawing;
    const busy = Math.max(this.physical?.busy ?? 0, this.cspace?.busy ?? 0);
    if (busy >= kMostDrawn && time < kMostWait_ms) return;
    this.drawing = 0;
    this.fineness.took(time, now);
    this.notBefore = now + 0.5 * Math.max(0, time - kFrame_ms);
  }

  private show(picture: Picture, now: number): void {
    if (this.fresh) {
      // A live session may be moved by others too: a hand here takes the part up where it then is.
      const byHand = picture.mode === "hand" || (picture.mode === "live" && performance.now() - this.movedAt < kHeld_ms);
      this.hands?.show(picture, byHand, now);
      if (!this.viewed || !sameView(picture, this.viewed)) {
        this.physical?.show(picture);
        this.cspace?.show(picture);
        this.looked = true;
      }
      this.viewed = picture;
      this.areWordsOld = true;
    }
    // In a room the headset asks for its pictures itself.
    if (this.looked && !this.devices?.isInRoom) {
      this.changedAt = now;
      this.setFineness(this.fineness.moving);
      this.physical?.render(this.side);
      this.cspace?.render(this.side);
      this.drawing = now;
    }
    this.delay.shown(picture.handAt, performance.now());
    this.frames.drawn(now);
    this.fresh = false;
    this.looked = this.cspace?.isMoving ?? false;
  }

  private showLamp(): void {
    const box = element("lamp");
    const { lamp } = this;
    const set = (state: string, text: string) => {
      box.dataset.state = state;
      if (box.textContent !== text) box.textContent = text;
    };
    if (lamp?.live) {
      const { isOpen, isOver, why } = lamp.live;
      const end = isOver ? "the session is over: " : "live: ";
      if (lamp.differs >= 0) set("red", `tick ${lamp.differs} differs from the one that ran`);
      else if (!isOpen && !isOver) set("grey", "the connection to the session is lost; trying again");
      else if (why) set("grey", `${end}not compared: ${why}${this.takesHand ? "; green after the next restart" : ""}`);
      else if (lamp.checked === 0) set("busy", "live: no tick yet");
      else if (lamp.total - lamp.checked > kCatchingUp) set("busy", `live: ${lamp.checked} of ${lamp.total} ticks compared`);
      else set("green", `${end}all ${lamp.checked} ticks equal, bit for bit`);
    } else if (this.live) {
      set("busy", "connecting");
    } else if (!lamp) {
      set("none", this.scene && !this.scene.recordedTicks ? "by hand: no recording to compare with" : "starting");
    } else if (lamp.differs >= 0) {
      set("red", `tick ${lamp.differs} differs from the recorded one`);
    } else if (lamp.checked < lamp.total) {
      set("busy", `${lamp.checked} of ${lamp.total} ticks compared`);
    } else if (this.picture?.mode === "hand") {
      set("none", "by hand: not the recording");
    } else {
      set("green", `all ${lamp.total} ticks equal, bit for bit`);
    }
  }

  /** All that is said of a picture. */
  private showWords(picture: Picture, scene: SceneFacts): void {
    this.areWordsOld = !this.graph.show(picture.graph, performance.now());
    this.showLamp();
    document.body.dataset.tick = String(picture.tick);
    if (this.physical) document.body.dataset.millimetresPerPixel = String(this.physical.metresPerPixel * 1e3);
    const set = (id: string, text: string) => {
      const box = element(id);
      if (box.textContent !== text) box.textContent = text;
    };
    if (scene.parts) {
      element<HTMLSelectElement>("hold").value = String(picture.held);
      element<HTMLButtonElement>("release").disabled = picture.held < 0;
      document.body.dataset.held = picture.held < 0 ? "" : scene.parts.names[picture.held];
    }
    const situation = scene.situations[picture.situation] ?? "none";
    set("situation", picture.status === 0 ? situationText(situation) : "the pose was refused");
    element("situation").dataset.situation = situation;
    const { guide } = picture;
    element("guide").hidden = element("guide-key").hidden = guide === null;
    if (guide) {
      set("guide", `guide: ${guide.place}`);
      set("guide-key-force", `force that leads along the plan: ${numberText(Math.hypot(...guide.force))} N, ${lengthText(guide.toGo)} to go`);
    }
    const size = (v: number[]) => Math.hypot(v[0], v[1], v[2]);
    const vectorText = (v: number[], scale: number, digits: number) => v.map((x) => (x * scale).toFixed(digits)).join("  ");
    const apart = Math.hypot(...picture.deviceGrip.map((x, k) => x - picture.feltGrip[k]));
    const facts: [string, string, string?][] = [
      ["force", `${numberText(size(picture.force))} N`],
      ["x, y, z", `${vectorText(picture.force, 1, 2)} N`],
      ["torque", `${numberText(size(picture.torque))} N m`],
      ["x, y, z", `${vectorText(picture.torque, 1, 2)} N m`],
      ["device to part", lengthText(apart)],
      ["D_near of device", `${isBound(picture.flags) ? "at least " : ""}${lengthText(picture.dNear)}`],
      ["gap of the part", lengthText(picture.gap)],
      ["part at", `${vectorText(picture.felt.p, 1e3, 2)} mm`, "felt-position"],
      ["planes that hold", String(picture.feltPlanes)],
      ["work of the tick", scene.workBound > 0 ? `${picture.work} units, ${((100 * picture.work) / scene.workBound).toFixed(1)} % of its bound` : String(picture.work)],
      ["work budget", scene.workBudget > 0 ? `${scene.workBudget} units: then a tick begins nothing more` : "-"],
      ["tick", String(picture.tick)],
      ["pace", this.live ? `${picture.behind} ticks behind` : `${(100 * picture.pace).toFixed(0)} % of real time`],
      ["input to picture", this.delay.text, "delay"],
      ["pictures", picture.mode === "pause" ? "-" : this.frames.text(performance.now()), "frames"],
      ["stiffness", `${numberText(scene.kT)} N/m`],
      ["in rotation", `${numberText(scene.kR)} N m/rad`],
      ["spring of the hand", `${numberText(scene.hand.k)} N/m`],
      ["law", ""],
      ["wide", lawText(scene.law)],
    ];
    const list = element("facts");
    if (list.childElementCount === 0) {
      for (const [name, , id] of facts) {
        if (name !== "wide") {
          const term = document.createElement("dt");
          term.textContent = name;
          list.append(term);
        }
        const value = document.createElement("dd");
        if (name === "wide") value.className = "wide";
        if (id) value.id = id;
        list.append(value);
      }
    }
    const values = list.querySelectorAll("dd");
    facts.forEach(([, text], k) => {
      if (values[k].textContent !== text) values[k].textContent = text;
    });
    const flags = flagTexts(picture.flags);
    const text = flags.map(([name, meaning]) => `${name}: ${meaning}`);
    const box = element("flags");
    if (box.dataset.shown !== text.join("|")) {
      box.dataset.shown = text.join("|");
      box.replaceChildren(
        ...(text.length > 0 ? text : ["none"]).map((line) => {
          const item = document.createElement("li");
          item.textContent = line;
          return item;
        }),
      );
    }
    set("verdict", picture.verdict.text);
    element("verdict").dataset.failed = String(picture.verdict.failed);
    if (scene.driven) {
      const { names } = scene.driven;
      set("driven", picture.driven.map((one, k) => drivenText(names[k], one)).join("\n") || "not known");
      document.body.dataset.driven = picture.driven.map(({ felt }) => felt.p.map((x) => (x * 1e3).toFixed(3)).join(" ")).join(";");
    }
    const contacts = contactsOf(picture.contacts);
    const lines = contacts.map(
      (c) => `${scene.bodies[c.body]}, ${situationText(scene.situations[c.situation])}\n  ${c.ids.slice(0, 12).join(" ")}${c.ids.length > 12 ? " .." : ""}`,
    );
    set("contacts", lines.join("\n") || "none");
    const count = this.cspace?.obstacleCount ?? 0;
    const note = [count === 1 ? "1 C-obstacle" : `${count} C-obstacles`];
    if (this.cspace?.leftOut) note.push(`${this.cspace.leftOut} more are not drawn`);
    set("cspace-note", note.join("; "));
    const clock = this.live ? (this.live.takesHand ? "live" : "live, view only") : scene.recordedTicks && picture.mode !== "hand" ? `${(Math.max(0, picture.tick - 1) / 1000).toFixed(3)} s` : "by hand";
    set("clock", clock);
    set("play", picture.mode === "play" ? "Hold" : "Play");
    if (picture.mode !== "hand" && scene.recordedTicks) element<HTMLInputElement>("time").value = String(Math.max(0, picture.tick - 1));
    document.body.dataset.mode = picture.mode;
  }
}

async function begin(): Promise<void> {
  try {
    await new Page().load();
  } catch (error) {
    if (!(error instanceof DamagedPage)) throw error;
    refuse(`This page cannot be shown: ${error.message}.`);
  }
}
void begin();
