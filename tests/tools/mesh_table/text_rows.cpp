// SPDX-License-Identifier: Apache-2.0
/// OBJ and OFF: lines, words, numbers, indices, counts.
#include <algorithm>
#include <limits>
#include <string_view>

#include "tests/tools/mesh_table/mesh_row.hpp"

namespace haptic::tools::test {
namespace {

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";  // lines 1 to 4
const std::string kFaces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";     // lines 5 to 8
const std::string kOffVertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";       // lines 3 to 6
const std::string kOffFaces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";  // lines 7 to 10
const std::string kOffTetra = "OFF\n4 4 6\n" + kOffVertices + kOffFaces;

std::string utf16(const std::string& text, bool mark) {
  std::string wide = mark ? "\xFF\xFE" : "";
  for (const char c : text) {
    wide += c;
    wide += '\0';
  }
  return wide;
}

/// The tetrahedron with its fourth vertex line or its last face line replaced.
std::string vertex_4(const std::string& line) {
  return replaced(kVertices, "v 0 0 1\n", line + "\n") + kFaces;
}
std::string face_4(const std::string& line) {
  return kVertices + replaced(kFaces, "f 1 4 3\n", line + "\n");
}

class TextRows {
 public:
  Row& good(const std::string& name, const std::string& bytes) {
    rows.push_back(accepted(form + ": " + name, file(), bytes, 1, 1, kTetra_m3, 4));
    return rows.back();
  }
  void bad(const std::string& name, const std::string& bytes, const std::string& place,
           const std::string& fix, Stage stage = Stage::kRead) {
    rows.push_back(refused(form + ": " + name, file(), bytes, stage, place, fix));
  }
  std::vector<Row> rows;
  std::string form;

