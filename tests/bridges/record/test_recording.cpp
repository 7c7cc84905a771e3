// SPDX-License-Identifier: Apache-2.0
// Files of recordings: damaged, giant, on a full disk, and keys that are private.
#include <doctest/doctest.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <thread>

#include "tests/bridges/record_bench.hpp"
#include "tests/support/random.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/record/recording_begin.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::TapKind;
using tools::RecordingEnd;

namespace {

constexpr std::uint64_t kRecordingSeed = 815;

std::vector<std::byte> some_bytes(std::size_t count, int first = 0) {
  std::vector<std::byte> bytes(count);
  for (std::size_t k = 0; k < count; ++k)
    bytes[k] = static_cast<std::byte>((static_cast<std::size_t>(first) + k) & 255);
  return bytes;
}

struct Read {
  std::vector<tools::RecordEntry> entries;
  std::string refusal;
};

Read read_all(const std::string& path) {
  Read read;
  try {
    tools::Recording recording(path);
    for (tools::RecordEntry entry; recording.next(entry);) read.entries.push_back(entry);
  } catch (const tools::InputError& error) {
    read.refusal = error.what();
  }
  return read;
}

/// 20 entries of many sizes.
void write_some(RecordBench& bench) {
  bench.begin();
  for (int k = 0; k < 20; ++k)
    bench.recorder->note(TapKind::kSent, k, some_bytes(static_cast<std::size_t>(k) * 7, k),
                         some_bytes(static_cast<std::size_t>(k % 3)));
  bench.recorder.reset();
}

/// Lines that a recorder has said.
struct Said {
  std::mutex mutex;
  std::vector<std::string> lines;
  std::function<void(const std::string&)> into() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex);
      lines.push_back(line);
    };
  }
};

/// Patience, not a time.
bool has_stopped(const tools::BridgeRecorder& recorder) {
  for (int k = 0; k < 5000 && recorder.is_keeping(); ++k)
    (void)hal::sleep_until(hal::monotonic_ns() + 1'000'000);
  return !recorder.is_keeping();
}

/// Notes 1 kB, `count` times, a little apart.
void note_many(tools::BridgeRecorder& recorder, int count) {
  const std::vector<std::byte> bytes = some_bytes(1000);
  for (int k = 0; k < count; ++k) {
    recorder.note(TapKind::kReceived, k, {}, bytes);
    if (k % 100 == 0) (void)hal::sleep_until(hal::monotonic_ns() + 1'000'000);
  }
}

}  // namespace

