// SPDX-License-Identifier: Apache-2.0
/// OFF and COFF in text form: counts, one vertex per line, one face per line; colours are checked
/// and skipped.
#include <utility>

#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

class OffParser {
 public:
  OffParser(std::string_view text, const std::string& file)
      : text_size_(text.size()),
        lines_(text, {.comments = true, .continuation = false}),
        file_(file) {
    mesh_.file = file;
    mesh_.indexed = true;
  }

  RawMesh parse() {
    read_header();
    for (std::size_t i = 0; i < vertex_count_; ++i) {
      next_line("vertex", i, vertex_count_);
      read_vertex();
    }
    for (std::size_t i = 0; i < face_count_; ++i) {
      next_line("face", i, face_count_);
      read_face();
    }
    if (lines_.next(words_)) {
      refuse("text after the last of " + std::to_string(face_count_) + " faces",
             "correct the counts in the header");
    }
    mesh_.print_resolution = printed_.resolution();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& defect, const std::string& fix) const {
    refuse_line(file_, lines_.line(), defect, fix);
  }

  void next_line(const char* what, std::size_t done, std::size_t announced) {
    if (!lines_.next(words_)) {
      refuse("the file ends after " + std::to_string(done) + " of " + std::to_string(announced) +
                 " lines of kind " + what,
             "complete the file or correct the counts");
    }
  }

  std::size_t read_count(std::string_view word, const char* what, std::size_t limit) const {
    const std::int64_t count = parse_integer(word, file_, lines_.line(), what);
    // Each vertex and face takes at least six characters: a larger count lies, and must not reserve
    // memory.
    if (count < 0 || static_cast<std::uint64_t>(count) > text_size_ / 6 + 1) {
      refuse(std::string(what) + " " + std::to_string(count) + " does not fit the size of the file",
             "correct the counts in the header");
    }
    if (static_cast<std::uint64_t>(count) > limit) {
      refuse(std::string(what) + " " + std::to_string(count) + ", limit " + std::to_string(limit),
             "simplify the part");
    }
    return static_cast<std::size_t>(count);
  }

  void read_header() {
    next_line("header", 0, 1);
    const std::string_view kind = words_.front();
    if (kind != "OFF" && kind != "COFF") {
      refuse("the header is " + shown_word(kind), "the first word must be OFF or COFF");
    }
    has_colours_ = kind == "COFF";
    words_.erase(words_.begin());
    if (words_.empty()) {
      next_line("counts", 0, 1);
    } else if (equals_lower(words_.front(), "binary")) {
      refuse("binary OFF", "export it as text");
    }
    if (words_.size() != 2 && words_.size() != 3) {
      refuse("the counts line has " + std::to_string(words_.size()) + " words",
             "give the numbers of vertices, faces and edges");
    }
    vertex_count_ = read_count(words_[0], "vertex count", kMaxMeshVertices);
    face_count_ = read_count(words_[1], "face count", kMaxMeshFaces);
    if (words_.size() == 3) {
      // Writers disagree about the edge count (often 0); it must only be a number.
      parse_integer(words_[2], file_, lines_.line(), "edge count");
    }
    mesh_.vertices.reserve(vertex_count_);
    mesh_.vertex_places.reserve(vertex_count_);
    mesh_.faces.reserve(face_count_);
  }

  void read_vertex() {
    const std::size_t values = words_.size();
    if (values != 3 && !(has_colours_ && (values == 6 || values == 7))) {
      refuse("a vertex line with " + std::to_string(values) + " numbers",
             has_colours_ ? "give x, y, z and a colour" : "give x, y and z");
    }
    Point3 point{};
    for (std::size_t i = 0; i < 3; ++i) {
      point[i] = parse_number(words_[i], file_, lines_.line(), "coordinate", &printed_);
    }
    for (std::size_t i = 3; i < values; ++i) {
      parse_number(words_[i], file_, lines_.line(), "colour", nullptr);
    }
    mesh_.vertices.push_back(point);
    mesh_.vertex_places.push_back(lines_.line());
  }

  void read_face() {
    const std::int64_t corners = parse_integer(words_[0], file_, lines_.line(), "corner count");
    if (corners < 3) {
      refuse("a face with " + std::to_string(corners) + " corners",
             "a face needs three; delete it");
    }
    const std::size_t rest = words_.size() - 1;
    if (static_cast<std::uint64_t>(corners) > rest) {
      refuse("a face announces " + std::to_string(corners) + " corners but lists " +
                 std::to_string(rest),
             "complete the line");
    }
    const auto count = static_cast<std::size_t>(corners);
    const std::size_t colours = rest - count;
    if (colours == 2 || colours > 4) {
      refuse(std::to_string(colours) + " words after the corners of a face",
             "a colour is one index, or three or four numbers");
    }
    RawFace face;
    face.source_place = lines_.line();
    face.vertices.reserve(count);
    for (std::size_t i = 1; i <= count; ++i) {
      const std::int64_t index = parse_integer(words_[i], file_, lines_.line(), "vertex index");
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertex_count_) {
        refuse("vertex index " + std::to_string(index) + " but the file has " +
                   std::to_string(vertex_count_) + " vertices (OFF counts from 0)",
               "correct the index");
      }
      face.vertices.push_back(static_cast<std::uint32_t>(index));
    }
    for (std::size_t i = count + 1; i < words_.size(); ++i) {
      parse_number(words_[i], file_, lines_.line(), "colour", nullptr);
    }
    mesh_.faces.push_back(std::move(face));
  }

  std::size_t text_size_;
  LineScanner lines_;
  std::string file_;
  RawMesh mesh_;
  PrintedDigits printed_;
  std::vector<std::string_view> words_;
  bool has_colours_ = false;
  std::size_t vertex_count_ = 0;
  std::size_t face_count_ = 0;
};

}  // namespace

RawMesh parse_off(std::string_view text, const std::string& file) {
  return OffParser(text, file).parse();
}

}  // namespace haptic::tools
