// SPDX-License-Identifier: Apache-2.0
// C-space at the orientation in which the part is felt: the part is a point, each pair of pieces near it a C-obstacle.
// The faces come from the core with their type and with what the core says of them: near, or holding the part.
import * as THREE from "three";
import type { Colours } from "./colours";
import type { Answer, Picture } from "./messages";
import { Dots, WideLines } from "./marks";
import type { Dot } from "./marks";
import { dashesOf, FaceRole, kFaceKinds, kNone, markedOf, normalOf, obstaclesOf, outlinesOf, sameAnswer, trianglesOf } from "./shapes";
import type { ObstacleFace } from "./shapes";
import { Growing, linearColour, PlainMaterial, Positions, shownColour, SolidMaterial } from "./solids";
import { rightOf, Stage, vector } from "./stage";
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

/** The close-up follows within about this time. */
const kClose_ms = 75;
/** C-obstacles of pieces that lie side by side share planes: one kind lies over the others by so much of the depth. */
const kBehind = 3e-6;

export class CSpacePane extends Stage {
  private readonly surface = new THREE.BufferGeometry();
  private readonly corners = new Growing(this.surface, "position", 3);
  private readonly normals = new Growing(this.surface, "normal", 3);
  private readonly tints = new Growing(this.surface, "tint", 4);
  private readonly faceMaterial = new SolidMaterial(this.around, { tinted: true, isCut: true });
  private readonly solid = new THREE.Mesh(this.surface, this.faceMaterial);
  private readonly outlineMaterial = new PlainMaterial(this.around.cut);
  private readonly outlinePositions = new Positions();
  private readonly outlines = new THREE.LineSegments(this.outlinePositions.geometry, this.outlineMaterial);
  private readonly litMaterial = new PlainMaterial(this.around.cut, { opacity: 0.22 });
  private readonly litPositions = new Positions();
  private readonly lit = new THREE.Mesh(this.litPositions.geometry, this.litMaterial);
  private readonly chosenMaterial = new PlainMaterial(null, { opacity: 0.5, depthTest: false });
  private readonly chosenPositions = new Positions();
  private readonly chosen = new THREE.Mesh(this.chosenPositions.geometry, this.chosenMaterial);
  private readonly lines = new WideLines(this.around, 18);
  private readonly dots = new Dots(this.around, 20);
  private faces: ObstacleFace[] = [];
  private litFaces: ObstacleFace[] = [];
  private chosenFace: Pick<ObstacleFace, "corners">[] = [];
  /** what the surface was made of */
  private made: Answer | null = null;
  private readonly feltPoint = new THREE.Vector3();
  private readonly devicePoint = new THREE.Vector3();
  private isApart = false;
  private close = 0;
  private wantedClose = 0;
  private closedAt = 0;
  private fitted = false;
  private labelled = "";
  partRadius = 0.05;
  /** whose C-obstacles are drawn: bodies; null: of all that are near */
  private drawn: ((body: number) => boolean) | null = null;
  leftOut = 0;
  obstacleCount = 0;

  constructor(canvas: HTMLCanvasElement, overlay: HTMLElement, colours: Colours, smooth: boolean) {
    super(canvas, overlay, colours, smooth);
    this.chosen.renderOrder = 9;
    this.scene.add(this.solid, this.outlines, this.lit, this.chosen, this.lines, this.dots);
    this.scene.traverse((o) => (o.frustumCulled = false));
    this.paint(colours);
  }

  paint(colours: Colours): void {
    this.colours = colours;
    this.faceMaterial.paint(colours.section, colours.section);
    this.outlineMaterial.paint(colours.ink);
    this.litMaterial.paint(colours.contact);
    this.chosenMaterial.paint(colours.chosen);
    this.makeSurface();
    this.mark();
  }

  show(picture: Picture): void {
    // At one orientation the C-obstacles are the same wherever the part is.
    if (!this.made || !sameAnswer(picture.obstacles, this.made)) {
      this.made = picture.obstacles;
      this.takeFaces();
    }
    const { face } = markedOf(picture.marked);
    this.chosenFace = face.length > 2 ? [{ corners: face }] : [];
    this.chosenPositions.set(trianglesOf(this.chosenFace), this.chosen);
    this.feltPoint.copy(vector(picture.feltGrip));
    this.devicePoint.copy(vector(picture.deviceGrip));
    if (!this.fitted && this.faces.length > 0) this.fit(this.faces);
    const apart = this.feltPoint.distanceTo(this.devicePoint);
    this.isApart = apart > 2e-4 * this.partRadius;
    this.mark();
    this.wantedClose = Math.max(kClosest * this.partRadius, 2.2 * apart);
    if (this.close === 0) this.close = this.wantedClose;
  }

  /** The C-obstacles of these bodies alone from now on. */
  drawOnly(drawn: ((body: number) => boolean) | null): void {
    this.drawn = drawn;
    this.takeFaces();
  }

  private takeFaces(): void {
    if (!this.made) return;
    const { obstacles, leftOut } = obstaclesOf(this.made);
    const { drawn } = this;
    const kept = drawn ? obstacles.filter(({ body }) => drawn(body)) : obstacles;
    this.leftOut = leftOut;
    this.obstacleCount = kept.length;
    this.faces = kept.flatMap(({ faces }) => faces);
    this.makeSurface();
  }

