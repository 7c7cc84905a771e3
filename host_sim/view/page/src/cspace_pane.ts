// SPDX-License-Identifier: Apache-2.0
// C-space at the orientation in which the part is felt: the part is a point, each pair of pieces near it a C-obstacle.
// The faces come from the core with their type and with what the core says of them: near, or holding the part.
import * as THREE from "three";
import type { Colours } from "./colours";
import type { Picture } from "./messages";
import { dashesOf, FaceRole, kFaceKinds, kNone, markedOf, obstaclesOf, outlinesOf, trianglesOf } from "./shapes";
import type { ObstacleFace } from "./shapes";
import { setPositions, Stage, vector, WideLines } from "./stage";
import type { Side } from "./stage";
import { lengthText, roundBelow } from "./words";

/** The close-up takes this share of the pane's height and width. */
const kInset = 0.42;
/** The whole is drawn so much farther to the left, beside the close-up [of the pane's width]. */
const kBesideInset = 0.09;
const kMostLabels = 5;
/** Height of a label, which may take two lines, and of what stands above and below them. */
const kLabel_px = 30, kLabelFrame_px = 55;
/** The close-up shows at least this much to each side [of the part's radius]. */
const kClosest = 0.02;

interface Faces {
  mesh: THREE.Mesh;
  inside: THREE.Mesh;
  front: THREE.MeshStandardMaterial;
  back: THREE.MeshBasicMaterial;
}

export class CSpacePane extends Stage {
  private readonly kinds: Faces[];
  private readonly lines: THREE.LineSegments;
  private readonly lit: THREE.Mesh;
  private readonly litLines = new WideLines(3, { depthTest: false });
  private readonly chosen: THREE.Mesh;
  private readonly chosenLines = new WideLines(3.5, { depthTest: false });
  private readonly felt: THREE.Mesh;
  private readonly device: THREE.Mesh;
  /** round both points, which must be seen on a face of any colour */
  private readonly rims: THREE.Mesh[];
  private readonly spring = new WideLines(2, { depthTest: false });
  private litFaces: ObstacleFace[] = [];
  private readonly feltPoint = new THREE.Vector3();
  private readonly devicePoint = new THREE.Vector3();
  private close = 0;
  private wantedClose = 0;
  private fitted = false;
  partRadius = 0.05;
  leftOut = 0;
  obstacleCount = 0;

