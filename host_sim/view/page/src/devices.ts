// SPDX-License-Identifier: Apache-2.0
// The page's list of devices that can move the part: finds them, has the buttons that connect them, and says how each stands.
import { gamePadText, headsetText, spaceMouseText } from "./device_words";
import type { Headset } from "./device_words";
import type { Hands } from "./inputs/hands";
import type { ControllerState } from "./inputs/room_controller";
import { SpaceMice } from "./inputs/space_mouse";
import type { Hid } from "./inputs/space_mouse";
import type { PhysicalPane } from "./physical_pane";
import { RoomView } from "./room_view";
import type { Side } from "./stage";

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

/** Words change no more often than an eye follows. */
const kSays_ms = 200;

export interface DevicesHost {
  takesHand: boolean;
  /** a picture of the headset is due */
  turn(): void;
  /** the page draws by itself again */
  drawsAgain(): void;
}

export class Devices {
  private readonly xr = (navigator as Navigator & { xr?: XRSystem }).xr;
  private readonly room: RoomView | null;
  private readonly mice: SpaceMice | null;
  private hasHeadset = false;
  private headsetTrouble = "";
  private saidAt = -Infinity;

  constructor(
    private readonly hands: Hands,
    private readonly pane: PhysicalPane | null,
    private readonly side: Side,
    private readonly host: DevicesHost,
  ) {
    const { hid } = navigator as Navigator & { hid?: Hid };
    this.mice = hid && host.takesHand ? new SpaceMice(hid, hands.spaceMice) : null;
    this.room = pane && new RoomView(pane, {
      frame: (controllers) => this.roomFrame(controllers),
      letGo: () => {
        for (const controller of hands.controllers) controller.rest();
      },
      ended: () => host.drawsAgain(),
    });
    const connect = element<HTMLButtonElement>("space-mouse");
    connect.hidden = this.mice === null;
    connect.onclick = () => void this.mice?.choose().then(() => this.say());
    element("enter-vr").onclick = () => void this.enterRoom();
    this.xr?.addEventListener?.("devicechange", () => void this.findHeadset());
    void this.findHeadset();
    this.say();
  }

  /** Whether a headset shows the scene: then the physical space is drawn there. */
  get isInRoom(): boolean {
    return this.room?.isIn ?? false;
  }

  private async findHeadset(): Promise<void> {
    // A browser without a runtime for headsets may refuse the question.
    this.hasHeadset = (await this.xr?.isSessionSupported("immersive-vr").catch(() => false)) ?? false;
    this.say();
  }

  private async enterRoom(): Promise<void> {
    const { xr, room } = this;
    if (!xr || !room) return;
    this.headsetTrouble = "";
    element("enter-vr").blur();  // the keys are the hand's
    try {
      if (room.isIn) await room.leave();
      else await room.enter(xr, this.side);
    } catch (error) {
      const message = error instanceof Error ? error.message : String(error);
      this.headsetTrouble = `the headset shows nothing: ${message.replace(/\.$/, "")}. Take it up and try again`;
    }
    this.say();
  }

  private roomFrame(controllers: ControllerState[]): void {
    for (const one of this.hands.controllers) one.track(controllers);
    this.host.turn();
    const holding = this.hands.controllers.map((one) => one.holding);
    this.pane?.showControllers(
      controllers.flatMap(({ grip, side }) => (grip ? [{ grip, holds: holding.includes(side) }] : [])),
    );
  }

  /** In every picture of the page. */
  turn(now: number): void {
    if (now - this.saidAt > kSays_ms) this.say(now);
  }

  /** How each device stands, in words. */
  private say(now = performance.now()): void {
    this.saidAt = now;
    const set = (id: string, text: string) => {
      const box = element(id);
      if (box.textContent !== text) box.textContent = text;
    };
    const around = { isSecure: window.isSecureContext, takesHand: this.host.takesHand };
    const headset: Headset = this.isInRoom ? "in" : this.hasHeadset ? "some" : "none";
    const canDraw = this.room !== null;
    set("headset-state", headsetText(around, { hasApi: this.xr !== undefined, canDraw, headset, trouble: this.headsetTrouble }));
    const enter = element<HTMLButtonElement>("enter-vr");
    enter.hidden = headset === "none" || !canDraw;
    set("enter-vr", headset === "in" ? "Leave VR" : "Enter VR");
    const names = this.hands.spaceMice.map(({ name }) => name);
    set("space-mouse-state", spaceMouseText(around, this.mice && { names, trouble: this.mice.trouble, isGone: this.mice.isGone }));
    set("game-pad-state", gamePadText(around, typeof navigator.getGamepads === "function", this.hands.pads));
  }
}
