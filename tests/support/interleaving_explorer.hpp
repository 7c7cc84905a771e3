// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs a writer and a reader in every order that their operations on shared memory can take. The
/// code under test is the real one: it is given ExploredAtomic for std::atomic, and its values are
/// made of ExploredWord. Each execution starts from a fresh scenario and follows the decisions of
/// the one before up to the last that has an alternative left, so that all are met once.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace haptic::test {

/// What a load may return, and what counts as a violation in addition to the scenario's own
/// demands.
enum class MemoryModel : std::uint8_t {
  /// One memory, every operation on an atomic and every copy of a word a step of its own. Orders
  /// of atomics mean nothing, races of words only what they do to the values.
  kInterleaving,
  /// C++20 release and acquire: a relaxed load returns any store that the thread has not been
  /// overtaken by, and two accesses to a word that no release and acquire orders are a violation
  /// (for which words need no steps of their own). Stores of one atomic take effect in the order of
  /// execution, sequential consistency is taken for release and acquire, and no load sees a store
  /// that is executed after it; the last leaves out some outcomes of relaxed code on real machines.
  kReleaseAcquire
};

/// One execution of two threads over objects that the constructor makes; no exception leaves it.
class Scenario {
 public:
  virtual ~Scenario() = default;
  virtual void writer() = 0;  ///< thread 0
  virtual void reader() = 0;  ///< thread 1
  virtual void settled() {}   ///< after both have ended and are joined
};

struct Exploration {
  std::uint64_t interleavings = 0;  ///< executions, each different
  bool complete = false;            ///< there is no other; false at a violation or at the limit
  std::string violation;            ///< empty: none. First one found
  std::string schedule;             ///< of the violation: w and r, one per operation
};

/// All executions of the scenarios that `make` makes, until one violates a demand or `limit` is
/// reached. Each has to end within 1000 operations. Deterministic; one exploration at a time.
Exploration explore(MemoryModel model, const std::function<std::unique_ptr<Scenario>()>& make,
                    std::uint64_t limit = 20'000'000);

template <class ScenarioType>
Exploration explore(MemoryModel model) {
  return explore(model, [] { return std::make_unique<ScenarioType>(); });
}

/// From within a scenario: ends the exploration with this violation unless `holds`.
void demand(bool holds, const char* violation);

/// The explored thread that runs: 0 writer, 1 reader, 2 neither.
std::size_t explored_thread();

/// The explorer's side of one atomic or word. Made within an explored thread it is that thread's
/// own and its operations are not explored.
class ExploredLocation {
 public:
  explicit ExploredLocation(std::uint64_t value);
  [[nodiscard]] std::uint64_t load(std::memory_order order) const;
  void store(std::uint64_t value, std::memory_order order);
  std::uint64_t exchange(std::uint64_t value, std::memory_order order);
  [[nodiscard]] std::uint64_t plain_read() const;
  void plain_write(std::uint64_t value);

 private:
  std::size_t index_;    ///< kOwn or the number within the execution
  std::uint64_t value_;  ///< of plain words and of what is the thread's own
};

/// The orders as the code under test states them.
struct StatedOrders {
  static std::memory_order of(std::memory_order stated) { return stated; }
};

/// As much of std::atomic as is explored; `Orders` has the last word on the orders.
template <class T, class Orders>
class OrderedAtomic {
 public:
  // NOLINTNEXTLINE(readability-identifier-naming): the standard's name
  static constexpr bool is_always_lock_free = true;
  OrderedAtomic() : OrderedAtomic(T{}) {}
  OrderedAtomic(T value) : location_(value) {}  // as std::atomic: not explicit
  OrderedAtomic(const OrderedAtomic&) = delete;
  OrderedAtomic& operator=(const OrderedAtomic&) = delete;
  [[nodiscard]] T load(std::memory_order order) const {
    return static_cast<T>(location_.load(Orders::of(order)));
  }
  void store(T value, std::memory_order order) { location_.store(value, Orders::of(order)); }
  T exchange(T value, std::memory_order order) {
    return static_cast<T>(location_.exchange(value, Orders::of(order)));
  }

 private:
  ExploredLocation location_;
};

/// In place of std::atomic.
template <class T>
using ExploredAtomic = OrderedAtomic<T, StatedOrders>;

enum class Half : std::uint8_t { kRelease, kAcquire };

/// `WithoutOrder<0, Half::kRelease>::Atomic` is an ExploredAtomic whose operations lose that half
/// of their order when that thread runs them: the code under test with a weaker order written into
/// it.
template <std::size_t thread, Half half>
struct WithoutOrder {
  static std::memory_order of(std::memory_order stated) {
    if (explored_thread() != thread) return stated;
    const auto kept =
        half == Half::kRelease ? std::memory_order_acquire : std::memory_order_release;
    return stated == kept || stated == std::memory_order_acq_rel ? kept : std::memory_order_relaxed;
  }
  template <class T>
  using Atomic = OrderedAtomic<T, WithoutOrder>;
};

/// A word of a value that is copied without atomics.
class ExploredWord {
 public:
  ExploredWord(std::uint64_t value = 0) : location_(value) {}  // as the number it stands for
  ExploredWord(const ExploredWord& other) : location_(other.location_.plain_read()) {}
  ExploredWord& operator=(const ExploredWord& other) {
    if (this != &other) location_.plain_write(other.location_.plain_read());
    return *this;
  }
  [[nodiscard]] std::uint64_t value() const { return location_.plain_read(); }

 private:
  ExploredLocation location_;
};

/// A value of two words that belong together: a copy of half of another shows.
struct ExploredPair {
  ExploredWord low, high;

  static ExploredPair of(std::uint64_t n) { return {n, partner(n)}; }
  static std::uint64_t partner(std::uint64_t n) { return n == 0 ? 0 : 1000 - 3 * n; }
  /// The number of a copy of `pair`; a torn one is a violation.
  static std::uint64_t number(const ExploredPair& pair) {
    const std::uint64_t low = pair.low.value(), high = pair.high.value();
    demand(high == partner(low), "torn");
    return low;
  }
};

}  // namespace haptic::test
