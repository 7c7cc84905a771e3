// SPDX-License-Identifier: Apache-2.0
// The scene in the room of a headset (WebXR, immersive-vr): one metre is one metre, in front of whoever puts the headset on, drawn for both
// eyes by the renderer of the physical space. Its controllers move the part.
import * as THREE from "three";
import type { ControllerState } from "./inputs/room_controller";
import type { Pose, Quat, Vec } from "./messages";
import type { PhysicalPane } from "./physical_pane";
import { rightOf, towardsEye, vector } from "./stage";
import type { Side } from "./stage";

/** The part is put so far before the eyes and below them [m]; of a large scene the middle is farther away. */
const kBefore_m = 0.45, kBelow_m = 0.12, kRadiiBefore = 1.8;
const kNear_m = 0.02, kFar_m = 50;
/** Buttons of a controller (xr-standard): trigger, squeeze; and A or X, which puts the scene in front again. */
const kTrigger = 0, kSqueeze = 1, kAgain = 4;

/** A frame of the room in which the headset says poses: y up, the place of its begin at the origin. */
export interface Placement {
  /** from the room to W */
  turn: THREE.Quaternion;
  shift: THREE.Vector3;
}

/** Puts `point` of W in front of the head: what is away of the eye in the page is away of the head, and W's z is up.
 * @param before, below  of the point, from the head [m] */
export function placedBefore(head: Pose, side: Side, point: Vec, before: number, below: number): Placement {
  const forward = new THREE.Vector3(0, 0, -1).applyQuaternion(new THREE.Quaternion(...head.q)).setY(0);
  // Whoever looks straight up or down: the way in which the room was entered.
  if (forward.lengthSq() < 1e-6) forward.set(0, 0, -1);
  forward.normalize();
  const yaw = Math.atan2(-forward.x, -forward.z);
  const away = towardsEye({ azimuth: side.azimuth, elevation: 0 }).negate();
  const axes = new THREE.Matrix4().makeBasis(rightOf(side), new THREE.Vector3(0, 0, 1), away.negate());
  const turn = new THREE.Quaternion().setFromRotationMatrix(axes);
  turn.multiply(new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), -yaw));
  const inRoom = vector(head.p).addScaledVector(forward, before);
  inRoom.y -= below;
  return { turn, shift: vector(point).sub(inRoom.applyQuaternion(turn)) };
}

/** A pose of the room in W. */
export function inScene({ turn, shift }: Placement, { p, q }: Pose): Pose {
  const turned = turn.clone().multiply(new THREE.Quaternion(...q));
  return { p: vector(p).applyQuaternion(turn).add(shift).toArray() as Vec, q: turned.toArray() as Quat };
}

const poseOf = ({ position, orientation }: XRRigidTransform): Pose => ({
  p: [position.x, position.y, position.z],
  q: [orientation.x, orientation.y, orientation.z, orientation.w],
});

export interface RoomHost {
  /** A picture is due: `controllers` are where they are in W. */
  frame(controllers: ControllerState[]): void;
  /** The scene is put elsewhere, or the session is over: nobody holds anything. */
  letGo(): void;
  ended(): void;
}

export class RoomView {
  private readonly camera = new THREE.PerspectiveCamera();
  /** the room in W; the headset moves the camera in it */
  private readonly room = new THREE.Group();
  private session: XRSession | null = null;
  private space: XRReferenceSpace | null = null;
  private placement: Placement | null = null;
  private side: Side = { azimuth: 0, elevation: 0 };

  constructor(
    private readonly pane: PhysicalPane,
    private readonly host: RoomHost,
  ) {
    this.camera.near = kNear_m;
    this.camera.far = kFar_m;
    this.room.add(this.camera);
    pane.scene.add(this.room);
    // Told after the renderer has gone back to its canvas.
    pane.renderer.xr.addEventListener("sessionend", () => this.end());
  }

  get isIn(): boolean {
    return this.session !== null;
  }

  /** After a click. @throws Error where the headset or the browser refuses */
  async enter(xr: XRSystem, side: Side): Promise<void> {
    if (this.session) return;
    const session = await xr.requestSession("immersive-vr");
    const { xr: manager } = this.pane.renderer;
    this.session = session;
    this.side = { ...side };
    this.placement = null;
    manager.enabled = true;
    manager.setReferenceSpaceType("local");
    manager.setAnimationLoop((_time, frame) => frame && this.frame(frame));
    try {
      await manager.setSession(session);
      this.space = manager.getReferenceSpace();
      // The user has said where "in front" is.
      this.space?.addEventListener("reset", () => (this.placement = null));
    } catch (error) {
      await session.end().catch(() => {});
      throw error;
    }
  }

  async leave(): Promise<void> {
    await this.session?.end();
  }

  private end(): void {
    const { renderer } = this.pane;
    this.session = this.space = this.placement = null;
    renderer.xr.enabled = false;
    // It has begun a loop of its own again.
    renderer.setAnimationLoop(null);
    this.pane.forgetSize();
    this.pane.showControllers([]);
    this.host.letGo();
    this.host.ended();
  }

  private place(head: Pose): void {
    this.host.letGo();
    const before = Math.max(kBefore_m, kRadiiBefore * this.pane.radius);
    this.placement = placedBefore(head, this.side, this.pane.feltAt, before, kBelow_m);
    this.room.position.copy(this.placement.shift);
    this.room.quaternion.copy(this.placement.turn);
    this.room.updateMatrixWorld(true);
  }

  private frame(frame: XRFrame): void {
    const { session, space } = this;
    if (!session || !space) return;
    const head = frame.getViewerPose(space);
    const sources = [...session.inputSources].filter((source) => source.gripSpace);
    const wantsAgain = sources.some(({ gamepad }) => gamepad?.buttons[kAgain]?.pressed);
    if (head && (!this.placement || wantsAgain)) this.place(poseOf(head.transform));
    const { placement } = this;
    if (!placement) return;
    const controllers = sources.map((source): ControllerState => {
      const pose = frame.getPose(source.gripSpace!, space);
      const { gamepad, handedness } = source;
      const motor = gamepad?.hapticActuators?.[0];
      return {
        side: handedness,
        grip: pose ? inScene(placement, poseOf(pose.transform)) : null,
        isPressed: [kTrigger, kSqueeze].some((k) => gamepad?.buttons[k]?.pressed),
        pulse: typeof motor?.pulse === "function" ? (strength, ms) => void motor.pulse(strength, ms).catch(() => {}) : null,
      };
    });
    this.host.frame(controllers);
    const [eye] = this.pane.renderer.xr.getCamera().cameras;
    if (eye) this.pane.renderInRoom(this.camera, this.side, eye.viewport.z, eye.viewport.w);
  }
}
