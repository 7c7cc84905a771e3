// SPDX-License-Identifier: Apache-2.0
// Compiles only behind first.cpp.
int second() { return of_first(); }
