// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>

#include "rt_core/exchange/spsc_ring.hpp"
#include "tests/support/derived_value.hpp"
#include "tests/support/interleaving_explorer.hpp"
#include "tests/support/two_threads.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

// One thread pushes 1 to `pushes`, the other tries to pop as often: what any ring has to keep.
// `drops` are numbers that the ring refused; the reader may count at most these, and at least those
// below what it has popped.
template <class Ring, std::uint64_t pushes>
struct PushAndPop : Scenario {
  Ring ring;
  std::array<bool, pushes + 1> refused{};
  std::uint64_t last = 0, popped = 0, drops = 0;

  void writer() override {
    for (std::uint64_t n = 1; n <= pushes; ++n) {
      // The reader looks at `refused` only for numbers below one that it has popped.
      refused[n] = !ring.push(ExploredPair::of(n));
      drops += refused[n] ? 1U : 0U;
    }
  }
  void reader() override {
    for (std::uint64_t i = 0; i < pushes; ++i) pop();
  }
  void settled() override {
    while (pop()) {
    }
    demand(popped + drops == pushes, "lost without being counted");
    demand(ring.dropped() == drops, "drops miscounted");
  }
  bool pop() {
    ExploredPair value;
    if (!ring.pop(value)) return false;
    const std::uint64_t n = ExploredPair::number(value);
    demand(n > last && n <= pushes, "out of order");
    std::uint64_t missing = 0;
    for (std::uint64_t i = last + 1; i < n; ++i) {
      demand(refused[i], "lost");
      ++missing;
    }
    missing_ += missing;
    demand(ring.dropped() >= missing_, "a drop before the value is not counted yet");
    last = n;
    ++popped;
    return true;
  }

 private:
  std::uint64_t missing_ = 0;
};

template <std::size_t capacity_count>
using Explored = SpscRing<ExploredPair, capacity_count, ExploredAtomic>;
template <std::size_t thread, Half half>
using Without = SpscRing<ExploredPair, 2, WithoutOrder<thread, half>::template Atomic>;

// A ring with one mistake.
enum class Mistake { kNone, kPositionBeforeData, kSlotLetGoBeforeCopy, kOneTooMany };
template <Mistake mistake>
struct SimpleRing {
  static constexpr std::uint32_t kCapacity = 2;
  std::array<ExploredPair, kCapacity> slots;
  ExploredAtomic<std::uint32_t> head, tail, drops;

