// SPDX-License-Identifier: Apache-2.0
// Runs the core, a tick a millisecond, apart from the drawing: by hand; or over the recorded session, whose ticks are
// all computed once first and their state hashes compared; or along a live session, tick by tick as they come.
import { Core, drivenTick, SceneRefused } from "./core.mjs";
import { Hand } from "./hand";
import { Account, handMessage, LiveLink, Next, restartMessage } from "./live";
import type { Chunk } from "./live";
import type { DrivenPicture, FromWorker, LiveOrder, Mode, Picture, Pose, SceneFacts, ToWorker, Vec, Verdict } from "./messages";
import { DamagedPage, Recording } from "./recording";
import { isMarked } from "./words";

const kPicture_ms = 15;
/** the same, while a hand moves the part */
const kUrgent_ms = 7;
/** Ticks that may be made up for at once; the rest is lost and shows as pace below 1. */
const kMostLate = 60;
/** Ticks that take longer are not made up for: the picture comes first, and the pace says what was lost. */
const kTurn_ms = 20;
/** While ticks run, C-space and graph take one part of the time in so many: where many facets are near they take longer than
 * a picture, and the part is drawn meanwhile. */
const kSpaceShare = 6;
/** Over so long the pace is an average. */
const kPaceOver_ms = 1000;
const kCheckedAtOnce = 400;
const kMostObstacles = 8;
const kMostNodes = 20000;
const kMostGraphNodes = 64;
const kMostSavedBytes = 64 * 2 ** 20;

const post = (message: FromWorker) =>
  (self as unknown as { postMessage(message: FromWorker): void }).postMessage(message);

/** The near C-obstacles and their graph, in a picture. */
type Described = Pick<Picture, "obstacles" | "contacts" | "graph">;

/** A stamp of 0 is none: the clock of the driven parts begins there. */
const kTick_ns = 1_000_000n;
/** Numbers of the poses with which driven parts are made to stand are above those of any owner. */
const kStandsFrom = 1n << 62n;

/** Where device and part are. */
const kPlaces = ["goal_p_wa_m", "goal_q_wa_xyzw", "goal_grip_w_m", "proxy_p_wa_m", "proxy_q_wa_xyzw", "proxy_grip_w_m"];

/** What a device says of a tick in addition to where it is. */
interface DeviceWords {
  /** force and torque that acted since the tick before */
  accepted?: number[];
  twist?: number[];
  clutched?: boolean;
}

class Runner {
  private mode: Mode = "pause";
  private tick = 0;
  private hand: Hand;
  /** of a scene with two */
  private second: Hand | null = null;
  private device: Pose;
  private facts: SceneFacts;
  /** grip point of the part that is held at first, in its mesh frame */
  private readonly firstGrip: Vec;
  /** part that the hand is to hold once it has let go; -1: none */
  private wanted = -1;
  /** the next tick takes a part */
  private takes = false;
  /** clock of the driven parts */
  private drivenNs = kTick_ns;
  /** the hand has let go since all parts were where they start */
  private hasLetGo = false;
  private samples: number[] = [];
  private cut = true;
  private saved: { tick: number; state: ArrayBuffer }[] = [];
  private saveEvery = 500;
  private checked = 0;
  private differs = -1;
  private last = performance.now();
  private owed = 0;
  private pace = 1;
  private lastDescribed: Described | undefined;
  private describedAt = 0;
  private describedIn = 0;
  private pictured = 0;
  private dirty = true;
  /** the hand has moved: the tick that follows it is shown at once */
  private urgent = false;
  /** a picture is on its way: a page that draws slowly gets fewer, and none waits for another */
  private underWay = false;
  private selected: { pair: number; node: number } | null = null;
  private handAt = 0;
  private link: LiveLink | null = null;
  private account = new Account("");
  private said: Record<string, any> | null = null;
  private behind = 0;
  /** of the whole recording */
  private recordedVerdict: Verdict | null = null;