 private:
  std::string file() const { return "t." + form; }
};

void add_obj_bytes(TextRows& t) {
  const std::string tetra = kVertices + kFaces;
  t.good("a tetrahedron", tetra);
  t.good("CRLF", replaced(tetra, "\n", "\r\n"));
  t.good("CR alone", replaced(tetra, "\n", "\r"));
  t.good("byte order mark", "\xEF\xBB\xBF" + tetra);
  t.good("tabs and runs of blanks", replaced(tetra, " ", " \t  "));
  t.good("no line end at the end", tetra.substr(0, tetra.size() - 1));
  t.good("comments everywhere", "# head\n" + replaced(tetra, "\n", " # 1 2 3\n#\n"));
  t.good("continuation lines", replaced(tetra, " 3 ", " \\\n3\\\n "));
  t.good("continuation at the end of the file", face_4("f 1 4 3 \\"));
  t.good("names that are not ASCII",
         "o Gr\xC3\xB6\xC3\x9F"
         "e \xE5\xAD\x94\ng \xFF\n" +
             tetra);
  t.good("unknown keywords, materials, lines", "mtllib a.mtl\n" + tetra + "l 1 2\nthis is not\n");
  t.good("colours after the coordinates", replaced(tetra, "0 0 1\n", "0 0 1 0.5 .5 1\n"));
  t.good("weights of one", replaced(tetra, "v 0 0 1\n", "v 0 0 1 1.0\n"));
  t.good("indices that reach forward", kFaces + kVertices);
  t.good("negative indices", kVertices + "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -4 -1 -2\n");
  t.good("texture and normal indices", "vt 0 0\nvn 0 0 1\n" + kVertices +
                                           "f 1/1 3/1 2/1\nf 1//1 2//1 4//1\n"
                                           "f 2/1/1 3/1/1 4/1/1\nf 1 4 3\n");
  t.good("a vertex that no face uses, far away", kVertices + "v 1e300 0 -1e300\n" + kFaces);
  t.bad("0 bytes", "", "t.obj: the file is empty (0 bytes)", "export the part again");
  t.bad("only white space", " \t\r\n\n  ", "t.obj: the file holds no face", "polygon mesh");
  t.bad("no faces", kVertices, "t.obj: the file holds no face", "polygon mesh");
  t.bad("a single vertex", "v 0 0 0\n", "t.obj: the file holds no face", "polygon mesh");
  t.bad("capital keywords are none", replaced(kVertices, "v", "V") + replaced(kFaces, "f", "F"),
        "t.obj: the file holds no face", "polygon mesh");
  t.bad("UTF-16 with its mark", utf16(tetra, true), "t.obj: byte 0: the text is UTF-16", "UTF-8");
  t.bad("UTF-16 without a mark", utf16(tetra, false), "t.obj: byte 0: the text is UTF-16", "UTF-8");
  t.bad("a zero byte", kVertices + std::string(1, '\0') + kFaces, "t.obj: byte 32: binary data",
        "export the part again");
  t.bad("binary junk at the end", tetra + std::string("\x01\x00\x7F", 3),
        "t.obj: byte 65: binary data", "extension");
}

void add_obj_numbers(TextRows& t) {
  t.good("1e-400 is zero", replaced(kVertices, "v 0 0 0", "v 1e-400 0 -1e-400") + kFaces);
  t.good("minus zero, plus signs, bare points", vertex_4("v -0 +0. 1."));
  t.bad("NaN", vertex_4("v 0 nan 1"), "t.obj:4: coordinate 'nan' is not finite", "delete the face");
  t.bad("Inf", vertex_4("v 0 0 -Inf"), "t.obj:4: coordinate '-Inf'", "delete the face");
  t.bad("1e400", vertex_4("v 0 0 1e400"), "t.obj:4: coordinate '1e400' is too large",
        "check the unit");
  t.bad("decimal comma", vertex_4("v 0,0 0,0 1,5"), "t.obj:4: coordinate '0,0' has a comma",
        "decimal point");
  t.bad("hexadecimal", vertex_4("v 0 0 0x1p0"), "t.obj:4: coordinate '0x1p0' is not a number",
        "write a decimal number");
  t.bad("a unit behind the number", vertex_4("v 0 0 1m"), "t.obj:4: coordinate '1m'", "decimal");
  t.bad("Fortran exponent", vertex_4("v 0 0 1d0"), "t.obj:4: coordinate '1d0'", "decimal");
  t.bad("two signs", vertex_4("v 0 0 +-1"), "t.obj:4: coordinate '+-1'", "decimal");
  t.bad("cut in the middle of a number", kVertices.substr(0, kVertices.size() - 2) + "1e",
        "t.obj:4: coordinate '1e' is not a number", "decimal number");
  t.bad("cut in the middle of a vertex", kVertices.substr(0, kVertices.size() - 3),
        "t.obj:4: a vertex has 2 numbers", "give x, y and z");
  t.bad("five numbers", vertex_4("v 0 0 1 0 0"), "t.obj:4: a vertex has 5 numbers", "x, y and z");
  t.bad("weight 0.5", vertex_4("v 0 0 1 0.5"), "t.obj:4: a vertex has the weight '0.5'",
        "weight 1");
  t.bad("coordinates near the largest double", vertex_4("v 0 0 1e308"), "largest 1e+04 m",
        "check the scale", Stage::kClean);
  t.bad("free-form surface", "cstype bezier\n" + kVertices, "t.obj:1: free-form", "polygon mesh");
  t.bad("a line that starts with a number", kVertices + "1 2 3\n" + kFaces,
        "t.obj:5: the line starts with '1'", "start it with v or f");
}

void add_obj_indices(TextRows& t) {
  t.good("a corner twice in a row", face_4("f 1 4 4 3 1"));
  t.good("a face over three times the same vertex", kVertices + kFaces + "f 2 2 2\n");
  t.bad("index 0", face_4("f 0 4 3"), "t.obj:8: vertex index 0", "OBJ counts from 1");
  t.bad("index out of range", face_4("f 1 4 5"), "t.obj:8: vertex index 5 but the file has 4",
        "correct the index");
  t.bad("negative index out of range", face_4("f 1 4 -5"), "t.obj:8: vertex index -5",
        "correct the index");
  t.bad("index 2^32 + 3", face_4("f 1 4 4294967299"), "t.obj:8: vertex index 4294967299",
        "correct the index");
  t.bad("index 2^64 + 3", face_4("f 1 4 18446744073709551619"), "t.obj:8: vertex index '1844674407",
        "correct the number");
  t.bad("index -2^63", face_4("f 1 4 -9223372036854775808"), "t.obj:8: vertex index", "correct");
  t.bad("index with a fraction", face_4("f 1 4 3.0"), "t.obj:8: vertex index '3.0'", "correct");
  t.bad("four indices in a corner", face_4("f 1/1/1/1 4 3"), "t.obj:8: corner '1/1/1/1'",
        "v/vt/vn");
  t.good("a corner that ends in a slash", face_4("f 1 4 3/"));
  t.bad("a face with two corners", face_4("f 1 4"), "t.obj:8: a face with 2 corners",
        "needs three");
  t.bad("cut in the middle of a face", (kVertices + kFaces).substr(0, 60),
        "t.obj:8: a face with 1 corners", "complete the file");
  t.bad("a face that runs back on itself", kVertices + "f 1 3 2 3\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
        "longest hole at (0.353553391, 0.353553391, 0) m (3 edges", "close the hole",
        Stage::kClean);
  t.bad("a single triangle", kVertices + "f 1 2 3\n", "open: 3 edges without a partner",
        "close the hole", Stage::kClean);
}

void add_obj_scales(TextRows& t) {
  const std::string tetra = kVertices + kFaces;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double s : {0.0, -1.0, nan, infinity}) {
    t.bad("scale " + std::to_string(s), tetra, "the scale (1, " + std::string(s == 0 ? "0" : ""),
          "metres per unit", Stage::kClean);
    t.rows.back().with_scale(1.0, s, 1.0);
  }
  t.good("three different scales", tetra).with_scale(0.001, 0.002, 0.003).volume_m3 = 1e-9;
  t.good("a scale that is no power of two", tetra).with_scale(0.0254, 0.0254, 0.0254).volume_m3 =
      0.0254 * 0.0254 * 0.0254 / 6.0;
}

void add_off_rows(TextRows& t) {
  const std::string all = kOffTetra;
  t.good("a tetrahedron", all);
  t.good("CRLF", replaced(all, "\n", "\r\n"));
  t.good("CR alone", replaced(all, "\n", "\r"));
  t.good("byte order mark", "\xEF\xBB\xBF" + all);
  t.good("tabs, blank lines, comments",
         "# head\n" + replaced(replaced(all, " ", "\t "), "\n", " # x\n\n"));
  t.good("counts in the header line", replaced(all, "OFF\n", "OFF "));
  t.good("two counts", replaced(all, "4 4 6", "4 4"));
  t.good("a wrong edge count", replaced(all, "4 4 6", "4 4 77"));
  t.good(
      "COFF with colours at the vertices",
      "COFF\n4 4 6\n0 0 0 255 0 0 255\n1 0 0 0.5 0 0\n0 1 0 1 1 1 1\n0 0 1 0 0 0 0\n" + kOffFaces);
  t.good("colours at the faces", "OFF\n4 4 6\n" + kOffVertices +
                                     "3 0 2 1 7\n3 0 1 3 255 0 0\n3 1 2 3 .1 .2 .3 1\n3 0 3 2\n");
  t.good("1e-400 is zero", replaced(all, "\n0 0 0\n", "\n1e-400 0 0\n"));
  t.good("a corner twice in a row", replaced(all, "3 0 3 2", "5 0 0 3 3 2"));
  t.bad("0 bytes", "", "t.off: the file is empty (0 bytes)", "export the part again");
  t.bad("only white space", "\n \t\n", "t.off:", "complete the file");
  t.bad("no header", all.substr(4), "t.off:1: the header is '4'", "must be OFF or COFF");
  t.bad("a header that is not read", "N" + all, "t.off:1: the header is 'NOFF'", "OFF or COFF");
  t.bad("binary OFF", "OFF BINARY\n1234", "t.off:1: binary OFF", "export it as text");
  t.bad("only the header", "OFF\n", "t.off:1: the file ends after 0 of 1", "complete the file");
  t.bad("one count", replaced(all, "4 4 6", "4"), "t.off:2: the counts line has 1 words",
        "vertices, faces and edges");
  t.bad("too many vertices announced", replaced(all, "4 4 6", "5 4 6"),
        "t.off:7: a vertex line with 4 numbers", "give x, y and z");
  t.bad("too few vertices announced", replaced(all, "4 4 6", "3 4 6"),
        "t.off:6: a face with 0 corners", "needs three");
  t.bad("too many faces announced", replaced(all, "4 4 6", "4 5 6"),
        "t.off:10: the file ends after 4 of 5", "correct the counts");
  t.bad("too few faces announced", replaced(all, "4 4 6", "4 3 6"),
        "t.off:10: text after the last of 3 faces", "correct the counts");
  t.bad("no face", "OFF\n4 0 0\n" + kOffVertices, "t.off: the file holds no face", "polygon mesh");
  t.bad("a count of a thousand million", replaced(all, "4 4 6", "1000000000 4 6"),
        "t.off:2: vertex count 1000000000 does not fit", "correct the counts");
  t.bad("a count of 2^64", replaced(all, "4 4 6", "4 18446744073709551616 6"),
        "t.off:2: face count '1844674407", "correct the number");
  t.bad("a negative count", replaced(all, "4 4 6", "4 -4 6"), "t.off:2: face count -4",
        "correct the counts");
  t.bad("a count with a fraction", replaced(all, "4 4 6", "4.0 4 6"), "t.off:2: vertex count '4.0'",
        "correct the number");
  t.bad("NaN", replaced(all, "0 0 1\n", "0 0 NaN\n"), "t.off:6: coordinate 'NaN'", "delete");
  t.bad("Inf", replaced(all, "0 0 1\n", "0 0 inf\n"), "t.off:6: coordinate 'inf'", "delete");
  t.bad("1e400", replaced(all, "0 0 1\n", "0 0 1e400\n"), "t.off:6: coordinate '1e400'", "unit");
  t.bad("decimal comma", replaced(all, "1 0 0\n", "1,0 0 0\n"), "t.off:4: coordinate '1,0'",
        "decimal point");
  t.bad("index out of range", replaced(all, "3 0 3 2", "3 0 4 2"),
        "t.off:10: vertex index 4 but the file has 4 vertices", "correct the index");
  t.bad("negative index", replaced(all, "3 0 3 2", "3 0 -1 2"), "t.off:10: vertex index -1",
        "correct the index");
  t.bad("a face with two corners", replaced(all, "3 0 3 2", "2 0 3"),
        "t.off:10: a face with 2 corners", "delete it");
  t.bad("a face of 2^62 corners", replaced(all, "3 0 3 2", "4611686018427387904 0 3 2"),
        "t.off:10: a face announces 4611686018427387904", "complete the line");
  t.bad("two words behind a face", replaced(all, "3 0 3 2", "3 0 3 2 1 1"),
        "t.off:10: 2 words after the corners", "a colour is");
  t.bad("cut in the middle of a face", all.substr(0, all.size() - 3),
        "t.off:10: a face announces 3 corners but lists 2", "complete the line");
  t.bad("text after the end", all + "end\n", "t.off:11: text after the last", "counts");
  t.bad("UTF-16", utf16(all, true), "t.off: byte 0: the text is UTF-16", "UTF-8");
  t.bad("a zero byte", all + std::string(1, '\0'), "binary data in a text format", "extension");
}

}  // namespace

std::vector<Row> text_rows() {
  TextRows t;
  t.form = "obj";
  add_obj_bytes(t);
  add_obj_numbers(t);
  add_obj_indices(t);
  add_obj_scales(t);
  t.form = "off";
  add_off_rows(t);
  return t.rows;
}

}  // namespace haptic::tools::test
