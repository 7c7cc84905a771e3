// SPDX-License-Identifier: Apache-2.0
// The 3Dconnexion six-axis devices and their reports, as hal/drivers/spacemouse_codec.hpp has them; the page's own tests compare both.
// Facts: spacenavd's dev.c and dev_usb_freebsd.c (GPL-3; facts only). WebHID gives a report without its number.
//   1  three signed 16-bit displacements X Y Z, the low byte first; on newer devices six: X Y Z RX RY RZ
//   2  RX RY RZ, on devices that send three
//   3  buttons, one bit each
//   23 charge of the battery in percent

/** What of WebHID is used here; browsers without it have none of this. */
export interface HidItem {
  isConstant?: boolean;
  isRange?: boolean;
  usages?: number[];
  usageMinimum?: number;
  usageMaximum?: number;
  reportCount: number;
  logicalMinimum: number;
  logicalMaximum: number;
}
export interface HidCollection {
  usagePage: number;
  usage: number;
  inputReports?: { reportId: number; items: HidItem[] }[];
  children?: HidCollection[];
}

export const k3DconnexionId = 0x256f;
export const kLogitechId = 0x046d;
/** Generic desktop page, multi-axis controller. */
export const kMultiAxis = { usagePage: 0x01, usage: 0x08 };

/** How the device's own axes become right, away and up: "current" models report right, towards, down; "older" ones right, up, away. */
export type Axes = "current" | "older";
export interface Model {
  vendor: number;
  product: number;
  name: string;
  axes: Axes;
}

const ofMaker = (vendor: number, axes: Axes, names: [number, string][]): Model[] =>
  names.map(([product, name]) => ({ vendor, product, name, axes }));
export const kModels: Model[] = [
  ...ofMaker(kLogitechId, "older", [
    [0xc603, "SpaceMouse Plus XT"], [0xc605, "CadMan"], [0xc606, "SpaceMouse Classic"], [0xc621, "Spaceball 5000"],
  ]),
  ...ofMaker(kLogitechId, "current", [
    [0xc623, "SpaceTraveler"], [0xc625, "SpacePilot"], [0xc626, "SpaceNavigator"], [0xc627, "SpaceExplorer"],
    [0xc628, "SpaceNavigator for Notebooks"], [0xc629, "SpacePilot Pro"], [0xc62b, "SpaceMouse Pro"],
  ]),
  ...ofMaker(k3DconnexionId, "current", [
    [0xc62e, "SpaceMouse Wireless (cable)"], [0xc62f, "SpaceMouse Wireless (receiver)"],
    [0xc631, "SpaceMouse Pro Wireless (cable)"], [0xc632, "SpaceMouse Pro Wireless (receiver)"],
    [0xc633, "SpaceMouse Enterprise"], [0xc635, "SpaceMouse Compact"], [0xc636, "SpaceMouse Module"],
    [0xc638, "SpaceMouse Pro Wireless BT"], [0xc63a, "SpaceMouse Wireless BT"],
    [0xc652, "Universal Receiver with a SpaceMouse Pro Wireless"],
  ]),
];
/** Devices of the same maker that are no six-axis devices: mice, keyboards, key pads. */
export const kRefused = [0xc62c, 0xc641, 0xc650, 0xc651, 0xc654, 0xc655, 0xc656, 0xc657, 0xc658, 0xc664, 0xc665, 0xc668];

/** The model of an identity; one of the maker's that is not listed is taken for a current one. Null: none of these devices. */
export function modelOf(vendor: number, product: number): Model | null {
  const model = kModels.find((one) => one.vendor === vendor && one.product === product);
  if (model) return model;
  if (vendor !== k3DconnexionId || kRefused.includes(product)) return null;
  return { vendor, product, name: "3Dconnexion device of unknown model", axes: "current" };
}

/** X of the generic desktop page; the five others follow. */
const kFirstUsage = 0x10030;
const kAxes = 6;
/** Full scale where the descriptor says none that makes sense: what current models declare. */
const kFullScale = 350;
const kMostScale = 32768;

/** The usage of element `k` of an item; those beyond a list repeat its last. */
function usageOf(item: HidItem, k: number): number {
  if (item.isRange) return Math.min((item.usageMinimum ?? 0) + k, item.usageMaximum ?? 0);
  const usages = item.usages ?? [];
  return usages[Math.min(k, usages.length - 1)] ?? 0;
}

/** What a report descriptor says of the axes: full scale of each, and whether one report may have all six. */
export interface Layout {
  scales: number[];
  mayBeJoined: boolean;
}

export function layoutOf(collections: HidCollection[]): Layout {
  const found: ({ reportId: number; scale: number } | undefined)[] = new Array(kAxes).fill(undefined);
  const take = (reportId: number, item: HidItem) => {
    const { logicalMinimum: least, logicalMaximum: most } = item;
    if (item.isConstant || !(most > least)) return;
    for (let k = 0; k < Math.min(item.reportCount, kAxes); ++k) {
      const axis = usageOf(item, k) - kFirstUsage;
      if (axis >= 0 && axis < kAxes) found[axis] ??= { reportId, scale: Math.max(most, -least) };
    }
  };
  const walk = (all: HidCollection[]) => {
    for (const { inputReports, children } of all) {
      for (const { reportId, items } of inputReports ?? []) for (const item of items) take(reportId, item);
      walk(children ?? []);
    }
  };
  walk(collections);
  const isUsable = (scale: number | undefined) => scale !== undefined && scale >= 1 && scale <= kMostScale;
  return {
    scales: found.map((axis) => (isUsable(axis?.scale) ? axis!.scale : kFullScale)),
    mayBeJoined: !found[0] || !found[3] || found[0].reportId === found[3].reportId,
  };
}

/** The last values of each kind that the device reported, in its own units and axes. */
export interface Reported {
  /** X Y Z RX RY RZ */
  axes: number[];
  buttons: number;
}
export const nothingReported = (): Reported => ({ axes: new Array(kAxes).fill(0), buttons: 0 });

const kShortBytes = 6, kLongBytes = 12;

/** "axes" and "buttons": these are new. "nothing": garbage, the battery's charge, or a number that is none of these. */
export type Kind = "axes" | "buttons" | "nothing";

/** Takes the part of `reported` that a report holds; bytes behind those are ignored.
 * @param data  without the report's number; of another length than its kind's it changes nothing
 * @param mayBeJoined  false where the descriptor puts turns into a report of their own: a long report 1 then still has three axes
 */
export function decode(reportId: number, data: DataView, mayBeJoined: boolean, reported: Reported): Kind {
  const takeAxes = (first: number, count: number): Kind => {
    if (data.byteLength < kShortBytes) return "nothing";
    for (let k = 0; k < count; ++k) reported.axes[first + k] = data.getInt16(2 * k, true);
    return "axes";
  };
  switch (reportId) {
    case 1:
      return takeAxes(0, mayBeJoined && data.byteLength >= kLongBytes ? 6 : 3);
    case 2:
      return takeAxes(3, 3);
    case 3:
      if (data.byteLength < 1) return "nothing";
      reported.buttons = 0;
      for (let k = 0; k < Math.min(data.byteLength, 4); ++k) reported.buttons += data.getUint8(k) * 2 ** (8 * k);
      return "buttons";
    default:
      return "nothing";
  }
}
