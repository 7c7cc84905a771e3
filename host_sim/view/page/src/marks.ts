// SPDX-License-Identifier: Apache-2.0
// Marks over the things of a space, of the same size in pixels at any distance: dots, wide lines, arrows. All of a kind are
// one call of drawing.
import * as THREE from "three";
import type { Vec } from "./messages";
import { Growing } from "./solids";
import type { Surroundings } from "./solids";

const over = { depthTest: false, depthWrite: false, transparent: true };

export interface Dot {
  at: Vec;
  /** [pixels of the page] */
  radius: number;
  colour: Vec;
}

/** Round dots; a later one lies over those before it. */
export class Dots extends THREE.Points<THREE.BufferGeometry, THREE.ShaderMaterial> {
  private readonly at: Growing;
  private readonly look: Growing;

  constructor({ ratio }: Surroundings, order: number) {
    super(
      new THREE.BufferGeometry(),
      new THREE.ShaderMaterial({
        ...over,
        uniforms: { ratio },
        vertexShader: /* glsl */ `
uniform float ratio;
attribute vec4 look;  // red, green, blue, radius
varying vec3 colour;
void main() {
  colour = look.rgb;
  gl_PointSize = 2.0 * look.a * ratio;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`,
        fragmentShader: /* glsl */ `
varying vec3 colour;
void main() {
  vec2 off = gl_PointCoord - 0.5;
  if (dot(off, off) > 0.25) discard;
  gl_FragColor = vec4(colour, 1.0);
}`,
      }),
    );
    this.at = new Growing(this.geometry, "position", 3);
    this.look = new Growing(this.geometry, "look", 4);
    this.renderOrder = order;
    this.frustumCulled = false;
  }

  set(dots: Dot[]): void {
    const count = dots.length;
    this.visible = count > 0;
    const at = this.at.take(count), look = this.look.take(count);
    dots.forEach((dot, k) => {
      at.set(dot.at, 3 * k);
      look.set(dot.colour, 4 * k);
      look[4 * k + 3] = dot.radius;
    });
    for (const numbers of [this.at, this.look]) numbers.done(count);
    this.geometry.setDrawRange(0, count);
  }
}

export interface Segments {
  /** from and to, each three numbers */
  ends: ArrayLike<number>;
  /** [pixels of the page] */
  width: number;
  colour: Vec;
}

/** Segments some pixels wide. */
export class WideLines extends THREE.Mesh<THREE.InstancedBufferGeometry, THREE.ShaderMaterial> {
  private readonly from: Growing;
  private readonly to: Growing;
  private readonly look: Growing;

  constructor({ screen }: Surroundings, order: number) {
    const corners = new THREE.InstancedBufferGeometry();
    corners.setAttribute("position", new THREE.BufferAttribute(new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]), 3));
    corners.setIndex([0, 1, 2, 0, 2, 3]);
    super(
      corners,
      new THREE.ShaderMaterial({
        ...over,
        uniforms: { screen },
        side: THREE.DoubleSide,
        forceSinglePass: true,
        vertexShader: /* glsl */ `
uniform vec2 screen;
attribute vec3 from, to;
attribute vec4 look;  // red, green, blue, width
varying vec3 colour;
void main() {
  vec4 a = projectionMatrix * modelViewMatrix * vec4(from, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(to, 1.0);
  // An end behind the eye is drawn in to where the picture begins.
  float near = projectionMatrix[3][2] / (projectionMatrix[2][2] - 1.0);
  if (a.w < near && b.w > near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  else if (b.w < near && a.w > near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * screen;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  colour = look.rgb;
  gl_Position = position.x < 0.5 ? a : b;
  vec2 aside = position.y * vec2(-along.y, along.x) + 0.6 * (2.0 * position.x - 1.0) * along;
  gl_Position.xy += look.a * aside / screen * gl_Position.w;
}`,
        fragmentShader: /* glsl */ `
varying vec3 colour;
void main() { gl_FragColor = vec4(colour, 1.0); }`,
      }),
    );
    const each = (array: Float32Array, size: number) => new THREE.InstancedBufferAttribute(array, size);
    this.from = new Growing(corners, "from", 3, each);
    this.to = new Growing(corners, "to", 3, each);
    this.look = new Growing(corners, "look", 4, each);
    this.renderOrder = order;
    this.frustumCulled = false;
  }

  set(lines: Segments[]): void {
    const count = lines.reduce((sum, { ends }) => sum + ends.length / 6, 0);
    this.visible = count > 0;
    const from = this.from.take(count), to = this.to.take(count), look = this.look.take(count);
    let at = 0;
    for (const { ends, width, colour } of lines) {
      for (let k = 0; k < ends.length; k += 6, ++at) {
        for (let axis = 0; axis < 3; ++axis) {
          from[3 * at + axis] = ends[k + axis];
          to[3 * at + axis] = ends[k + 3 + axis];
          look[4 * at + axis] = colour[axis];
        }
        look[4 * at + 3] = width;
      }
    }
    for (const numbers of [this.from, this.to, this.look]) numbers.done(count);
    this.geometry.instanceCount = count;
  }
}

