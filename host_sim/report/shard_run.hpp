// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Work cut into shards that threads take one after another. Each shard draws from a seed of its
/// own and writes to a place of its own, so totals do not depend on the number of threads.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace haptic::sim {

/// How a long run is carried out.
struct RunOptions {
  std::uint32_t threads = 1;
  bool progress = false;  ///< a line every few seconds on stderr
};

/// A seed for each number of a run: the numbers of different runs do not repeat each other.
[[nodiscard]] constexpr std::uint64_t seed_of(std::uint64_t seed, std::uint64_t number) {
  std::uint64_t z = seed * 0x9e3779b97f4a7c15ull + (number + 1) * 0xd1342543de82ef95ull;
  z = (z ^ (z >> 32)) * 0xd6e8feb86659fd93ull;
  return z ^ (z >> 32);
}

/// Calls `run(worker, shard)` for every shard in [0, count); `make_worker()` once per thread.
/// `name` is for progress. Rethrows the first exception of a thread.
template <typename MakeWorker, typename Run>
void run_shards(std::size_t count, const RunOptions& options, const std::string& name,
                const MakeWorker& make_worker, const Run& run) {
  std::atomic<std::size_t> next{0}, done{0};
  std::mutex mutex;
  std::exception_ptr failure;
  auto last = std::chrono::steady_clock::now();
  const auto work = [&] {
    try {
      auto worker = make_worker();
      for (std::size_t shard = next++; shard < count; shard = next++) {
        run(worker, shard);
        const std::size_t finished = ++done;
        if (!options.progress) continue;
        const std::lock_guard lock(mutex);
        const auto now = std::chrono::steady_clock::now();
        if (now - last < std::chrono::seconds(5) && finished != count) continue;
        last = now;
        std::fprintf(stderr, "%s: %zu / %zu\n", name.c_str(), finished, count);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::thread> threads;
  for (std::uint32_t k = 1; k < options.threads; ++k) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

/// The numbers of a run's items: all of `count`, or the one that is asked for.
[[nodiscard]] inline std::vector<std::uint64_t> numbers_of(std::uint64_t count,
                                                           std::optional<std::uint64_t> only) {
  std::vector<std::uint64_t> numbers;
  if (only) return {*only};
  for (std::uint64_t k = 0; k < count; ++k) numbers.push_back(k);
  return numbers;
}

/// The totals of all rows of a table together, in their order.
template <typename Row>
[[nodiscard]] auto sum_of(const std::vector<Row>& rows) {
  decltype(Row::totals) sum;
  for (const Row& row : rows) sum.add(row.totals);
  return sum;
}

/// Sums of rows that share a key, in the order in which the keys first come.
template <typename Key, typename Totals>
class Groups {
 public:
  Totals& at(const Key& key) {
    for (auto& [known, totals] : groups_)
      if (known == key) return totals;
    return groups_.emplace_back(key, Totals{}).second;
  }
  [[nodiscard]] const std::vector<std::pair<Key, Totals>>& list() const { return groups_; }

 private:
  std::vector<std::pair<Key, Totals>> groups_;
};

/// Rows of a table, each with a number of items to judge, cut into shards that threads take in any
/// order. `Row` has `totals` with `add`; they are added in the order of the shards, so that the
/// number of threads changes nothing.
template <typename Row>
struct Campaign {
  struct Shard {
    std::size_t row;
    std::uint64_t count;
  };
  std::vector<Row> rows;
  std::vector<Shard> shards;

  void add(Row row, double count, std::uint64_t most_per_shard) {
    auto left = static_cast<std::uint64_t>(std::ceil(count));
    for (; left > 0; left -= std::min(left, most_per_shard))
      shards.push_back({rows.size(), std::min(left, most_per_shard)});
    rows.push_back(std::move(row));
  }

  /// `judge(kept, shard, number)` gives the totals of a shard; `kept`: what a thread keeps from
  /// one to the next, a map from numbers to std::unique_ptr<Kept>.
  template <typename Kept, typename Judge>
  void run(const RunOptions& options, const std::string& name, const Judge& judge) {
    std::vector<decltype(Row::totals)> results(shards.size());
    const auto make_worker = [] { return std::map<std::size_t, std::unique_ptr<Kept>>(); };
    run_shards(shards.size(), options, name, make_worker,
               [&](auto& kept, std::size_t k) { results[k] = judge(kept, shards[k], k); });
    for (std::size_t k = 0; k < shards.size(); ++k) rows[shards[k].row].totals.add(results[k]);
  }
};

}  // namespace haptic::sim
