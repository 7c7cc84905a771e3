// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"

using namespace haptic;

TEST_SUITE("rt_core.base") {
  TEST_CASE("BoundedList: a full list refuses and keeps what it has") {
    std::array<int, 2> memory{};
    BoundedList<int> list{std::span<int>(memory)};
    CHECK(list.push(1));
    CHECK(list.push(2));
    CHECK_FALSE(list.push(3));
    CHECK(list.size() == 2);
    CHECK(list[1] == 2);
    list.clear();
    CHECK(list.empty());
    CHECK(list.push(4));
    CHECK(list.view()[0] == 4);
  }

  TEST_CASE("Arena: counting and placing agree and respect alignment") {
    Arena counting;
    CHECK(counting.take<char>(3).empty());
    CHECK(counting.take<double>(2).empty());
    alignas(64) std::array<std::byte, 64> memory{};
    Arena placing(memory.data());
    CHECK(placing.take<char>(3).size() == 3);
    const auto doubles = placing.take<double>(2);
    CHECK(reinterpret_cast<std::uintptr_t>(doubles.data()) % alignof(double) == 0);
    CHECK(doubles[1] == 0.0);
    CHECK(placing.used() == counting.used());
    CHECK(placing.used() == 24);
  }
}
