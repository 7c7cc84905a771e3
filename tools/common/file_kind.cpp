// SPDX-License-Identifier: Apache-2.0
#include "tools/common/file_kind.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::string lower(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small;
}

/// The lines that hold something, without blanks around them; `most` at the most.
std::vector<std::string_view> lines_of(std::string_view text, std::size_t most) {
  std::vector<std::string_view> lines;
  while (!text.empty() && lines.size() < most) {
    const std::size_t end = text.find_first_of("\r\n");
    const std::string_view line = trimmed(text.substr(0, end));
    if (!line.empty()) lines.push_back(line);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
  return lines;
}

/// The first words of a line, without digits: the same for one output of a program and the next.
std::string first_words(std::string_view line) {
  constexpr std::size_t kWords = 3;
  std::string words;
  std::size_t count = 0;
  for (std::size_t at = line.find_first_not_of(kBlanks);
       at != std::string_view::npos && count < kWords; at = line.find_first_not_of(kBlanks, at)) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    if (count++ > 0) words += ' ';
    for (const char c : line.substr(at, end - at))
      if (std::isdigit(static_cast<unsigned char>(c)) == 0) words += c;
    at = end;
  }
  return words;
}

std::string first_columns(std::string_view header) {
  constexpr std::size_t kColumns = 3;
  std::string columns;
  for (std::size_t k = 0; k < kColumns; ++k) {
    const std::size_t end = header.find_first_of(",;\t");
    if (k > 0) columns += ',';
    columns += trimmed(header.substr(0, end));
    if (end == std::string_view::npos) break;
    header.remove_prefix(end + 1);
  }
  return columns;
}

/// A number, or as much of one as "1e" and "nan" are not.
bool is_number(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789+-.eE") == std::string_view::npos &&
         word.find_first_of("0123456789") != std::string_view::npos;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;
       at = line.find_first_not_of(kBlanks, at)) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

/// "v 0 0 1": a vertex of an OBJ file, in one of its first lines.
bool has_obj_vertex(std::string_view text) {
  constexpr std::size_t kLinesLookedAt = 200;
  return std::ranges::any_of(lines_of(text, kLinesLookedAt), [](std::string_view line) {
    const std::vector<std::string_view> words = words_of(line);
    return words.size() >= 4 && words[0] == "v" && is_number(words[1]) && is_number(words[2]) &&
           is_number(words[3]);
  });
}

std::optional<FileKind> binary_kind(std::string_view front) {
  constexpr std::size_t kStlHead = 84, kStlFacet = 50;
  const auto mesh = [](const char* name) { return FileKind{FileFormat::kMesh, name}; };
  if (front.starts_with(std::string_view(kSceneMagic, sizeof kSceneMagic)))
    return FileKind{FileFormat::kScene, {}};
  if (front.starts_with("HAPTHREC")) return FileKind{FileFormat::kRecording, {}};
  if (front.starts_with("\x89MCAP")) return FileKind{FileFormat::kMcap, {}};
  if (front.starts_with("PK\x03\x04")) return mesh("an archive, as 3MF");
  if (front.starts_with("glTF")) return mesh("glTF");
  if (front.starts_with("ply\n") || front.starts_with("ply\r")) return mesh("PLY");
  if (front.starts_with("OFF") || front.starts_with("COFF") || front.starts_with("NOFF"))
    return mesh("OFF");
  if (front.starts_with("ISO-10303-21")) return mesh("STEP");
  if (front.starts_with("#VRML")) return mesh("VRML");
  const bool binary = front.find('\0') != std::string_view::npos;
  if (!binary && front.starts_with("solid") && front.find("facet") != std::string_view::npos)
    return mesh("STL");
  if (!binary) return std::nullopt;
  // Binary STL has no magic number: 80 bytes, a count, and 50 bytes for each facet, of which the
  // last two are nearly always 0.
  if (front.size() < kStlHead + kStlFacet) return FileKind{FileFormat::kOther, {}};
  std::uint32_t count = 0;
  std::memcpy(&count, front.data() + 80, sizeof count);
  const std::size_t shown = std::min<std::size_t>(count, (front.size() - kStlHead) / kStlFacet);
  const bool whole = front.size() == kStlHead + kStlFacet * std::size_t{count};
  bool plain = shown > 0 && (whole || front.size() >= kKindBytes);
  for (std::size_t k = 0; k < shown && plain && !whole; ++k) {
    const char* const end = front.data() + kStlHead + kStlFacet * (k + 1);
    plain = end[-1] == '\0' && end[-2] == '\0';
  }
  return plain ? mesh("STL") : FileKind{FileFormat::kOther, {}};
}

