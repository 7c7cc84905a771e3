// SPDX-License-Identifier: Apache-2.0
/// Work in a process of its own: every way in which it can end.
#include <doctest/doctest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <stdexcept>

#include "tools/common/limited_child.hpp"

using namespace haptic::tools;

namespace {

ChildResult run(const std::function<std::string()>& work, ChildLimits limits = {}) {
  limits.seconds = 1;
  return run_in_child("test", limits, work);
}

}  // namespace

TEST_SUITE("tools.limited_child") {
  TEST_CASE("an answer of any bytes comes whole; nothing else is shared") {
    int here = 1;
    const std::string long_answer(300000, '\0');
    const ChildResult result = run([&] {
      here = 2;
      return long_answer + "end";
    });
    CHECK(result.end == ChildEnd::kAnswered);
    CHECK(result.text == long_answer + "end");
    CHECK(here == 1);
    CHECK(result.memory_bytes > 0);
    CHECK(run([] { return std::string(); }).end == ChildEnd::kAnswered);
  }

  TEST_CASE("an exception is told with its text, lack of memory apart") {
    const ChildResult threw = run([]() -> std::string { throw std::runtime_error("no mesh"); });
    CHECK(threw.end == ChildEnd::kThrew);
    CHECK(threw.text == "no mesh");
    const ChildResult other = run([]() -> std::string { throw 7; });
    CHECK(other.end == ChildEnd::kThrew);
    CHECK(other.text == "");
    CHECK(run([]() -> std::string { throw std::bad_alloc(); }).end == ChildEnd::kOutOfMemory);
  }

  TEST_CASE("crashes, exits and endless work end the child alone") {
    const ChildResult crashed = run([]() -> std::string { std::abort(); });
    CHECK(crashed.end == ChildEnd::kSignal);
    CHECK(crashed.number == SIGABRT);
    const ChildResult left = run([]() -> std::string { ::_exit(7); });
    CHECK(left.end == ChildEnd::kEnded);
    CHECK(left.number == 7);
    CHECK(run([]() -> std::string { ::_exit(0); }).end == ChildEnd::kEnded);
    CHECK(run([]() -> std::string {
            for (std::atomic<unsigned> k = 0;;) ++k;
          }).end == ChildEnd::kOutOfTime);
    ChildLimits waiting;
    waiting.waiting_seconds = 1;
    CHECK(run(
              []() -> std::string {
                for (;;) ::pause();
              },
              waiting)
              .end == ChildEnd::kOutOfTime);
  }

  TEST_CASE("an answer beyond its limit is not kept") {
    ChildLimits limits;
    limits.answer_bytes = 1000;
    CHECK(run([] { return std::string(1000, 'x'); }, limits).text.size() == 1000);
    const ChildResult result = run([] { return std::string(1 << 20, 'x'); }, limits);
    CHECK(result.end == ChildEnd::kTooLong);
    CHECK(result.text.empty());
  }

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  TEST_CASE("memory beyond the limit is refused to the child") {
    ChildLimits limits;
    limits.memory_bytes = std::uint64_t{64} << 20;
    CHECK(run([] { return std::string(std::size_t{1} << 30, 'x'); }, limits).end ==
          ChildEnd::kOutOfMemory);
  }
#endif
}
