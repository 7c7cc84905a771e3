// SPDX-License-Identifier: Apache-2.0
// The explorer against what is known by counting and from the litmus tests of memory models.
#include <doctest/doctest.h>

#include <set>
#include <utility>

#include "tests/support/interleaving_explorer.hpp"

using namespace haptic::test;

namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr auto kAcquire = std::memory_order_acquire;
constexpr auto kRelease = std::memory_order_release;

template <int writes, int reads>
struct Counted : Scenario {
  ExploredAtomic<std::uint32_t> x;
  ExploredWord y;
  void writer() override {
    for (int i = 0; i < writes; ++i) x.store(1, kRelease);
  }
  void reader() override {
    for (int i = 0; i < reads; ++i) (void)y.value();
  }
};

using Outcomes = std::set<std::pair<std::uint64_t, std::uint64_t>>;

// Each thread stores one atomic and loads the other: the outcome is what the two loads returned.
struct StoreBuffering : Scenario {
  explicit StoreBuffering(Outcomes& seen) : outcomes(seen) {}
  Outcomes& outcomes;
  ExploredAtomic<std::uint64_t> x, y;
  std::uint64_t by_writer = 0, by_reader = 0;
  void writer() override {
    x.store(1, kRelease);
    by_writer = y.load(kAcquire);
  }
  void reader() override {
    y.store(1, kRelease);
    by_reader = x.load(kAcquire);
  }
  void settled() override { outcomes.insert({by_writer, by_reader}); }
};

// A message under a flag, the message an atomic.
struct MessagePassing : Scenario {
  MessagePassing(Outcomes& seen, std::memory_order store, std::memory_order load)
      : outcomes(seen), store_order(store), load_order(load) {}
  Outcomes& outcomes;
  std::memory_order store_order, load_order;
  ExploredAtomic<std::uint64_t> message, flag;
  std::uint64_t flag_read = 0, message_read = 0;
  void writer() override {
    message.store(1, kRelaxed);
    flag.store(1, store_order);
  }
  void reader() override {
    flag_read = flag.load(load_order);
    message_read = message.load(kRelaxed);
  }
  void settled() override { outcomes.insert({flag_read, message_read}); }
};

struct Coherence : Scenario {
  ExploredAtomic<std::uint64_t> x;
  void writer() override {
    for (std::uint64_t n = 1; n <= 3; ++n) x.store(n, kRelaxed);
  }
  void reader() override {
    std::uint64_t last = 0;
    for (int i = 0; i < 3; ++i) {
      const std::uint64_t n = x.load(kRelaxed);
      demand(n >= last, "an atomic went back");
      last = n;
    }
  }
  void settled() override { demand(x.load(kRelaxed) == 3, "joined, and not the last store"); }
};

// A release sequence: the reader acquires through an exchange that is itself relaxed.
struct ReleaseSequence : Scenario {
  ExploredAtomic<std::uint64_t> flag;
  ExploredWord message;
  void writer() override {
    message = 7;
    flag.store(1, kRelease);
    flag.exchange(2, kRelaxed);
  }
  void reader() override {
    if (flag.load(kAcquire) == 2) demand(message.value() == 7, "message not seen");
  }
};

template <std::size_t kWithout, Half half>
struct WordUnderFlag : Scenario {
  typename WithoutOrder<kWithout, half>::template Atomic<std::uint64_t> flag;
  ExploredWord message;
  void writer() override {
    message = 7;
    flag.store(1, kRelease);
  }
  void reader() override {
    if (flag.load(kAcquire) == 1) demand(message.value() == 7, "message not seen");
  }
};

struct Endless : Scenario {
  ExploredAtomic<std::uint64_t> x;
  void writer() override { x.store(1, kRelease); }
  void reader() override {
    while (x.load(kAcquire) == 0) {
    }
  }
};

}  // namespace

TEST_SUITE("support.interleaving_explorer") {
  TEST_CASE("explore: as many executions as there are orders, by counting") {
    const auto orders = [](const Exploration& e) {
      CHECK(e.complete);
      CHECK(e.violation.empty());
      return e.interleavings;
    };
    CHECK(orders(explore<Counted<1, 1>>(MemoryModel::kInterleaving)) == 2);
    CHECK(orders(explore<Counted<3, 0>>(MemoryModel::kInterleaving)) == 1);
    CHECK(orders(explore<Counted<0, 3>>(MemoryModel::kInterleaving)) == 1);
    CHECK(orders(explore<Counted<3, 4>>(MemoryModel::kInterleaving)) == 35);
    CHECK(orders(explore<Counted<8, 8>>(MemoryModel::kInterleaving)) == 12870);
  }

  TEST_CASE("explore: the limit ends an exploration that is then not complete") {
    const auto make = [] { return std::make_unique<Counted<8, 8>>(); };
    const Exploration e = explore(MemoryModel::kInterleaving, make, 100);
    CHECK(e.interleavings == 100);
    CHECK_FALSE(e.complete);
    CHECK(e.violation.empty());
  }

  TEST_CASE("store buffering: neither store seen only where memory is weak") {
    for (const auto model : {MemoryModel::kInterleaving, MemoryModel::kReleaseAcquire}) {
      Outcomes outcomes;
      CHECK(explore(model, [&] { return std::make_unique<StoreBuffering>(outcomes); }).complete);
      Outcomes expected = {{0, 1}, {1, 0}, {1, 1}};
      if (model == MemoryModel::kReleaseAcquire) expected.insert({0, 0});
      CHECK(outcomes == expected);
    }
  }

  TEST_CASE("message passing: flag without message only where an order is missing") {
    for (const auto store : {kRelaxed, kRelease}) {
      for (const auto load : {kRelaxed, kAcquire}) {
        Outcomes outcomes;
        const auto make = [&] { return std::make_unique<MessagePassing>(outcomes, store, load); };
        CHECK(explore(MemoryModel::kReleaseAcquire, make).complete);
        Outcomes expected = {{0, 0}, {0, 1}, {1, 1}};
        if (store == kRelaxed || load == kRelaxed) expected.insert({1, 0});
        CHECK(outcomes == expected);
      }
    }
  }

  TEST_CASE("one atomic: never back, in any order; after the end the last store") {
    CHECK(explore<Coherence>(MemoryModel::kInterleaving).complete);
    CHECK(explore<Coherence>(MemoryModel::kReleaseAcquire).complete);
    CHECK(explore<ReleaseSequence>(MemoryModel::kReleaseAcquire).complete);
  }

  TEST_CASE("a word under a flag: a race as soon as either half of the order is gone") {
    const auto violation = [](const Exploration& e) { return e.violation; };
    const auto weak = MemoryModel::kReleaseAcquire;
    const std::string race = "two threads use a word and no release and acquire orders them";
    CHECK(violation(explore<WordUnderFlag<0, Half::kRelease>>(weak)) == race);
    CHECK(violation(explore<WordUnderFlag<1, Half::kAcquire>>(weak)) == race);
    CHECK(explore<WordUnderFlag<1, Half::kRelease>>(weak).complete);  // it has none to lose
    CHECK(explore<WordUnderFlag<0, Half::kRelease>>(MemoryModel::kInterleaving).complete);
  }

  TEST_CASE("a thread that waits for the other is distinguished from one that ends") {
    const Exploration e = explore<Endless>(MemoryModel::kInterleaving);
    CHECK(e.violation == "does not end");
    CHECK(e.schedule.size() == 1000);
    CHECK_FALSE(e.complete);
  }
}
