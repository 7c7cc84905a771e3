// SPDX-License-Identifier: Apache-2.0
// Physical space: the fixed parts, the part as it is felt, the device's part as a ghost, driven parts as they are felt and
// where their owners have them, the contact, force and torque.
import * as THREE from "three";
import type { Colours } from "./colours";
import { rotate } from "./hand";
import type { Picture, Pose, SceneFacts, Vec } from "./messages";
import { Arrows, Dots, WideLines } from "./marks";
import type { Dot, Segments } from "./marks";
import { RoomMarks } from "./room_marks";
import type { ControllerMark } from "./room_marks";
import { contactsOf, kNone, markedOf, outlinesOf, piecesOf, surfaceOf, trianglesOf } from "./shapes";
import type { Face } from "./shapes";
import { PlainMaterial, Positions, shownColour, SolidMaterial } from "./solids";
import { Stage, vector } from "./stage";
import type { Side } from "./stage";
import { numberText, roundBelow } from "./words";

/** Where device and felt part are farther apart than this, the ghost is drawn [of the part's radius]. */
const kGhostFrom = 2e-4;
/** Where a driven part is farther behind its owner, the outline of where that has it is drawn [m]. */
const kBehindFrom_m = 1e-4;
/** An arrow a third of the part long is about the pull of the spring at this distance [of the part's radius] and turn. */
const kShareOfArrow = 0.03;
const kTurnOfArrow_rad = 0.03;
/** Radius of the shaft of an arrow [pixels]; in a room [of the part's radius]. */
const kArrow_px = 2.2, kArrowInRoom = 0.03;

/** Least box round faces. */
function boundsOf(faces: Face[]): THREE.Box3 {
  const box = new THREE.Box3(), at = new THREE.Vector3();
  for (const { corners } of faces) for (const corner of corners) box.expandByPoint(at.set(...corner));
  return box;
}

class Shape {
  readonly surface = new THREE.BufferGeometry();
  readonly edges = new THREE.BufferGeometry();
  readonly hasSheets: boolean;

  constructor(faces: Face[]) {
    const { corners, normals, sheets, triangles, edges } = surfaceOf(faces);
    const vectors = (numbers: Float32Array) => new THREE.BufferAttribute(numbers, 3);
    this.surface.setAttribute("position", vectors(corners)).setAttribute("normal", vectors(normals));
    this.surface.setAttribute("sheet", new THREE.BufferAttribute(sheets, 1));
    this.hasSheets = sheets.includes(1);
    this.surface.setIndex(new THREE.BufferAttribute(triangles, 1));
    this.edges.setAttribute("position", vectors(edges));
  }
}

function empty(group: THREE.Group): void {
  for (const child of [...group.children]) {
    if (child instanceof THREE.Mesh || child instanceof THREE.LineSegments) child.geometry.dispose();
    group.remove(child);
  }
}

export class PhysicalPane extends Stage {
  /** what the hand does not hold */
  private readonly fixed = new THREE.Group();
  private readonly felt = new THREE.Group();
  private readonly ghost = new THREE.Group();
  /** by driven part: as it is felt, and where its owner has it */
  private readonly driven = new THREE.Group();
  private readonly commanded = new THREE.Group();
  private readonly fixedMaterial = new SolidMaterial(this.around, { isCut: true });
  private readonly fixedLines = new PlainMaterial(this.around.cut);
  private readonly feltMaterial = new SolidMaterial(this.around);
  private readonly feltLines = new PlainMaterial(null);
  private readonly ghostFill = new PlainMaterial(null, { opacity: 0.16 });
  private readonly ghostLines = new PlainMaterial(null, { opacity: 0.85, depthTest: false });
  private readonly drivenMaterial = new SolidMaterial(this.around, { isCut: true });
  private readonly drivenLines = new PlainMaterial(this.around.cut);
  private readonly commandedLines = new PlainMaterial(null, { opacity: 0.6, depthTest: false });
  private readonly polygonFill = new PlainMaterial(null, { opacity: 0.45, depthTest: false });
  private readonly areas = new Positions();
  private readonly polygons = new THREE.Mesh(this.areas.geometry, this.polygonFill);
  private readonly lines = new WideLines(this.around, 13);
  private readonly dots = new Dots(this.around, 15);
  private readonly roomMarks = new RoomMarks(this.around);
  private readonly arrows = new Arrows(20);
  private picture: Picture | null = null;
  radius = 0.1;
  partRadius = 0.05;
  /** N and N m of an arrow a third of the part long */
  private forceUnit = 1;
  private torqueUnit = 1;
  private grip_a: Vec = [0, 0, 0];

  constructor(canvas: HTMLCanvasElement, overlay: HTMLElement, colours: Colours, smooth: boolean) {
    super(canvas, overlay, colours, smooth);
    this.polygons.frustumCulled = false;
    this.polygons.renderOrder = 10;
    this.scene.add(this.fixed, this.driven, this.felt, this.ghost, this.commanded, this.polygons, this.lines, this.dots, this.arrows, this.roomMarks);
  }

