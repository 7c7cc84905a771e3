// SPDX-License-Identifier: Apache-2.0
/// PLY, as text and binary of both byte orders: coordinates x, y, z of element `vertex` and the
/// list of corners of element `face`; everything else is walked over and must be complete.
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

enum class PlyForm : std::uint8_t { kText, kLittleEndian, kBigEndian };

struct PlyType {
  std::string_view name, other_name;
  std::size_t bytes;
  bool is_signed, is_real;
};
constexpr PlyType kPlyTypes[] = {
    {"char", "int8", 1, true, false},    {"uchar", "uint8", 1, false, false},
    {"short", "int16", 2, true, false},  {"ushort", "uint16", 2, false, false},
    {"int", "int32", 4, true, false},    {"uint", "uint32", 4, false, false},
    {"float", "float32", 4, true, true}, {"double", "float64", 8, true, true}};

struct PlyProperty {
  std::string name;
  const PlyType* type = nullptr;
  const PlyType* count = nullptr;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

class PlyParser {
 public:
  PlyParser(std::span<const char> bytes, const std::string& file)
      : bytes_(bytes), file_(file), body_({}, {.comments = false}) {
    mesh_.file = file;
    mesh_.indexed = true;
  }

  RawMesh parse() {
    read_header();
    mesh_.places_are_lines = form_ == PlyForm::kText;
    if (form_ == PlyForm::kText && at_ < bytes_.size()) {
      body_ = LineScanner(checked_text(bytes_.subspan(at_), file_), {.comments = false});
    }
    for (const PlyElement& element : elements_) read_element(element);
    const bool is_over = form_ == PlyForm::kText ? word_ == words_.size() && !body_.next(words_)
                                                 : at_ == bytes_.size();
    if (!is_over) refuse("data after the last element", "correct the counts in the header");
    mesh_.print_resolution = printed_.any ? printed_.resolution() : 0.0;
    return std::move(mesh_);
  }

 private:
  /// Line or byte at present.
  [[nodiscard]] std::size_t place() const {
    return in_header_ || form_ == PlyForm::kText ? header_lines_ + body_.line() : at_;
  }
  [[noreturn]] void refuse(const std::string& defect, const std::string& fix) const {
    if (in_header_ || form_ == PlyForm::kText) refuse_line(file_, place(), defect, fix);
    refuse_byte(file_, at_, defect, fix);
  }

  /// Words of the next line of the header.
  std::vector<std::string_view> header_line() {
    const std::string_view rest(bytes_.data() + at_, bytes_.size() - at_);
    const std::size_t end = rest.find('\n');
    ++header_lines_;
    if (end == std::string_view::npos || end > kLongestHeaderLine) {
      refuse("the header has no end", "write LF or CRLF line ends and the line end_header");
    }
    at_ += end + 1;
    std::vector<std::string_view> words;
    LineScanner(rest.substr(0, end), {.comments = false}).next(words);
    return words;
  }

  void read_header() {
    const auto first = header_line();
    if (first.size() != 1 || first[0] != "ply") {
      refuse("the first line is not 'ply'", "check the extension of the file");
    }
    std::optional<PlyForm> form;
    for (;;) {
      const auto words = header_line();
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format" && words.size() == 3) {
        form = form_of(words[1]);
      } else if (words[0] == "element" && words.size() == 3) {
        add_element(words);
      } else if (words[0] == "property" && !elements_.empty() &&
                 (words.size() == 3 || (words.size() == 5 && words[1] == "list"))) {
        add_property(words);
      } else {
        refuse("the header says " + shown_word(words[0]),
               "see the PLY format; export the file again");
      }
    }
    if (!form) refuse("the header names no format", "add a line such as: format ascii 1.0");
    check_elements();
    form_ = *form;
    in_header_ = false;
  }

  PlyForm form_of(std::string_view word) const {
    if (word == "ascii") return PlyForm::kText;
    if (word == "binary_little_endian") return PlyForm::kLittleEndian;
    if (word == "binary_big_endian") return PlyForm::kBigEndian;
    refuse("the format is " + shown_word(word),
           "it must be ascii, binary_little_endian or binary_big_endian");
  }

