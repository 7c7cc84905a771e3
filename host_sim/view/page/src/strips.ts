// SPDX-License-Identifier: Apache-2.0
// Force, torque and distance over time: the newest seconds by hand, or the whole recorded session with its place.
import uPlot from "uplot";
import type { Colours } from "./colours";
import { Channel, kChannels } from "./messages";
import { Pyramid } from "./pyramid";

const kShown_s = 12;
const kKept_s = 60;
const kPoints = 700;
const kRedraw_ms = 80;

interface Strip {
  title: string;
  unit: string;
  series: { channel: Channel; label: string; colour: (c: Colours) => string; scale: number; dash?: number[] }[];
}

const kStrips: Strip[] = [
  { title: "force", unit: "N", series: [{ channel: Channel.force, label: "force", colour: (c) => c.force, scale: 1 }] },
  {
    title: "torque",
    unit: "N m",
    series: [{ channel: Channel.torque, label: "torque", colour: (c) => c.torque, scale: 1 }],
  },
  {
    title: "distance",
    unit: "mm",
    series: [{ channel: Channel.apart, label: "device to part", colour: (c) => c.contact, scale: 1e3 }],
  },
];

export class Strips {
  private plots: uPlot[] = [];
  private live = new Pyramid(kChannels, kKept_s * 1000);
  private recorded: Pyramid | null = null;
  private showsRecorded = false;
  private cursor = 0;
  private stale = false;
  private drawn = 0;
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
      const plot = new uPlot(
        {
          width: Math.max(120, box.clientWidth),
          height: Math.max(60, box.clientHeight),
          padding: [6, 8, 0, 0],
          legend: { show: false },
          cursor: { show: false },
          scales: { x: { time: false }, y: { range: (_, low, high) => [Math.min(0, low ?? 0), Math.max(0.01, (high ?? 0) * 1.08)] } },
          axes: [
            { ...axis, size: 22, values: (_, ticks) => ticks.map((t) => `${+t.toFixed(3)} s`) },
            { ...axis, size: 46, label: undefined },
          ],
          series: [
            {},
            ...strip.series.flatMap((s) => [
              { stroke: s.colour(this.colours), width: 1.4, points: { show: false } },
              { stroke: s.colour(this.colours), width: 1.4, points: { show: false } },
            ]),
          ],
          bands: strip.series.map((s, k) => ({ series: [2 * k + 1, 2 * k + 2] as [number, number], fill: `${s.colour(this.colours)}66` })),
          hooks: { draw: [(u) => this.drawCursor(u)] },
        },
        [[], ...strip.series.flatMap(() => [[], []])] as unknown as uPlot.AlignedData,
        box,
      );
      const title = document.createElement("div");
      title.className = "strip-title";
      title.textContent = `${strip.title === "distance" ? "device to part" : strip.title} [${strip.unit}]`;
      box.append(title);
      plot.over.addEventListener("click", (event) => {
        if (this.showsRecorded) this.onSeek(Math.round(plot.posToVal(event.offsetX, "x") * 1000));
      });
      return plot;
    });
    this.draw();
  }

  resize(): void {
    for (const plot of this.plots) {
      const box = plot.root.parentElement!;
      plot.setSize({ width: Math.max(120, box.clientWidth), height: Math.max(60, box.clientHeight) });
    }
  }

  setRecorded(samples: Float32Array): void {
    this.recorded = new Pyramid(kChannels, samples.length / kChannels);
    this.recorded.push(samples);
    this.draw();
  }

  /** `time`: of the newest picture [s]. */
  update(byHand: boolean, samples: Float32Array, cut: boolean, time: number): void {
    if (cut && byHand) this.live.clear();
    if (byHand) this.live.push(samples);
    this.showsRecorded = !byHand && this.recorded !== null;
    this.cursor = time;
    this.stale = true;
  }

  /** Draws what is new, not more often than an eye follows. */
  render(now: number): void {
    if (!this.stale || now - this.drawn < kRedraw_ms) return;
    this.draw();
    this.drawn = now;
    this.stale = false;
  }

  private drawCursor(u: uPlot): void {
    if (!this.showsRecorded) return;
    const x = u.valToPos(this.cursor, "x", true);
    u.ctx.save();
    u.ctx.strokeStyle = this.colours.ink;
    u.ctx.lineWidth = 2 * (window.devicePixelRatio || 1);
    u.ctx.beginPath();
    u.ctx.moveTo(x, u.bbox.top);
    u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
    u.ctx.stroke();
    u.ctx.restore();
  }

  private draw(): void {
    const source = this.showsRecorded ? this.recorded! : this.live;
    const begin = this.showsRecorded ? 0 : source.end - kShown_s * 1000;
    kStrips.forEach((strip, k) => {
      const columns: Float64Array[] = [];
      strip.series.forEach(({ channel, scale }) => {
        const part = source.range(channel, begin, source.end, kPoints);
        if (columns.length === 0) columns.push(part.index.map((i) => i / 1000));
        columns.push(part.largest.map((v) => v * scale), part.least.map((v) => v * scale));
      });
      this.plots[k]?.setData(columns as unknown as uPlot.AlignedData);
    });
  }
}
