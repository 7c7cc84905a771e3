// SPDX-License-Identifier: Apache-2.0
// The hand that holds the simulated device: a spring and a damper from the device to where mouse, keys or gamepad want
// it, without mass. The device gives way to the force, as one in a real hand does.
import type { Pose, Quat, Vec } from "./messages";

export function multiply(a: Quat, b: Quat): Quat {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}

export function conjugate(q: Quat): Quat {
  return [-q[0], -q[1], -q[2], q[3]];
}

export function normalised(q: Quat): Quat {
  const length = Math.hypot(...q);
  return [q[0] / length, q[1] / length, q[2] / length, q[3] / length];
}

export function rotate(q: Quat, v: Vec): Vec {
  const [x, y, z] = multiply(multiply(q, [v[0], v[1], v[2], 0]), conjugate(q));
  return [x, y, z];
}

/** The shorter rotation vector of `q` [rad]. */
export function rotationVector(q: Quat): Vec {
  const sign = q[3] < 0 ? -1 : 1;
  const sine = Math.hypot(q[0], q[1], q[2]);
  if (sine < 1e-12) return [2 * sign * q[0], 2 * sign * q[1], 2 * sign * q[2]];
  const scale = (sign * 2 * Math.atan2(sine, sign * q[3])) / sine;
  return [scale * q[0], scale * q[1], scale * q[2]];
}

export function rotationOf(v: Vec): Quat {
  const angle = Math.hypot(...v);
  const scale = angle < 1e-12 ? 0.5 : Math.sin(angle / 2) / angle;
  return [scale * v[0], scale * v[1], scale * v[2], Math.cos(angle / 2)];
}

export function gripOf(pose: Pose, grip: Vec): Vec {
  const turned = rotate(pose.q, grip);
  return [pose.p[0] + turned[0], pose.p[1] + turned[1], pose.p[2] + turned[2]];
}

export function poseOf(gripPoint: Vec, q: Quat, grip: Vec): Pose {
  const turned = rotate(q, grip);
  return { p: [gripPoint[0] - turned[0], gripPoint[1] - turned[1], gripPoint[2] - turned[2]], q };
}

/** Of the axis-aligned orientations the one nearest to `q`. */
export function upright(q: Quat): Quat {
  const columns = [rotate(q, [1, 0, 0]), rotate(q, [0, 1, 0])];
  const snapped: Vec[] = [];
  const taken = new Set<number>();
  for (const column of columns) {
    let best = -1;
    for (let k = 0; k < 3; ++k) {
      if (!taken.has(k) && (best < 0 || Math.abs(column[k]) > Math.abs(column[best]))) best = k;
    }
    taken.add(best);
    const axis: Vec = [0, 0, 0];
    axis[best] = Math.sign(column[best]) || 1;
    snapped.push(axis);
  }
  const [x, y] = snapped;
  const z: Vec = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
  return fromColumns(x, y, z);
}

function fromColumns(x: Vec, y: Vec, z: Vec): Quat {
  const trace = x[0] + y[1] + z[2];
  if (trace > 0) {
    const s = 2 * Math.sqrt(1 + trace);
    return [(y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s, s / 4];
  }
  if (x[0] >= y[1] && x[0] >= z[2]) {
    const s = 2 * Math.sqrt(1 + x[0] - y[1] - z[2]);
    return [s / 4, (y[0] + x[1]) / s, (z[0] + x[2]) / s, (y[2] - z[1]) / s];
  }
  if (y[1] >= z[2]) {
    const s = 2 * Math.sqrt(1 + y[1] - x[0] - z[2]);
    return [(y[0] + x[1]) / s, s / 4, (z[1] + y[2]) / s, (z[0] - x[2]) / s];
  }
  const s = 2 * Math.sqrt(1 + z[2] - x[0] - y[1]);
  return [(z[0] + x[2]) / s, (z[1] + y[2]) / s, s / 4, (x[1] - y[0]) / s];
}

/** Share of the rendered stiffness that the hand has. */
const kShare = 0.5;
/** Time in which the device follows a hand in free space [s]. */
const kLag_s = 0.02;
/** The damper takes at least this many periods to give up what both springs hold: with fewer the sum would swing. */
const kPeriods = 3;
/** And is this many times as strong as the coupling's, which feels the device's velocity a tick late. */
const kDamperShare = 2;

export class Hand {
  readonly k: number;
  readonly kR: number;
  private readonly b: number;
  private readonly bR: number;
  private gripPoint: Vec = [0, 0, 0];
  private q: Quat = [0, 0, 0, 1];
  private wantedGrip: Vec = [0, 0, 0];
  private wantedQ: Quat = [0, 0, 0, 1];

  constructor(
    kT: number,
    kR: number,
    damping: number,
    private readonly grip: Vec,
    private readonly period: number,
  ) {
    this.k = kShare * kT;
    this.kR = kShare * kR;
    this.b = Math.max(this.k * kLag_s, kPeriods * (this.k + kT) * period, kDamperShare * damping);
    this.bR = Math.max(this.kR * kLag_s, kPeriods * (this.kR + kR) * period, (kDamperShare * damping * kR) / kT);
  }

  /** The device stands there, and the hand wants it there. */
  place(pose: Pose): void {
    this.gripPoint = gripOf(pose, this.grip);
    this.q = normalised(pose.q);
    this.want(pose);
  }

  want(pose: Pose): void {
    this.wantedGrip = gripOf(pose, this.grip);
    this.wantedQ = normalised(pose.q);
  }

  /** One period under the wrench that the core rendered; where the device is then. */
  advance(force: Vec, torque: Vec): Pose {
    const turn = rotationVector(multiply(this.wantedQ, conjugate(this.q)));
    const step: Vec = [0, 0, 0];
    for (let k = 0; k < 3; ++k) {
      const pull = this.k * (this.wantedGrip[k] - this.gripPoint[k]);
      this.gripPoint[k] += (this.period * (pull + force[k])) / this.b;
      step[k] = (this.period * (this.kR * turn[k] + torque[k])) / this.bR;
    }
    this.q = normalised(multiply(rotationOf(step), this.q));
    return poseOf(this.gripPoint, this.q, this.grip);
  }
}
