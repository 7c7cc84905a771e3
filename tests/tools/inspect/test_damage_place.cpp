// SPDX-License-Identifier: Apache-2.0
// What is said about a damaged scene: the byte, the table and the element where it is damaged.
#include <doctest/doctest.h>

#include <cstring>
#include <limits>
#include <string>

#include "tests/support/shapes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/scene_inspect/damage_place.hpp"

using namespace haptic;
using namespace haptic::test;
using tools::SceneBytes;

namespace {

SceneBytes sound_scene() {
  const tools::SceneDescription scene = scene_of(
      box({0, 0, 0}, {1, 1, 1}),
      {join({box({2, 0, 0}, {3, 1, 1}), box({3, 0, 0}, {4, 1, 1})}), box({6, 0, 0}, {7, 1, 1})});
  return SceneBytes(tools::write_scene(scene));
}

template <typename T>
void put(SceneBytes& bytes, std::uint64_t at, const T& value) {
  std::memcpy(bytes.span().data() + at, &value, sizeof value);
}

void rehash(SceneBytes& bytes) {
  put(bytes, offsetof(SceneHeader, content_hash), scene_content_hash(bytes.span()));
}

/// Byte of an element, and of the section's entry in the table.
std::uint64_t place(const SceneBytes& bytes, SectionId id, std::uint64_t index,
                    std::uint64_t* entry = nullptr) {
  SceneView view;
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  std::uint64_t at = sizeof(SceneHeader);
  for (const SectionEntry& s : view.sections()) {
    if (s.id == id) {
      if (entry != nullptr) *entry = at;
      return s.offset + index * s.element_bytes;
    }
    at += sizeof(SectionEntry);
  }
  FAIL("no such section");
  return 0;
}

/// What is said of bytes that must not open.
std::string said(const SceneBytes& bytes) {
  SceneView view;
  SceneFault fault;
  const RtStatus status = SceneView::open(bytes.span(), view, fault);
  REQUIRE(status != RtStatus::kOk);
  SceneView plain;
  CHECK(SceneView::open(bytes.span(), plain) == status);
  return tools::damage_text(bytes.span(), status, fault);
}

bool holds(const std::string& text, const std::string& words) {
  CAPTURE(text);
  CAPTURE(words);
  const bool found = text.find(words) != std::string::npos;
  CHECK(found);
  return found;
}

}  // namespace

TEST_SUITE("tools.damage_place") {
  TEST_CASE("the header: what it states and what is there") {
    SceneBytes bytes = sound_scene();
    const std::size_t size = bytes.span().size();
    holds(said(SceneBytes(bytes.span().first(64))), "the file has 64 bytes, a header alone");
    holds(said(SceneBytes(bytes.span().first(size - 64))), "header (byte 16): it states");
    put(bytes, 0, 'X');
    holds(said(bytes), "header (byte 0): it does not start with RTSCENE");
    bytes = sound_scene();
    put(bytes, offsetof(SceneHeader, version), kSceneVersion + 1);
    holds(said(bytes), "version " + std::to_string(kSceneVersion + 1));
    bytes = sound_scene();
    put(bytes, offsetof(SceneHeader, scalar_bytes), std::uint32_t{16});
    holds(said(bytes), "numbers of 16 bytes");
    bytes = sound_scene();
    put(bytes, size / 2, std::uint8_t{0xA5});
    holds(said(bytes), "some byte is not what was written");
  }

  TEST_CASE("the table of sections: the entry, what it says and where the one before ends") {
    SceneBytes bytes = sound_scene();
    std::uint64_t entry = 0;
    place(bytes, SectionId::kFaces, 0, &entry);
    put(bytes, entry + offsetof(SectionEntry, count), std::uint64_t{1} << 40);
    rehash(bytes);
    holds(said(bytes), "entry 5 of the table of sections ('faces', byte " + std::to_string(entry));
    bytes = sound_scene();
    put(bytes, entry + offsetof(SectionEntry, id), std::uint32_t{900});
    rehash(bytes);
    holds(said(bytes), "no section 'faces'");
    bytes = sound_scene();
    put(bytes, entry + offsetof(SectionEntry, id), SectionId::kPlanes);
    rehash(bytes);
    holds(said(bytes), "comes twice");
  }

  TEST_CASE("tables: name, element and byte of the first that is wrong") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto damaged = [&](SectionId id, std::uint32_t index, std::uint64_t field,
                             const char* name) {
      SceneBytes bytes = sound_scene();
      const std::uint64_t at = place(bytes, id, index);
      put(bytes, at + field, nan);
      rehash(bytes);
      std::string byte = std::to_string(at);
      for (std::size_t k = byte.size(); k > 3; k -= 3) byte.insert(k - 3, 1, ' ');
      holds(said(bytes), std::string("table '") + name + "', element " + std::to_string(index) +
                             " (byte " + byte + ")");
    };
    damaged(SectionId::kParameters, 0, offsetof(SceneParameters, rate_hz), "parameters");
    for (std::uint32_t body = 0; body < 3; ++body) {
      damaged(SectionId::kBodies, body, offsetof(BodyRecord, reference_m), "bodies");
    }
    for (std::uint32_t piece = 0; piece < 4; ++piece) {
      damaged(SectionId::kPieces, piece, offsetof(PieceRecord, radius_m), "pieces");
    }
    SceneBytes bytes = sound_scene();
    const std::uint64_t pair = place(bytes, SectionId::kPairs, 2);
    put(bytes, pair + offsetof(PairRecord, near_capacity), std::uint32_t{1});
    rehash(bytes);
    holds(said(bytes), "table 'pairs', element 2 (byte ");
    bytes = sound_scene();
    put(bytes, offsetof(SceneHeader, capacity) + offsetof(SceneCapacity, max_edge_pairs),
        std::uint32_t{1});
    rehash(bytes);
    holds(said(bytes), "capacities in the header (byte " +
                           std::to_string(offsetof(SceneHeader, capacity)) + ")");
  }

  TEST_CASE("any bytes are answered with words") {
    const SceneBytes sound = sound_scene();
    Random random(20261121);
    for (int trial = 0; trial < 2000; ++trial) {
      SceneBytes bytes(sound.span());
      // Header and table of sections, where a wrong number could lead outside the file.
      const std::uint64_t at = random.next() % (sizeof(SceneHeader) + 20 * sizeof(SectionEntry));
      put(bytes, at, static_cast<std::uint8_t>(random.next()));
      rehash(bytes);
      SceneView view;
      SceneFault fault;
      const RtStatus status = SceneView::open(bytes.span(), view, fault);
      if (status == RtStatus::kOk) continue;
      CHECK(tools::damage_text(bytes.span(), status, fault).size() > 20);
    }
  }
}
