// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>

#include "rt_core/exchange/newest_record.hpp"
#include "tests/support/derived_value.hpp"
#include "tests/support/interleaving_explorer.hpp"
#include "tests/support/two_threads.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

struct NumberPair {
  std::uint64_t low = 0, high = 0;

  static NumberPair of(std::uint64_t n) { return {n, ExploredPair::partner(n)}; }
};

template <template <class> class Atomic, std::size_t slots>
struct Exchange {
  NewestRecord<NumberPair, Atomic, slots> memory;
  NewestWriter<NumberPair, Atomic, slots> writer{memory};
  NewestReader<NumberPair, Atomic, slots> reader{memory};
};

// One thread publishes 1, 2, .., the other reads as often: what any exchange of newest values has
// to keep.
template <template <class> class Atomic, std::size_t slots = 2, std::uint64_t values = 2>
struct RecordedAndRead : Scenario {
  Exchange<Atomic, slots> exchange;
  std::uint64_t last = 0;

  void writer() override {
    for (std::uint64_t n = 1; n <= values; ++n) exchange.writer.publish(NumberPair::of(n));
  }
  void reader() override { read(); }
  void settled() override {
    read();
    demand(last == values, "newest never seen");
  }
  void read() {
    bool is_new = false;
    const NumberPair pair = exchange.reader.newest(&is_new);
    demand(pair.high == ExploredPair::partner(pair.low), "torn");
    demand(pair.low >= last, "older than the last one read");
    demand(is_new == (pair.low != last), "said to be new and is not, or the reverse");
    last = pair.low;
  }
};

template <std::size_t thread, Half half>
struct Weakened {
  template <class T>
  using Atomic = typename WithoutOrder<thread, half>::template Atomic<T>;
};

using Value = DerivedValue;

struct OneExchange {
  NewestRecord<Value> memory;
  NewestWriter<Value> writer{memory};
  NewestReader<Value> reader{memory};
};

}  // namespace

TEST_SUITE("rt_core.newest_record") {
  TEST_CASE("newest: value-initialised before the first publish, then the last one published") {
    OneExchange e;
    bool is_new = true;
    CHECK(e.reader.newest(&is_new).number() == 0);
    CHECK_FALSE(is_new);
    for (std::uint64_t n = 1; n <= 20; ++n) {
      for (std::uint64_t i = 0; i < n; ++i) e.writer.publish(Value::of(100 * n + i));
      const Value& value = e.reader.newest(&is_new);
      CHECK(is_new);
      CHECK(value.number() == 100 * n + n - 1);
      CHECK(value.whole());
      CHECK(e.reader.newest(&is_new).number() == value.number());
      CHECK_FALSE(is_new);
    }
  }

  TEST_CASE("newest: what the reader holds stays as it is while others are published") {
    OneExchange e;
    e.writer.publish(Value::of(1));
    const Value& held = e.reader.newest();
    for (std::uint64_t n = 2; n < 12; ++n) {
      e.writer.publish(Value::of(n));
      CHECK(held.number() == 1);
      CHECK(held.whole());
    }
    CHECK(e.reader.newest().number() == 11);
  }

  TEST_CASE("each reader has its own newest value") {
    OneExchange e;
    NewestReader<Value> other(e.memory);
    e.writer.publish(Value::of(1));
    bool is_new = false;
    CHECK(e.reader.newest(&is_new).number() == 1);
    CHECK(is_new);
    CHECK(other.newest(&is_new).number() == 1);
    CHECK(is_new);
  }

  TEST_CASE("any bytes in the memory: some value, at once, and the writer goes on") {
    std::uint64_t state = 12345;
    const auto next = [&state] {
      return state = state * 6364136223846793005U + 1442695040888963407U;
    };
    OneExchange e;
    for (int k = 0; k < 20'000; ++k) {
      auto* const bytes = reinterpret_cast<unsigned char*>(&e.memory);
      if (k % 3 == 0) std::memset(bytes, static_cast<int>(next() >> 56U), sizeof e.memory);
      bytes[(next() >> 20U) % sizeof e.memory] = static_cast<unsigned char>(next() >> 40U);
      static_cast<void>(e.reader.newest());
    }
    // The writer's count is its own, and a reader that comes new follows it.
    e.writer.publish(Value::of(7));
    CHECK(NewestReader<Value>(e.memory).newest().number() == 7);
  }

  TEST_CASE("two threads: no value torn, none older than the one before, the last one arrives") {
    OneExchange e;
    std::uint64_t last = 0, torn = 0, older = 0, wrongly_new = 0;
    const auto read = [&] {
      bool is_new = false;
      const Value& value = e.reader.newest(&is_new);
      torn += value.whole() ? 0U : 1U;
      older += value.number() < last ? 1U : 0U;
      wrongly_new += is_new != (value.number() != last) ? 1U : 0U;
      last = value.number();
      return is_new ? 1U : 0U;
    };
    const TwoThreadRun run = run_two_threads(
        200'000, 2'000'000, [&](std::uint64_t n) { e.writer.publish(Value::of(n)); }, read);
    read();
    CHECK(last == run.written);
    CHECK(torn == 0);
    CHECK(older == 0);
    CHECK(wrongly_new == 0);
    MESSAGE(run.read, " values read of ", run.written, " published");
  }

  TEST_CASE("every interleaving: never torn, never older, the newest seen in the end") {
    for (const MemoryModel model : {MemoryModel::kInterleaving, MemoryModel::kReleaseAcquire}) {
      const Exploration two = explore<RecordedAndRead<ExploredAtomic>>(model);
      CHECK_MESSAGE(two.complete, two.violation, " ", two.schedule);
      MESSAGE("2 values, 2 slots: ", two.interleavings, " executions");
    }
    const Exploration lapped =
        explore<RecordedAndRead<ExploredAtomic, 1, 2>>(MemoryModel::kReleaseAcquire);
    CHECK_MESSAGE(lapped.complete, lapped.violation, " ", lapped.schedule);
    MESSAGE("2 values, 1 slot: ", lapped.interleavings, " executions");
  }

  TEST_CASE("the explorer finds a torn value where a half of the memory order is missing") {
    const auto weak = MemoryModel::kReleaseAcquire;
    CHECK(explore<RecordedAndRead<Weakened<0, Half::kRelease>::Atomic, 1>>(weak).violation != "");
    CHECK(explore<RecordedAndRead<Weakened<1, Half::kAcquire>::Atomic, 1>>(weak).violation != "");
  }
}
