// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>

#include "rt_core/exchange/latest_value.hpp"
#include "tests/support/derived_value.hpp"
#include "tests/support/interleaving_explorer.hpp"
#include "tests/support/two_threads.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

// One thread publishes 1, 2, .., the other reads as often: what any exchange of newest values has
// to keep. The value is read from where `newest` left it, while the writer goes on.
template <class Exchange, std::uint64_t values = 3>
struct PublishAndRead : Scenario {
  Exchange exchange;
  std::uint64_t last = 0;

  void writer() override {
    for (std::uint64_t n = 1; n <= values; ++n) exchange.publish(ExploredPair::of(n));
  }
  void reader() override {
    for (std::uint64_t i = 0; i < values; ++i) read();
  }
  void settled() override {
    read();
    demand(last == values, "newest never seen");
  }
  void read() {
    bool is_new = false;
    const std::uint64_t n = ExploredPair::number(exchange.newest(&is_new));
    demand(n >= last, "older than the last one read");
    demand(is_new == (n != last), "said to be new and is not, or the reverse");
    last = n;
  }
};

using Explored = LatestValue<ExploredPair, ExploredAtomic>;
template <std::size_t thread, Half half>
using Without = LatestValue<ExploredPair, WithoutOrder<thread, half>::template Atomic>;

// Two slots: the writer comes round to the one being read.
struct DoubleBuffer {
  std::array<ExploredPair, 2> slots;
  ExploredAtomic<std::uint32_t> published;
  std::uint32_t write = 1, read = 0;

  void publish(const ExploredPair& value) {
    slots[write] = value;
    write = published.exchange(write, std::memory_order_acq_rel);
  }
  const ExploredPair& newest(bool* is_new) {
    const std::uint32_t newest = published.load(std::memory_order_acquire);
    *is_new = newest != read;
    read = newest;
    return slots[read];
  }
};

// Three slots in turn, without asking which one is being read.
struct SlotsInTurn {
  std::array<ExploredPair, 3> slots;
  ExploredAtomic<std::uint32_t> published;
  std::uint32_t written = 0, read = 0;

  void publish(const ExploredPair& value) {
    slots[++written % 3] = value;
    published.store(written, std::memory_order_release);
  }
  const ExploredPair& newest(bool* is_new) {
    const std::uint32_t newest = published.load(std::memory_order_acquire);
    *is_new = newest != read;
    read = newest;
    return slots[read % 3];
  }
};

// A triple buffer that swaps whether or not there is something new: it gives the old slot back.
struct SwapAlways {
  std::array<ExploredPair, 3> slots;
  ExploredAtomic<std::uint32_t> middle{1};
  std::uint32_t write = 0, read = 2;

  void publish(const ExploredPair& value) {
    slots[write] = value;
    write = middle.exchange(write | 4U, std::memory_order_acq_rel) & 3U;
  }
  const ExploredPair& newest(bool* is_new) {
    const std::uint32_t got = middle.exchange(read, std::memory_order_acq_rel);
    *is_new = (got & 4U) != 0;
    read = got & 3U;
    return slots[read];
  }
};

}  // namespace

TEST_SUITE("rt_core.latest_value") {
  TEST_CASE("newest: value-initialised before the first publish, then the last one published") {
    LatestValue<DerivedValue> exchange;
    bool is_new = true;
    CHECK(exchange.newest(&is_new).number() == 0);
    CHECK_FALSE(is_new);
    for (std::uint64_t n = 1; n <= 20; ++n) {
      for (std::uint64_t i = 0; i < n; ++i) exchange.publish(DerivedValue::of(100 * n + i));
      const DerivedValue& value = exchange.newest(&is_new);
      CHECK(is_new);
      CHECK(value.number() == 100 * n + n - 1);
      CHECK(value.whole());
      // Nothing newer: the same object again.
      CHECK(&exchange.newest(&is_new) == &value);
      CHECK_FALSE(is_new);
    }
  }

  TEST_CASE("newest: what the reader holds stays as it is while others are published") {
    LatestValue<DerivedValue> exchange;
    exchange.publish(DerivedValue::of(1));
    const DerivedValue& held = exchange.newest();
    for (std::uint64_t n = 2; n < 12; ++n) {
      exchange.publish(DerivedValue::of(n));
      CHECK(held.number() == 1);
      CHECK(held.whole());
    }
    CHECK(exchange.newest().number() == 11);
  }

  TEST_CASE("two threads: no value torn, none older than the one before, the last one arrives") {
    LatestValue<DerivedValue> exchange;
    std::uint64_t last = 0, torn = 0, older = 0, wrongly_new = 0;
    const auto read = [&] {
      bool is_new = false;
      const DerivedValue& value = exchange.newest(&is_new);
      torn += value.whole() ? 0U : 1U;
      older += value.number() < last ? 1U : 0U;
      wrongly_new += is_new != (value.number() != last) ? 1U : 0U;
      last = value.number();
      return is_new ? 1U : 0U;
    };
    const TwoThreadRun run = run_two_threads(
        200'000, 2'000'000, [&](std::uint64_t n) { exchange.publish(DerivedValue::of(n)); }, read);
    read();
    CHECK(last == run.written);
    CHECK(torn == 0);
    CHECK(older == 0);
    CHECK(wrongly_new == 0);
    MESSAGE(run.read, " values read of ", run.written, " published");
  }

  TEST_CASE("every interleaving: never torn, never older, the newest seen in the end") {
    const Exploration words = explore<PublishAndRead<Explored>>(MemoryModel::kInterleaving);
    CHECK_MESSAGE(words.complete, words.violation, " ", words.schedule);
    const Exploration weak = explore<PublishAndRead<Explored>>(MemoryModel::kReleaseAcquire);
    CHECK_MESSAGE(weak.complete, weak.violation, " ", weak.schedule);
    const Exploration more = explore<PublishAndRead<Explored, 6>>(MemoryModel::kReleaseAcquire);
    CHECK_MESSAGE(more.complete, more.violation, " ", more.schedule);
    MESSAGE("3 values: ", words.interleavings, " interleavings of single words, ",
            weak.interleavings, " executions in weak memory; 6 values: ", more.interleavings);
  }

  TEST_CASE("every half of the memory order is needed") {
    const auto is_race = [](const Exploration& e) {
      return e.violation == "two threads use a word and no release and acquire orders them";
    };
    const auto weak = MemoryModel::kReleaseAcquire;
    CHECK(is_race(explore<PublishAndRead<Without<0, Half::kRelease>>>(weak)));
    CHECK(is_race(explore<PublishAndRead<Without<0, Half::kAcquire>>>(weak)));
    CHECK(is_race(explore<PublishAndRead<Without<1, Half::kRelease>>>(weak)));
    CHECK(is_race(explore<PublishAndRead<Without<1, Half::kAcquire>>>(weak)));
  }

  TEST_CASE("the explorer finds what is wrong with a double buffer and with broken triple ones") {
    const auto violation = [](const Exploration& e) {
      MESSAGE(e.violation, " after ", e.interleavings, " interleavings: ", e.schedule);
      return e.violation;
    };
    const auto words = MemoryModel::kInterleaving;
    CHECK(violation(explore<PublishAndRead<DoubleBuffer>>(words)) == "torn");
    CHECK(violation(explore<PublishAndRead<SlotsInTurn>>(words)) == "torn");
    CHECK(violation(explore<PublishAndRead<SwapAlways>>(words)) == "older than the last one read");
  }
}
