// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A recording of an emulated session, and one of it with a byte changed behind a right check sum.

#include <doctest/doctest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "tests/support/program_run.hpp"
#include "tools/bridges/record/bridge_recorder.hpp"
#include "tools/bridges/record/recorded_device.hpp"
#include "tools/bridges/record/recording.hpp"
#include "tools/bridges/record/replay.hpp"

namespace haptic::test {

/// The folder of a recording, and its recorder while it is made.
struct RecordBench {
  explicit RecordBench(const std::string& name) : folder(name), path(folder.file("session.rec")) {}

  void begin(tools::RecorderSettings settings = {}) {
    settings.path = path;
    recorder = std::make_shared<tools::BridgeRecorder>(std::move(settings));
  }
  /// `device`, whose session is kept from now on.
  std::unique_ptr<hal::BridgedDevice> recorded(std::unique_ptr<hal::BridgedDevice> device) {
    begin();
    return std::make_unique<tools::RecordedDevice>(std::move(device), recorder);
  }
  [[nodiscard]] std::vector<char> bytes() const {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write(const std::vector<char>& bytes) const {
    std::ofstream(path, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  /// Turns a bit of the received bytes of the last entry of `kind` that has more than `at` of them.
  /// @param bit  of that byte. @return false: there is none.
  [[nodiscard]] bool turn_bit(hal::TapKind kind, std::size_t at, unsigned bit = 0) const {
    tools::RecordEntry entry, last;
    {
      tools::Recording recording(path);
      while (recording.next(entry))
        if (entry.kind == kind && entry.received.size() > at) last = entry;
    }
    if (last.received.empty()) return false;
    std::vector<char> all = bytes();
    const std::size_t begin = last.at, size = 36 + last.sent.size() + last.received.size();
    all[begin + 32 + last.sent.size() + at] ^= static_cast<char>(1u << bit);
    const std::uint32_t sum =
        hal::crc32({reinterpret_cast<const std::uint8_t*>(all.data()) + begin, size - 4});
    std::memcpy(all.data() + begin + size - 4, &sum, sizeof sum);
    write(all);
    return true;
  }
  [[nodiscard]] std::size_t count(hal::TapKind kind) const {
    tools::RecordEntry entry;
    tools::Recording recording(path);
    std::size_t found = 0;
    while (recording.next(entry)) found += entry.kind == kind ? 1 : 0;
    return found;
  }

  sim::test::ScratchFolder folder;
  std::string path;
  std::shared_ptr<tools::BridgeRecorder> recorder;
};

/// @param least  poses that must be in it
inline void check_same(const tools::ReplayResult& result, std::uint64_t least) {
  CAPTURE(result.first);
  CHECK(result.first.empty());
  CHECK(result.poses >= least);
  CHECK(result.different == 0);
  CHECK(result.has_end);
  CHECK(result.end == tools::RecordingEnd::kDone);
}

}  // namespace haptic::test