TEST_SUITE("bridges.recording") {
  TEST_CASE("what was noted comes back, in its order, with an end") {
    RecordBench bench("recording");
    write_some(bench);
    const Read read = read_all(bench.path);
    CHECK(read.refusal.empty());
    REQUIRE(read.entries.size() == 21);
    for (int k = 0; k < 20; ++k) {
      const tools::RecordEntry& entry = read.entries[static_cast<std::size_t>(k)];
      CHECK(entry.kind == TapKind::kSent);
      CHECK(entry.result == k);
      CHECK(entry.sent == some_bytes(static_cast<std::size_t>(k) * 7, k));
      CHECK(entry.received == some_bytes(static_cast<std::size_t>(k % 3)));
    }
    CHECK(read.entries.back().kind == TapKind::kEnd);
    CHECK(read.entries.back().result == 0);
    const auto mode = std::filesystem::status(bench.path).permissions();
    CHECK((mode & std::filesystem::perms::others_read) == std::filesystem::perms::none);
  }

  TEST_CASE("four threads at once: each entry whole, those of a thread in their order") {
    RecordBench bench("recording_threads");
    bench.begin();
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (int k = 0; k < 2000; ++k)
          bench.recorder->note(TapKind::kClock, t * 10'000 + k,
                               some_bytes(static_cast<std::size_t>(k % 90), t), {});
      });
    for (std::thread& thread : threads) thread.join();
    bench.recorder.reset();
    const Read read = read_all(bench.path);
    CHECK(read.refusal.empty());
    REQUIRE(read.entries.size() == 8001);
    std::array<std::int64_t, 4> next{};
    for (const tools::RecordEntry& entry : read.entries) {
      if (entry.kind == TapKind::kEnd) continue;
      const std::int64_t thread = entry.result / 10'000, k = entry.result % 10'000;
      CHECK(k == next[static_cast<std::size_t>(thread)]++);
      CHECK(entry.sent == some_bytes(static_cast<std::size_t>(k % 90), static_cast<int>(thread)));
    }
  }

  TEST_CASE("cut anywhere: refused with file, byte and fix, or whole up to there") {
    RecordBench bench("recording_cut");
    write_some(bench);
    const std::vector<char> all = bench.bytes();
    std::vector<std::uint64_t> begins;
    for (const tools::RecordEntry& entry : read_all(bench.path).entries) begins.push_back(entry.at);
    for (std::size_t length = 0; length < all.size(); ++length) {
      bench.write({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(length)});
      const Read read = read_all(bench.path);
      const auto at = std::ranges::find(begins, length);
      CAPTURE(length);
      if (at != begins.end()) {
        CHECK(read.refusal.empty());
        CHECK(read.entries.size() == static_cast<std::size_t>(at - begins.begin()));
      } else if (length < 16) {
        CHECK(has(read.refusal, bench.path + ": byte 0: no recording of a bridge; give a file"));
      } else {
        CHECK(has(read.refusal, bench.path + ": byte "));
        CHECK(has(read.refusal, "head -c "));
      }
    }
  }

  TEST_CASE("any bit turned: refused with its byte") {
    RecordBench bench("recording_bits");
    write_some(bench);
    std::vector<char> all = bench.bytes();
    for (std::size_t at = 0; at < all.size(); ++at) {
      all[at] ^= static_cast<char>(1u << (at % 8));
      bench.write(all);
      CAPTURE(at);
      CHECK(has(read_all(bench.path).refusal, bench.path + ": byte "));
      all[at] ^= static_cast<char>(1u << (at % 8));
    }
  }

  TEST_CASE("any bytes behind the magic, right check sums too: an answer, and no crash") {
    RecordBench bench("recording_random");
    Random random(kRecordingSeed);
    for (int k = 0; k < 300; ++k) {
      std::vector<char> all(tools::kRecordingMagic.begin(), tools::kRecordingMagic.end());
      const auto length = static_cast<std::size_t>(random.uniform(0, 200));
      for (std::size_t i = 0; i < length; ++i)
        all.push_back(static_cast<char>(static_cast<int>(random.uniform(0, 255.99))));
      if (k % 2 == 0 && length >= 36) {
        const auto size = static_cast<std::uint32_t>(length);
        std::memcpy(all.data() + 16, &size, 4);
        const std::uint32_t sum = hal::crc32(
            {reinterpret_cast<const std::uint8_t*>(all.data()) + 16, std::size_t{size} - 4});
        std::memcpy(all.data() + 16 + size - 4, &sum, 4);
      }
      bench.write(all);
      const Read read = read_all(bench.path);
      CHECK((length == 0 || !read.refusal.empty()));
    }
  }

  TEST_CASE("no file, a folder, another file, another version, a giant") {
    RecordBench bench("recording_other");
    CHECK(has(read_all(bench.path).refusal, "cannot be read as a file; check the path"));
    CHECK(has(read_all(bench.folder.file("")).refusal, "cannot be read as a file"));
    CHECK(has(read_all("/dev/zero").refusal, "cannot be read as a file"));
    bench.write({'h', 'a', 'l', 'l', 'o'});
    CHECK(has(read_all(bench.path).refusal, "no recording of a bridge"));
    bench.write({'H', 'A', 'P', 'T', 'I', 'C', '-', 'B', 'R', 'I', 'D', 'G', 'E', '-', 'R', '9'});
    CHECK(has(read_all(bench.path).refusal, "another version of this program"));
    std::filesystem::remove(bench.path);
    write_some(bench);
    std::filesystem::resize_file(bench.path, (std::uint64_t{1} << 30) + 1);
    CHECK(has(read_all(bench.path).refusal, "has 1073741825 bytes, and a recording has 1 GiB"));
  }

  TEST_CASE("recorder: keeps the recording before, and replaces no other file") {
    RecordBench bench("recording_replaced");
    write_some(bench);
    bench.begin();
    bench.recorder.reset();
    CHECK(read_all(bench.path).entries.size() == 1);
    CHECK(read_all(bench.path + ".1").entries.size() == 21);
    const std::vector<char> mine = {'m', 'i', 'n', 'e'};
    bench.write(mine);
    CHECK_THROWS_AS(bench.begin(), tools::UsageError);
    CHECK(bench.bytes() == mine);
    std::filesystem::remove(bench.path);
    write_some(bench);
    std::ofstream(bench.path + ".1") << "mine";
    CHECK_THROWS_AS(bench.begin(), tools::UsageError);
    bench.path = bench.folder.file("absent/session.rec");
    CHECK_THROWS_AS(bench.begin(), tools::OsError);
  }

  TEST_CASE("recorder: ends at its size with a word, and is whole") {
    RecordBench bench("recording_full");
    Said said;
    tools::RecorderSettings settings;
    settings.most_bytes = 100'000;
    settings.say = said.into();
    bench.begin(settings);
    note_many(*bench.recorder, 1000);
    CHECK(has_stopped(*bench.recorder));
    bench.recorder.reset();
    const Read read = read_all(bench.path);
    CHECK(read.refusal.empty());
    CHECK(read.entries.size() > 90);
    CHECK(read.entries.back().result == static_cast<std::int64_t>(RecordingEnd::kFull));
    CHECK(std::filesystem::file_size(bench.path) <= 100'000);
    REQUIRE(said.lines.size() == 1);
    CHECK(has(said.lines[0], "record_mb"));
  }

  TEST_CASE("recorder: a disk that is slower than its device ends it, without a gap") {
    RecordBench bench("recording_slow");
    Said said;
    tools::RecorderSettings settings;
    settings.waiting_bytes = 4096;
    settings.say = said.into();
    bench.begin(settings);
    const std::vector<std::byte> bytes = some_bytes(1000);
    for (int k = 0; k < 50; ++k) bench.recorder->note(TapKind::kReceived, k, {}, bytes);
    CHECK(has_stopped(*bench.recorder));
    bench.recorder.reset();
    const Read read = read_all(bench.path);
    CHECK(read.refusal.empty());
    CHECK(read.entries.back().result == static_cast<std::int64_t>(RecordingEnd::kSlow));
    for (std::size_t k = 0; k + 1 < read.entries.size(); ++k)
      CHECK(read.entries[k].result == static_cast<std::int64_t>(k));
    CHECK(has(said.lines.at(0), "too slow"));
    RecordBench large("recording_large");
    large.begin();
    large.recorder->note(TapKind::kMessage, 0, {}, some_bytes(tools::kMostEntry_bytes));
    large.recorder.reset();
    CHECK(read_all(large.path).entries.back().result ==
          static_cast<std::int64_t>(RecordingEnd::kTooLong));
  }

  TEST_CASE("recorder: a full disk and a file that may not grow disturb nobody") {
    Said said;
    tools::RecorderSettings settings;
    settings.path = "/dev/full";
    settings.say = said.into();
    {
      tools::BridgeRecorder recorder(settings);
      note_many(recorder, 300);
      CHECK(has_stopped(recorder));
    }
    REQUIRE(said.lines.size() == 1);
    CHECK(has(said.lines[0], "No space left on device"));
    CHECK(has(said.lines[0], "the device is not affected"));

    RecordBench bench("recording_limited");
    rlimit before{};
    REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
    const rlimit small{50'000, before.rlim_max};
    settings.path.clear();
    REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
    bench.begin(settings);
    note_many(*bench.recorder, 300);
    CHECK(has_stopped(*bench.recorder));
    bench.recorder.reset();
    REQUIRE(setrlimit(RLIMIT_FSIZE, &before) == 0);
    REQUIRE(said.lines.size() == 2);
    CHECK(has(said.lines[1], "File too large"));
    // The entries in the file are whole.
    const Read read = read_all(bench.path);
    CHECK(read.refusal.empty());
  }

  TEST_CASE("note: takes less than a period with a disk that takes nothing") {
    tools::RecorderSettings settings;
    settings.path = "/dev/full";
    tools::BridgeRecorder recorder(settings);
    const std::vector<std::byte> bytes = some_bytes(64'000);
    std::vector<std::int64_t> took_ns;
    for (int k = 0; k < 500; ++k) {
      const std::int64_t begin_ns = hal::monotonic_ns();
      recorder.note(TapKind::kMessage, k, {}, bytes);
      took_ns.push_back(hal::monotonic_ns() - begin_ns);
    }
    std::ranges::sort(took_ns);
    // A busy machine holds up some of them; a wait for the disk would hold up most.
    CHECK(took_ns[250] < 500'000);
  }

  TEST_CASE("begin: the keys come back, those given stand instead, private ones are left out") {
    const hal::DriverRow& row = *hal::find_driver("dynamixel");
    hal::DriverOptions options;
    options.values = {{"port", std::string("/dev/serial/by-id/usb-FTDI_FT4TH-if00")},
                      {"urdf", std::string("/home/anna/arm/leader.urdf")},
                      {"baud", 57600.0},
                      {"ids", std::string("1 2 3")},
                      {"pose_only", true}};
    const std::string text = tools::begin_text(row, options);
    CHECK_FALSE(has(text, "anna"));
    CHECK_FALSE(has(text, "FT4TH"));
    RecordBench bench("recording_begin");
    const auto begin_with = [&](const std::string& words, TapKind kind = TapKind::kBegin) {
      bench.begin();
      bench.recorder->note(kind, 0, {}, std::as_bytes(std::span<const char>(words)));
      bench.recorder.reset();
    };
    begin_with(text);
    hal::DriverOptions given;
    given.values = {{"urdf", std::string("here.urdf")}};
    {
      tools::Recording recording(bench.path);
      const hal::DriverOptions back = tools::recorded_options(recording, row, given);
      CHECK(*back.value<std::string>("urdf") == "here.urdf");
      CHECK(*back.value<double>("baud") == 57600);
      CHECK(*back.value<bool>("pose_only"));
      CHECK(*back.value<std::string>("ids") == "1 2 3");
      CHECK(back.values.size() == 5);
    }
    const auto refusal = [&](const char* bridge) {
      try {
        tools::Recording recording(bench.path);
        (void)tools::recorded_options(recording, *hal::find_driver(bridge), {});
      } catch (const tools::InputError& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    CHECK(has(refusal("haply"), "device_bridge dynamixel --replay"));
    begin_with(R"({"bridge": "haply", "keys": {"http_port": "ten"}})");
    CHECK(has(refusal("haply"), "the key http_port has another type"));
    for (const char* words :
         {"", "{", "[]", "{\"bridge\": 1, \"keys\": {}}", "{\"bridge\": \"haply\"}"}) {
      begin_with(words);
      CHECK(has(refusal("haply"), "does not begin with its bridge"));
    }
    begin_with(text, TapKind::kOpen);
    CHECK(has(refusal("dynamixel"), "does not begin with its bridge"));
  }
}
