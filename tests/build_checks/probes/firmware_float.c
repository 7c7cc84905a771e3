/* SPDX-License-Identifier: Apache-2.0 */
/* A firmware that scales in floating point. */
float scaled(float force, float by);
float scaled(float force, float by) { return force * by; }
