// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/damage_place.hpp"

#include <cstddef>
#include <cstring>
#include <optional>
#include <set>
#include <vector>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

std::string at_byte(std::uint64_t offset) { return "byte " + grouped(offset); }

/// The entries that lie in the file; the header must.
std::vector<SectionEntry> entries_of(std::span<const std::byte> bytes, const SceneHeader& header) {
  std::vector<SectionEntry> entries;
  std::size_t at = sizeof(SceneHeader);
  for (std::uint32_t i = 0; i < header.section_count && at + sizeof(SectionEntry) <= bytes.size();
       ++i, at += sizeof(SectionEntry)) {
    std::memcpy(&entries.emplace_back(), bytes.data() + at, sizeof(SectionEntry));
  }
  return entries;
}

std::string entry_name(std::size_t index, const SectionEntry& entry) {
  return "entry " + std::to_string(index) + " of the table of sections ('" +
         section_name(entry.id) + "', " +
         at_byte(sizeof(SceneHeader) + index * sizeof(SectionEntry)) + ")";
}

/// The first entry out of order, else the first that repeats; else the table as a whole.
std::string section_table_place(std::span<const std::byte> bytes, const SceneHeader& header) {
  const std::vector<SectionEntry> entries = entries_of(bytes, header);
  const std::string table = "the table of sections (" + at_byte(sizeof(SceneHeader)) + ", " +
                            std::to_string(header.section_count) + " entries)";
  if (entries.size() != header.section_count) return table + " reaches beyond the file";
  std::uint64_t end = sizeof(SceneHeader) + entries.size() * sizeof(SectionEntry);
  std::set<SectionId> seen;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const SectionEntry& s = entries[i];
    const bool in_place = s.element_bytes != 0 && s.offset % kSceneAlignment == 0 &&
                          s.offset >= end && s.offset <= bytes.size() &&
                          s.offset - end < 2 * kSceneAlignment;
    if (!in_place || s.count > (bytes.size() - s.offset) / s.element_bytes) {
      return entry_name(i, s) + ": " + grouped(s.count) + " elements of " +
             std::to_string(s.element_bytes) + " bytes from " + at_byte(s.offset) +
             ", the section before ends at " + at_byte(end) + ", the file at " +
             at_byte(bytes.size());
    }
    if (!seen.insert(s.id).second) return entry_name(i, s) + " comes twice";
    end = s.offset + s.count * s.element_bytes;
  }
  return end == bytes.size()
             ? table + ": a gap is not zero, or elements of a section have another size"
             : "bytes beyond the last section, from " + at_byte(end);
}

std::string missing_sections(std::span<const std::byte> bytes, const SceneHeader& header) {
  std::set<SectionId> seen;
  for (const SectionEntry& s : entries_of(bytes, header)) seen.insert(s.id);
  std::string names;
  for (auto id = static_cast<std::uint32_t>(SectionId::kParameters);
       id < static_cast<std::uint32_t>(SectionId::kNodeMarks); ++id) {
    if (seen.contains(SectionId{id})) continue;
    names += (names.empty() ? "no section '" : ", '") + section_name(SectionId{id}) + "'";
  }
  return names;
}

/// The difference between what the header states and what is there; nothing for a status of the
/// tables.
std::optional<std::string> header_place(std::span<const std::byte> bytes, RtStatus status,
                                        const SceneHeader& header) {
  switch (status) {
    case RtStatus::kBlobTooSmall:
      return "header (" + at_byte(offsetof(SceneHeader, byte_count)) + "): it states " +
             grouped(header.byte_count) + " bytes, the file has " + grouped(bytes.size());
    case RtStatus::kBlobBadMagic:
      return "header (" + at_byte(0) + "): it does not start with RTSCENE";
    case RtStatus::kBlobBadVersion:
      return "header (" + at_byte(offsetof(SceneHeader, version)) + "): version " +
             std::to_string(header.version) + " with a header of " +
             std::to_string(header.header_bytes) + " bytes, read is version " +
             std::to_string(kSceneVersion) + " with " + std::to_string(sizeof(SceneHeader));
    case RtStatus::kBlobWrongScalar:
      return "header (" + at_byte(offsetof(SceneHeader, scalar_bytes)) + "): numbers of " +
             std::to_string(header.scalar_bytes) + " bytes, this program reads those of " +
             std::to_string(sizeof(Real));
    case RtStatus::kBlobBadHash:
      return "header (" + at_byte(offsetof(SceneHeader, content_hash)) + "): it states content " +
             hash_text(header.content_hash) + ", the bytes have " +
             hash_text(scene_content_hash(bytes)) + "; some byte is not what was written";
    case RtStatus::kBlobBadSectionTable:
      return section_table_place(bytes, header);
    case RtStatus::kBlobMissingSection:
      return missing_sections(bytes, header);
    default:
      return std::nullopt;
  }
}

std::string table_place(std::span<const std::byte> bytes, const SceneHeader& header,
                        const SceneFault& fault) {
  if (fault.section == SectionId{0}) {
    return "capacities in the header (" + at_byte(offsetof(SceneHeader, capacity)) + ")";
  }
  for (const SectionEntry& s : entries_of(bytes, header)) {
    if (s.id != fault.section) continue;
    return "table '" + section_name(s.id) + "', element " + std::to_string(fault.index) + " (" +
           at_byte(s.offset + std::uint64_t{fault.index} * s.element_bytes) +
           ") or what it refers to";
  }
  return "table '" + section_name(fault.section) + "'";
}

}  // namespace

std::string damage_text(std::span<const std::byte> bytes, RtStatus status,
                        const SceneFault& fault) {
  if (bytes.size() < sizeof(SceneHeader)) {
    return "the file has " + grouped(bytes.size()) + " bytes, a header alone takes " +
           std::to_string(sizeof(SceneHeader)) + ": " + to_text(status);
  }
  SceneHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  const auto in_header = header_place(bytes, status, header);
  return (in_header ? *in_header : table_place(bytes, header, fault)) + ": " + to_text(status);
}

}  // namespace haptic::tools
