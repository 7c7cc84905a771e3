// SPDX-License-Identifier: Apache-2.0
// Physical space: the fixed parts, the part as it is felt, the device's part as a ghost, the contact, force and torque.
import * as THREE from "three";
import type { Colours } from "./colours";
import { rotate } from "./hand";
import type { Picture, Pose, SceneFacts, Vec } from "./messages";
import { contactsOf, edgesOf, kNone, markedOf, outlinesOf, piecesOf, trianglesOf } from "./shapes";
import { Arrow, CutSurface, setPositions, Stage, vector, WideLines } from "./stage";
import type { Side } from "./stage";
import { numberText, roundBelow } from "./words";

/** Where device and felt part are farther apart than this, the ghost is drawn [of the part's radius]. */
const kGhostFrom = 2e-4;
/** An arrow a third of the part long is about the pull of the spring at this distance [of the part's radius] and turn. */
const kShareOfArrow = 0.03;
const kTurnOfArrow_rad = 0.03;

export class PhysicalPane extends Stage {
  private readonly fixed: CutSurface[] = [];
  private readonly felt = new THREE.Group();
  private readonly ghost = new THREE.Group();
  private readonly feltMaterial = new THREE.MeshStandardMaterial({
    flatShading: true,
    roughness: 0.75,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
  private readonly feltLines = new THREE.LineBasicMaterial();
  private readonly ghostFill = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false });
  private readonly ghostLines = new THREE.LineBasicMaterial({ transparent: true, opacity: 0.85, depthTest: false });
  private readonly grip: THREE.Mesh;
  private readonly deviceGrip: THREE.Mesh;
  private readonly link = new WideLines(2, { depthTest: false });
  private readonly polygonFill: THREE.Mesh;
  private readonly polygonLine = new WideLines(2.5, { depthTest: false });
  private readonly corners = new THREE.Group();
  private readonly chosenLines = new WideLines(5, { depthTest: false });
  private readonly chosenPoints: THREE.Mesh[];
  private readonly force: Arrow;
  private readonly torque: Arrow;
  private readonly guide: Arrow;
  /** of fixed parts and the part at its start */
  readonly centre = new THREE.Vector3();
  radius = 0.1;
  partRadius = 0.05;
  /** N and N m of an arrow a third of the part long */
  private forceUnit = 1;
  private torqueUnit = 1;
  private grip_a: Vec = [0, 0, 0];

