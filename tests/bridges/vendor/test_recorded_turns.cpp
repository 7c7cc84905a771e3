// SPDX-License-Identifier: Apache-2.0
// Sessions on stand-ins of the vendors' libraries, kept and replayed without them.
#include <doctest/doctest.h>

#include "tests/bridges/record_bench.hpp"
#include "tests/bridges/vendor/vendor_bench.hpp"
#include "tools/bridges/bridge_table.hpp"
#include "tools/bridges/forcedimension/forcedimension_device.hpp"
#include "tools/bridges/openhaptics/openhaptics_device.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::TapKind;

namespace {

struct VendorKind {
  const char* name;
  VendorMake* make;
  const char* library;
};
const VendorKind kVendorKinds[] = {{"forcedimension", tools::make_forcedimension, HAPTIC_DHD_FAKE},
                                   {"openhaptics", tools::make_openhaptics, HAPTIC_HD_FAKE}};

/// The device moves and turns, pushes, is released, and is opened again.
void record_session(RecordBench& bench, const VendorKind& kind) {
  VendorBench b(kind.make, kind.library, {{"device_velocity", true}});
  b.device = bench.recorded(std::move(b.device));
  b.trace->is_fixed.store(1);
  for (int again = 0; again < 2; ++again) {
    REQUIRE(b.open());
    for (int k = 0; k < 20; ++k) {
      for (int axis = 0; axis < 3; ++axis)
        b.trace->hand_m[axis].store(0.001 * k * (axis + 1) + 0.01 * again);
      b.trace->buttons.store(static_cast<unsigned>(k & 3));
      b.run(4, [&](int ms) { return ramp(4 * k + ms, 1); });
    }
    CHECK(b.release());
    b.device->close();
  }
  b.device.reset();
  bench.recorder.reset();
  b.device = kind.make({}, *std::make_unique<hal::DriverDefect>());
}

tools::ReplayResult replay_row(const VendorKind& kind, const std::string& path) {
  tools::Recording recording(path);
  hal::DriverDefect defect;
  const auto device = kind.make({}, defect);
  for (const tools::BridgeRow& row : tools::bridge_rows())
    if (row.name == kind.name) return row.replay(recording, *device);
  return {};
}

}  // namespace

TEST_SUITE("bridges.recorded_turns") {
  TEST_CASE("a session gives its poses again to the bit, without the library") {
    for (const VendorKind& kind : kVendorKinds) {
      CAPTURE(kind.name);
      RecordBench bench(std::string("recorded_") + kind.name);
      record_session(bench, kind);
      CHECK(bench.count(TapKind::kSettings) == 2);
      CHECK(bench.count(TapKind::kExert) > 50);
      check_same(replay_row(kind, bench.path), 60);
    }
  }

  TEST_CASE("one bit of what the library said, or of a pose, and the replay says where") {
    for (const VendorKind& kind : kVendorKinds) {
      CAPTURE(kind.name);
      RecordBench bench(std::string("changed_") + kind.name);
      record_session(bench, kind);
      const std::vector<char> all = bench.bytes();
      REQUIRE(bench.turn_bit(TapKind::kSensed, 8));
      tools::ReplayResult result = replay_row(kind, bench.path);
      CHECK(result.different == 1);
      CHECK(contains(result.first, "another pose than then"));
      // Position: Force Dimension's comes first, libHD's in the last column of a matrix. What a
      // turn heard twice of one frame makes no pose: then an earlier one is changed.
      const std::size_t at = kind.library == kVendorKinds[0].library ? 95 : 110;
      result.first.clear();
      for (std::size_t back = 0; back < 20 && result.first.empty(); ++back) {
        bench.write(all);
        REQUIRE(bench.turn_bit(TapKind::kCall, at, 0, back));
        result = replay_row(kind, bench.path);
      }
      CHECK_FALSE(result.first.empty());
    }
  }

  TEST_CASE("a byte changed anywhere: the replay ends, with a result or a refusal") {
    for (const VendorKind& kind : kVendorKinds) {
      RecordBench bench(std::string("mutated_") + kind.name);
      record_session(bench, kind);
      check_mutations(
          bench, [&](const std::string& path) { return replay_row(kind, path); }, 60);
    }
  }

  TEST_CASE("turns of a library in an order that cannot be are told, and end") {
    RecordBench bench("turns_order");
    bench.begin();
    bench.recorder->note(TapKind::kSense, 0, {}, {});
    bench.recorder.reset();
    const tools::ReplayResult result = replay_row(kVendorKinds[0], bench.path);
    CHECK(result.poses == 0);
    CHECK(contains(result.first, "asked for less here"));
  }
}
