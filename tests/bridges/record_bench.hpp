// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A recording of an emulated session, and one of it with a byte changed behind a right check sum.

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/random.hpp"
#include "tools/bridges/record/bridge_recorder.hpp"
#include "tools/bridges/record/recorded_device.hpp"
#include "tools/bridges/record/recording.hpp"
#include "tools/bridges/record/replay.hpp"
#include "tools/common/error.hpp"

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
  /// @param bit  of that byte. @param back  entries before the last one. @return false: there is
  ///   none.
  [[nodiscard]] bool turn_bit(hal::TapKind kind, std::size_t at, unsigned bit = 0,
                              std::size_t back = 0) const {
    tools::RecordEntry entry;
    std::vector<tools::RecordEntry> entries;
    {
      tools::Recording recording(path);
      while (recording.next(entry))
        if (entry.kind == kind && entry.received.size() > at) entries.push_back(entry);
    }
    if (entries.size() <= back) return false;
    const tools::RecordEntry& last = entries[entries.size() - 1 - back];
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

/// Replays `count` recordings of which one entry has another byte behind a right check sum: each
/// ends with a result or a refusal.
inline void check_mutations(const RecordBench& bench,
                            const std::function<tools::ReplayResult(const std::string&)>& replay,
                            int count) {
  const std::vector<char> all = bench.bytes();
  std::vector<std::pair<std::size_t, std::size_t>> entries;
  {
    tools::Recording recording(bench.path);
    for (tools::RecordEntry e; recording.next(e);)
      entries.emplace_back(e.at, 36 + e.sent.size() + e.received.size());
  }
  constexpr std::uint64_t kMutationSeed = 4242;
  Random random(kMutationSeed);
  const auto below = [&](std::size_t limit) {
    const auto at = static_cast<std::size_t>(random.uniform(0, static_cast<double>(limit)));
    return std::min(at, limit - 1);
  };
  int answers = 0;
  for (int k = 0; k < count; ++k) {
    std::vector<char> changed = all;
    const auto [begin, size] = entries[below(entries.size())];
    // Kind, time, result, bytes; now and then the sizes.
    const std::size_t at = k % 8 == 0 ? below(size - 4) : 8 + below(size - 12);
    changed[begin + at] = static_cast<char>(static_cast<int>(random.uniform(0, 255)));
    const std::uint32_t sum =
        hal::crc32({reinterpret_cast<const std::uint8_t*>(changed.data()) + begin, size - 4});
    std::memcpy(changed.data() + begin + size - 4, &sum, sizeof sum);
    bench.write(changed);
    try {
      const tools::ReplayResult result = replay(bench.path);
      answers += !result.first.empty() || result.poses > 0 ? 1 : 0;
    } catch (const tools::InputError& error) {
      answers += std::string(error.what()).find(": byte ") != std::string::npos ? 1 : 0;
    }
  }
  CHECK(answers == count);
  bench.write(all);
}

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