  constructor(
    private readonly core: Core,
    private readonly recording: Recording | null,
    private readonly live: LiveOrder | null,
  ) {
    const scene = core.read("scene") as Record<string, any>;
    this.firstGrip = scene.grip_a_m;
    this.device = { p: scene.start_p_wa_m, q: scene.start_q_wa_xyzw };
    this.hand = this.handAtDevice();
    this.facts = this.describe();
    if (this.facts.second) this.second = this.handFor(this.facts.second.grip);
    this.placeSecond();
    post({ kind: "loaded", scene: this.facts });
    if (recording) {
      this.check();
    } else if (live) {
      this.restart();
      this.follow(live);
      this.loop();
    } else {
      this.restart();
      this.setMode("hand");
      this.loop();
    }
  }

  /** For the stiffness of the part that is held. It leads the first part, and any other by that one's own grip point. */
  private handAtDevice(): Hand {
    const hand = this.handFor(this.firstGrip);
    hand.place(this.device);
    return hand;
  }

  private handFor(grip: Vec): Hand {
    const scene = this.core.read("scene") as Record<string, any>;
    const { kT, kR } = this.stiffness(scene);
    const damping = scene.law === 3 ? scene.damping_ns_per_m : 0;
    return new Hand(kT, kR, damping, grip, 1 / (scene.rate_hz || 1000));
  }

  /** The second hand is where it leads its part. */
  private placeSecond(): void {
    if (this.second) this.second.place(this.core.driven()[this.facts.second!.mover].commanded);
  }

  /** Before a tick: the second hand's device moves under what it feels, and leads its part. */
  private leadSecond(): void {
    if (!this.second) return;
    const { mover } = this.facts.second!;
    const { push_n, push_nm } = this.core.driven()[mover];
    const pose = this.second.advance(push_n as Vec, push_nm as Vec);
    this.core.give({
      driven: BigInt(mover),
      number: this.drivenNs,
      stamp_ns: this.drivenNs,
      p_m: pose.p,
      q_xyzw: pose.q,
      fastest_m_per_s: 0,
      fastest_rad_per_s: 0,
      late_ns: 0n,
      stands: 0n,
    });
  }

  private stiffness(scene: Record<string, any>): { kT: number; kR: number } {
    const kT = scene.law === 3 ? scene.k_t_n_per_m : scene.k_f_n_per_m;
    return { kT, kR: scene.k_r_nm_per_rad || kT * 0.01 };
  }

  /** The scene as it is shown now. */
  private describe(): SceneFacts {
    const { core } = this;
    const scene = core.read("scene") as Record<string, any>;
    const names = core.names();
    const parts = core.parts();
    const driven = core.driven();
    return {
      name: names.name,
      law: names.law,
      bodies: names.bodies,
      ...this.stiffness(scene),
      kF: scene.k_f_n_per_m,
      hand: { k: this.hand.k, kR: this.hand.kR },
      start: { p: scene.start_p_wa_m, q: scene.start_q_wa_xyzw },
      grip: scene.grip_a_m,
      workBudget: scene.work_units,
      workBound: scene.max_work_units,
      single: scene.scalar_bytes === 4,
      pairCount: scene.pair_count,
      pieceCount: scene.piece_count,
      situations: Array.from({ length: 7 }, (_, k) => core.situation(k)),
      pieces: core.describe("pieces"),
      parts: parts && { names: parts.names, mayBeHeld: parts.mayBeHeld, bodies: parts.bodies },
      driven:
        driven.length === 0
          ? null
          : {
              names: driven.map(({ name }) => name),
              pieces: core.describe("driven_pieces"),
              starts: driven.map(({ felt }) => felt),
            },
      second: scene.hands > 1 ? { grip: scene.second_grip_m, mover: driven.length - 1 } : null,
      recordedTicks: this.recording?.ticks ?? 0,
    };
  }

  /** Each part where it starts. */
  private putBack(): void {
    this.core.reset();
    this.drivenNs = kTick_ns;
    this.wanted = -1;
    this.takes = false;
    if (this.hasLetGo) this.tellParts();
    this.hasLetGo = false;
  }

  /** Another body is in the hand, or others have moved: tells the page where the parts are. */
  private tellParts(): void {
    this.hand = this.handAtDevice();
    this.facts = this.describe();
    this.selected = null;
    post({ kind: "held", scene: this.facts });
  }

