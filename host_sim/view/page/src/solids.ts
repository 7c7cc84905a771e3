// SPDX-License-Identifier: Apache-2.0
// Surfaces and thin lines in plain colours, cut open by a plane. Light is computed at the corners, as every face is flat: a
// pixel costs next to nothing, also where the processor draws it.
import * as THREE from "three";
import type { Vec } from "./messages";

/** Shared by all that a stage draws. */
export interface Surroundings {
  /** direction towards the lamp, in W */
  lamp: THREE.IUniform<THREE.Vector3>;
  /** plane (normal, constant): what lies behind it is left out */
  cut: THREE.IUniform<THREE.Vector4>;
  /** width and height of what is drawn [pixels of the page] */
  screen: THREE.IUniform<THREE.Vector2>;
  /** pixels of the canvas for one of the page */
  ratio: THREE.IUniform<number>;
}

/** Red, green and blue as they are shown, 0 to 1. */
export function shownColour(text: string): Vec {
  const n = parseInt(text.slice(1), 16);
  return [(n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}

/** The same, linear in light. */
export function linearColour(text: string): Vec {
  const { r, g, b } = new THREE.Color(text);
  return [r, g, b];
}

const kUncut: THREE.IUniform<THREE.Vector4> = { value: new THREE.Vector4(0, 0, 0, 1) };

const kSolidVertex = /* glsl */ `
#ifdef TINTED
attribute vec4 tint;
#else
attribute float sheet;
uniform vec3 colour;
#endif
uniform vec3 lamp;
uniform vec3 inside;
uniform vec4 cut;
varying vec3 lit;
varying vec3 behind;
varying float ahead;
vec3 seen(vec3 colour, vec3 normal_w) {
  vec3 sky = mix(vec3(0.254, 0.275, 0.314), vec3(1.0), 0.5 + 0.5 * normal_w.y);
  vec3 light = colour * (0.605 * max(0.0, dot(normal_w, lamp)) + 0.541 * sky);
  return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
}
void main() {
#ifdef TINTED
  vec3 colour = tint.rgb;
#endif
  vec3 normal_w = mat3(modelMatrix) * normal;
  lit = seen(colour, normal_w);
  behind = inside;
#ifndef TINTED
  if (sheet > 0.5) behind = seen(colour, -normal_w);
#endif
#ifdef TINTED
  float back = tint.a;
#else
  float back = 3e-6;
#endif
  vec3 at_w = (modelMatrix * vec4(position, 1.0)).xyz;
  ahead = dot(at_w, cut.xyz) + cut.w;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  // Of an outside and an inside in one plane the inside is seen.
  if (dot(normal_w, cameraPosition - at_w) > 0.0) gl_Position.z += back * gl_Position.w;
}`;
const kSolidFragment = /* glsl */ `
varying vec3 lit;
varying vec3 behind;
varying float ahead;
void main() {
  if (ahead < 0.0) discard;
  gl_FragColor = vec4(gl_FrontFacing ? lit : behind, 1.0);
}`;

const kPlainVertex = /* glsl */ `
uniform vec4 cut;
varying float ahead;
void main() {
  ahead = dot((modelMatrix * vec4(position, 1.0)).xyz, cut.xyz) + cut.w;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;
const kPlainFragment = /* glsl */ `
uniform vec4 colour;
varying float ahead;
void main() {
  if (ahead < 0.0) discard;
  gl_FragColor = colour;
}`;

/** A lit surface. The inside of a solid, where one looks into it, has the flat colour of a section; a sheet is lit on both sides. */
export class SolidMaterial extends THREE.ShaderMaterial {
  /** `tinted`: by an attribute of colour (linear) and of how far behind others in its plane it is drawn. */
  constructor({ lamp, cut }: Surroundings, options: { tinted?: boolean; isCut?: boolean } = {}) {
    super({
      vertexShader: kSolidVertex,
      fragmentShader: kSolidFragment,
      uniforms: {
        lamp,
        cut: options.isCut ? cut : kUncut,
        colour: { value: new THREE.Vector3() },
        inside: { value: new THREE.Vector3() },
      },
      defines: options.tinted ? { TINTED: "" } : {},
      side: options.isCut ? THREE.DoubleSide : THREE.FrontSide,
      // Lines on its edges lie over it.
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
  }
  paint(colour: string, inside = colour): void {
    this.uniforms.colour.value.set(...linearColour(colour));
    this.uniforms.inside.value.set(...shownColour(inside));
  }
}

/** One colour, of faces or of lines a pixel wide. */
export class PlainMaterial extends THREE.ShaderMaterial {
  private readonly opacityShown: number;

  constructor(cut: Surroundings["cut"] | null, options: { opacity?: number; depthTest?: boolean } = {}) {
    const opacity = options.opacity ?? 1;
    super({
      vertexShader: kPlainVertex,
      fragmentShader: kPlainFragment,
      uniforms: { cut: cut ?? kUncut, colour: { value: new THREE.Vector4() } },
      transparent: opacity < 1,
      depthWrite: opacity === 1,
      depthTest: options.depthTest ?? true,
      side: THREE.DoubleSide,
      forceSinglePass: true,
    });
    this.opacityShown = opacity;
  }
  paint(colour: string): void {
    this.uniforms.colour.value.set(...shownColour(colour), this.opacityShown);
  }
}

/** Numbers of a geometry that change, in memory that grows and is kept. */
export class Growing {
  private attribute: THREE.BufferAttribute;

  constructor(
    private readonly geometry: THREE.BufferGeometry,
    private readonly name: string,
    private readonly size: number,
    private readonly create = (array: Float32Array, size: number) => new THREE.BufferAttribute(array, size),
  ) {
    this.attribute = this.room(64);
  }

  private room(items: number): THREE.BufferAttribute {
    this.attribute = this.create(new Float32Array(items * this.size), this.size);
    this.attribute.setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute(this.name, this.attribute);
    return this.attribute;
  }

  /** Room for so many items, what was there is lost; `done` once they are filled. */
  take(items: number): Float32Array {
    if (items * this.size > this.attribute.array.length) {
      this.geometry.dispose();
      this.room(2 * items);
    }
    return this.attribute.array as Float32Array;
  }
  done(items: number): void {
    this.attribute.clearUpdateRanges();
    this.attribute.addUpdateRange(0, items * this.size);
    this.attribute.needsUpdate = true;
  }
}

/** Faces or segments that change, in one colour or tinted. */
export class Positions {
  readonly geometry = new THREE.BufferGeometry();
  private readonly positions = new Growing(this.geometry, "position", 3);

  /** `drawn` is hidden where there are none. */
  set(values: ArrayLike<number>, drawn: THREE.Object3D): void {
    const count = values.length / 3;
    drawn.visible = count > 0;
    if (count === 0) return;
    this.positions.take(count).set(values);
    this.positions.done(count);
    this.geometry.setDrawRange(0, count);
  }
}
