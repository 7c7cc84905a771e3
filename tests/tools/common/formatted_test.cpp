// SPDX-License-Identifier: Apache-2.0
#include "tools/common/formatted.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>

using namespace haptic::tools;

TEST_SUITE("tools.formatted") {
  TEST_CASE("formatted: what printf writes, of any length") {
    CHECK(formatted("%d of %s: %.3g m", 7, "nine", 0.00123456) == "7 of nine: 0.00123 m");
    CHECK(formatted("%s", "").empty());
    for (const std::size_t length : {1U, 15U, 16U, 511U, 512U, 70'000U}) {
      CAPTURE(length);
      const std::string word(length, 'x');
      CHECK(formatted("<%s>", word.c_str()) == "<" + word + ">");
    }
  }

  TEST_CASE("append_line: behind what is there, with the end of a line") {
    std::string text = "head\n";
    append_line(text, "%5.1f %%", 12.34);
    append_line(text, "end");
    CHECK(text == "head\n 12.3 %\nend\n");
  }

  TEST_CASE("short_number and hash_text: digits as tables and reports have them") {
    CHECK(short_number(1234.5678, 3) == "1.23e+03");
    CHECK(short_number(0.1, 9) == "0.1");
    CHECK(short_number(-0.0, 4) == "-0");
    CHECK(short_number(unsigned_zero(-0.0), 4) == "0");
    for (const char* zero : {"-0", "-0.00", "-0e+00"})
      CHECK(unsigned_zero(std::string(zero)) == zero + 1);
    for (const char* number : {"0", "-0.01", "-1e-09", "-nan", "-inf", "0-0"})
      CHECK(unsigned_zero(std::string(number)) == number);
    CHECK(short_number(std::nan(""), 3) == "nan");
    CHECK(hash_text(0) == "0000000000000000");
    CHECK(hash_text(0xfedcba9876543210u) == "fedcba9876543210");
  }
}
