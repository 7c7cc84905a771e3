// SPDX-License-Identifier: Apache-2.0
// Controllers as they are drawn in a room: a rod along each, and from one that holds the part a line to where it does.
import * as THREE from "three";
import type { Colours } from "./colours";
import { rotate } from "./hand";
import { Dots, WideLines } from "./marks";
import type { Segments } from "./marks";
import type { Pose, Vec } from "./messages";
import { shownColour } from "./solids";
import type { Surroundings } from "./solids";

/** Length of a rod on either side of the grip [m]. */
const kRod_m = 0.05;

export interface ControllerMark {
  /** in W */
  grip: Pose;
  holds: boolean;
}

export class RoomMarks extends THREE.Group {
  private readonly rods: WideLines;
  private readonly grips: Dots;

  constructor(around: Surroundings) {
    super();
    this.rods = new WideLines(around, 16);
    this.grips = new Dots(around, 17);
    this.add(this.rods, this.grips);
    this.visible = false;
  }

  /** `part`: where the part is held. */
  show(controllers: ControllerMark[], part: Vec, { device, contact }: Colours): void {
    this.visible = controllers.length > 0;
    const colourOf = (holds: boolean) => shownColour(holds ? contact : device);
    this.rods.set(
      controllers.flatMap(({ grip: { p, q }, holds }): Segments[] => {
        const along = rotate(q, [0, 0, kRod_m]);
        const end = (sign: number) => p.map((x, k) => x + sign * along[k]);
        const rod = { ends: [...end(-1), ...end(1)], width: 6, colour: colourOf(holds) };
        return holds ? [rod, { ends: [...p, ...part], width: 2, colour: colourOf(holds) }] : [rod];
      }),
    );
    this.grips.set(controllers.map(({ grip, holds }) => ({ at: grip.p, radius: 6, colour: colourOf(holds) })));
  }
}