const kShaftSides = 12, kHeadSides = 16;

/** An arrow: a solid shaft and one or two heads. */
export interface Arrow {
  from: THREE.Vector3;
  /** [m] */
  along: THREE.Vector3;
  heads: 1 | 2;
  colour: Vec;
}

/** Arrows in flat colours, of which the outline is all that is seen. */
export class Arrows extends THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial> {
  private readonly at: Growing;
  private readonly look: Growing;

  constructor(order: number) {
    super(
      new THREE.BufferGeometry(),
      new THREE.ShaderMaterial({
        ...over,
        side: THREE.DoubleSide,
        forceSinglePass: true,
        vertexShader: /* glsl */ `
attribute vec3 look;
varying vec3 colour;
void main() {
  colour = look;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`,
        fragmentShader: /* glsl */ `
varying vec3 colour;
void main() { gl_FragColor = vec4(colour, 1.0); }`,
      }),
    );
    this.at = new Growing(this.geometry, "position", 3);
    this.look = new Growing(this.geometry, "look", 3);
    this.renderOrder = order;
    this.frustumCulled = false;
  }

  /** `thick`: radius of a shaft [m]; an arrow that is shorter than it is thick is left out. */
  set(arrows: Arrow[], thick: number): void {
    const long = arrows.filter(({ along }) => along.length() > 1.5 * thick);
    const count = long.reduce((sum, { heads }) => sum + 6 * kShaftSides + 3 * kHeadSides * heads, 0);
    this.visible = count > 0;
    const at = this.at.take(count), look = this.look.take(count);
    let corner = 0;
    for (const { from, along, heads, colour } of long) {
      const length = along.length(), direction = along.clone().divideScalar(length);
      const side = new THREE.Vector3(Math.abs(direction.z) < 0.9 ? 0 : 1, 0, Math.abs(direction.z) < 0.9 ? 1 : 0)
        .cross(direction)
        .normalize();
      const other = direction.clone().cross(side);
      const put = (reach: number, radius: number, turn: number) => {
        const c = radius * Math.cos(turn), s = radius * Math.sin(turn);
        for (let axis = 0; axis < 3; ++axis) {
          at[3 * corner + axis] =
            from.getComponent(axis) + reach * direction.getComponent(axis) + c * side.getComponent(axis) + s * other.getComponent(axis);
          look[3 * corner + axis] = colour[axis];
        }
        corner += 1;
      };
      const head = Math.min(7 * thick, 0.6 * length);
      for (let k = 0; k < kShaftSides; ++k) {
        const a = (2 * Math.PI * k) / kShaftSides, b = (2 * Math.PI * (k + 1)) / kShaftSides;
        const end = Math.max(0, length - head);
        put(0, thick, a), put(0, thick, b), put(end, thick, b);
        put(0, thick, a), put(end, thick, b), put(end, thick, a);
      }
      for (let k = 0; k < heads; ++k) {
        const tip = length - k * 0.75 * head;
        for (let i = 0; i < kHeadSides; ++i) {
          const a = (2 * Math.PI * i) / kHeadSides, b = (2 * Math.PI * (i + 1)) / kHeadSides;
          put(tip - head, 2.6 * thick, a), put(tip - head, 2.6 * thick, b), put(tip, 0, 0);
        }
      }
    }
    for (const numbers of [this.at, this.look]) numbers.done(count);
    this.geometry.setDrawRange(0, count);
  }
}
