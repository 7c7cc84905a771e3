// SPDX-License-Identifier: Apache-2.0
// SpaceMouse by WebHID: chosen by the user, connected again by itself where the browser remembers that, and gone at any time.
import type { HandInput, HandView, Motion } from "./hand_input";
import { inW, kFine, kHolds_ms } from "./hand_input";
import { k3DconnexionId, kLogitechId, kMultiAxis, layoutOf, modelOf } from "./space_mouse_codec";
import type { HidCollection } from "./space_mouse_codec";
import { SpaceMousePose } from "./space_mouse_pose";
import { rotationOf, rotationVector } from "../hand";
import type { Vec } from "../messages";

export interface HidReport extends Event {
  reportId: number;
  data: DataView;
}
export interface HidDevice {
  vendorId: number;
  productId: number;
  productName: string;
  opened: boolean;
  collections: HidCollection[];
  open(): Promise<void>;
  oninputreport: ((event: HidReport) => void) | null;
}
export interface Hid {
  getDevices(): Promise<HidDevice[]>;
  requestDevice(options: { filters: object[] }): Promise<HidDevice[]>;
  addEventListener(kind: "connect" | "disconnect", take: (event: { device: HidDevice }) => void): void;
}

const nanoseconds = (ms: number) => Math.round(ms * 1e6);

/** The cap as an input of one hand; without a device it does nothing. */
export class SpaceMouse implements HandInput {
  private device: HidDevice | null = null;
  private pose: SpaceMousePose | null = null;
  private movedAt = -Infinity;

  get name(): string {
    return this.device ? modelOf(this.device.vendorId, this.device.productId)!.name : "";
  }
  has(device: HidDevice | null): boolean {
    return this.device === device;
  }

  /** `device`: open, of a known model. */
  attach(device: HidDevice): void {
    const { axes } = modelOf(device.vendorId, device.productId)!;
    const pose = new SpaceMousePose(layoutOf(device.collections), axes);
    this.device = device;
    this.pose = pose;
    device.oninputreport = ({ reportId, data, timeStamp }) => pose.read(reportId, data, nanoseconds(timeStamp));
  }
  /** The device is gone: the part stands where it is. */
  detach(): void {
    if (this.device) this.device.oninputreport = null;
    this.device = this.pose = null;
  }

  take(view: HandView, _seconds: number, now: number): Motion | null {
    const { pose } = this;
    if (!pose) return null;
    pose.rest(nanoseconds(now));
    const { p, q } = pose.take();
    const scale = view.isFine ? kFine : 1;
    const inView = ([right, away, up]: Vec) => inW(view, [right * scale, up * scale, away * scale]);
    const shift = inView(p), turn = inView(rotationVector(q));
    if ([...shift, ...turn].every((x) => x === 0)) return null;
    this.movedAt = now;
    return { shift, turn: rotationOf(turn), hold: "near", at: now };
  }

  holds(now: number): boolean {
    return this.device !== null && now - this.movedAt < kHolds_ms;
  }
  /** It has no motor. */
  feel(): void {}
}

/** Connects devices to the hands that have none yet, and says in words how that went. */
export class SpaceMice {
  /** what went wrong last; empty: nothing */
  trouble = "";
  /** one was there and has been unplugged */
  isGone = false;
  /** while the browser opens them: it is asked for a device by several events at once */
  private readonly opening = new Set<HidDevice>();

  constructor(
    private readonly hid: Hid,
    private readonly hands: SpaceMouse[],
  ) {
    hid.addEventListener("disconnect", ({ device }) => this.drop(device));
    hid.addEventListener("connect", ({ device }) => void this.use([device]));
    // Those that the user has allowed before.
    void hid.getDevices().then((devices) => this.use(devices)).catch(() => {});
  }

  /** Asks the browser, which asks the user; only after a click. */
  async choose(): Promise<void> {
    this.trouble = "";
    const ofVendor = (vendorId: number) => ({ vendorId, ...kMultiAxis });
    try {
      const chosen = await this.hid.requestDevice({ filters: [ofVendor(k3DconnexionId), ofVendor(kLogitechId)] });
      const known = chosen.filter((device) => modelOf(device.vendorId, device.productId));
      if (chosen.length > 0 && known.length === 0) this.trouble = `${chosen[0].productName} is no six-axis device of 3Dconnexion`;
      else await this.use(known);
    } catch (error) {
      this.trouble = `the browser gives no SpaceMouse: ${messageOf(error)}`;
    }
  }

  private async use(devices: HidDevice[]): Promise<void> {
    const isCap = ({ usagePage, usage }: HidCollection) => usagePage === kMultiAxis.usagePage && usage === kMultiAxis.usage;
    for (const device of devices) {
      if (!modelOf(device.vendorId, device.productId) || !device.collections.some(isCap)) continue;
      if (this.opening.has(device) || this.hands.some((hand) => hand.has(device))) continue;
      this.opening.add(device);
      try {
        if (!device.opened) await device.open();
      } catch (error) {
        this.trouble = `${device.productName} cannot be opened: ${messageOf(error)}. Close the program that holds it, and connect it again`;
        continue;
      } finally {
        this.opening.delete(device);
      }
      const free = this.hands.find((hand) => hand.has(null));
      if (!free) {
        this.trouble = "every hand has a SpaceMouse already; unplug one";
        return;
      }
      free.attach(device);
      this.trouble = "";
      this.isGone = false;
    }
  }

  private drop(device: HidDevice): void {
    const hand = this.hands.find((one) => one.has(device));
    if (!hand) return;
    hand.detach();
    this.isGone = true;
  }
}

function messageOf(error: unknown): string {
  return (error instanceof Error ? error.message : String(error)).replace(/\.$/, "");
}
