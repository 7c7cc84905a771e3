// SPDX-License-Identifier: Apache-2.0
#include "tools/common/toml_file.hpp"

#include <doctest/doctest.h>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

std::string refusal(std::string_view text) {
  try {
    check_toml_text(text, "s.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

bool starts(const std::string& text, std::string_view part) { return text.find(part) == 0; }

std::string dotted_key(std::size_t parts) {
  std::string key = "a";
  for (std::size_t i = 1; i < parts; ++i) {
    key += ".a";
  }
  return key;
}

}  // namespace

TEST_SUITE("tools.toml_text") {
  TEST_CASE("letters beyond ASCII pass in comments and in one-line strings") {
    CHECK(refusal("") == "");
    CHECK(refusal("\xEF\xBB\xBF# \xC3\xA9\na = 1 # \xEF\xBB\xB7") == "");
    CHECK(
        refusal("a = \"\xC3\xA9 \\\" # \xC3\xA9\" # '\xC3\xA9\nb = '\xC3\xA9\"\\' # \xC3\xA9\n") ==
        "");
    CHECK(
        refusal("a={b={c=['\xC3\xA9',\"\xC3\xA9\"],d='\xC3\xA9'}}\n[ '\xC3\xA9' ]\n['\xC3\xA9']") ==
        "");
    CHECK(refusal("a = '' # \xC3\xA9\nb = \"\"# \xC3\xA9\n") == "");
    CHECK(refusal("a = '''x''' # \xC3\xA9\nb = \"\"\"x\\\"\"\"\"\"\" # \xC3\xA9\n") == "");
  }

  TEST_CASE("elsewhere they are refused with line and column in characters") {
    CHECK(starts(refusal("a = 1\n\xC3\xA9 = 1\n"), "s.toml:2:1: not valid TOML: a character"));
    CHECK(starts(refusal("a = '\xC3\xA9\xC3\xA9' \xC3\xA9"), "s.toml:1:10: "));
    CHECK(starts(refusal("\xEF\xBB\xB7"), "s.toml:1:1: "));
    CHECK(starts(refusal("a = \"\"\"x\\\n\xC3\xA9\"\"\""), "s.toml:2:1: "));
    CHECK(starts(refusal("a = 'open\n\xC3\xA9"), "s.toml:2:1: "));
    CHECK(starts(refusal("a = \"\\\"\n\xC3\xA9\""), "s.toml:2:1: "));
    CHECK(starts(refusal("a = 0.1S'\xC3\xA9'"), "s.toml:1:10: "));
    CHECK(starts(refusal("a = 0.'\xC3\xA9'"), "s.toml:1:8: "));
    CHECK(starts(refusal("a = 0['\xC3\xA9'"), "s.toml:1:8: "));
    CHECK(starts(refusal("a=0='\xC3\xA9'"), "s.toml:1:6: "));
    CHECK(starts(refusal("a = 0n='\xC3\xA9'"), "s.toml:1:9: "));
    CHECK(starts(refusal("a = [ 1,\n 0n='\xC3\xA9'"), "s.toml:2:6: "));
    CHECK(starts(refusal("# a\rb\xC3\xA9"), "s.toml:1:6: "));
  }

  TEST_CASE("keys of very many parts are refused, arrays of many numbers are not") {
    CHECK(refusal(dotted_key(kMaxTomlKeyParts) + " = 1\n[" + dotted_key(kMaxTomlKeyParts) +
                  "]\n") == "");
    CHECK(starts(refusal(dotted_key(kMaxTomlKeyParts + 1) + " = 1\n"), "s.toml:1:64: "));
    CHECK(starts(refusal("\n[" + dotted_key(kMaxTomlKeyParts + 1) + "]\n"), "s.toml:2:65: "));
    CHECK(starts(refusal("b = {" + dotted_key(400'000) + " = 1}"), "s.toml:1:69: "));
    std::string array = "a = [";
    for (int i = 0; i < 200; ++i) {
      array += "0.5, ";
    }
    CHECK(refusal(array +
                  "]\nb = 'a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a'\n") ==
          "");
  }
}

}  // namespace haptic::tools