  bool push(const ExploredPair& value) {
    const std::uint32_t at = head.load(std::memory_order_relaxed);
    const std::uint32_t limit = kCapacity + (mistake == Mistake::kOneTooMany ? 1 : 0);
    if (at - tail.load(std::memory_order_acquire) >= limit) {
      drops.store(drops.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    if (mistake == Mistake::kPositionBeforeData) head.store(at + 1, std::memory_order_release);
    slots[at % kCapacity] = value;
    if (mistake != Mistake::kPositionBeforeData) head.store(at + 1, std::memory_order_release);
    return true;
  }
  bool pop(ExploredPair& value) {
    const std::uint32_t at = tail.load(std::memory_order_relaxed);
    if (at == head.load(std::memory_order_acquire)) return false;
    if (mistake == Mistake::kSlotLetGoBeforeCopy) tail.store(at + 1, std::memory_order_release);
    value = slots[at % kCapacity];
    if (mistake != Mistake::kSlotLetGoBeforeCopy) tail.store(at + 1, std::memory_order_release);
    return true;
  }
  std::uint32_t dropped() const { return drops.load(std::memory_order_relaxed); }
};

template <std::size_t capacity_count, std::uint64_t pushes>
void explore_both() {
  using Case = PushAndPop<Explored<capacity_count>, pushes>;
  const Exploration words = explore<Case>(MemoryModel::kInterleaving);
  CHECK_MESSAGE(words.complete, words.violation, " ", words.schedule);
  const Exploration weak = explore<Case>(MemoryModel::kReleaseAcquire);
  CHECK_MESSAGE(weak.complete, weak.violation, " ", weak.schedule);
  MESSAGE("capacity ", capacity_count, ", ", pushes, " values: ", words.interleavings,
          " interleavings of single words, ", weak.interleavings, " executions in weak memory");
}

}  // namespace

TEST_SUITE("rt_core.spsc_ring") {
  TEST_CASE("pop: empty leaves the value; then every value in order, round the ring many times") {
    SpscRing<DerivedValue, 8> ring;
    CHECK(ring.capacity() == 8);
    DerivedValue value = DerivedValue::of(77);
    CHECK_FALSE(ring.pop(value));
    CHECK(value.number() == 77);
    std::uint64_t pushed = 0, popped = 0;
    for (std::uint64_t fill = 1; fill <= 8; ++fill) {
      for (int round = 0; round < 5; ++round) {
        for (std::uint64_t i = 0; i < fill; ++i) CHECK(ring.push(DerivedValue::of(++pushed)));
        for (std::uint64_t i = 0; i < fill; ++i) {
          REQUIRE(ring.pop(value));
          CHECK(value.number() == ++popped);
          CHECK(value.whole());
        }
        CHECK_FALSE(ring.pop(value));
      }
    }
    CHECK(ring.dropped() == 0);
  }

  TEST_CASE("push: full refuses, keeps what it has and counts; the capacity of one works too") {
    SpscRing<DerivedValue, 4> ring;
    for (std::uint64_t n = 1; n <= 10; ++n) CHECK(ring.push(DerivedValue::of(n)) == (n <= 4));
    CHECK(ring.dropped() == 6);
    DerivedValue value;
    CHECK(ring.pop(value));
    CHECK(value.number() == 1);
    CHECK(ring.push(DerivedValue::of(11)));
    CHECK_FALSE(ring.push(DerivedValue::of(12)));
    for (const std::uint64_t n : {2U, 3U, 4U, 11U}) {
      REQUIRE(ring.pop(value));
      CHECK(value.number() == n);
    }
    CHECK_FALSE(ring.pop(value));
    CHECK(ring.dropped() == 7);

    SpscRing<std::uint64_t, 1> single;
    std::uint64_t number = 0;
    for (std::uint64_t n = 1; n <= 5; ++n) {
      CHECK(single.push(n));
      CHECK_FALSE(single.push(100 + n));
      REQUIRE(single.pop(number));
      CHECK(number == n);
      CHECK_FALSE(single.pop(number));
    }
    CHECK(single.dropped() == 5);
  }

  TEST_CASE("two threads: no value torn, out of order or lost without being counted") {
    SpscRing<DerivedValue, 64> ring;
    std::uint64_t refused = 0, last = 0, popped = 0, torn = 0, disorder = 0, uncounted = 0;
    const auto push = [&](std::uint64_t n) { refused += ring.push(DerivedValue::of(n)) ? 0U : 1U; };
    const auto pop = [&] {
      DerivedValue value;
      if (!ring.pop(value)) return 0U;
      ++popped;
      torn += value.whole() ? 0U : 1U;
      disorder += value.number() <= last ? 1U : 0U;
      last = value.number();
      uncounted += ring.dropped() < last - popped ? 1U : 0U;
      return 1U;
    };
    const TwoThreadRun run = run_two_threads(200'000, 4'000'000, push, pop);
    while (pop() != 0) {
    }
    CHECK(torn == 0);
    CHECK(disorder == 0);
    CHECK(uncounted == 0);
    CHECK(ring.dropped() == refused);
    CHECK(popped + refused == run.written);
    MESSAGE(popped, " of ", run.written, " values popped, ", refused, " dropped");
  }

  TEST_CASE("every interleaving: never torn, in order, what is lost is counted") {
    explore_both<1, 3>();
    explore_both<2, 3>();
    const Exploration weak = explore<PushAndPop<Explored<2>, 4>>(MemoryModel::kReleaseAcquire);
    CHECK_MESSAGE(weak.complete, weak.violation, " ", weak.schedule);
    MESSAGE("capacity 2, 4 values: ", weak.interleavings, " executions in weak memory");
  }

  TEST_CASE("[long] every interleaving of four values through a ring of two") {
    explore_both<2, 4>();
  }

  TEST_CASE("every half of the memory order is needed") {
    const auto is_race = [](const Exploration& e) {
      return e.violation == "two threads use a word and no release and acquire orders them";
    };
    const auto weak = MemoryModel::kReleaseAcquire;
    CHECK(is_race(explore<PushAndPop<Without<0, Half::kRelease>, 3>>(weak)));
    CHECK(is_race(explore<PushAndPop<Without<0, Half::kAcquire>, 3>>(weak)));
    CHECK(is_race(explore<PushAndPop<Without<1, Half::kRelease>, 3>>(weak)));
    CHECK(is_race(explore<PushAndPop<Without<1, Half::kAcquire>, 3>>(weak)));
  }

  TEST_CASE("the explorer finds the mistake in a ring, and none where there is none") {
    const auto violation = [](const Exploration& e) {
      MESSAGE(e.violation, " after ", e.interleavings, " interleavings: ", e.schedule);
      return e.violation;
    };
    const auto words = MemoryModel::kInterleaving;
    CHECK(violation(explore<PushAndPop<SimpleRing<Mistake::kPositionBeforeData>, 2>>(words)) ==
          "torn");
    CHECK(violation(explore<PushAndPop<SimpleRing<Mistake::kSlotLetGoBeforeCopy>, 3>>(words)) ==
          "torn");
    CHECK(violation(explore<PushAndPop<SimpleRing<Mistake::kOneTooMany>, 3>>(words)) == "lost");
    CHECK(explore<PushAndPop<SimpleRing<Mistake::kNone>, 2>>(words).complete);
  }
}