  void add_element(const std::vector<std::string_view>& words) {
    PlyElement element;
    element.name = words[1];
    const std::int64_t count = parse_integer(words[2], file_, place(), "count");
    // Each takes a byte at least: a larger count lies, and must not reserve memory.
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size()) {
      refuse("the count " + std::to_string(count) + " does not fit the size of the file",
             "correct it");
    }
    element.count = static_cast<std::size_t>(count);
    if (element.count > (element.name == "face" ? kMaxMeshFaces : kMaxMeshVertices)) {
      refuse("the count " + std::to_string(count) + " is too large", "simplify the part");
    }
    elements_.push_back(std::move(element));
  }

  void add_property(const std::vector<std::string_view>& words) {
    PlyProperty property;
    const bool is_list = words.size() == 5;
    if (is_list) {
      property.count = type_of(words[2]);
      if (property.count->is_real) refuse("a list is counted by reals", "count it by uchar or int");
    }
    property.type = type_of(words[is_list ? 3 : 1]);
    property.name = words.back();
    elements_.back().properties.push_back(std::move(property));
  }

  const PlyType* type_of(std::string_view word) const {
    for (const PlyType& type : kPlyTypes) {
      if (word == type.name || word == type.other_name) return &type;
    }
    refuse("no type " + shown_word(word), "export the file again");
  }

  /// Vertices with three coordinates, and faces with one list of corners, once each.
  void check_elements() {
    std::size_t vertices = 0, faces = 0;
    for (const PlyElement& element : elements_) {
      if (element.properties.empty()) {
        refuse("element " + shown_word(element.name) + " has no property", "export the file again");
      }
      std::size_t coordinates = 0, corners = 0;
      for (const PlyProperty& p : element.properties) {
        if (!p.count && (p.name == "x" || p.name == "y" || p.name == "z")) ++coordinates;
        if (is_corners(p)) ++corners;
      }
      if (element.name == "vertex") {
        ++vertices;
        vertex_count_ = element.count;
        if (coordinates != 3) refuse("element vertex needs x, y and z", "export the file again");
      } else if (element.name == "face") {
        ++faces;
        if (corners != 1) {
          refuse("element face needs one list vertex_indices", "export it as a polygon mesh");
        }
      }
    }
    if (vertices != 1 || faces != 1) {
      refuse("the file needs one element vertex and one element face",
             "export it as a polygon mesh");
    }
  }

  static bool is_corners(const PlyProperty& p) {
    return p.count != nullptr && (p.name == "vertex_indices" || p.name == "vertex_index");
  }

  void read_element(const PlyElement& element) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    for (std::size_t k = 0; k < element.count; ++k) {
      Point3 point{};
      std::size_t start = 0;
      RawFace face;
      for (std::size_t j = 0; j < element.properties.size(); ++j) {
        const PlyProperty& p = element.properties[j];
        const bool is_coordinate =
            is_vertex && !p.count && p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z';
        if (p.count != nullptr) {
          read_list(p, is_face && is_corners(p) ? &face.vertices : nullptr);
        } else {
          const double value = next(*p.type, is_coordinate);
          if (is_coordinate) point[static_cast<std::size_t>(p.name[0] - 'x')] = value;
        }
        if (j == 0) start = place_of_value_;
      }
      if (is_vertex) {
        mesh_.vertices.push_back(point);
        mesh_.vertex_places.push_back(start);
      } else if (is_face) {
        face.source_place = start;
        mesh_.faces.push_back(std::move(face));
      }
    }
  }

  void read_list(const PlyProperty& p, std::vector<std::uint32_t>* corners) {
    const double count = next(*p.count, false);
    const std::size_t place = place_of_value_;
    if (!(count >= 0.0) || count != std::floor(count) ||
        count > static_cast<double>(bytes_.size())) {
      refuse("a list of " + short_number(count, 9) + " items", "correct the count");
    }
    if (corners != nullptr && count < 3.0) {
      refuse("a face with " + std::to_string(static_cast<int>(count)) + " corners",
             "a face needs three; delete it");
    }
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      const double value = next(*p.type, false);
      if (corners == nullptr) continue;
      if (!(value >= 0.0) || value >= static_cast<double>(vertex_count_) ||
          value != std::floor(value)) {
        refuse("a vertex index does not fit the file's " + std::to_string(vertex_count_) +
                   " vertices (PLY counts from 0)",
               "correct the index");
      }
      corners->push_back(static_cast<std::uint32_t>(value));
    }
    place_of_value_ = place;
  }

  /// The next number of the body, finite where it is a coordinate.
  double next(const PlyType& type, bool is_coordinate) {
    if (form_ == PlyForm::kText) {
      while (word_ == words_.size()) {
        word_ = 0;
        if (!body_.next(words_)) refuse("the file ends early", "complete it, or export it again");
      }
      place_of_value_ = place();
      return parse_number(words_[word_++], file_, place(), is_coordinate ? "coordinate" : "number",
                          is_coordinate ? &printed_ : nullptr);
    }
    if (type.bytes > bytes_.size() - at_) refuse("the file ends early", "export it again");
    place_of_value_ = at_;
    std::uint64_t word = 0;
    for (std::size_t k = 0; k < type.bytes; ++k) {
      const std::size_t from = form_ == PlyForm::kLittleEndian ? type.bytes - 1 - k : k;
      word = word << 8 | static_cast<unsigned char>(bytes_[at_ + from]);
    }
    const double value = value_of(word, type);
    if (is_coordinate && !std::isfinite(value)) {
      refuse("a coordinate is not finite", "export the part again");
    }
    at_ += type.bytes;
    return value;
  }

  static double value_of(std::uint64_t word, const PlyType& type) {
    if (type.is_real) {
      if (type.bytes == 8) return std::bit_cast<double>(word);
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(word)));
    }
    const auto value = static_cast<double>(word);
    const double half = std::ldexp(1.0, static_cast<int>(8 * type.bytes) - 1);
    return type.is_signed && value >= half ? value - 2.0 * half : value;
  }

  static constexpr std::size_t kLongestHeaderLine = 4096;
  std::span<const char> bytes_;
  std::string file_;
  RawMesh mesh_;
  PlyForm form_ = PlyForm::kText;
  bool in_header_ = true;
  std::size_t at_ = 0, header_lines_ = 0, vertex_count_ = 0, place_of_value_ = 0;
  std::vector<PlyElement> elements_;
  LineScanner body_;
  std::vector<std::string_view> words_;
  std::size_t word_ = 0;
  PrintedDigits printed_;
};

}  // namespace

RawMesh parse_ply(std::span<const char> bytes, const std::string& file) {
  return PlyParser(bytes, file).parse();
}

}  // namespace haptic::tools
