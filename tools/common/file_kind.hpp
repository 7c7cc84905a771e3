// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Recognises the kind of a file by its content, so that an output replaces nothing but a file of
/// its own kind.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace haptic::tools {

enum class FileFormat : std::uint8_t {
  kScene,      ///< compiled: its magic
  kRecording,  ///< of a session (.hrec): its magic
  kMcap,
  kPlan,
  kMesh,  ///< STL, OBJ, OFF, PLY, AMF, COLLADA, glTF, STEP, VRML, an archive as 3MF
  kToml,
  kCsv,
  kJson,
  kHtml,
  kSvg,
  kXml,
  kText,
  kOther,  ///< binary, and nothing of the above
};

/// Two files are of one kind if both members are equal.
struct FileKind {
  FileFormat format = FileFormat::kOther;
  /// Text that distinguishes files of one format: the first three columns of CSV, the first key of
  /// JSON, "scene file" and the like of TOML, the format of a mesh (of OBJ with a remark in front
  /// also its first words), the first words of other text, without digits.
  std::string mark;

  friend bool operator==(const FileKind&, const FileKind&) = default;
};

/// The kind of a content of which `front` is all, or the first kKindBytes; none: it is empty.
inline constexpr std::size_t kKindBytes = 65536;
[[nodiscard]] std::optional<FileKind> kind_of(std::string_view front);
/// The same of a file. None: it is empty, absent, or no regular file.
/// @throws OsError  it cannot be read.
[[nodiscard]] std::optional<FileKind> kind_of_file(const std::filesystem::path& path);

/// "a compiled scene", "CSV with the columns t,x,y".
[[nodiscard]] std::string to_text(const FileKind& kind);

/// Kinds of the files that programs write under a name of the user's.
[[nodiscard]] FileKind csv_kind(std::string_view header);
[[nodiscard]] FileKind json_kind(std::string_view first_key);
[[nodiscard]] FileKind text_kind(std::string_view first_line);
[[nodiscard]] FileKind scene_file_kind();

/// The format that a name ends in, where outputs of this project have it: .csv, .json, .svg, .html,
/// .obj, .rtscene, ...; .md, .txt and others: none.
[[nodiscard]] std::optional<FileFormat> format_named(const std::filesystem::path& path);

}  // namespace haptic::tools
