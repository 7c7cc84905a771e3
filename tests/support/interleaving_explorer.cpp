// SPDX-License-Identifier: Apache-2.0
#include "tests/support/interleaving_explorer.hpp"

#include <ucontext.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>
#include <vector>

#if defined(__SANITIZE_THREAD__)
#define HAPTIC_TEST_FIBERS 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define HAPTIC_TEST_FIBERS 1
#endif
#endif
#ifdef HAPTIC_TEST_FIBERS
#include <sanitizer/tsan_interface.h>
#endif

namespace haptic::test {

namespace {

constexpr std::size_t kThreads = 2, kMain = 2, kOwn = ~std::size_t{0};
constexpr std::size_t kMaxLocations = 32, kMaxOperations = 1000;
constexpr std::size_t kStackBytes = std::size_t{256} * 1024;

bool acquires(std::memory_order order) {
  return order != std::memory_order_relaxed && order != std::memory_order_release;
}
bool releases(std::memory_order order) {
  return order != std::memory_order_relaxed && order != std::memory_order_acquire &&
         order != std::memory_order_consume;
}

// What a thread knows, and what a release hands over: of each atomic the latest store that it can
// not be behind, of each thread how many operations happened before.
struct View {
  std::array<std::uint32_t, kMaxLocations> store{};
  std::array<std::uint32_t, kThreads> operations{};

  void join(const View& other) {
    for (std::size_t i = 0; i < store.size(); ++i) store[i] = std::max(store[i], other.store[i]);
    for (std::size_t i = 0; i < operations.size(); ++i)
      operations[i] = std::max(operations[i], other.operations[i]);
  }
};

struct Store {
  std::uint64_t value = 0;
  View handed_over;
};

struct Location {
  std::vector<Store> stores;  // of an atomic, in modification order
  // Of a word: the operation of each thread that read or wrote it last; 0: none.
  std::array<std::uint32_t, kThreads> read{}, written{};
};

struct Decision {
  std::size_t taken = 0, options = 0;
};

class Explorer;
Explorer* current = nullptr;

class Explorer {
 public:
  explicit Explorer(MemoryModel model) : model_(model) {
    for (std::size_t i = 0; i < kThreads; ++i) make_thread(i);
#ifdef HAPTIC_TEST_FIBERS
    fibers_[kMain] = __tsan_get_current_fiber();
    for (std::size_t i = 0; i < kThreads; ++i) fibers_[i] = __tsan_create_fiber(0);
#endif
  }
  ~Explorer() {
#ifdef HAPTIC_TEST_FIBERS
    for (std::size_t i = 0; i < kThreads; ++i) __tsan_destroy_fiber(fibers_[i]);
#endif
  }
  Explorer(const Explorer&) = delete;
  Explorer& operator=(const Explorer&) = delete;

  void execute(const std::function<std::unique_ptr<Scenario>()>& make) {
    locations_.clear();
    views_ = {};
    started_ = finished_ = {};
    decisions_made_ = 0;
    schedule_.clear();
    const auto scenario = make();
    scenario_ = scenario.get();
    switch_to(0);
    if (!violation_.empty()) return;
    for (std::size_t i = 0; i < kThreads; ++i) views_[kMain].join(views_[i]);
    scenario->settled();
  }

  // Leaves the decisions of the next execution to come; false: there is none.
  bool next() {
    while (!decisions_.empty() && decisions_.back().taken + 1 == decisions_.back().options)
      decisions_.pop_back();
    if (decisions_.empty()) return false;
    ++decisions_.back().taken;
    return true;
  }

  // Does not return to an explored thread: its stack is left as it is, and nothing runs after it.
  void violate(const char* text) {
    if (violation_.empty()) violation_ = text;
    if (running_ != kMain) switch_to(kMain);
  }

  std::size_t running() const { return running_; }
  const std::string& violation() const { return violation_; }
  const std::string& schedule() const { return schedule_; }

  std::size_t add_location(std::uint64_t value) {
    if (running_ != kMain) return kOwn;
    if (locations_.size() == kMaxLocations) std::abort();  // raise kMaxLocations
    locations_.emplace_back().stores.push_back({value, {}});
    return locations_.size() - 1;
  }

  std::uint64_t load(std::size_t index, std::memory_order order) {
    step();
    const std::vector<Store>& stores = locations_[index].stores;
    std::uint32_t& seen = views_[running_].store[index];
    const auto last = static_cast<std::uint32_t>(stores.size() - 1);
    // The newest first, so that the first execution is the one of a single memory.
    const bool any_newer = model_ == MemoryModel::kReleaseAcquire && running_ != kMain;
    seen = last - (any_newer ? static_cast<std::uint32_t>(choose(last - seen + 1)) : 0);
    const Store& read = stores[seen];
    if (acquires(order)) views_[running_].join(read.handed_over);
    return read.value;
  }

  void store(std::size_t index, std::uint64_t value, std::memory_order order) {
    step();
    append(index, value, order, {});
  }

  // Reads the last store in any order; the new one hands on what that one handed over, for
  // it continues its release sequence.
  std::uint64_t exchange(std::size_t index, std::uint64_t value, std::memory_order order) {
    step();
    const Store read = locations_[index].stores.back();
    if (acquires(order)) views_[running_].join(read.handed_over);
    append(index, value, order, read.handed_over);
    return read.value;
  }

