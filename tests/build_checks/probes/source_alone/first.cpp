// SPDX-License-Identifier: Apache-2.0
namespace {
int of_first() { return 1; }
}  // namespace
int first() { return of_first(); }
