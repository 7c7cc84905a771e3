// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <vector>

#include "hal/realtime/system_tree.hpp"

using namespace haptic::hal;

TEST_SUITE("hal.system_tree") {
  TEST_CASE("parse_cpu_list: ranges, single ones, and text that is none") {
    CHECK(parse_cpu_list("0-2,5\n") == std::vector<int>{0, 1, 2, 5});
    CHECK(parse_cpu_list("7") == std::vector<int>{7});
    for (const char* text : {"", "(null)", "1-", "-1", "a", "1,,2", "0-99999999", "3-x"}) {
      CAPTURE(text);
      CHECK(parse_cpu_list(text).empty());
    }
    CHECK(cpu_list_text({5, 0, 1, 2}) == "0-2,5");
    CHECK(cpu_list_text({}) == "none");
  }

  TEST_CASE("value_after and has_word: whole keys at line starts, whole words") {
    CHECK(value_after("a: 1\nab:\t 2 \n", "ab:") == "2");
    CHECK(value_after("x ab: 2\n", "ab:").empty());
    CHECK(has_word("constant_tsc tsc", "tsc"));
    CHECK_FALSE(has_word("constant_tsc", "tsc"));
  }

  TEST_CASE("cpu masks: as the kernel writes and takes them") {
    using List = std::vector<int>;
    CHECK(parse_cpu_mask("c") == List{2, 3});
    CHECK(parse_cpu_mask("00000001,80000000") == List{31, 32});
    CHECK(parse_cpu_mask("0").empty());
    CHECK(parse_cpu_mask("x").empty());
    CHECK(cpu_mask_text({3, 2}) == "c");
    CHECK(cpu_mask_text({31, 32}) == "1,80000000");
    CHECK(cpu_mask_text({}) == "0");
  }
}
