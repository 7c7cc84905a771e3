// SPDX-License-Identifier: Apache-2.0
/// STL, text and binary: keywords, numbers, counts that lie, records cut short.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "tests/tools/mesh_table/mesh_row.hpp"
#include "tests/tools/mesh_table/mesh_text.hpp"

namespace haptic::tools::test {
namespace {

constexpr const char* kAgain = "export the part again";

MeshBuilder tetrahedron() {
  MeshBuilder mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.face({0, 2, 1});
  mesh.face({0, 1, 3});
  mesh.face({1, 2, 3});
  mesh.face({0, 3, 2});
  return mesh;
}

class StlRows {
 public:
  explicit StlRows(std::string form) : form_(std::move(form)) {}
  Row& good(const std::string& name, const std::string& bytes) {
    rows.push_back(accepted(form_ + ": " + name, "t.stl", bytes, 1, 1, kTetra_m3, 4));
    return rows.back();
  }
  void bad(const std::string& name, const std::string& bytes, const std::string& place,
           const std::string& fix) {
    rows.push_back(refused(form_ + ": " + name, "t.stl", bytes, Stage::kRead, place, fix));
  }
  std::vector<Row> rows;

 private:
  std::string form_;
};

/// Facet f has its "facet" in line 2 + 7 f and its vertices in the lines 4 to 6 + 7 f.
std::vector<Row> stl_text_rows() {
  StlRows t("text stl");
  const std::string all = stl_text(tetrahedron());
  const std::string last = "vertex 0 0 1\nvertex 0 1 0\nendloop";  // lines 26 to 28
  const auto with_last = [&](const std::string& text) { return replaced(all, last, text); };
  t.good("a tetrahedron", all);
  t.good("CRLF", replaced(all, "\n", "\r\n"));
  t.good("CR alone", replaced(all, "\n", "\r"));
  t.good("byte order mark", "\xEF\xBB\xBF" + all);
  t.good("everything in one line after the name",
         "solid\n" + replaced(all.substr(all.find('\n') + 1), "\n", " \t"));
  t.good("capitals",
         replaced(replaced(replaced(all, "facet", "FACET"), "vertex", "Vertex"), "solid", "SOLID"));
  t.good("no name", replaced(all, " part", ""));
  t.good("a name that is not ASCII", replaced(all, "part",
                                              "Gr\xC3\xB6\xC3\x9F"
                                              "e"));
  t.good("normals that are not numbers", replaced(all, "normal 0 0 0", "normal nan -nan inf"));
  t.good("blank lines at both ends", "\n\n" + all + "\n \n");
  t.good("1e-400 is zero", replaced(all, "vertex 0 0 0", "vertex 1e-400 0 0"));
  t.good("two solids that are one surface",
         replaced(all, "endfacet\nfacet normal 0 0 0\nouter loop\nvertex 1",
                  "endfacet\nendsolid\nsolid b\nfacet normal 0 0 0\nouter loop\nvertex 1"));
  t.bad("only white space", " \n\t\r\n", "t.stl: byte 0: neither text STL", "extension");
  t.bad("another first word", "sold x\n" + all, "t.stl: byte 0: neither text STL", "extension");
  t.bad("UTF-16", "\xFF\xFEs" + std::string(1, '\0'), "t.stl: byte 0: the text is UTF-16", "UTF-8");
  t.bad("no facet", "solid a\nendsolid a\n", "t.stl: the file holds no face", "polygon mesh");
  t.bad("without endsolid", replaced(all, "endsolid part\n", ""),
        "t.stl:29: the file ends inside a solid", "'endsolid' is missing");
  t.bad("cut in the middle of a keyword", all.substr(0, all.find(last) + 3),
        "t.stl:26: found 'ver' where 'vertex' must be", kAgain);
  t.bad("cut in the middle of a facet", all.substr(0, all.find(last) + 13),
        "t.stl:26: the file ends inside a solid", "complete the file");
  t.bad("a facet of two vertices", with_last("vertex 0 0 1\nendloop"),
        "t.stl:27: found 'endloop' where 'vertex' must be", kAgain);
  t.bad("a facet of four vertices", with_last("vertex 0 0 1\nvertex 0 1 0\n" + last),
        "t.stl:28: found 'vertex' where 'endloop' must be", kAgain);
  t.bad("NaN", with_last("vertex 0 nan 1\nvertex 0 1 0\nendloop"), "t.stl:26: coordinate 'nan'",
        "delete the face");
  t.bad("Inf", with_last("vertex 0 0 1\nvertex inf 1 0\nendloop"), "t.stl:27: coordinate 'inf'",
        "delete the face");
  t.bad("1e400", with_last("vertex 0 0 1e400\nvertex 0 1 0\nendloop"),
        "t.stl:26: coordinate '1e400'", "unit");
  t.bad("decimal comma", with_last("vertex 0 0 1\nvertex 0 1,0 0\nendloop"),
        "t.stl:27: coordinate '1,0'", "decimal point");
  t.bad("a comment", with_last("# the last one\n" + last), "t.stl:26: found '#'", kAgain);
  t.bad("text after the end", all + "the end\n", "t.stl:31: found 'the'", "delete");
  // Which of the two forms such a file should be is decided by its first 512 bytes.
  const std::string long_text =
      all.substr(0, all.find("endsolid")) + all.substr(all.find('\n') + 1);
  t.bad("a zero byte far from the start", long_text + std::string(1, '\0'),
        "t.stl: byte " + std::to_string(long_text.size()) + ": binary data in a text format",
        kAgain);
  t.bad("a zero byte near the start", "solid" + std::string(1, '\0') + all,
        "t.stl: byte 80: the header announces", kAgain);
  return t.rows;
}

/// Triangle t at byte 84 + 50 t, its corner c at + 12 (c + 1).
std::vector<Row> stl_binary_rows() {
  StlRows t("binary stl");
  const auto four = fans_of(tetrahedron());
  const std::string all = stl_bytes("", 4, four);
  const auto with_value = [&](std::size_t triangle, double value) {
    auto triangles = four;
    triangles[triangle][1][2] = value;
    return stl_bytes("", 4, triangles);
  };
  t.good("a tetrahedron", all);
  t.good("a header that says solid", stl_bytes("solid facet normal", 4, four));
  t.good("a header of spaces that says solid", stl_bytes("solid" + std::string(75, ' '), 4, four));
  t.good("a header that says OBJ", stl_bytes("v 0 0 0\nf 1 2 3\n", 4, four));
  std::string attributes = all;
  attributes.replace(84 + 48, 2, "\xFF\xFF");
  t.good("attribute bytes", attributes);
  t.good("subnormal coordinates", with_value(0, 1e-42));  // corner (0, 1, 0) of the base
  t.bad("0 bytes", "", "t.stl: the file is empty (0 bytes)", kAgain);
  t.bad("one byte", std::string(1, '\0'), "t.stl: byte 1: the file ends inside the header", kAgain);
  t.bad("cut in the header", all.substr(0, 83), "t.stl: byte 83: the file ends inside", kAgain);
  t.bad("cut in a record", all.substr(0, all.size() - 10),
        "t.stl: byte 80: the header announces 4 triangles, 284 bytes, but the file has 274",
        kAgain);
  t.bad("one triangle too many announced", stl_bytes("", 5, four),
        "t.stl: byte 80: the header announces 5", kAgain);
  t.bad("no triangle announced", stl_bytes("", 0, four), "t.stl: byte 80: the header announces 0",
        kAgain);
  t.bad("2^32 - 1 triangles announced", stl_bytes("", 0xFFFFFFFFU, four),
        "t.stl: byte 80: the header announces 4294967295", kAgain);
  t.bad("a lying count behind solid", stl_bytes("solid", 40, four),
        "t.stl: byte 80: the header announces 40", kAgain);
  t.bad("no triangle at all", stl_bytes("", 0, {}), "t.stl: the file holds no face",
        "polygon mesh");
  t.good("junk at the end", all + "junk");
  t.bad("NaN", with_value(2, std::numeric_limits<double>::quiet_NaN()),
        "t.stl: byte " + std::to_string(84 + 100 + 24 + 8) + ": a coordinate of triangle 2",
        "delete the triangle");
  t.bad("Inf", with_value(3, -std::numeric_limits<double>::infinity()),
        "t.stl: byte " + std::to_string(84 + 150 + 24 + 8) + ": a coordinate of triangle 3",
        "delete the triangle");
  return t.rows;
}

}  // namespace

std::vector<Row> stl_rows() {
  std::vector<Row> rows = stl_text_rows();
  const std::vector<Row> binary = stl_binary_rows();
  rows.insert(rows.end(), binary.begin(), binary.end());
  return rows;
}

}  // namespace haptic::tools::test