  /** Grip point of the part as it is felt [m]. */
  get feltAt(): Vec {
    return this.picture?.feltGrip ?? (this.felt.position.toArray() as Vec);
  }

  /** Of a scene that is shown already another part is in the hand: the view stays. */
  load(scene: SceneFacts): void {
    const pieces = piecesOf(scene.pieces);
    this.grip_a = scene.grip;
    const isFirst = this.fixed.children.length === 0;
    for (const group of [this.fixed, this.felt, this.ghost]) empty(group);
    const outer = (holds: (body: number) => boolean) =>
      pieces
        .filter((piece) => holds(piece.body))
        .flatMap((piece) => piece.faces)
        .filter((face) => face.source !== kNone);
    const part = outer((body) => body === 0), fixed = outer((body) => body !== 0);
    const partShape = new Shape(part);
    this.feltMaterial.side = partShape.hasSheets ? THREE.DoubleSide : THREE.FrontSide;
    this.felt.add(new THREE.Mesh(partShape.surface, this.feltMaterial), new THREE.LineSegments(partShape.edges, this.feltLines));
    const ghostEdges = new THREE.LineSegments(partShape.edges, this.ghostLines);
    ghostEdges.renderOrder = 5;
    this.ghost.add(new THREE.Mesh(partShape.surface, this.ghostFill), ghostEdges);
    // All fixed parts look alike; those that can be clicked on are surfaces of their own.
    const bodies = scene.parts ? scene.parts.bodies.map((_, body) => body).slice(1) : [-1];
    for (const body of bodies) {
      const shape = new Shape(body < 0 ? fixed : outer((of) => of === body));
      const surface = new THREE.Mesh(shape.surface, this.fixedMaterial);
      surface.userData.body = body;
      this.fixed.add(surface, new THREE.LineSegments(shape.edges, this.fixedLines));
    }

    this.loadDriven(scene);

    const ofPart = boundsOf(part), all = boundsOf(fixed);
    this.partRadius = ofPart.getBoundingSphere(new THREE.Sphere()).radius;
    this.forceUnit = roundBelow(kShareOfArrow * scene.kT * this.partRadius);
    this.torqueUnit = roundBelow(kTurnOfArrow_rad * scene.kR);
    if (isFirst) {
      this.place(this.felt, scene.start);
      this.felt.updateMatrix();
      for (const face of part) for (const corner of face.corners) all.expandByPoint(vector(corner).applyMatrix4(this.felt.matrix));
      all.expandByObject(this.driven);
      const sphere = all.getBoundingSphere(new THREE.Sphere());
      this.radius = sphere.radius;
      this.target.copy(sphere.center);
      this.halfHeight = 0.92 * this.radius;
    }
    this.picture = null;
    this.paint(this.colours);
  }

  private loadDriven({ driven }: SceneFacts): void {
    for (const group of [this.driven, this.commanded]) {
      for (const one of group.children) empty(one as THREE.Group);
      group.clear();
    }
    if (!driven) return;
    const pieces = piecesOf(driven.pieces);
    driven.starts.forEach((start, k) => {
      const faces = pieces.filter((piece) => piece.body === k).flatMap((piece) => piece.faces);
      const shape = new Shape(faces.filter((face) => face.source !== kNone));
      const felt = new THREE.Group().add(new THREE.Mesh(shape.surface, this.drivenMaterial), new THREE.LineSegments(shape.edges, this.drivenLines));
      const outline = new THREE.LineSegments(shape.edges, this.commandedLines);
      outline.renderOrder = 5;
      const commanded = new THREE.Group().add(outline);
      commanded.visible = false;
      for (const one of [felt, commanded]) this.placeFrame(one, start);
      this.driven.add(felt);
      this.commanded.add(commanded);
    });
  }

  get scaleText(): string {
    const length = (this.partRadius / 3) * 1e3;
    return `arrows: ${numberText(this.forceUnit)} N, ${numberText(this.torqueUnit)} N m = ${numberText(length)} mm`;
  }

  paint(colours: Colours): void {
    this.colours = colours;
    this.fixedMaterial.paint(colours.fixed, colours.section);
    this.fixedLines.paint(colours.fixedEdge);
    this.feltMaterial.paint(colours.felt);
    this.feltLines.paint(colours.feltEdge);
    this.ghostFill.paint(colours.device);
    this.ghostLines.paint(colours.device);
    this.drivenMaterial.paint(colours.driven, colours.section);
    this.drivenLines.paint(colours.drivenEdge);
    this.commandedLines.paint(colours.commanded);
    this.polygonFill.paint(colours.contact);
    if (this.picture) this.show(this.picture);
  }

  /** Of a part whose vertices are about its mesh frame. */
  private placeFrame(group: THREE.Object3D, pose: Pose): void {
    group.position.set(...pose.p);
    group.quaternion.set(...pose.q);
  }

  private showDriven({ driven }: Picture): void {
    driven.forEach((one, k) => {
      if (k >= this.driven.children.length) return;
      this.placeFrame(this.driven.children[k], one.felt);
      const commanded = this.commanded.children[k];
      this.placeFrame(commanded, one.commanded);
      commanded.visible = one.lag_m > kBehindFrom_m;
    });
  }