  /** The hand lets go of what it holds, and then holds `part`; -1: nothing. */
  hold(part: number): void {
    if (!this.facts.parts || this.live) return;
    if (this.mode !== "hand") this.setMode("hand");
    this.hasLetGo = true;
    if (part < 0) this.core.release();
    this.wanted = part === this.core.parts()!.held ? -1 : part;
  }

  /** Before a tick: the hand goes to the part that it is to take, and takes it once it is empty. */
  private takeWanted(): void {
    if (this.wanted < 0) return;
    const place = this.core.hold(this.wanted);
    if (place === "waits") return;
    this.wanted = -1;
    if (place === "refused") return;
    this.hand.place(place);
    this.takes = true;
  }

  /** Nobody moves the driven parts from now on: they stand where they were led to. */
  private standDriven(): void {
    this.core.driven().forEach(({ commanded }, k) =>
      this.core.give({
        driven: BigInt(k),
        number: kStandsFrom + this.drivenNs,
        stamp_ns: this.drivenNs,
        p_m: commanded.p,
        q_xyzw: commanded.q,
        fastest_m_per_s: 0,
        fastest_rad_per_s: 0,
        late_ns: 0n,
        stands: 1n,
      }),
    );
  }

  /** One tick of the device at `pose`. */
  private step(pose: Pose, stamp: bigint, report: boolean, { accepted, twist, clutched }: DeviceWords = {}): void {
    this.core.write({
      ...(accepted ? { accepted_w: accepted } : {}),
      accepted_valid: accepted ? 1 : 0,
      ...(twist ? { twist_w: twist } : {}),
      twist_valid: twist ? 1 : 0,
      clutched: clutched ? 1 : 0,
      p_wa_m: pose.p,
      q_wa_xyzw: pose.q,
      stamp_ns: stamp,
      sequence: BigInt(this.tick),
      report_goal_contact: report ? 1 : 0,
    });
    this.core.step();
    this.device = pose;
    this.tick += 1;
  }

  private recordedStep(report: boolean): void {
    const tick = this.tick;
    const r = this.recording!;
    const accepted = r.hasAccepted ? r.accepted(tick) : undefined;
    const words = { accepted, twist: r.twist(tick), clutched: r.clutched(tick) };
    if (r.resets(tick)) this.core.reset();
    if (r.hasDriven) {
      for (const pose of r.given(tick)) this.core.give(pose);
      this.drivenNs = r.drivenNs(tick);
      this.core.follow(this.drivenNs, r.feelsDriven(tick));
    }
    this.step({ p: r.place(tick), q: r.orientation(tick) }, r.stampNs(tick), report, words);
    if (this.core.one("state_hash") !== r.hash(tick) && (this.differs < 0 || tick < this.differs)) {
      this.differs = tick;
      this.lamp();
    }
  }

  private sample(into: number[]): void {
    const length = (v: ArrayLike<number>) => Math.hypot(v[0], v[1], v[2]);
    const goal = this.core.list("goal_grip_w_m"), felt = this.core.list("proxy_grip_w_m");
    into.push(
      length(this.core.list("force_w_n")),
      length(this.core.list("torque_w_nm")),
      Math.hypot(goal[0] - felt[0], goal[1] - felt[1], goal[2] - felt[2]),
      this.core.one("situation") as number,
      (this.core.one("work_units") as number) / Math.max(1, this.facts.workBound),
      this.core.one("energy_j") as number,
      isMarked(this.core.one("flags") as number) ? 1 : 0,
    );
  }

  private lamp(): void {
    post({ kind: "lamp", checked: this.checked, total: this.recording!.ticks, differs: this.differs });
  }

