// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

#include "rt_core/exchange/stamped_record.hpp"
#include "rt_core/exchange/step_trace.hpp"
#include "tests/support/interleaving_explorer.hpp"
#include "tests/support/signal_process.hpp"
#include "tests/support/two_threads.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

// A trace of which every byte follows from the tick, so that a torn copy shows.
using TraceWords = std::array<std::uint64_t, sizeof(StepTrace) / sizeof(std::uint64_t)>;
TraceWords words_of_tick(std::uint64_t tick) {
  TraceWords words{};
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = tick * (1 + 2 * i * tick);
  return words;
}
StepTrace trace_of(std::uint64_t tick) { return std::bit_cast<StepTrace>(words_of_tick(tick)); }
bool is_whole(const StepTrace& trace) {
  return std::bit_cast<TraceWords>(trace) == words_of_tick(trace.tick);
}

// Memory whose last byte is the last of a page; the pages on both sides can not be touched. Other
// processes made from this one share it.
class FencedMemory {
 public:
  explicit FencedMemory(std::size_t bytes) : bytes_(bytes) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    inner_ = (bytes + page - 1) / page * page;
    mapped_ = inner_ + 2 * page;
    void* at = mmap(nullptr, mapped_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    REQUIRE(at != MAP_FAILED);
    base_ = static_cast<std::byte*>(at);
    begin_ = base_ + page;
    REQUIRE(mprotect(base_, page, PROT_NONE) == 0);
    REQUIRE(mprotect(begin_ + inner_, page, PROT_NONE) == 0);
  }
  ~FencedMemory() { munmap(base_, mapped_); }
  FencedMemory(const FencedMemory&) = delete;
  FencedMemory& operator=(const FencedMemory&) = delete;

  [[nodiscard]] std::span<std::byte> at_end() const { return {begin_ + inner_ - bytes_, bytes_}; }

 private:
  std::size_t bytes_, inner_ = 0, mapped_ = 0;
  std::byte* base_ = nullptr;
  std::byte* begin_ = nullptr;
};

std::vector<std::uint64_t> ticks_in(std::span<const std::byte> memory, std::size_t room) {
  std::vector<StepTrace> out(room);
  out.resize(FlightRecorder::copy_newest(memory, out));
  std::vector<std::uint64_t> ticks;
  for (const StepTrace& trace : out) {
    CHECK(is_whole(trace));
    ticks.push_back(trace.tick);
  }
  return ticks;
}
std::vector<std::uint64_t> range(std::uint64_t first, std::uint64_t last) {
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t tick = first; tick <= last; ++tick) ticks.push_back(tick);
  return ticks;
}

// One record written `writes` times while the other thread copies it `reads` times.
template <class Record, std::uint64_t writes, int reads>
struct WriteAndCopy : Scenario {
  Record record;
  std::uint64_t last = 0;

  void writer() override {
    for (std::uint64_t n = 1; n <= writes; ++n) record.write(n, {n, ExploredPair::partner(n)});
  }
  void reader() override {
    for (int i = 0; i < reads; ++i) copy();
  }
  void settled() override {
    copy();
    demand(last == writes, "newest never seen");
  }
  void copy() {
    const RecordWord stamp = record.stamp();
    demand(stamp == 0 || stamp >= last, "older than the last one read");
    std::array<RecordWord, 2> words{};
    if (!record.copy(stamp, words)) return;
    demand(words[0] == stamp, "another record than the stamp says");
    demand(words[1] == ExploredPair::partner(stamp), "torn");
    last = stamp;
  }
};

using ExploredStamped = StampedRecord<2, ExploredAtomic>;
template <std::size_t thread, Half half>
using StampedWithout = StampedRecord<2, WithoutOrder<thread, half>::template Atomic>;

// A stamped record with one step left out.
enum class MissingStep { kStampTakenBack, kSecondLook };
template <MissingStep missing>
struct BrokenRecord {
  ExploredAtomic<RecordWord> stamp_word;
  std::array<ExploredAtomic<RecordWord>, 2> words;

  void write(RecordWord stamp, const std::array<RecordWord, 2>& value) {
    if (missing != MissingStep::kStampTakenBack) stamp_word.store(0, std::memory_order_release);
    for (std::size_t i = 0; i < 2; ++i) words[i].store(value[i], std::memory_order_release);
    stamp_word.store(stamp, std::memory_order_release);
  }
  RecordWord stamp() const { return stamp_word.load(std::memory_order_acquire); }
  bool copy(RecordWord stamp, std::array<RecordWord, 2>& value) const {
    if (stamp == 0 || stamp_word.load(std::memory_order_acquire) != stamp) return false;
    for (std::size_t i = 0; i < 2; ++i) value[i] = words[i].load(std::memory_order_acquire);
    return missing == MissingStep::kSecondLook ||
           stamp_word.load(std::memory_order_acquire) == stamp;
  }
};

}  // namespace

