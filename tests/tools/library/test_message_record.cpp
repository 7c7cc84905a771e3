// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tools/library/message_record.hpp"

using haptic::tools::message_record;
using haptic::tools::MessageRecord;

namespace {

void check(const MessageRecord& r, const char* file, const char* place, const char* cause,
           const char* remedy) {
  CHECK(r.file == file);
  CHECK(r.place == place);
  CHECK(r.cause == cause);
  CHECK(r.remedy == remedy);
}

}  // namespace

TEST_SUITE("tools.message_record") {
  TEST_CASE("a message is file, place, cause and remedy") {
    check(message_record(2, "peg.obj:41: face 12 is not flat; split it", {"peg.obj"}), "peg.obj",
          "41", "face 12 is not flat", "split it");
    check(message_record(2, "a b.toml:12:3: no key 'x'; remove it", {"a b.toml"}), "a b.toml",
          "12:3", "no key 'x'", "remove it");
    check(message_record(2, "peg.stl: byte 812: nan; export again", {"peg.stl"}), "peg.stl",
          "byte 812", "nan", "export again");
    check(message_record(2, "peg.stl: there is no such file; check the path", {"peg.stl"}),
          "peg.stl", "", "there is no such file", "check the path");
  }

  TEST_CASE("what is no file belongs to the cause; the longest name wins; the last semicolon") {
    check(message_record(0, "no [[friction]] between a and b: coefficient 0", {"peg.obj", ""}), "",
          "", "no [[friction]] between a and b: coefficient 0", "");
    check(message_record(1, "peg: two: holes", {"peg", "peg: two"}), "peg: two", "", "holes", "");
    check(message_record(1, "peg:7: one; two; three", {"peg"}), "peg", "7", "one; two", "three");
    check(message_record(1, "peg:7 pins", {"peg"}), "peg", "", "7 pins", "");
    const MessageRecord r = message_record(1, "whole; text", {});
    CHECK(r.text == "whole; text");
    CHECK(r.severity == 1);
  }
}
