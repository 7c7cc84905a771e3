// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no libm beyond the square root, whose bits would differ between
// libraries.
#include <cmath>

double height(double angle_rad) { return std::sin(angle_rad); }
