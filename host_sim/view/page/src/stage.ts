// SPDX-License-Identifier: Apache-2.0
// What both spaces share: a canvas, and a camera that looks from the same side in both.
import * as THREE from "three";
import type { Colours } from "./colours";
import type { Vec } from "./messages";
import type { Surroundings } from "./solids";

/** The side from which both panes look: angles in rad, z up. */
export interface Side {
  azimuth: number;
  elevation: number;
}

export function towardsEye({ azimuth, elevation }: Side): THREE.Vector3 {
  const flat = Math.cos(elevation);
  return new THREE.Vector3(
    flat * Math.sin(azimuth),
    -flat * Math.cos(azimuth),
    Math.sin(elevation),
  );
}

/** Right-hand direction of the view in W. */
export function rightOf({ azimuth }: Side): THREE.Vector3 {
  return new THREE.Vector3(Math.cos(azimuth), Math.sin(azimuth), 0);
}

export const vector = (v: Vec): THREE.Vector3 => new THREE.Vector3(v[0], v[1], v[2]);

const kFieldOfView_deg = 28;

export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(kFieldOfView_deg, 1, 0.001, 10);
  readonly renderer: THREE.WebGLRenderer;
  readonly target = new THREE.Vector3();
  /** half of what the pane shows in height [m] */
  halfHeight = 0.05;
  /** Static parts are cut open: what lies towards the eye is left out. */
  cutOpen = true;
  protected readonly around: Surroundings = {
    lamp: { value: new THREE.Vector3() },
    cut: { value: new THREE.Vector4() },
    screen: { value: new THREE.Vector2() },
    ratio: { value: 1 },
  };
  private readonly gl: WebGL2RenderingContext;
  private readonly fences: WebGLSync[] = [];
  private width = 0;
  private height = 0;

  /** `smooth`: edges without steps, which costs some times the pixels.
   * @throws Error where the browser has no WebGL */
  constructor(
    readonly canvas: HTMLCanvasElement,
    protected readonly overlay: HTMLElement,
    public colours: Colours,
    smooth: boolean,
  ) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: smooth, powerPreference: "high-performance" });
    this.renderer.autoClear = false;
    this.gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.camera.up.set(0, 0, 1);
  }

  /** `ratio`: pixels of the canvas for one of the page. */
  resize(ratio: number): void {
    // What a headset shows has the size of its eyes.
    if (this.renderer.xr.isPresenting) return;
    const width = Math.max(1, this.canvas.clientWidth), height = Math.max(1, this.canvas.clientHeight);
    const { value } = this.around.ratio;
    if (width === this.width && height === this.height && ratio === value) return;
    this.width = width;
    this.height = height;
    this.around.ratio.value = ratio;
    this.renderer.setDrawingBufferSize(width, height, ratio);
  }

  /** Somebody else has drawn here in another size. */
  forgetSize(): void {
    this.width = this.height = 0;
  }

  /** Pixels of the page. */
  protected get paneWidth(): number {
    return this.width;
  }
  protected get paneHeight(): number {
    return this.height;
  }

  /** Metres of one pixel at the target. */
  get metresPerPixel(): number {
    return (2 * this.halfHeight) / Math.max(1, this.height);
  }

  private look(side: Side, target: THREE.Vector3, halfHeight: number, aspect: number): void {
    const away = halfHeight / Math.tan((kFieldOfView_deg * Math.PI) / 360);
    const eye = towardsEye(side);
    this.camera.position.copy(target).addScaledVector(eye, away);
    this.camera.near = away / 60;
    this.camera.far = away * 40;
    this.camera.aspect = aspect;
    this.camera.lookAt(target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.light(side);
  }

  /** From behind the eye, to its left and above. */
  private light(side: Side): void {
    const lamp = this.around.lamp.value.copy(towardsEye(side)).addScaledVector(rightOf(side), -0.6);
    lamp.z += 0.5;
    lamp.normalize();
  }

  /** Puts the cut through `point`, upright, towards the eye. */
  protected setCut(side: Side, point: THREE.Vector3): void {
    const away = towardsEye({ azimuth: side.azimuth, elevation: 0 }).negate();
    if (this.cutOpen) this.around.cut.value.set(away.x, away.y, away.z, -away.dot(point));
    else this.around.cut.value.set(0, 0, 0, 1);
  }

  protected clear(): void {
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, this.width, this.height);
    this.renderer.setClearColor(this.colours.ground, 1);
    this.renderer.clear();
  }

  /** `left`: by how much the target is drawn beside the middle [pixels]. */
  protected draw(side: Side, left = 0): void {
    const middle = this.target.clone().addScaledVector(rightOf(side), left * this.metresPerPixel);
    this.drawAt(side, middle, this.halfHeight, this.width, this.height);
  }

  /** Into the viewport that is set, of so many pixels of the page. */
  protected drawAt(side: Side, target: THREE.Vector3, halfHeight: number, width: number, height: number): void {
    this.around.screen.value.set(width, height);
    this.look(side, target, halfHeight, width / height);
    this.renderer.render(this.scene, this.camera);
  }

  /** For the eyes of a headset, each of so many pixels. `side`: of the room before them. */
  protected drawInRoom(camera: THREE.Camera, side: Side, width: number, height: number): void {
    this.around.screen.value.set(width, height);
    this.around.ratio.value = 1;
    this.light(side);
    this.renderer.setClearColor(this.colours.ground, 1);
    this.renderer.clear();
    this.renderer.render(this.scene, camera);
  }

  /** After the last call of a picture. */
  protected begun(): void {
    const fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (fence) this.fences.push(fence);
  }
  /** Pictures that were begun and are still being drawn. */
  get busy(): number {
    const { gl, fences } = this;
    while (fences.length > 0 && gl.getSyncParameter(fences[0], gl.SYNC_STATUS) !== gl.UNSIGNALED) gl.deleteSync(fences.shift()!);
    return fences.length;
  }
}
