// SPDX-License-Identifier: Apache-2.0
// Six-axis devices (SpaceMouse) by WebHID: which bits of a report are an axis is read from the device's HID report
// descriptor, not from a list of products.
import type { Vec } from "./messages";

/** What of WebHID is used here; browsers without it have none of this. */
export interface HidItem {
  isConstant?: boolean;
  isRange?: boolean;
  usages?: number[];
  usageMinimum?: number;
  usageMaximum?: number;
  reportSize: number;
  reportCount: number;
  logicalMinimum: number;
  logicalMaximum: number;
}
export interface HidCollection {
  usagePage: number;
  usage: number;
  inputReports?: { reportId: number; items: HidItem[] }[];
}
export interface HidDevice {
  productName: string;
  opened: boolean;
  collections: HidCollection[];
  open(): Promise<void>;
  addEventListener(kind: "inputreport", take: (event: { reportId: number; data: DataView }) => void): void;
}
export interface Hid {
  getDevices(): Promise<HidDevice[]>;
  requestDevice(options: { filters: { usagePage: number; usage: number }[] }): Promise<HidDevice[]>;
  addEventListener(kind: "disconnect", gone: (event: { device: HidDevice }) => void): void;
}

/** Generic desktop page, multi-axis controller. */
export const kMultiAxis = { usagePage: 0x01, usage: 0x08 };
/** X, Y, Z, Rx, Ry, Rz of the generic desktop page. */
const kFirstAxis = 0x10030;
const kAxes = 6;
const kDeadZone = 0.05;

interface Field {
  axis: number;
  bit: number;
  bits: number;
  least: number;
  most: number;
}

/** The usage of element `k` of an item; those beyond a list repeat its last. */
function usageOf(item: HidItem, k: number): number {
  if (item.isRange) return Math.min((item.usageMinimum ?? 0) + k, item.usageMaximum ?? 0);
  const usages = item.usages ?? [];
  return usages[Math.min(k, usages.length - 1)] ?? 0;
}

/** An integer of `bits` bits from bit `bit` on, the lowest first; signed where the range begins below zero. */
function integerAt(data: DataView, { bit, bits, least }: Field): number {
  let value = 0;
  for (let k = 0; k < bits; ++k) {
    const at = bit + k;
    value += ((data.getUint8(at >> 3) >> (at & 7)) & 1) * 2 ** k;
  }
  return least < 0 && value >= 2 ** (bits - 1) ? value - 2 ** bits : value;
}

/** The newest of the six axes, each from -1 to 1, as the device counts them: x right, y towards the operator, z down. */
export class SixAxes {
  readonly axes = new Array<number>(kAxes).fill(0);
  private readonly reports = new Map<number, { fields: Field[]; bytes: number }>();

  constructor(collections: HidCollection[]) {
    for (const collection of collections) {
      for (const { reportId, items } of collection.inputReports ?? []) {
        let bit = 0;
        const fields: Field[] = [];
        for (const item of items) {
          for (let k = 0; k < item.reportCount; ++k, bit += item.reportSize) {
            const axis = usageOf(item, k) - kFirstAxis;
            const isAxis = !item.isConstant && axis >= 0 && axis < kAxes && item.reportSize <= 32;
            const { logicalMinimum: least, logicalMaximum: most, reportSize: bits } = item;
            if (isAxis && most > least) fields.push({ axis, bit, bits, least, most });
          }
        }
        if (fields.length > 0) this.reports.set(reportId, { fields, bytes: Math.ceil(bit / 8) });
      }
    }
  }

  /** Whether the descriptor has all six axes. */
  get isComplete(): boolean {
    const known = new Set([...this.reports.values()].flatMap(({ fields }) => fields.map(({ axis }) => axis)));
    return known.size === kAxes;
  }

  /** `data`: of a report without its number. One of another length, or unknown, changes nothing. */
  take(reportId: number, data: DataView): void {
    const report = this.reports.get(reportId);
    if (!report || data.byteLength < report.bytes) return;
    for (const field of report.fields) {
      const middle = (field.least + field.most) / 2;
      const share = (integerAt(data, field) - middle) / (field.most - middle);
      this.axes[field.axis] = Math.max(-1, Math.min(1, share));
    }
  }

  /** The cap is let go, or the device is gone. */
  release(): void {
    this.axes.fill(0);
  }

  /** Push and turn of the cap along right, up and away of the operator, each from -1 to 1 beyond a dead zone. */
  get cap(): { push: Vec; turn: Vec } {
    const [x, y, z, rx, ry, rz] = this.axes.map((value) =>
      Math.abs(value) < kDeadZone ? 0 : (value - Math.sign(value) * kDeadZone) / (1 - kDeadZone),
    );
    return { push: [x, -z, -y], turn: [rx, -rz, -ry] };
  }
}

/** Asks the browser for a device, which asks the user. @returns its axes and name; null: none was chosen. */
export async function openSpaceMouse(hid: Hid): Promise<{ name: string; axes: SixAxes } | null> {
  const [device] = await hid.requestDevice({ filters: [kMultiAxis] });
  if (!device) return null;
  if (!device.opened) await device.open();
  const axes = new SixAxes(device.collections);
  device.addEventListener("inputreport", ({ reportId, data }) => axes.take(reportId, data));
  hid.addEventListener("disconnect", (event) => {
    if (event.device === device) axes.release();
  });
  return { name: device.productName, axes };
}
