// SPDX-License-Identifier: Apache-2.0
// What both spaces share: a canvas, a camera that looks from the same side in both, and things to draw.
import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import type { Colours } from "./colours";
import type { Vec } from "./messages";

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
  /** Static parts are cut open along it: what lies towards the eye is left out. */
  readonly cut = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
  cutOpen = true;
  private readonly lamp = new THREE.DirectionalLight(0xffffff, 1.9);

  /** @throws Error where the browser has no WebGL */
  constructor(
    readonly canvas: HTMLCanvasElement,
    protected readonly overlay: HTMLElement,
    public colours: Colours,
  ) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.localClippingEnabled = true;
    this.renderer.autoClear = false;
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 1.7), this.lamp);
    this.camera.up.set(0, 0, 1);
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(Math.max(1, clientWidth), Math.max(1, clientHeight), false);
  }

  /** Metres of one pixel at the target. */
  get metresPerPixel(): number {
    return (2 * this.halfHeight) / Math.max(1, this.canvas.clientHeight);
  }

  look(side: Side, target: THREE.Vector3, halfHeight: number, aspect: number): void {
    const away = halfHeight / Math.tan((kFieldOfView_deg * Math.PI) / 360);
    const eye = towardsEye(side);
    this.camera.position.copy(target).addScaledVector(eye, away);
    this.camera.near = away / 60;
    this.camera.far = away * 40;
    this.camera.aspect = aspect;
    this.camera.lookAt(target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.lamp.position.copy(this.camera.position).addScaledVector(rightOf(side), -0.6 * away);
    this.lamp.position.z += 0.5 * away;
    this.lamp.target.position.copy(target);
    this.lamp.target.updateMatrixWorld();
  }

  /** Puts the cut through `point`, upright, towards the eye. */
  setCut(side: Side, point: THREE.Vector3): void {
    const eye = towardsEye({ azimuth: side.azimuth, elevation: 0 });
    this.cut.setFromNormalAndCoplanarPoint(eye.negate(), point);
  }

  clear(): void {
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    this.renderer.setClearColor(this.colours.ground, 1);
    this.renderer.clear();
  }

  /** `left`: by how much the target is drawn beside the middle [pixels]. */
  draw(side: Side, left = 0): void {
    const { clientWidth, clientHeight } = this.canvas;
    const middle = this.target.clone().addScaledVector(rightOf(side), left * this.metresPerPixel);
    this.look(side, middle, this.halfHeight, clientWidth / Math.max(1, clientHeight));
    this.renderer.render(this.scene, this.camera);
  }
}

/** An arrow of a solid shaft and one or two heads, along +y of its own frame, a unit long. */
export class Arrow extends THREE.Group {
  private readonly shaft: THREE.Mesh;
  private readonly heads: THREE.Mesh[] = [];
  readonly material: THREE.MeshBasicMaterial;

  constructor(colour: string, heads: 1 | 2) {
    super();
    this.material = new THREE.MeshBasicMaterial({ color: colour, depthTest: false, transparent: true });
    this.shaft = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 12), this.material);
    this.add(this.shaft);
    for (let k = 0; k < heads; ++k) {
      const head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 16), this.material);
      this.heads.push(head);
      this.add(head);
    }
    this.traverse((o) => (o.renderOrder = 20));
  }

  /** From `from` along `along` [m]; `thick`: radius of the shaft [m]. */
  point(from: THREE.Vector3, along: THREE.Vector3, thick: number): void {
    const length = along.length();
    this.visible = length > 1.5 * thick;
    if (!this.visible) return;
    this.position.copy(from);
    this.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize());
    const head = Math.min(7 * thick, 0.6 * length);
    this.shaft.scale.set(thick, Math.max(1e-9, length - head), thick);
    this.shaft.position.set(0, (length - head) / 2, 0);
    this.heads.forEach((cone, k) => {
      cone.scale.set(2.6 * thick, head, 2.6 * thick);
      cone.position.set(0, length - head / 2 - k * 0.75 * head, 0);
    });
  }
}

/** Positions of a mesh or of segments, replaced each time. */
export function setPositions(geometry: THREE.BufferGeometry, positions: Float32Array): void {
  const old = geometry.getAttribute("position") as THREE.BufferAttribute | undefined;
  if (old && old.array.length === positions.length) {
    old.copyArray(positions);
    old.needsUpdate = true;
  } else {
    geometry.dispose();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  }
  geometry.boundingSphere = null;
}

/** Segments some pixels wide. */
export class WideLines extends LineSegments2 {
  constructor(pixels: number, options: { depthTest?: boolean } = {}) {
    super(
      new LineSegmentsGeometry(),
      new LineMaterial({ linewidth: pixels, transparent: true, depthWrite: false, ...options }),
    );
    this.frustumCulled = false;
  }

  set(positions: Float32Array): void {
    this.geometry.dispose();
    this.geometry = new LineSegmentsGeometry();
    this.visible = positions.length > 0;
    if (this.visible) this.geometry.setPositions(positions);
  }
}

/** A surface, cut open: its inside, where one looks into it, has the flat colour of a section. */
export class CutSurface extends THREE.Group {
  readonly front: THREE.MeshStandardMaterial;
  readonly inside: THREE.MeshBasicMaterial;
  readonly lines: THREE.LineBasicMaterial;

  constructor(triangles: Float32Array, edges: Float32Array, cut: THREE.Plane) {
    super();
    this.front = new THREE.MeshStandardMaterial({
      flatShading: true,
      roughness: 0.9,
      clippingPlanes: [cut],
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
    this.inside = new THREE.MeshBasicMaterial({ side: THREE.BackSide, clippingPlanes: [cut] });
    this.lines = new THREE.LineBasicMaterial({ clippingPlanes: [cut] });
    const surface = new THREE.BufferGeometry();
    surface.setAttribute("position", new THREE.BufferAttribute(triangles, 3));
    surface.computeVertexNormals();
    const outline = new THREE.BufferGeometry();
    outline.setAttribute("position", new THREE.BufferAttribute(edges, 3));
    this.add(
      new THREE.Mesh(surface, this.front),
      new THREE.Mesh(surface, this.inside),
      new THREE.LineSegments(outline, this.lines),
    );
  }

  open(cut: THREE.Plane | null): void {
    const planes = cut ? [cut] : [];
    for (const material of [this.front, this.inside, this.lines]) material.clippingPlanes = planes;
  }
}