  /** Computes each tick of a session elsewhere as it comes. */
  private follow(live: LiveOrder): void {
    this.mode = "live";
    this.core.beginVerdict();
    this.account = new Account(live.whyNotCompared);
    const lamp = () => {
      const { checked, differs, why } = this.account;
      const state = { isOpen: this.link?.isOpen ?? false, isOver: (this.said?.is_over ?? 0) !== 0, why };
      post({ kind: "lamp", checked, total: checked + this.behind, differs, live: state });
    };
    const take = (chunk: Chunk) => {
      const skips = this.account.skips(chunk);
      this.takeLive(chunk, skips);
      lamp();
      return skips ? chunk.written - 1 : this.account.ask(chunk.written);
    };
    this.link = new LiveLink(live.url, this.core.layout.live, () => this.account.expected, take, lamp);
  }

  private takeLive(chunk: Chunk, skips: boolean): void {
    this.said = chunk.state;
    this.urgent ||= this.said.hand_stamp !== this.handAt;
    this.handAt = this.said.hand_stamp;
    this.dirty = true;
    if (skips) return;
    for (let k = 0; k < chunk.ticks; ++k) {
      const next = this.account.tick(chunk.first + k, chunk.resets(k));
      if (next !== Next.step) {
        this.core.reset();
        this.samples = [];
        this.cut = true;
        // A part that is pressed onto another must have been outside before.
        if (next === Next.lost && this.said.knows_felt !== 0)
          this.step({ p: this.said.proxy_p_wa_m, q: this.said.proxy_q_wa_xyzw }, 0n, false);
      }
      for (const pose of chunk.given(k)) this.core.give(pose);
      const driven = chunk.driven(k);
      if (driven) this.core.follow(driven.now_ns, driven.isFelt);
      this.tick = Number(chunk.sequence(k));
      this.step(chunk.pose(k), chunk.stampNs(k), k === chunk.ticks - 1, {
        accepted: chunk.accepted(k),
        twist: chunk.twist(k),
        clutched: chunk.clutched(k),
      });
      this.account.compare(this.core.one("state_hash") === chunk.hash(k));
      this.sample(this.samples);
    }
    this.behind = Math.max(0, chunk.written - this.account.expected);
    this.showNewest(performance.now());
  }

  /** Computes the whole session, in portions, and keeps states to jump to. */
  private check(): void {
    const recording = this.recording!;
    const samples: number[] = [];
    const portion = () => {
      const end = Math.min(recording.ticks, this.checked + kCheckedAtOnce);
      while (this.checked < end) {
        this.keep();
        this.recordedStep(false);
        this.sample(samples);
        this.checked += 1;
      }
      this.lamp();
      if (this.checked < recording.ticks) {
        setTimeout(portion, 0);
        return;
      }
      this.recordedVerdict = this.core.verdict();
      post({ kind: "strips", samples: new Float32Array(samples) });
      this.seek(0);
      this.setMode("play");
      this.loop();
    };
    this.core.reset();
    this.core.beginVerdict();
    this.tick = 0;
    portion();
  }

  /** Not while the session is computed for the first time. */
  get takesOrders(): boolean {
    return !this.recording || this.checked === this.recording.ticks;
  }

  /** Saves the state before the present tick where one is due; of a large scene fewer. */
  private keep(): void {
    if (this.tick % this.saveEvery !== 0) return;
    this.saved.push({ tick: this.tick, state: this.core.save() });
    if (this.saved.length * this.saved[0].state.byteLength <= kMostSavedBytes) return;
    this.saved = this.saved.filter((_, k) => k % 2 === 0);
    this.saveEvery *= 2;
  }

  seek(tick: number): void {
    if (!this.recording || this.saved.length === 0) return;
    // A recording is of the part that is held at first, and its saved states are of that part's core.
    if (this.hasLetGo) this.putBack();
    const to = Math.max(0, Math.min(tick, this.recording.ticks - 1));
    const from = this.saved.filter((s) => s.tick <= to).at(-1)!;
    this.core.restore(from.state);
    this.tick = from.tick;
    while (this.tick <= to) this.recordedStep(this.tick === to);
    this.samples = [];
    this.cut = true;
    this.dirty = true;
  }

  restart(): void {
    if (this.link) {
      if (this.live!.takesHand) this.link.send(restartMessage());
      return;
    }
    if (this.recording && this.mode !== "hand") return this.seek(0);
    this.putBack();
    this.core.beginVerdict();
    this.tick = 0;
    this.step(this.facts.start, 0n, true);
    this.hand.place(this.device);
    this.placeSecond();
    this.samples = [];
    this.cut = true;
    this.dirty = true;
  }

