// SPDX-License-Identifier: Apache-2.0
// What the address of the page holds behind its '#': the tick of a recording, or the pose of the device, and the side from
// which it is seen. A person can send it to another, who opens the same file.
import type { Pose } from "./messages";
import type { Side } from "./stage";

export interface Place {
  tick?: number;
  /** of the device's part, by hand */
  pose?: Pose;
  side?: Side;
}

const kNumbers = { pose: 7, view: 2 };

/** Six digits behind the point of a metre are a micrometre. */
const text = (values: number[], digits: number) => values.map((x) => String(+x.toFixed(digits))).join(",");

/** "tick=6500&view=0.5,0.42" or "pose=x,y,z,qx,qy,qz,qw&view=..". */
export function placeText({ tick, pose, side }: Place): string {
  const parts: string[] = [];
  if (tick !== undefined) parts.push(`tick=${tick}`);
  if (pose) parts.push(`pose=${text([...pose.p, ...pose.q], 7)}`);
  if (side) parts.push(`view=${text([side.azimuth, side.elevation], 3)}`);
  return parts.join("&");
}

/** What can be read of it; the rest is left out. */
export function placeOf(hash: string): Place {
  const place: Place = {};
  const words = new URLSearchParams(hash.replace(/^#/, ""));
  const numbers = (name: "pose" | "view") => {
    const values = (words.get(name) ?? "").split(",").map((word) => (word === "" ? NaN : Number(word)));
    return values.length === kNumbers[name] && values.every(Number.isFinite) ? values : null;
  };
  const tick = words.get("tick");
  if (tick !== null && /^\d{1,9}$/.test(tick)) place.tick = Number(tick);
  const pose = numbers("pose");
  const length = pose ? Math.hypot(...pose.slice(3)) : 0;
  if (pose && Math.abs(length - 1) < 1e-3 && pose.slice(0, 3).every((x) => Math.abs(x) < 1000)) {
    const [x, y, z, ...q] = pose;
    place.pose = { p: [x, y, z], q: q.map((c) => c / length) as Pose["q"] };
  }
  const view = numbers("view");
  if (view) place.side = { azimuth: view[0], elevation: Math.max(-1.5, Math.min(1.5, view[1])) };
  return place;
}