  constructor(canvas: HTMLCanvasElement, overlay: HTMLElement, colours: Colours) {
    super(canvas, overlay, colours);
    const ball = new THREE.SphereGeometry(1, 20, 14);
    const over = { depthTest: false, transparent: true };
    this.grip = new THREE.Mesh(ball, new THREE.MeshBasicMaterial(over));
    this.deviceGrip = new THREE.Mesh(ball, new THREE.MeshBasicMaterial(over));
    this.chosenPoints = [0, 1].map(() => {
      const point = new THREE.Mesh(ball, new THREE.MeshBasicMaterial(over));
      point.renderOrder = 14;
      this.scene.add(point);
      return point;
    });
    this.chosenLines.renderOrder = 13;
    this.scene.add(this.chosenLines);
    this.force = new Arrow(colours.force, 1);
    this.torque = new Arrow(colours.torque, 2);
    this.guide = new Arrow(colours.guide, 1);
    this.polygonFill = new THREE.Mesh(
      new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ ...over, opacity: 0.45, side: THREE.DoubleSide }),
    );
    for (const o of [this.link, this.polygonFill, this.polygonLine]) {
      o.frustumCulled = false;
      o.renderOrder = 10;
    }
    this.grip.renderOrder = this.deviceGrip.renderOrder = 15;
    this.scene.add(this.felt, this.ghost, this.link, this.deviceGrip, this.grip);
    this.scene.add(this.polygonFill, this.polygonLine, this.corners, this.force, this.torque, this.guide);
  }

  load(scene: SceneFacts): void {
    const pieces = piecesOf(scene.pieces);
    this.grip_a = scene.grip;
    const box = new THREE.Box3();
    const part = new THREE.Box3();
    scene.bodies.forEach((_, body) => {
      const faces = pieces
        .filter((piece) => piece.body === body)
        .flatMap((piece) => piece.faces)
        .filter((face) => face.source !== kNone);
      const triangles = trianglesOf(faces), edges = edgesOf(faces);
      if (body === 0) {
        const surface = new THREE.BufferGeometry();
        surface.setAttribute("position", new THREE.BufferAttribute(triangles, 3));
        surface.computeVertexNormals();
        const outline = new THREE.BufferGeometry();
        outline.setAttribute("position", new THREE.BufferAttribute(edges, 3));
        this.felt.add(new THREE.Mesh(surface, this.feltMaterial), new THREE.LineSegments(outline, this.feltLines));
        const lines = new THREE.LineSegments(outline, this.ghostLines);
        lines.renderOrder = 5;
        this.ghost.add(new THREE.Mesh(surface, this.ghostFill), lines);
        for (const face of faces) {
          for (const corner of face.corners) {
            part.expandByPoint(vector(corner));
            const turned = rotate(scene.start.q, corner), grip = rotate(scene.start.q, scene.grip);
            box.expandByPoint(vector(scene.start.p).add(vector(turned)).add(vector(grip)));
          }
        }
      } else {
        const surface = new CutSurface(triangles, edges, this.cut);
        this.fixed.push(surface);
        this.scene.add(surface);
        for (const face of faces) face.corners.forEach((corner) => box.expandByPoint(vector(corner)));
      }
    });
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    this.centre.copy(sphere.center);
    this.radius = sphere.radius;
    this.partRadius = part.getBoundingSphere(new THREE.Sphere()).radius;
    this.target.copy(this.centre);
    this.halfHeight = 0.92 * this.radius;
    this.forceUnit = roundBelow(kShareOfArrow * scene.kT * this.partRadius);
    this.torqueUnit = roundBelow(kTurnOfArrow_rad * scene.kR);
    this.paint(this.colours);
  }

  get scaleText(): string {
    const length = (this.partRadius / 3) * 1e3;
    return `arrows: ${numberText(this.forceUnit)} N, ${numberText(this.torqueUnit)} N m = ${numberText(length)} mm`;
  }

  paint(colours: Colours): void {
    this.colours = colours;
    for (const part of this.fixed) {
      part.front.color.set(colours.fixed);
      part.inside.color.set(colours.section);
      part.lines.color.set(colours.fixedEdge);
    }
    this.feltMaterial.color.set(colours.felt);
    this.feltLines.color.set(colours.feltEdge);
    this.ghostFill.color.set(colours.device);
    this.ghostLines.color.set(colours.device);
    (this.grip.material as THREE.MeshBasicMaterial).color.set(colours.feltEdge);
    (this.deviceGrip.material as THREE.MeshBasicMaterial).color.set(colours.device);
    this.link.material.color.set(colours.device);
    (this.polygonFill.material as THREE.MeshBasicMaterial).color.set(colours.contact);
    this.polygonLine.material.color.set(colours.contact);
    this.chosenLines.material.color.set(colours.chosen);
    for (const point of this.chosenPoints) (point.material as THREE.MeshBasicMaterial).color.set(colours.chosen);
    this.force.material.color.set(colours.force);
    this.torque.material.color.set(colours.torque);
    this.guide.material.color.set(colours.guide);
  }

  private place(group: THREE.Object3D, pose: Pose): void {
    const grip = rotate(pose.q, this.grip_a);
    group.position.set(pose.p[0] + grip[0], pose.p[1] + grip[1], pose.p[2] + grip[2]);
    group.quaternion.set(...pose.q);
  }

  show(picture: Picture): void {
    this.place(this.felt, picture.felt);
    this.place(this.ghost, picture.device);
    const felt = vector(picture.feltGrip), device = vector(picture.deviceGrip);
    const turned = new THREE.Quaternion(...picture.felt.q).angleTo(new THREE.Quaternion(...picture.device.q));
    const apart = felt.distanceTo(device) + turned * this.partRadius;
    this.ghost.visible = apart > kGhostFrom * this.partRadius;
    this.deviceGrip.visible = this.ghost.visible;
    this.grip.position.copy(felt);
    this.deviceGrip.position.copy(device);
    this.link.set(new Float32Array(this.ghost.visible ? [...felt.toArray(), ...device.toArray()] : []));
    const third = this.partRadius / 3;
    const force = vector(picture.force).multiplyScalar(third / this.forceUnit);
    const torque = vector(picture.torque).multiplyScalar(third / this.torqueUnit);
    const guide = vector(picture.guide?.force ?? [0, 0, 0]).multiplyScalar(third / this.forceUnit);
    for (const arrow of [force, torque, guide]) arrow.clampLength(0, 6 * third);
    const thick = 2.2 * this.metresPerPixel;
    this.force.point(felt, force, thick);
    this.torque.point(felt, torque, thick);
    this.guide.point(felt, guide, thick);

    const contacts = contactsOf(picture.contacts);
    const areas = contacts.filter((c) => c.polygon.length > 2).map((c) => ({ corners: c.polygon }));
    setPositions(this.polygonFill.geometry, trianglesOf(areas));
    const lines: number[] = [];
    const points: THREE.Vector3[] = [];
    for (const { polygon } of contacts) {
      polygon.forEach((from, k) => {
        if (polygon.length > 1) lines.push(...from, ...polygon[(k + 1) % polygon.length]);
        points.push(vector(from));
      });
    }
    this.polygonLine.set(new Float32Array(lines));
    const marked = markedOf(picture.marked);
    const features = [marked.ofA, marked.ofB];
    this.chosenLines.set(outlinesOf(features.filter((f) => f.length > 1).map((corners) => ({ corners }))));
    this.chosenPoints.forEach((point, k) => {
      point.visible = features[k].length === 1;
      if (point.visible) point.position.copy(vector(features[k][0]));
    });
    while (this.corners.children.length < points.length) {
      const corner = new THREE.Mesh(this.grip.geometry, this.polygonFill.material);
      corner.renderOrder = 12;
      this.corners.add(corner);
    }
    this.corners.children.forEach((corner, k) => {
      corner.visible = k < points.length;
      if (corner.visible) corner.position.copy(points[k]);
    });
  }

  render(side: Side, cutAt: THREE.Vector3): void {
    this.setCut(side, cutAt);
    for (const part of this.fixed) part.open(this.cutOpen ? this.cut : null);
    const pixel = this.metresPerPixel;
    this.grip.scale.setScalar(5 * pixel);
    this.deviceGrip.scale.setScalar(4 * pixel);
    for (const point of this.chosenPoints) point.scale.setScalar(6 * pixel);
    this.corners.children.forEach((corner) => corner.scale.setScalar(3.5 * pixel));
    this.clear();
    this.draw(side);
  }

  /** Whether the part, felt or ghost, lies under a point of the canvas. */
  hitsPart(x: number, y: number): boolean {
    const ray = new THREE.Raycaster();
    const at = new THREE.Vector2((2 * x) / this.canvas.clientWidth - 1, 1 - (2 * y) / this.canvas.clientHeight);
    ray.setFromCamera(at, this.camera);
    const shown = this.ghost.visible ? [this.felt, this.ghost] : [this.felt];
    return ray.intersectObjects(shown, true).some((hit) => hit.object instanceof THREE.Mesh);
  }
}