TEST_SUITE("rt_core.flight_recorder") {
  TEST_CASE("copy_newest: the newest records in order, before the ring is full and after") {
    constexpr std::size_t kRecords = 7;
    const FencedMemory memory(FlightRecorder::bytes_for(kRecords));
    FlightRecorder recorder(memory.at_end());
    CHECK(recorder.capacity() == kRecords);
    CHECK(ticks_in(memory.at_end(), 10).empty());
    for (std::uint64_t tick = 1; tick <= 40; ++tick) {
      recorder.write(trace_of(tick));
      for (const std::size_t room :
           {std::size_t{0}, std::size_t{1}, std::size_t{4}, kRecords, 2 * kRecords}) {
        const std::uint64_t count = std::min<std::uint64_t>(tick, std::min(room, kRecords));
        CHECK(ticks_in(memory.at_end(), room) == range(tick - count + 1, tick));
      }
    }
    // Another recorder over the same memory starts again.
    FlightRecorder again(memory.at_end());
    CHECK(ticks_in(memory.at_end(), 10).empty());
    again.write(trace_of(3));
    CHECK(ticks_in(memory.at_end(), 10) == range(3, 3));
  }

  TEST_CASE("recorder: as many records as fit; memory too small or not aligned records nothing") {
    alignas(64) std::array<std::byte, 4096> memory{};
    const std::span<std::byte> whole(memory);
    const std::size_t two = FlightRecorder::bytes_for(2), three = FlightRecorder::bytes_for(3);
    for (std::size_t bytes = 0; bytes < three; bytes += 8) {
      FlightRecorder recorder(whole.first(bytes));
      const std::size_t fit = bytes < FlightRecorder::bytes_for(1) ? 0 : bytes < two ? 1 : 2;
      REQUIRE(recorder.capacity() == fit);
      for (std::uint64_t tick = 1; tick <= 5; ++tick) recorder.write(trace_of(tick));
      REQUIRE(ticks_in(whole.first(bytes), 9) == range(6 - fit, 5));
    }
    FlightRecorder misplaced(whole.subspan(8));
    CHECK(misplaced.capacity() == 0);
    misplaced.write(trace_of(1));
    CHECK(ticks_in(whole.subspan(8), 9).empty());
  }

  TEST_CASE("copy_newest: memory cut short, moved or of another layout is not a recorder's") {
    alignas(64) std::array<std::byte, 4096> memory{};
    FlightRecorder recorder{std::span<std::byte>(memory)};
    for (std::uint64_t tick = 1; tick <= 50; ++tick) recorder.write(trace_of(tick));
    const std::size_t full = FlightRecorder::bytes_for(recorder.capacity());
    CHECK(ticks_in(std::span(memory).first(full), 99).size() == recorder.capacity());
    for (std::size_t bytes = 0; bytes < full; ++bytes)
      REQUIRE(ticks_in(std::span(memory).first(bytes), 99).empty());
    CHECK(ticks_in(std::span(memory).subspan(64), 99).empty());
    // The first four words: magic, sizes of slot and trace, number of slots.
    for (std::size_t word = 0; word < 4; ++word) {
      std::byte& byte = memory[word * sizeof(RecordWord) + 2];
      byte ^= std::byte{1};
      CHECK(ticks_in(memory, 99).empty());
      byte ^= std::byte{1};
    }
    CHECK(ticks_in(memory, 99).size() == recorder.capacity());
  }

  TEST_CASE("copy_newest: with any bytes, nothing outside the memory is touched") {
    constexpr std::uint32_t kSeed = 20;
    CAPTURE(kSeed);
    std::mt19937 random(kSeed);
    constexpr std::size_t kRecords = 5;
    const FencedMemory memory(FlightRecorder::bytes_for(kRecords));
    const std::span<std::byte> bytes = memory.at_end();
    const auto poke = [&](std::size_t at) { bytes[at] = std::byte(random() & 255U); };
    std::array<StepTrace, 8> out;
    std::size_t some = 0;
    for (int round = 0; round < 20'000; ++round) {
      FlightRecorder recorder(bytes);
      const std::uint64_t written = random() % 12;
      for (std::uint64_t tick = 1; tick <= written; ++tick) recorder.write(trace_of(tick));
      // All bytes; or all behind the header; or a few anywhere; or stamps of full words of ones.
      const std::uint32_t kind = random() % 4;
      if (kind <= 1)
        for (std::size_t i = kind == 0 ? 0 : 64; i < bytes.size(); ++i) poke(i);
      if (kind == 2)
        for (int i = 0; i < 6; ++i) poke(random() % bytes.size());
      if (kind == 3) std::memset(&bytes[FlightRecorder::bytes_for(random() % kRecords)], 0xFF, 8);
      for (StepTrace& trace : out) trace.tick = 0xABCD;
      const std::size_t room = random() % 8;
      const std::size_t copied = FlightRecorder::copy_newest(bytes, std::span(out).first(room));
      REQUIRE(copied <= std::min(room, kRecords));
      for (std::size_t i = room; i < out.size(); ++i) REQUIRE(out[i].tick == 0xABCD);
      some += copied > 0 ? 1U : 0U;
    }
    CHECK(some > 1000);  // the rounds get past the header
  }

  TEST_CASE("writer killed at any moment: at most the record it was at is lost") {
    constexpr std::size_t kRecords = 16;
    const FencedMemory memory(FlightRecorder::bytes_for(kRecords));
    int in_the_middle = 0;
    for (int round = 0; round < 60; ++round) {
      FlightRecorder recorder(memory.at_end());
      const pid_t writer = fork();
      if (writer == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (std::uint64_t tick = 1;; ++tick) recorder.write(trace_of(tick));
      }
      REQUIRE(writer > 0);
      std::array<StepTrace, 1> newest{};
      while (FlightRecorder::copy_newest(memory.at_end(), newest) == 0 ||
             newest[0].tick < 3 * kRecords)
        std::this_thread::yield();
      signal_process(writer, SIGKILL);
      int status = 0;
      REQUIRE(waitpid(writer, &status, 0) == writer);
      CHECK(WIFSIGNALED(status));
      const auto ticks = ticks_in(memory.at_end(), kRecords);
      REQUIRE(!ticks.empty());
      CHECK(ticks == range(ticks.back() - ticks.size() + 1, ticks.back()));
      CHECK(ticks.size() >= kRecords - 1);
      in_the_middle += ticks.size() < kRecords ? 1 : 0;
    }
    MESSAGE(in_the_middle, " of 60 writers died within a record");
  }

  TEST_CASE("two threads: no record torn or twice, in order, also while records are overwritten") {
    constexpr std::size_t kRecords = 16;
    const FencedMemory memory(FlightRecorder::bytes_for(kRecords));
    FlightRecorder recorder(memory.at_end());
    std::array<StepTrace, kRecords> out;
    std::uint64_t torn = 0, disorder = 0, back = 0, copies = 0, newest = 0;
    const auto copy = [&] {
      const std::size_t copied = FlightRecorder::copy_newest(memory.at_end(), out);
      for (std::size_t i = 0; i < copied; ++i) {
        torn += is_whole(out[i]) ? 0U : 1U;
        disorder += i > 0 && out[i].tick <= out[i - 1].tick ? 1U : 0U;
      }
      // Records may be overwritten one after the other while they are copied, so that an older one
      // than last time is the newest left; never older by more than the ring.
      if (copied > 0) back += out[copied - 1].tick + kRecords < newest ? 1U : 0U;
      if (copied > 0) newest = out[copied - 1].tick;
      ++copies;
      return copied;
    };
    const TwoThreadRun run = run_two_threads(
        400'000, 4'000'000, [&](std::uint64_t n) { recorder.write(trace_of(n)); }, copy);
    CHECK(torn == 0);
    CHECK(disorder == 0);
    CHECK(back == 0);
    const std::uint64_t kept = std::min<std::uint64_t>(run.written, kRecords);
    CHECK(ticks_in(memory.at_end(), kRecords) == range(run.written - kept + 1, run.written));
    MESSAGE(run.read, " records in ", copies, " copies while ", run.written, " were written");
  }

  TEST_CASE("one record, every interleaving: what is copied is whole and what its stamp says") {
    const Exploration words =
        explore<WriteAndCopy<ExploredStamped, 3, 3>>(MemoryModel::kInterleaving);
    CHECK_MESSAGE(words.complete, words.violation, " ", words.schedule);
    const Exploration weak =
        explore<WriteAndCopy<ExploredStamped, 2, 2>>(MemoryModel::kReleaseAcquire);
    CHECK_MESSAGE(weak.complete, weak.violation, " ", weak.schedule);
    MESSAGE(words.interleavings, " interleavings of single words, ", weak.interleavings,
            " executions in weak memory");
  }

  TEST_CASE("one record: the writer's releases and the reader's acquires are needed") {
    const auto weak = MemoryModel::kReleaseAcquire;
    CHECK(explore<WriteAndCopy<StampedWithout<0, Half::kRelease>, 2, 1>>(weak).violation == "torn");
    CHECK(explore<WriteAndCopy<StampedWithout<1, Half::kAcquire>, 2, 1>>(weak).violation == "torn");
  }

  TEST_CASE("one record: the explorer finds what a missing step does") {
    const auto violation = [](const Exploration& e) {
      MESSAGE(e.violation, " after ", e.interleavings, " interleavings: ", e.schedule);
      return e.violation;
    };
    const auto words = MemoryModel::kInterleaving;
    CHECK(violation(explore<WriteAndCopy<BrokenRecord<MissingStep::kStampTakenBack>, 2, 1>>(
              words)) == "another record than the stamp says");
    CHECK(violation(explore<WriteAndCopy<BrokenRecord<MissingStep::kSecondLook>, 2, 1>>(words)) ==
          "torn");
  }
}
