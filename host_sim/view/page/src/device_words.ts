// SPDX-License-Identifier: Apache-2.0
// What the page says of each device that could move the part: that it does, or why it does not and how it would.

/** Browsers give headsets, HID devices and game pads to pages of a secure context alone. */
export const kInsecure =
  "not here: browsers give it to secure pages alone. Open this page as a file, from localhost (adb reverse, see the README) or by https";
const kNeedsHand = "not here: this session is only watched, so nothing moves its part";

/** What all rows depend on. */
export interface Surroundings {
  isSecure: boolean;
  /** whether a hand of this page moves the part */
  takesHand: boolean;
}

export interface PadFacts {
  name: string;
  foreign: string;
  canRumble: boolean;
  wasThere: boolean;
  isRefused: boolean;
}

/** `pads`: of each hand of the page. */
export function gamePadText({ isSecure, takesHand }: Surroundings, hasApi: boolean, pads: PadFacts[]): string {
  if (!takesHand) return kNeedsHand;
  if (!hasApi) return isSecure ? "not here: this browser has no Gamepad interface" : kInsecure;
  if (pads.some(({ isRefused }) => isRefused)) return "not here: the browser keeps game pads from a page within another; open this one by itself";
  const there = pads.filter(({ name }) => name !== "");
  if (there.length > 0) {
    const says = ({ name, canRumble }: PadFacts) => `${name} moves the part${canRumble ? "; its motors say the force" : "; this browser cannot turn its motors"}`;
    return there.map(says).join(". ");
  }
  const foreign = pads.find((pad) => pad.foreign !== "")?.foreign;
  if (foreign) return `${foreign} has a layout that this browser does not know, so it is not used`;
  if (pads.some(({ wasThere }) => wasThere)) return "unplugged; the part stands. Plug it in again and press one of its buttons";
  return "none yet: plug one in and press one of its buttons";
}

/** `hid`: null where the browser has none. */
export function spaceMouseText({ isSecure, takesHand }: Surroundings, hid: { names: string[]; trouble: string; isGone: boolean } | null): string {
  if (!takesHand) return kNeedsHand;
  if (!hid) return isSecure ? "not here: this browser has no WebHID; Chrome, Edge and Chromium have it" : kInsecure;
  const names = hid.names.filter((name) => name !== "");
  if (hid.trouble !== "") return hid.trouble;
  if (names.length > 0) return `${names.join(" and ")} moves the part`;
  return hid.isGone ? "unplugged; the part stands. Plug it in again" : "none yet: plug it in and choose it with this button";
}

/** "none": no headset is found; "some": one can be entered; "in": it shows the scene. */
export type Headset = "none" | "some" | "in";

export function headsetText({ isSecure, takesHand }: Surroundings, facts: { hasApi: boolean; canDraw: boolean; headset: Headset; trouble: string }): string {
  if (!facts.hasApi) return isSecure ? "not here: this browser has no WebXR; those of headsets, Chrome and Edge have it" : kInsecure;
  if (!facts.canDraw) return "not here: this browser offers no WebGL";
  if (facts.trouble !== "") return facts.trouble;
  if (facts.headset === "in") return takesHand ? "it shows the scene, and its controllers move the part" : "it shows the scene; this session is only watched";
  return facts.headset === "some" ? "one is here: Enter VR, at the top of the page" : "none is found: switch it on, or open this page in its own browser";
}