  private place(group: THREE.Object3D, pose: Pose): void {
    const grip = rotate(pose.q, this.grip_a);
    group.position.set(pose.p[0] + grip[0], pose.p[1] + grip[1], pose.p[2] + grip[2]);
    group.quaternion.set(...pose.q);
  }

  show(picture: Picture): void {
    this.picture = picture;
    this.place(this.felt, picture.felt);
    this.place(this.ghost, picture.device);
    this.showDriven(picture);
    const { feltGrip: felt, deviceGrip: device } = picture;
    const turned = new THREE.Quaternion(...picture.felt.q).angleTo(new THREE.Quaternion(...picture.device.q));
    const apart = vector(felt).distanceTo(vector(device)) + turned * this.partRadius;
    this.ghost.visible = apart > kGhostFrom * this.partRadius;

    const contacts = contactsOf(picture.contacts);
    const { chosen, contact, device: ofDevice, feltEdge } = this.colours;
    const mark = { chosen: shownColour(chosen), contact: shownColour(contact), device: shownColour(ofDevice), grip: shownColour(feltEdge) };
    this.areas.set(trianglesOf(contacts.filter((c) => c.polygon.length > 2).map((c) => ({ corners: c.polygon }))), this.polygons);
    const lines: Segments[] = [], dots: Dot[] = [];
    if (this.ghost.visible) lines.push({ ends: [...felt, ...device], width: 2, colour: mark.device });
    for (const { polygon } of contacts) {
      if (polygon.length > 1) lines.push({ ends: outlinesOf([{ corners: polygon }]), width: 2.5, colour: mark.contact });
      for (const at of polygon) dots.push({ at, radius: 2.8, colour: mark.contact });
    }
    const { ofA, ofB } = markedOf(picture.marked);
    for (const corners of [ofA, ofB]) {
      if (corners.length > 1) lines.push({ ends: outlinesOf([{ corners }]), width: 5, colour: mark.chosen });
      if (corners.length === 1) dots.push({ at: corners[0], radius: 6, colour: mark.chosen });
    }
    if (this.ghost.visible) dots.push({ at: device, radius: 4, colour: mark.device });
    dots.push({ at: felt, radius: 5, colour: mark.grip });
    this.lines.set(lines);
    this.dots.set(dots);
  }

  private pointArrows({ feltGrip, force, torque, guide }: Picture, thick: number): void {
    const third = this.partRadius / 3;
    const from = vector(feltGrip);
    const arrow = (value: Vec, unit: number, heads: 1 | 2, colour: string) => ({
      from,
      along: vector(value).multiplyScalar(third / unit).clampLength(0, 6 * third),
      heads,
      colour: shownColour(colour),
    });
    const { colours, forceUnit, torqueUnit } = this;
    const arrows = [arrow(force, forceUnit, 1, colours.force), arrow(torque, torqueUnit, 2, colours.torque)];
    if (guide) arrows.push(arrow(guide.force, forceUnit, 1, colours.guide));
    this.arrows.set(arrows, thick);
  }

  render(side: Side): void {
    if (this.picture) {
      this.setCut(side, vector(this.picture.feltGrip));
      this.pointArrows(this.picture, kArrow_px * this.metresPerPixel);
    }
    this.clear();
    this.draw(side);
    this.begun();
  }

  /** For the eyes of a headset, which moves `camera`; `side`: from where whoever wears it sees the scene; pixels of an eye. */
  renderInRoom(camera: THREE.Camera, side: Side, width: number, height: number): void {
    if (this.picture) {
      this.setCut(side, vector(this.picture.feltGrip));
      this.pointArrows(this.picture, kArrowInRoom * this.partRadius);
    }
    this.drawInRoom(camera, side, width, height);
  }

  showControllers(controllers: ControllerMark[]): void {
    this.roomMarks.show(controllers, this.feltAt, this.colours);
  }

  private rayAt(x: number, y: number): THREE.Raycaster {
    const ray = new THREE.Raycaster();
    const at = new THREE.Vector2((2 * x) / this.paneWidth - 1, 1 - (2 * y) / this.paneHeight);
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  /** Number of the body, of those that the hand does not hold, whose drawn half lies under a point of the canvas; -1: none. */
  bodyAt(x: number, y: number): number {
    const { value: cut } = this.around.cut;
    const isDrawn = ({ point }: THREE.Intersection) => cut.x * point.x + cut.y * point.y + cut.z * point.z + cut.w >= 0;
    const hit = this.rayAt(x, y)
      .intersectObjects(this.fixed.children, true)
      .find((one) => one.object instanceof THREE.Mesh && isDrawn(one));
    return hit ? hit.object.userData.body : -1;
  }

  /** Whether the part, felt or ghost, lies under a point of the canvas. */
  hitsPart(x: number, y: number): boolean {
    const ray = this.rayAt(x, y);
    const shown = this.ghost.visible ? [this.felt, this.ghost] : [this.felt];
    return ray.intersectObjects(shown, true).some((hit) => hit.object instanceof THREE.Mesh);
  }
}