  private makeSurface(): void {
    const { faces } = this;
    const triangles = faces.reduce((sum, { corners }) => sum + Math.max(0, corners.length - 2), 0);
    this.solid.visible = triangles > 0;
    const corners = this.corners.take(3 * triangles), normals = this.normals.take(3 * triangles);
    const tints = this.tints.take(3 * triangles);
    const colours = this.colours.kinds.map(linearColour);
    let at = 0;
    for (const face of faces) {
      const normal = normalOf(face);
      for (let k = 2; k < face.corners.length; ++k) {
        for (const corner of [face.corners[0], face.corners[k - 1], face.corners[k]]) {
          corners.set(corner, 3 * at);
          normals.set(normal, 3 * at);
          tints.set(colours[face.kind], 4 * at);
          tints[4 * at + 3] = kBehind * (1 + face.kind);
          at += 1;
        }
      }
    }
    for (const numbers of [this.corners, this.normals, this.tints]) numbers.done(at);
    this.surface.setDrawRange(0, at);
    const open = outlinesOf(faces.filter((face) => !face.hidden));
    const dashes = dashesOf(faces.filter((face) => face.hidden), 0.02 * this.partRadius);
    const outlines = new Float32Array(open.length + dashes.length);
    outlines.set(open);
    outlines.set(dashes, open.length);
    this.outlinePositions.set(outlines, this.outlines);
    this.litFaces = faces.filter((face) => face.role !== FaceRole.other);
    this.litPositions.set(trianglesOf(this.litFaces.filter((face) => face.role === FaceRole.holds)), this.lit);
  }

  /** The points, round which is a rim, as they must be seen on a face of any colour. */
  private mark(): void {
    const rim = shownColour(this.colours.ink);
    const point = ({ x, y, z }: THREE.Vector3, radius: number, colour: string): Dot[] => [
      { at: [x, y, z], radius: 1.45 * radius, colour: rim },
      { at: [x, y, z], radius, colour: shownColour(colour) },
    ];
    const device = this.isApart ? point(this.devicePoint, 5, this.colours.device) : [];
    this.dots.set([...device, ...point(this.feltPoint, 5.5, this.colours.felt)]);
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

  /** `pixel` [m] */
  private setLines(side: Side, pixel: number): void {
    const { colours } = this;
    this.lines.set([
      { ends: outlinesOf(this.litFaces), width: 3, colour: shownColour(colours.contact) },
      { ends: outlinesOf(this.chosenFace), width: 3.5, colour: shownColour(colours.chosen) },
      { ends: this.isApart ? this.spring(side, pixel) : [], width: 2, colour: shownColour(colours.device) },
    ]);
  }

  private spring(side: Side, pixel: number): number[] {
    const along = this.devicePoint.clone().sub(this.feltPoint);
    const right = rightOf(side);
    const across = new THREE.Vector3().crossVectors(along, right.cross(along));
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
    return segments;
  }

  /** The close-up has not come to its scale yet. */
  get isMoving(): boolean {
    return Math.abs(this.close - this.wantedClose) > 0.01 * this.wantedClose;
  }

  /** Drawn twice: the whole, and a close-up of the point in the corner. */
  render(side: Side): void {
    this.setCut(side, this.feltPoint);
    const now = performance.now();
    this.close += (1 - Math.exp((this.closedAt - now) / kClose_ms)) * (this.wantedClose - this.close);
    this.closedAt = now;
    this.setLines(side, this.metresPerPixel);
    this.clear();
    this.draw(side, kBesideInset * this.paneWidth);

    const width = Math.round(kInset * this.paneWidth), height = Math.round(kInset * this.paneHeight);
    const left = this.paneWidth - width - 8, bottom = 8;
    this.renderer.setScissorTest(true);
    this.renderer.setScissor(left, bottom, width, height);
    this.renderer.setViewport(left, bottom, width, height);
    this.renderer.clear();
    this.setLines(side, (2 * this.close) / height);
    this.drawAt(side, this.feltPoint, this.close, width, height);
    this.label(left, bottom, width, height);
    this.renderer.setScissorTest(false);
    this.begun();
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
    const place = {
      "--inset-left": `${left}px`,
      "--inset-bottom": `${bottom}px`,
      "--inset-width": `${width}px`,
      "--inset-height": `${height}px`,
      "--bar": `${((bar / (2 * this.close)) * height).toFixed(1)}px`,
    };
    const all = JSON.stringify(place);
    if (all !== this.labelled) {
      this.labelled = all;
      for (const [name, value] of Object.entries(place)) this.overlay.style.setProperty(name, value);
    }
    const list = this.overlay.querySelector<HTMLElement>(".inset-list")!;
    if (list.textContent !== lines) list.textContent = lines;
    const scale = this.overlay.querySelector<HTMLElement>(".inset-scale")!;
    if (scale.textContent !== lengthText(bar)) scale.textContent = lengthText(bar);
  }
}