std::optional<FileKind> marked_up_kind(std::string_view text) {
  if (!text.starts_with('<')) return std::nullopt;
  const std::string small = lower(text);
  if (small.starts_with("<!doctype html") || small.starts_with("<html"))
    return FileKind{FileFormat::kHtml, {}};
  // The root: the first element that is no declaration and no comment.
  std::size_t at = 0;
  while (at < small.size() &&
         (small.compare(at, 2, "<?") == 0 || small.compare(at, 2, "<!") == 0)) {
    const bool comment = small.compare(at, 4, "<!--") == 0;
    const std::size_t end = small.find(comment ? "-->" : ">", at);
    if (end == std::string::npos) return FileKind{FileFormat::kXml, {}};
    at = small.find('<', end);
  }
  if (at >= small.size()) return FileKind{FileFormat::kXml, {}};
  const std::string root = small.substr(at + 1, small.find_first_of(" \t\r\n/>", at) - at - 1);
  if (root == "svg") return FileKind{FileFormat::kSvg, {}};
  if (root == "html") return FileKind{FileFormat::kHtml, {}};
  if (root == "amf") return FileKind{FileFormat::kMesh, "AMF"};
  if (root == "collada") return FileKind{FileFormat::kMesh, "COLLADA"};
  return FileKind{FileFormat::kXml, root};
}

std::optional<FileKind> json_content(std::string_view text) {
  if (!text.starts_with('{') && !text.starts_with('[')) return std::nullopt;
  // After the brackets stands the first key, a value, or the end.
  const std::size_t at = text.find_first_not_of("{[ \t\r\n");
  if (at == std::string_view::npos) return FileKind{FileFormat::kJson, {}};
  if (text[at] != '"') {
    if (text[at] != '}' && text[at] != ']' && text[at] != '-' && text[at] != 't' &&
        text[at] != 'f' && text[at] != 'n' &&
        std::isdigit(static_cast<unsigned char>(text[at])) == 0)
      return std::nullopt;  // "[moving]" is TOML
    return FileKind{FileFormat::kJson, {}};
  }
  const std::string_view key = text.substr(at + 1, text.find('"', at + 1) - at - 1);
  const bool gltf = text.find("\"asset\"") != std::string_view::npos &&
                    (text.find("\"meshes\"") != std::string_view::npos ||
                     text.find("\"accessors\"") != std::string_view::npos ||
                     text.find("\"buffers\"") != std::string_view::npos);
  if (gltf) return FileKind{FileFormat::kMesh, "glTF"};
  return FileKind{FileFormat::kJson, std::string(key)};
}

std::optional<FileKind> toml_content(std::string_view text) {
  constexpr std::size_t kLinesLookedAt = 400;
  std::vector<std::string_view> lines = lines_of(text, kLinesLookedAt);
  std::erase_if(lines, [](std::string_view line) { return line.starts_with('#'); });
  if (lines.empty()) return std::nullopt;
  const auto is_key = [](std::string_view line) {
    const std::size_t equal = line.find('=');
    return equal != std::string_view::npos && equal > 0 &&
           trimmed(line.substr(0, equal))
                   .find_first_not_of(
                       "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                       "0123456789_-.\"'") == std::string_view::npos;
  };
  const auto is_table = [](std::string_view line) {
    return line.starts_with('[') && line.find(']') != std::string_view::npos;
  };
  if (!is_key(lines.front()) && !is_table(lines.front())) return std::nullopt;
  const auto has = [&](std::string_view begin) {
    return std::ranges::any_of(lines, [&](std::string_view l) { return l.starts_with(begin); });
  };
  if (has("[moving]")) return scene_file_kind();
  if (has("[[waypoint")) return FileKind{FileFormat::kToml, "a motion script"};
  return FileKind{FileFormat::kToml, {}};
}

