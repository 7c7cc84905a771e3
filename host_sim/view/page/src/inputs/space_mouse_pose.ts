// SPDX-License-Identifier: Apache-2.0
// What the cap of a SpaceMouse says, integrated to a pose: the law of hal/drivers/displacement_pose.hpp, number by number. Frame D: x
// right, y away from the operator, z up.
import { multiply, normalised, rotationOf } from "../hand";
import type { Pose, Vec } from "../messages";
import { beyond } from "./hand_input";
import { decode, nothingReported } from "./space_mouse_codec";
import type { Axes, Layout } from "./space_mouse_codec";

export interface CapSettings {
  /** at full displacement [m/s] and at full turn [rad/s] */
  fullSpeed: number;
  fullTurn: number;
  /** share of full scale that counts as rest */
  deadZone: number;
  /** the pose stays within this distance of its origin [m] */
  reach: number;
  /** longest time that one velocity is taken to last [ns] */
  longestStep_ns: number;
}
/** Those of the driver. */
export const kCapSettings: CapSettings = {
  fullSpeed: 0.1,
  fullTurn: 1,
  deadZone: 0.05,
  reach: 0.25,
  longestStep_ns: 50_000_000,
};

const kOrigin = (): Pose => ({ p: [0, 0, 0], q: [0, 0, 0, 1] });

/** From the device's axes to those of D. */
function inD([x, y, z]: Vec, axes: Axes): Vec {
  return axes === "older" ? [x, z, y] : [x, -y, -z];
}

export class SpaceMousePose {
  private readonly reported = nothingReported();
  private pose = kOrigin();
  private push: Vec = [0, 0, 0];
  private turn: Vec = [0, 0, 0];
  /** up to which the velocity is in the pose, and when it was reported [ns] */
  private stamp = 0;
  private reportedAt = 0;
  private isStamped = false;

  constructor(
    private readonly layout: Layout,
    private readonly axes: Axes,
    private readonly settings = kCapSettings,
  ) {}

  /** Integrates the velocity so far, then takes over that of the report. Buttons say nothing of the axes: the velocity so far goes on for
   * its time. Garbage changes nothing. `stamp` [ns], an integer. */
  read(reportId: number, data: DataView, stamp: number): void {
    const kind = decode(reportId, data, this.layout.mayBeJoined, this.reported);
    if (kind === "nothing") return;
    this.integrate(stamp);
    if (kind !== "axes") return;
    this.takeVelocity();
    this.reportedAt = this.stamp;
  }

  /** No report has come: the pose where the hand has it by now. A velocity lasts for its longest step, and silence is a hand at rest. */
  rest(stamp: number): void {
    this.integrate(stamp);
  }

  /** In D, since the begin or the last `take`. */
  get now(): Pose {
    return this.pose;
  }
  get buttons(): number {
    return this.reported.buttons;
  }

  /** The pose since the last `take`, and begins again at the origin: what a hand has moved by. */
  take(): Pose {
    const { pose } = this;
    this.pose = kOrigin();
    return pose;
  }

  private integrate(stamp: number): void {
    const since = (to: number) => Math.max(0, to - this.reportedAt);
    if (this.isStamped && stamp > this.stamp) {
      const longest = this.settings.longestStep_ns;
      const dt = (Math.min(since(stamp), longest) - Math.min(since(this.stamp), longest)) * 1e-9;
      const { p, q } = this.pose;
      let moved = p.map((x, k) => x + this.push[k] * dt) as Vec;
      const distance = Math.hypot(...moved);
      if (distance > this.settings.reach) moved = moved.map((x) => x * (this.settings.reach / distance)) as Vec;
      const turned = rotationOf(this.turn.map((x) => x * dt) as Vec);
      this.pose = { p: moved, q: normalised(multiply(turned, q)) };
      if (since(stamp) >= longest) this.push = this.turn = [0, 0, 0];
    }
    this.stamp = this.isStamped ? Math.max(this.stamp, stamp) : stamp;
    this.isStamped = true;
  }

  private takeVelocity(): void {
    const { scales } = this.layout;
    const { deadZone, fullSpeed, fullTurn } = this.settings;
    const share = (first: number) =>
      [0, 1, 2].map((k) => beyond(this.reported.axes[first + k] / scales[first + k], deadZone)) as Vec;
    this.push = inD(share(0), this.axes).map((x) => x * fullSpeed) as Vec;
    this.turn = inD(share(3), this.axes).map((x) => x * fullTurn) as Vec;
  }
}