  constructor(canvas: HTMLCanvasElement, overlay: HTMLElement, colours: Colours) {
    super(canvas, overlay, colours);
    this.kinds = kFaceKinds.map((_, kind) => {
      const front = new THREE.MeshStandardMaterial({
        flatShading: true,
        roughness: 0.9,
        // C-obstacles of pieces that lie side by side share planes: one kind lies over the others.
        polygonOffset: true,
        polygonOffsetFactor: 1,
        polygonOffsetUnits: 1 + 4 * kind,
      });
      const back = new THREE.MeshBasicMaterial({ side: THREE.BackSide });
      const geometry = new THREE.BufferGeometry();
      return { mesh: new THREE.Mesh(geometry, front), inside: new THREE.Mesh(geometry, back), front, back };
    });
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial());
    const over = { transparent: true, depthWrite: false };
    this.lit = new THREE.Mesh(
      new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ ...over, opacity: 0.22, side: THREE.DoubleSide }),
    );
    this.chosen = new THREE.Mesh(
      new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ ...over, opacity: 0.5, depthTest: false, side: THREE.DoubleSide }),
    );
    this.chosen.renderOrder = 9;
    this.chosenLines.renderOrder = 10;
    const ball = new THREE.SphereGeometry(1, 20, 14);
    this.felt = new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ depthTest: false, transparent: true }));
    this.device = new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ depthTest: false, transparent: true }));
    this.rims = [this.felt, this.device].map((point) => {
      const rim = new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ depthTest: false, transparent: true }));
      rim.scale.setScalar(1.45);
      point.add(rim);
      return rim;
    });
    this.rims[1].renderOrder = 18.5;
    this.rims[0].renderOrder = 19.5;
    this.spring.renderOrder = 18;
    this.device.renderOrder = 19;
    this.felt.renderOrder = 20;
    this.litLines.renderOrder = 8;
    for (const { mesh, inside } of this.kinds) this.scene.add(mesh, inside);
    this.scene.add(this.lines, this.lit, this.litLines, this.chosen, this.chosenLines, this.spring, this.device, this.felt);
    this.scene.traverse((o) => (o.frustumCulled = false));
    this.paint(colours);
  }

  paint(colours: Colours): void {
    this.colours = colours;
    this.kinds.forEach(({ front, back }, k) => {
      front.color.set(colours.kinds[k]);
      back.color.set(colours.section);
    });
    const colour = (o: THREE.Mesh | THREE.LineSegments | WideLines, c: string) =>
      (o.material as THREE.MeshBasicMaterial).color.set(c);
    colour(this.lines, colours.ink);
    colour(this.lit, colours.contact);
    colour(this.litLines, colours.contact);
    colour(this.chosen, colours.chosen);
    colour(this.chosenLines, colours.chosen);
    colour(this.felt, colours.felt);
    colour(this.device, colours.device);
    colour(this.spring, colours.device);
    for (const rim of this.rims) colour(rim, colours.ink);
  }

  show(picture: Picture): void {
    const { obstacles, leftOut } = obstaclesOf(picture.obstacles);
    this.leftOut = leftOut;
    this.obstacleCount = obstacles.length;
    const faces = obstacles.flatMap((obstacle) => obstacle.faces);
    this.kinds.forEach(({ mesh }, kind) => {
      setPositions(mesh.geometry, trianglesOf(faces.filter((face) => face.kind === kind)));
      mesh.geometry.computeVertexNormals();
    });
    const open = outlinesOf(faces.filter((face) => !face.hidden));
    const dashes = dashesOf(faces.filter((face) => face.hidden), 0.02 * this.partRadius);
    const outlines = new Float32Array(open.length + dashes.length);
    outlines.set(open);
    outlines.set(dashes, open.length);
    setPositions(this.lines.geometry, outlines);
    const { face } = markedOf(picture.marked);
    const chosen = face.length > 2 ? [{ corners: face }] : [];
    setPositions(this.chosen.geometry, trianglesOf(chosen));
    this.chosenLines.set(outlinesOf(chosen));
    this.litFaces = faces.filter((face) => face.role !== FaceRole.other);
    const holds = this.litFaces.filter((face) => face.role === FaceRole.holds);
    setPositions(this.lit.geometry, trianglesOf(holds));
    this.litLines.set(outlinesOf(this.litFaces));
    this.feltPoint.copy(vector(picture.feltGrip));
    this.devicePoint.copy(vector(picture.deviceGrip));
    if (!this.fitted && faces.length > 0) this.fit(faces);
    this.felt.position.copy(this.feltPoint);
    this.device.position.copy(this.devicePoint);
    const apart = this.feltPoint.distanceTo(this.devicePoint);
    this.device.visible = apart > 2e-4 * this.partRadius;
    const wanted = Math.max(kClosest * this.partRadius, 2.2 * apart);
    this.wantedClose = wanted;
    if (this.close === 0) this.close = wanted;
  }

  /** Shows all that is drawn first. */
  private fit(faces: ObstacleFace[]): void {
    const box = new THREE.Box3().setFromPoints([this.feltPoint, this.devicePoint]);
    for (const face of faces) for (const corner of face.corners) box.expandByPoint(vector(corner));
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    this.target.copy(sphere.center);
    this.halfHeight = 1.05 * sphere.radius;
    this.fitted = true;
  }

  private setSpring(side: Side, pixel: number): void {
    if (!this.device.visible) return this.spring.set(new Float32Array());
    const along = this.devicePoint.clone().sub(this.feltPoint);
    const right = new THREE.Vector3(Math.cos(side.azimuth), Math.sin(side.azimuth), 0);
    const across = new THREE.Vector3().crossVectors(along, new THREE.Vector3().crossVectors(right, along));
    if (across.lengthSq() < 1e-24) across.set(0, 0, 1);
    across.normalize().multiplyScalar(Math.min(5 * pixel, along.length() / 8));
    const turns = 8;
    const segments: number[] = [];
    let from = this.feltPoint;
    for (let k = 1; k <= 2 * turns; ++k) {
      const to = this.feltPoint.clone().addScaledVector(along, k / (2 * turns));
      if (k < 2 * turns) to.addScaledVector(across, k % 2 === 0 ? 1 : -1);
      segments.push(...from.toArray(), ...to.toArray());
      from = to;
    }
    this.spring.set(new Float32Array(segments));
  }

  /** The close-up has not come to its scale yet. */
  get isMoving(): boolean {
    return Math.abs(this.close - this.wantedClose) > 0.01 * this.wantedClose;
  }

  /** Drawn twice: the whole, and a close-up of the point in the corner. */
  render(side: Side): void {
    const { clientWidth, clientHeight } = this.canvas;
    this.setCut(side, this.feltPoint);
    this.close += 0.2 * (this.wantedClose - this.close);
    const planes = this.cutOpen ? [this.cut] : [];
    for (const { front, back } of this.kinds) front.clippingPlanes = back.clippingPlanes = planes;
    (this.lines.material as THREE.LineBasicMaterial).clippingPlanes = planes;
    (this.lit.material as THREE.MeshBasicMaterial).clippingPlanes = planes;
    this.size(side, this.metresPerPixel);
    this.clear();
    this.draw(side, kBesideInset * clientWidth);

    const width = Math.round(kInset * clientWidth), height = Math.round(kInset * clientHeight);
    const left = clientWidth - width - 8, bottom = 8;
    this.renderer.setScissorTest(true);
    this.renderer.setScissor(left - 1, bottom - 1, width + 2, height + 2);
    this.renderer.setClearColor(this.colours.grid, 1);
    this.renderer.clear();
    this.renderer.setScissor(left, bottom, width, height);
    this.renderer.setViewport(left, bottom, width, height);
    this.renderer.setClearColor(this.colours.ground, 1);
    this.renderer.clear();
    this.size(side, (2 * this.close) / height);
    this.look(side, this.feltPoint, this.close, width / height);
    this.renderer.render(this.scene, this.camera);
    this.label(left, bottom, width, height);
    this.renderer.setScissorTest(false);
  }

  private size(side: Side, pixel: number): void {
    this.felt.scale.setScalar(5.5 * pixel);
    this.device.scale.setScalar(5 * pixel);
    this.setSpring(side, pixel);
  }

  /** Numbers of the lit faces in the close-up, beside the point. */
  private label(left: number, bottom: number, width: number, height: number): void {
    const named = this.litFaces.filter((face) => face.node !== kNone);
    const fitting = Math.max(1, Math.min(kMostLabels, Math.floor((height - kLabelFrame_px) / kLabel_px)));
    const lines = named
      .slice(0, fitting)
      .map((face) => {
        const kind = face.kind < 3 ? `type ${kFaceKinds[face.kind]}` : "several types";
        const more = face.nodes > 1 ? ` and ${face.nodes - 1} more` : "";
        return `${face.role === FaceRole.holds ? "holds" : "near"}: ${face.node}${more}, ${kind}`;
      })
      .concat(named.length > fitting ? [`and ${named.length - fitting} more`] : [])
      .join("\n");
    const bar = roundBelow(this.close);
    this.overlay.style.setProperty("--inset-left", `${left}px`);
    this.overlay.style.setProperty("--inset-bottom", `${bottom}px`);
    this.overlay.style.setProperty("--inset-width", `${width}px`);
    this.overlay.style.setProperty("--inset-height", `${height}px`);
    this.overlay.style.setProperty("--bar", `${((bar / (2 * this.close)) * height).toFixed(1)}px`);
    const list = this.overlay.querySelector<HTMLElement>(".inset-list")!;
    if (list.textContent !== lines) list.textContent = lines;
    const scale = this.overlay.querySelector<HTMLElement>(".inset-scale")!;
    if (scale.textContent !== lengthText(bar)) scale.textContent = lengthText(bar);
  }
}