  /** A basic contact whose features are shown; null: none. */
  select(selected: { pair: number; node: number } | null): void {
    this.selected = selected;
    this.dirty = true;
  }

  want(target: Pose, at: number, second: boolean): void {
    if (this.link) {
      if (this.live!.takesHand && !second) this.link.send(handMessage(target, at));
      return;
    }
    this.handAt = at;
    if (this.mode !== "hand") this.setMode("hand");
    (second && this.second ? this.second : this.hand).want(target);
    this.urgent = true;
    this.dirty = false;  // what was computed before is not what the hand made
    this.turn();
  }

  setMode(mode: Mode): void {
    if (this.live) return;
    if (mode === "play" && !this.recording) mode = "hand";
    if (mode === "hand" && this.mode !== "hand") {
      this.hand.place(this.device);
      this.placeSecond();
      this.core.beginVerdict();
      this.standDriven();
      this.cut = true;
      this.samples = [];
    }
    if (mode === "play" && (this.mode === "hand" || this.tick >= this.recording!.ticks)) this.seek(0);
    this.mode = mode;
    this.last = performance.now();
    this.owed = 0;
    this.dirty = true;
  }

  private runs(): boolean {
    return this.mode === "hand" || this.mode === "play";
  }

  private loop(): void {
    this.turn();
    setTimeout(() => this.loop(), 4);
  }

  /** The ticks that are due, and a picture where it is time for one. */
  private turn(): void {
    const now = performance.now();
    const passed = now - this.last;
    this.last = now;
    if (this.runs()) {
      this.owed += passed;
      const asked = Math.floor(this.owed);
      const due = Math.min(asked, kMostLate);
      this.owed -= asked;
      let made = 0;
      for (let isLast = false; made < due && !isLast && this.runs(); ++made) {
        isLast = made === due - 1 || performance.now() - now > kTurn_ms;
        this.advance(isLast);
      }
      if (asked > 0) this.pace += Math.min(1, asked / kPaceOver_ms) * (made / asked - this.pace);
    }
    this.showNewest(now);
  }

  /** C-obstacles, contacts and graph: of now, or where they take long of a moment ago. */
  private described(): Described {
    const begin = performance.now();
    const isRecent = begin - this.describedAt < (kSpaceShare - 1) * this.describedIn;
    if (this.lastDescribed && isRecent && this.runs() && !this.cut) return this.lastDescribed;
    this.lastDescribed = {
      obstacles: this.core.describe("obstacles", kMostObstacles, kMostNodes),
      contacts: this.core.describe("contacts"),
      graph: this.core.describe("graph", kMostGraphNodes),
    };
    this.describedAt = performance.now();
    this.describedIn = this.describedAt - begin;
    return this.lastDescribed;
  }

  private showNewest(now: number): void {
    if (!this.dirty || this.underWay) return;
    if (now - this.pictured < (this.urgent ? kUrgent_ms : kPicture_ms)) return;
    this.underWay = true;
    this.picture();
    this.pictured = now;
    this.dirty = this.urgent = false;
  }

  /** The page has the picture. */
  taken(): void {
    this.underWay = false;
    this.showNewest(performance.now());
  }

  private advance(report: boolean): void {
    if (this.mode === "play") {
      if (this.tick >= this.recording!.ticks) {
        this.mode = "pause";
        this.dirty = true;
        return;
      }
      this.recordedStep(report || this.tick + 1 === this.recording!.ticks);
    } else {
      this.takeWanted();
      // The hand feels the contact and what leads it.
      const sum = (contact: string, guide: string) => {
        const led = this.core.list(guide);
        return [...this.core.list(contact)].map((x, k) => x + led[k]) as Vec;
      };
      const pose = this.hand.advance(
        sum("force_w_n", "guide_force_w_n"),
        sum("torque_w_nm", "guide_torque_w_nm"),
      );
      this.drivenNs += kTick_ns;
      this.leadSecond();
      this.core.follow(this.drivenNs, true);
      this.step(pose, BigInt(this.tick) * kTick_ns, report);
      this.sample(this.samples);
      if (this.takes) this.tellParts();
      this.takes = false;
    }
    this.dirty = true;
  }

