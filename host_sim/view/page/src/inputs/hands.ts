// SPDX-License-Identifier: Apache-2.0
// One hand of the page or two, and which inputs lead which: of two, the mouse, the first game pad, the first SpaceMouse and the right
// controller lead the first; keys and the second, and left, ones the other.
import { gripOf } from "../hand";
import type { Picture, Pose, SceneFacts, Vec } from "../messages";
import type { Side } from "../stage";
import { GamePad } from "./game_pad";
import type { HandInput } from "./hand_input";
import { Keys } from "./keys";
import { LedHand } from "./led_hand";
import { Mouse } from "./mouse";
import { RoomController } from "./room_controller";
import { SpaceMouse } from "./space_mouse";

/** Stiffness of the hand's spring and the part's, one behind the other: what a hand feels of a wall. */
const inSeries = ({ hand, kT }: SceneFacts) => (hand.k * kT) / (hand.k + kT);

export class Hands {
  readonly keys = new Keys();
  readonly pads: GamePad[];
  readonly spaceMice: SpaceMouse[];
  readonly controllers: RoomController[];
  private readonly mouse = new Mouse();
  private readonly all: LedHand[];

  /** `want`: the hand, 0 or 1, wants its part there; `at`: since when [ms]. */
  constructor(
    private scene: SceneFacts,
    side: Side,
    radius: number,
    hasSecond: boolean,
    want: (hand: number, target: Pose, at: number) => void,
  ) {
    const grips: Vec[] = hasSecond ? [scene.grip, scene.second!.grip] : [scene.grip];
    this.pads = grips.map((_, hand) => new GamePad(hand));
    this.spaceMice = grips.map(() => new SpaceMouse());
    this.controllers = hasSecond ? [new RoomController(["right", "none"]), new RoomController(["left"])] : [new RoomController(["right", "left", "none"])];
    this.all = grips.map((grip, hand) => {
      const desk: HandInput[] = grips.length === 1 ? [this.mouse, this.keys] : [[this.mouse], [this.keys]][hand];
      const inputs = [...desk, this.pads[hand], this.spaceMice[hand], this.controllers[hand]];
      return new LedHand(inputs, side, grip, radius, inSeries(scene), (target, at) => want(hand, target, at));
    });
  }

  /** Another part is in the hand. */
  hold(scene: SceneFacts, radius: number): void {
    this.scene = scene;
    this.all[0].partRadius = radius;
    this.all[0].stiffness = inSeries(scene);
    this.forget();
  }

  /** The newest picture: where parts and devices are, and what is felt. */
  show(picture: Picture, byHand: boolean, now: number): void {
    const { device, felt, deviceGrip, feltGrip, force, driven } = picture;
    this.all[0].follow({ p: deviceGrip, q: device.q }, { p: feltGrip, q: felt.q }, byHand);
    this.all[0].feel(Math.hypot(...force), now);
    const { second } = this.scene;
    if (this.all.length < 2 || !second) return;
    const other = driven[second.mover];
    const at = (pose: Pose): Pose => ({ p: gripOf(pose, second.grip), q: pose.q });
    this.all[1].follow(at(other.commanded), at(other.felt), byHand);
    this.all[1].feel(Math.hypot(...other.push_n), now);
  }

  /** Dragged by the mouse; see Mouse.drag. */
  drag(right: number, up: number, isFlat: boolean, isFine: boolean, at: number): void {
    this.mouse.drag(right, up, isFlat, isFine, at);
    this.all[0].takeFrom(this.mouse, 0, at);
  }

  /** @returns whether the key moves a part. */
  key(event: KeyboardEvent, isDown: boolean): boolean {
    for (const hand of this.all) hand.isFine = event.shiftKey;
    return this.keys.key(event, isDown);
  }

  advance(seconds: number, now: number): void {
    for (const hand of this.all) hand.advance(seconds, now);
  }
  forget(): void {
    for (const hand of this.all) hand.forget();
  }
  makeUpright(): void {
    this.all[0].makeUpright();
  }
}
