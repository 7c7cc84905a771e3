// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "hal/drivers/sha256.hpp"

using namespace haptic::hal;

namespace {

std::string digest_of(std::span<const std::uint8_t> bytes, std::size_t piece) {
  Sha256 hash;
  for (std::size_t at = 0; at < bytes.size(); at += piece)
    hash.add(bytes.subspan(at, std::min(piece, bytes.size() - at)));
  std::string text;
  char two[3];
  for (const std::uint8_t byte : hash.finish()) {
    std::snprintf(two, sizeof two, "%02x", static_cast<unsigned>(byte));
    text += two;
  }
  return text;
}

std::string digest_of(const std::string& text) {
  return digest_of({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, 1000);
}

}  // namespace

TEST_SUITE("hal.sha256") {
  // FIPS 180-4 and the examples that NIST publishes with it.
  TEST_CASE("finish: the vectors of the standard") {
    CHECK(digest_of("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    CHECK(digest_of("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(digest_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
          "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    CHECK(digest_of("abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmno"
                    "pqklmnopqrlmnopqrsmnopqrstnopqrstu") ==
          "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1");
    CHECK(digest_of(std::string(1'000'000, 'a')) ==
          "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  }

  TEST_CASE("add: the same in any pieces, across every length of the padding") {
    for (std::size_t size = 0; size < 200; ++size) {
      std::vector<std::uint8_t> bytes(size);
      for (std::size_t k = 0; k < size; ++k) bytes[k] = static_cast<std::uint8_t>(7 * k + size);
      const std::string whole = digest_of(bytes, 1000);
      for (const std::size_t piece : {std::size_t{1}, std::size_t{63}, std::size_t{64}})
        CHECK(digest_of(bytes, piece) == whole);
    }
  }

  TEST_CASE("parse_sha256: 64 digits and nothing else") {
    const std::string good = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015AD";
    Sha256Digest digest{};
    REQUIRE(parse_sha256(good, digest));
    CHECK(digest[0] == 0xba);
    CHECK(digest[31] == 0xad);
    for (const std::string& bad :
         {std::string(), good.substr(1), good + "0", "x" + good.substr(1), "-" + good.substr(1)}) {
      CHECK_FALSE(parse_sha256(bad, digest));
      CHECK(digest[0] == 0xba);
    }
  }
}