  /** Of the core here; a live session of which not all is known has no guide to show. */
  private guideOf(result: Record<string, any>): Picture["guide"] {
    if (result.guide_state === 0 || (this.said && this.account.why)) return null;
    return {
      force: result.guide_force_w_n,
      torque: result.guide_torque_w_nm,
      place: this.core.guide(),
      toGo: result.guide_to_go_m,
    };
  }

  /** Of the core here, or, where not all is known of a live session, in that one's words. */
  private drivenNow(): DrivenPicture[] {
    const here = this.core.driven();
    if (!this.said || !this.account.why) return here;
    const known = Math.min(here.length, Number(this.said.driven_count));
    return here.slice(0, known).map((_, k) => drivenTick(this.said!.driven, k));
  }

  private picture(): void {
    const result = this.core.read("result") as Record<string, any>;
    // What is not computed from all that the session's core was given is shown in that core's own words.
    if (this.said && this.account.why) {
      const { force_w_n, torque_w_nm, situation, flags, status, nodes_evaluated } = this.said;
      Object.assign(result, { force_w_n, torque_w_nm, situation, flags, status, work_units: nodes_evaluated });
      // A part that others push is where that core has it, too.
      if (this.facts.driven) for (const name of kPlaces) result[name] = this.said[name];
    }
    const samples = new Float32Array(this.samples);
    this.samples = [];
    post({
      kind: "picture",
      mode: this.mode,
      tick: this.tick,
      time: this.tick / 1000,
      device: { p: result.goal_p_wa_m, q: result.goal_q_wa_xyzw },
      felt: { p: result.proxy_p_wa_m, q: result.proxy_q_wa_xyzw },
      deviceGrip: result.goal_grip_w_m,
      feltGrip: result.proxy_grip_w_m,
      force: result.force_w_n,
      torque: result.torque_w_nm,
      guide: this.guideOf(result),
      gap: result.proxy_gap_m,
      dNear: result.d_near_m,
      energy: result.energy_j,
      situation: result.situation,
      flags: result.flags,
      status: result.status,
      work: result.work_units,
      verdict: this.recordedVerdict && this.mode !== "hand" ? this.recordedVerdict : this.core.verdict(),
      feltPlanes: result.felt_planes,
      driven: this.drivenNow(),
      ...this.described(),
      marked: this.selected
        ? this.core.describe("marked", this.selected.pair, this.selected.node)
        : { numbers: new Float64Array(), counts: new Uint32Array() },
      held: this.facts.parts ? this.core.parts()!.held : -1,
      pace: this.pace,
      handAt: this.handAt,
      behind: this.behind,
      samples,
      cut: this.cut,
    });
    this.cut = false;
  }
}

let runner: Runner | undefined;

async function load(message: ToWorker & { kind: "load" }): Promise<void> {
  try {
    const core = await Core.load(message.module);
    core.open(message.scene);
    runner = new Runner(core, message.recording ? new Recording(message.recording) : null, message.live);
  } catch (error) {
    if (error instanceof SceneRefused) {
      post({ kind: "refused", text: `The core refuses the scene in this page: ${error.message}.` });
    } else if (error instanceof DamagedPage) {
      post({ kind: "refused", text: `This page cannot be shown: ${error.message}.` });
    } else {
      post({ kind: "refused", text: `The core could not be started in this browser: ${String(error)}` });
    }
  }
}

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if (message.kind === "load") void load(message);
  if (!runner?.takesOrders) return;
  if (message.kind === "hand") runner.want(message.target, message.at, message.second ?? false);
  if (message.kind === "mode") runner.setMode(message.mode);
  if (message.kind === "seek") runner.seek(message.tick);
  if (message.kind === "select") runner.select(message.selected);
  if (message.kind === "restart") runner.restart();
  if (message.kind === "hold") runner.hold(message.part);
  if (message.kind === "taken") runner.taken();
};
