// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/vendor/vendor_replay.hpp"

#include <array>
#include <cstring>

namespace haptic::tools {
namespace {

using hal::TapKind;

constexpr std::array kTurnKinds = {TapKind::kSettings, TapKind::kSense,   TapKind::kSensed,
                                   TapKind::kExert,    TapKind::kExerted, TapKind::kCall};

}  // namespace

ReplayResult replay_turns(Recording& recording, const MakeReplayed& make) {
  ReplayTap tap(recording, kTurnKinds);
  std::unique_ptr<VendorHandle> handle;
  while (const RecordEntry* const entry = tap.next()) {
    if (entry->kind == TapKind::kSettings && entry->received.size() == sizeof(VendorNumbers)) {
      VendorNumbers numbers;
      std::memcpy(numbers.data(), entry->received.data(), sizeof numbers);
      handle = make(numbers, tap.shared());
    } else if (entry->kind == TapKind::kSense && handle != nullptr) {
      hal::BridgeSample sample;
      const VendorResult sensed = handle->sense(sample);
      const SampleBytes bytes = bytes_of(sample);
      tap.expect(TapKind::kSensed, static_cast<std::int64_t>(sensed),
                 std::span(bytes).first(sensed == VendorResult::kDone ? bytes.size() : 0));
    } else if (entry->kind == TapKind::kExert && handle != nullptr) {
      const VendorResult exerted = handle->exert(entry->result != 0, wrench_of_bytes(entry->sent));
      tap.expect(TapKind::kExerted, static_cast<std::int64_t>(exerted), {});
    } else {
      tap.diverge("the library is asked for less here than then");
    }
  }
  return tap.result();
}

}  // namespace haptic::tools