std::optional<FileKind> csv_content(const std::vector<std::string_view>& lines) {
  // Behind remarks, a header without blanks; a text may begin with '#' too.
  const std::size_t remarks = lines.size() > 1 && lines[0].starts_with('#') ? 1 : 0;
  std::string_view header = lines[remarks];
  if (remarks > 0) {
    if (header.find_first_of(kBlanks) != std::string_view::npos) return std::nullopt;
    if (header.find(',') == std::string_view::npos) return std::nullopt;
    return csv_kind(header);
  }
  if (header.starts_with('#')) return std::nullopt;
  const char* const marks = header.find(',') != std::string_view::npos   ? ","
                            : header.find(';') != std::string_view::npos ? ";"
                                                                         : "\t";
  const auto columns = std::ranges::count(header, marks[0]);
  if (columns == 0) return std::nullopt;
  // A sentence has commas too: the second line has as many columns, or there is none.
  const bool quoted = lines.size() > 1 && lines[1].find('"') != std::string_view::npos;
  if (lines.size() > 1 && !quoted && std::ranges::count(lines[1], marks[0]) != columns)
    return std::nullopt;
  if (lines.size() == 1 && header.find(' ') != std::string_view::npos) return std::nullopt;
  return csv_kind(header);
}

}  // namespace

FileKind csv_kind(std::string_view header) { return {FileFormat::kCsv, first_columns(header)}; }
FileKind json_kind(std::string_view first_key) {
  return {FileFormat::kJson, std::string(first_key)};
}
FileKind text_kind(std::string_view first_line) {
  return {FileFormat::kText, first_words(first_line)};
}
FileKind scene_file_kind() { return {FileFormat::kToml, "a scene file"}; }

std::optional<FileKind> kind_of(std::string_view front) {
  front = front.substr(0, kKindBytes);
  if (front.empty()) return std::nullopt;
  if (const auto kind = binary_kind(front)) return kind;
  if (front.starts_with("\xEF\xBB\xBF")) front.remove_prefix(3);
  const std::string_view text = trimmed(front);
  if (text.empty()) return text_kind({});
  if (text.starts_with("haptic-plan")) return FileKind{FileFormat::kPlan, {}};
  if (const auto kind = marked_up_kind(text)) return kind;
  if (const auto kind = json_content(text)) return kind;
  const std::vector<std::string_view> lines = lines_of(text, 2);
  if (has_obj_vertex(text)) {
    const bool remark = lines.front().starts_with('#');
    return FileKind{FileFormat::kMesh,
                    "OBJ" + (remark ? ": " + first_words(lines.front()) : std::string())};
  }
  if (const auto kind = toml_content(text)) return kind;
  if (const auto kind = csv_content(lines)) return kind;
  return text_kind(lines.front());
}

std::optional<FileKind> kind_of_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  std::string front(kKindBytes, '\0');
  if (in) in.read(front.data(), static_cast<std::streamsize>(front.size()));
  if (!in.is_open() || in.bad()) {
    throw OsError(path.string() + ": is there and cannot be read, so nobody knows what would be " +
                  "lost (" + std::strerror(errno) + "); give another name");
  }
  front.resize(static_cast<std::size_t>(in.gcount()));
  return kind_of(front);
}

std::string to_text(const FileKind& kind) {
  switch (kind.format) {
    case FileFormat::kScene:
      return "a compiled scene";
    case FileFormat::kRecording:
      return "a recorded session";
    case FileFormat::kMcap:
      return "an MCAP file";
    case FileFormat::kPlan:
      return "a plan";
    case FileFormat::kMesh:
      return "a mesh (" + kind.mark + ")";
    case FileFormat::kToml:
      return kind.mark.empty() ? "a TOML file" : kind.mark + " (TOML)";
    case FileFormat::kCsv:
      return "CSV with the columns " + kind.mark + ",..";
    case FileFormat::kJson:
      return kind.mark.empty() ? "JSON" : "JSON that begins with \"" + kind.mark + "\"";
    case FileFormat::kHtml:
      return "an HTML page";
    case FileFormat::kSvg:
      return "an SVG picture";
    case FileFormat::kXml:
      return kind.mark.empty() ? "an XML file" : "an XML file (" + kind.mark + ")";
    case FileFormat::kText:
      return kind.mark.empty() ? "a text" : "a text that begins with '" + kind.mark + "'";
    case FileFormat::kOther:
      break;
  }
  return "a file of an unknown kind";
}

std::optional<FileFormat> format_named(const std::filesystem::path& path) {
  constexpr std::array<std::pair<std::string_view, FileFormat>, 8> kNamed{{
      {".csv", FileFormat::kCsv},
      {".json", FileFormat::kJson},
      {".svg", FileFormat::kSvg},
      {".html", FileFormat::kHtml},
      {".obj", FileFormat::kMesh},
      {".rtscene", FileFormat::kScene},
      {".mcap", FileFormat::kMcap},
      {".hrec", FileFormat::kRecording},
  }};
  const std::string extension = lower(path.extension().string());
  for (const auto& [name, format] : kNamed)
    if (extension == name) return format;
  return std::nullopt;
}

}  // namespace haptic::tools