  // A word: steps where values count, races where orders do.
  void touch(std::size_t index, bool write) {
    if (running_ == kMain) return;
    if (model_ == MemoryModel::kInterleaving) return step();
    Location& word = locations_[index];
    const std::size_t other = 1 - running_;
    const std::uint32_t known = views_[running_].operations[other];
    if (word.written[other] > known || (write && word.read[other] > known))
      violate("two threads use a word and no release and acquire orders them");
    (write ? word.written : word.read)[running_] = ++views_[running_].operations[running_];
  }

 private:
  void make_thread(std::size_t i) {
    stacks_[i].resize(kStackBytes);
    if (getcontext(&contexts_[i]) != 0) std::abort();
    contexts_[i].uc_stack.ss_sp = stacks_[i].data();
    contexts_[i].uc_stack.ss_size = stacks_[i].size();
    contexts_[i].uc_link = nullptr;
    makecontext(&contexts_[i], i == 0 ? &Explorer::run_writer : &Explorer::run_reader, 0);
  }

  // A thread's body once per execution; the stack is used again by the next.
  static void run_writer() { current->run(0, &Scenario::writer); }
  static void run_reader() { current->run(1, &Scenario::reader); }
  void run(std::size_t i, void (Scenario::*body)()) {
    while (true) {
      started_[i] = true;
      (scenario_->*body)();
      finished_[i] = true;
      switch_to(finished_[1 - i] ? kMain : 1 - i);
    }
  }

  void switch_to(std::size_t next_thread) {
    const std::size_t last = running_;
    running_ = next_thread;
#ifdef HAPTIC_TEST_FIBERS
    __tsan_switch_to_fiber(fibers_[next_thread], 0);
#endif
    if (swapcontext(&contexts_[last], &contexts_[next_thread]) != 0) std::abort();
  }

  // Before an operation that the other thread can notice: either may have its next one now. A
  // thread comes here for the first time before any choice, as what it does up to here is its own.
  void step() {
    if (running_ == kMain) return;
    if (schedule_.size() >= kMaxOperations) violate("does not end");
    const std::size_t other = 1 - running_;
    if (!finished_[other] && (!started_[other] || choose(kThreads) == 1)) switch_to(other);
    schedule_ += running_ == 0 ? 'w' : 'r';
  }

  std::size_t choose(std::size_t options) {
    if (options == 1) return 0;
    if (decisions_made_ == decisions_.size()) decisions_.push_back({0, options});
    const Decision& decision = decisions_[decisions_made_++];
    if (decision.options != options) std::abort();  // the scenario is not deterministic
    return decision.taken;
  }

  void append(std::size_t index, std::uint64_t value, std::memory_order order,
              const View& handed_on) {
    View& view = views_[running_];
    std::vector<Store>& stores = locations_[index].stores;
    view.store[index] = static_cast<std::uint32_t>(stores.size());
    Store made = {value, handed_on};
    made.handed_over.store[index] = view.store[index];
    if (releases(order)) made.handed_over.join(view);
    stores.push_back(made);
  }

  MemoryModel model_;
  Scenario* scenario_ = nullptr;
  std::size_t running_ = kMain;
  std::array<ucontext_t, kThreads + 1> contexts_{};
  std::array<std::vector<char>, kThreads> stacks_;
#ifdef HAPTIC_TEST_FIBERS
  std::array<void*, kThreads + 1> fibers_{};
#endif
  std::array<bool, kThreads> started_{}, finished_{};
  std::array<View, kThreads + 1> views_{};
  std::vector<Location> locations_;
  std::vector<Decision> decisions_;
  std::size_t decisions_made_ = 0;
  std::string schedule_, violation_;
};

}  // namespace

Exploration explore(MemoryModel model, const std::function<std::unique_ptr<Scenario>()>& make,
                    std::uint64_t limit) {
  Explorer explorer(model);
  current = &explorer;
  Exploration result;
  bool more = true;
  while (more && result.interleavings < limit && explorer.violation().empty()) {
    explorer.execute(make);
    ++result.interleavings;
    more = explorer.next();
  }
  result.complete = !more && explorer.violation().empty();
  result.violation = explorer.violation();
  if (!result.violation.empty()) result.schedule = explorer.schedule();
  current = nullptr;
  return result;
}

void demand(bool holds, const char* violation) {
  if (!holds) current->violate(violation);
}

std::size_t explored_thread() { return current->running(); }

ExploredLocation::ExploredLocation(std::uint64_t value)
    : index_(current->add_location(value)), value_(value) {}

std::uint64_t ExploredLocation::load(std::memory_order order) const {
  return index_ == kOwn ? value_ : current->load(index_, order);
}
void ExploredLocation::store(std::uint64_t value, std::memory_order order) {
  if (index_ == kOwn) {
    value_ = value;
  } else {
    current->store(index_, value, order);
  }
}
std::uint64_t ExploredLocation::exchange(std::uint64_t value, std::memory_order order) {
  if (index_ != kOwn) return current->exchange(index_, value, order);
  return std::exchange(value_, value);
}
std::uint64_t ExploredLocation::plain_read() const {
  if (index_ != kOwn) current->touch(index_, false);
  return value_;
}
void ExploredLocation::plain_write(std::uint64_t value) {
  if (index_ != kOwn) current->touch(index_, true);
  value_ = value;
}

}  // namespace haptic::test
