// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/blob_builder.hpp"

#include <bit>

namespace haptic::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the blob is little-endian");

std::size_t align_up(std::size_t offset) {
  return (offset + kSceneAlignment - 1) / kSceneAlignment * kSceneAlignment;
}

}  // namespace

void BlobBuilder::add_bytes(SectionId id, std::uint32_t element_bytes, std::uint64_t count,
                            std::span<const std::byte> bytes) {
  sections_.push_back({id, element_bytes, count, {bytes.begin(), bytes.end()}});
}

std::vector<std::byte> BlobBuilder::finish(const SceneCapacity& capacity) const {
  std::vector<SectionEntry> table;
  std::size_t end = sizeof(SceneHeader) + sections_.size() * sizeof(SectionEntry);
  for (const Section& s : sections_) {
    const std::size_t offset = align_up(end);
    table.push_back({s.id, s.element_bytes, offset, s.count});
    end = offset + s.bytes.size();
  }
  std::vector<std::byte> blob(end, std::byte{0});
  SceneHeader header{};
  std::memcpy(header.magic, kSceneMagic, sizeof(kSceneMagic));
  header.version = kSceneVersion;
  header.header_bytes = sizeof(SceneHeader);
  header.byte_count = blob.size();
  header.scalar_bytes = sizeof(Real);
  header.section_count = static_cast<std::uint32_t>(sections_.size());
  header.section_table = sizeof(SceneHeader);
  header.capacity = capacity;
  std::memcpy(blob.data(), &header, sizeof(header));
  std::memcpy(blob.data() + sizeof(header), table.data(), table.size() * sizeof(SectionEntry));
  for (std::size_t i = 0; i < sections_.size(); ++i) {
    if (sections_[i].bytes.empty()) continue;
    std::memcpy(blob.data() + table[i].offset, sections_[i].bytes.data(),
                sections_[i].bytes.size());
  }
  header.content_hash = scene_content_hash(blob);
  std::memcpy(blob.data(), &header, sizeof(header));
  return blob;
}

}  // namespace haptic::tools
