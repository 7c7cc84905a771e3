// SPDX-License-Identifier: Apache-2.0
// Violates the image's rule: every section has its place.
[[gnu::section(".odd_constants"), gnu::used]] static const int kOdd = 7;
