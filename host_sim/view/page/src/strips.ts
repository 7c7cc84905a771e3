// SPDX-License-Identifier: Apache-2.0
// Force, torque, distance, situation, work and energy over time: the newest seconds by hand, or the whole recorded session
// with its place. What the core has flagged is marked at the top of each.
import uPlot from "uplot";
import type { Colours } from "./colours";
import { Channel, kChannels } from "./messages";
import { Pyramid } from "./pyramid";

const kShown_s = 12;
const kKept_s = 60;
const kPoints = 700;
/** A strip is drawn no more often than an eye follows, and one at a time. */
const kRedraw_ms = 110;

/** On the axis, by situation. */
const kSituations = ["free", "A", "B", "C", "edge", "face", "several"];

interface Strip {
  title: string;
  channel: Channel;
  colour: (c: Colours) => string;
  scale: number;
  /** words of the axis, by value */
  names?: string[];
  /** least of the axis' upper end */
  least: number;
}

const kStrips: Strip[] = [
  { title: "force [N]", channel: Channel.force, colour: (c) => c.force, scale: 1, least: 0.01 },
  { title: "torque [N m]", channel: Channel.torque, colour: (c) => c.torque, scale: 1, least: 0.001 },
  { title: "device to part [mm]", channel: Channel.apart, colour: (c) => c.contact, scale: 1e3, least: 0.01 },
  { title: "situation", channel: Channel.situation, colour: (c) => c.feltEdge, scale: 1, names: kSituations, least: 6 },
  { title: "work [% of its bound]", channel: Channel.work, colour: (c) => c.kinds[2], scale: 100, least: 1 },
  { title: "energy [mJ]", channel: Channel.energy, colour: (c) => c.device, scale: 1e3, least: 0.01 },
];
/** Height of a mark, at the top of each strip. */
const kMark_px = 5;

export class Strips {
  private plots: uPlot[] = [];
  private live = new Pyramid(kChannels, kKept_s * 1000);
  private recorded: Pyramid | null = null;
  private showsRecorded = false;
  /** of the newest picture, and where the cursors stand; NaN: unknown [s] */
  private time = 0;
  private cursorAt = NaN;
  /** from and to [s] of what the core has flagged */
  private marks: [number, number][] = [];
  /** by strip: what it shows is not the newest, and when it was drawn */
  private stale = kStrips.map(() => true);
  private drawn = kStrips.map(() => -Infinity);
  /** by strip: where the recording is held */
  private cursors: HTMLElement[] = [];
  /** called with a tick where a strip of the recording is clicked */
  onSeek: (tick: number) => void = () => {};

  constructor(
    private readonly place: HTMLElement,
    private colours: Colours,
  ) {
    this.build();
  }

  paint(colours: Colours): void {
    this.colours = colours;
    this.build();
  }

  private build(): void {
    for (const plot of this.plots) plot.destroy();
    this.place.replaceChildren();
    this.plots = kStrips.map((strip) => {
      const box = document.createElement("div");
      box.className = "strip";
      this.place.append(box);
      const axis = { stroke: this.colours.ink, grid: { stroke: this.colours.grid, width: 1 }, ticks: { show: false } };
      const colour = strip.colour(this.colours);
      const words = strip.names
        ? { splits: () => strip.names!.map((_, k) => k), values: (_: uPlot, at: number[]) => at.map((k) => strip.names![k]), font: "10px sans-serif" }
        : { space: 22 };
      const plot = new uPlot(
        {
          width: Math.max(120, box.clientWidth),
          height: Math.max(50, box.clientHeight),
          padding: [6, 8, 0, 0],
          legend: { show: false },
          cursor: { show: false },
          scales: {
            x: { time: false },
            y: { range: (_, low, high) => [Math.min(0, low ?? 0), Math.max(strip.least, (high ?? 0) * 1.08)] },
          },
          axes: [
            { ...axis, size: 20, values: (_, ticks) => ticks.map((t) => `${+t.toFixed(3)} s`) },
            { ...axis, ...words, size: 46, label: undefined },
          ],
          series: [
            {},
            { stroke: colour, width: 1.4, points: { show: false } },
            { stroke: colour, width: 1.4, points: { show: false } },
          ],
          bands: [{ series: [1, 2], fill: `${colour}66` }],
          hooks: { draw: [(u) => this.drawOver(u)] },
        },
        [[], [], []] as unknown as uPlot.AlignedData,
        box,
      );
      const title = document.createElement("div");
      title.className = "strip-title";
      title.textContent = strip.title;
      box.append(title);
      plot.over.addEventListener("click", (event) => {
        if (this.showsRecorded) this.onSeek(Math.round(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x") * 1000));
      });
      return plot;
    });
    this.cursors = this.plots.map((plot) => {
      const cursor = document.createElement("div");
      cursor.className = "strip-cursor";
      plot.over.append(cursor);
      return cursor;
    });
    // Only now each has the room that it keeps.
    this.resize();
    this.forget();
  }

  /** All is to be drawn again. */
  private forget(): void {
    this.stale.fill(true);
    this.drawn.fill(-Infinity);
  }

  resize(): void {
    for (const plot of this.plots) {
      const box = plot.root.parentElement!;
      plot.setSize({ width: Math.max(120, box.clientWidth), height: Math.max(50, box.clientHeight) });
    }
    this.cursorAt = NaN;
  }

  setRecorded(samples: Float32Array): void {
    this.recorded = new Pyramid(kChannels, samples.length / kChannels);
    this.recorded.push(samples);
    this.forget();
  }

  /** `time`: of the newest picture [s]. */
  update(byHand: boolean, samples: Float32Array, cut: boolean, time: number): void {
    if (cut && byHand) this.live.clear();
    if (byHand) this.live.push(samples);
    const showsRecorded = !byHand && this.recorded !== null;
    // All of a recording is there, and does not change.
    if (!showsRecorded || !this.showsRecorded) this.stale.fill(true);
    this.showsRecorded = showsRecorded;
    this.time = time;
  }

  /** Draws the strip that has waited longest, so that no picture has to wait for all of them. */
  render(now: number): void {
    // Those that are new are drawn at once.
    const isNew = (_: number, k: number) => this.stale[k] && this.drawn[k] === -Infinity;
    const due = this.drawn.map((_, k) => k).filter(isNew);
    if (due.length === 0) {
      const oldest = this.drawn.reduce((k, drawn, i) => (this.stale[i] && (k < 0 || drawn < this.drawn[k]) ? i : k), -1);
      if (oldest >= 0 && now - this.drawn[oldest] >= kRedraw_ms) due.push(oldest);
    }
    for (const k of due) {
      this.draw(k);
      this.stale[k] = false;
      this.drawn[k] = now;
    }
    this.placeCursors();
  }

  private placeCursors(): void {
    const at = this.showsRecorded ? this.time : -1;
    if (at === this.cursorAt) return;
    this.cursorAt = at;
    this.cursors.forEach((cursor, k) => {
      cursor.hidden = at < 0;
      if (at >= 0) cursor.style.transform = `translateX(${this.plots[k].valToPos(at, "x").toFixed(1)}px)`;
    });
  }

  /** The marks of what the core has flagged. */
  private drawOver(u: uPlot): void {
    const ratio = window.devicePixelRatio || 1;
    this.cursorAt = NaN;
    u.ctx.save();
    u.ctx.fillStyle = this.colours.contact;
    for (const [from, to] of this.marks) {
      const x = u.valToPos(from, "x", true);
      u.ctx.fillRect(x, u.bbox.top, Math.max(2 * ratio, u.valToPos(to, "x", true) - x), kMark_px * ratio);
    }
    u.ctx.restore();
  }

  private draw(k: number): void {
    const source = this.showsRecorded ? this.recorded! : this.live;
    const begin = this.showsRecorded ? 0 : source.end - kShown_s * 1000;
    const marked = source.range(Channel.marked, begin, source.end, kPoints);
    this.marks = [];
    marked.index.forEach((index, i) => {
      if (marked.largest[i] === 0) return;
      const end = (marked.index[i + 1] ?? index + 1) / 1000;
      const last = this.marks[this.marks.length - 1];
      if (last && last[1] >= index / 1000) last[1] = end;
      else this.marks.push([index / 1000, end]);
    });
    const strip = kStrips[k];
    const part = source.range(strip.channel, begin, source.end, kPoints);
    const scaled = (values: ArrayLike<number>) => Float64Array.from(values, (v) => v * strip.scale);
    this.plots[k].setData([part.index.map((i) => i / 1000), scaled(part.largest), scaled(part.least)] as unknown as uPlot.AlignedData);
  }
}
