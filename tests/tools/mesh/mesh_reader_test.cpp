// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/mesh_reader.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

RawMesh parse(std::string_view text, MeshFormat format = MeshFormat::kObj) {
  return parse_mesh(std::span(text.data(), text.size()), format, "part");
}

/// Message of the refusal, empty if the text is read.
std::string refusal(std::string_view text, MeshFormat format = MeshFormat::kObj) {
  try {
    parse(text, format);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

bool starts(const std::string& text, std::string_view part) { return text.find(part) == 0; }
bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

const std::string kTriangle = "v 0 0 0\nv 1.5 0 0\nv 0 1 -2.25e-1\n";

const std::string kTextStl =
    "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
    "   vertex 0 1.25e-3 0\n  endloop\n endfacet\nendsolid a b\n";

/// Binary STL with `announced` triangles in the header and `stored` in the body.
std::string binary_stl(std::uint32_t announced, std::uint32_t stored, const std::string& header) {
  std::string bytes = header;
  bytes.resize(80, ' ');
  const auto append = [&](std::uint32_t word) {
    for (int i = 0; i < 4; ++i) {
      bytes += static_cast<char>((word >> (8 * i)) & 0xFFU);
    }
  };
  append(announced);
  for (std::uint32_t t = 0; t < stored; ++t) {
    for (int i = 0; i < 12; ++i) {
      append(std::bit_cast<std::uint32_t>(0.25F * static_cast<float>(i)));
    }
    bytes += std::string(2, '\0');
  }
  return bytes;
}

}  // namespace

TEST_SUITE("tools.mesh_reader") {
  TEST_CASE("obj: corners in all forms, n-gons, negative indices, groups, continuation") {
    const RawMesh mesh =
        parse("# a comment\nmtllib x.mtl\no left\n" + kTriangle +
              "vn 0 0 1\nvt 0 0\nv 1 1 0 1.0\ng rim\nusemtl steel\ns off\n"
              "f 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/1 4/1/1 3/1/1\n"
              "o right\nf -4 -3 \\\n  -2 # end\no left\ng rim\nf 3 2 1\nl 1 2\n");
    REQUIRE(mesh.faces.size() == 6);
    CHECK(mesh.indexed);
    CHECK(mesh.vertices[2] == Point3{0, 1, -0.225});
    CHECK(mesh.vertex_places[1] == 5);
    CHECK(mesh.faces[3].vertices == std::vector<std::uint32_t>{0, 1, 3, 2});
    CHECK(mesh.faces[4].vertices == std::vector<std::uint32_t>{0, 1, 2});
    CHECK(mesh.faces[4].source_place == 18);
    CHECK(mesh.faces[5].source_place == 22);
    CHECK(mesh.faces[4].group != mesh.faces[0].group);
    CHECK(mesh.faces[5].group == mesh.faces[0].group);
    CHECK(mesh.print_resolution == 1.0e-3);  // -2.25e-1
  }

  TEST_CASE("obj: indices may reach forward, vertices may carry colours") {
    const RawMesh mesh = parse("f 1 2 3\nv 0 0 0 1 0 0\nv +1 0 0 1 .5 0\nv 0 1. 0 1 1 0 1\n");
    CHECK(mesh.vertices.size() == 3);
    CHECK(mesh.vertices[1] == Point3{1, 0, 0});
    CHECK(mesh.print_resolution == 1.0);
  }

  TEST_CASE("obj: indices that are left empty, and keywords that OBJ does not have") {
    for (const char* face :
         {"f 1/ 2/ 3/\n", "f 1// 2// 3//\n", "f 1/1/ 2/1/ 3/2/\n", "f 1 2/ 3//7\n"}) {
      CAPTURE(face);
      const RawMesh mesh = parse(kTriangle + face);
      REQUIRE(mesh.faces.size() == 1);
      CHECK(mesh.faces[0].vertices == std::vector<std::uint32_t>{0, 1, 2});
      CHECK(mesh.notes.empty());
    }
    const RawMesh known = parse(kTriangle + "vt 0 0\nvp 1\ns off\nl 1 2\np 1\nusemtl a\nf 1 2 3\n");
    CHECK(known.notes.empty());
    const RawMesh mesh =
        parse("xyz 1 2\n" + kTriangle + "xyz\nf 1 2 3\nabc\nd d\ne\nF 1 2 3\nq\nq\n");
    CHECK(mesh.faces.size() == 1);
    REQUIRE(mesh.notes.size() == 1);
    CHECK(mesh.notes[0] ==
          "part: 8 lines with keywords that OBJ does not have left out: 'xyz' in line 1, "
          "'abc' in line 7, 'd' in line 8, 'e' in line 9, 'F' in line 10 and others");
    CHECK(parse(kTriangle + "f 1 2 3\nxyz\n").notes.at(0) ==
          "part: 1 line with a keyword that OBJ does not have left out: 'xyz' in line 5");
  }

  TEST_CASE("text: line ends of three kinds, tabs and a byte order mark are the same mesh") {
    const std::string text = kTriangle + "f 1 2 3\n";
    std::string dos = "\xEF\xBB\xBF";
    std::string mac;
    for (const char c : text) {
      dos += c == '\n' ? std::string("\r\n") : std::string(1, c == ' ' ? '\t' : c);
      mac += c == '\n' ? '\r' : c;
    }
    for (const std::string& variant : {dos, mac, text.substr(0, text.size() - 1)}) {
      const RawMesh mesh = parse(variant);
      CHECK(mesh.vertices == parse(text).vertices);
      CHECK(mesh.faces[0].source_place == 4);
    }
  }

  TEST_CASE("obj: defects are refused with the line and a fix") {
    CHECK(starts(refusal(kTriangle + "f 1 2\n"), "part:4: a face with 2 corners"));
    CHECK(starts(refusal(kTriangle + "f 0 1 2\n"), "part:4: vertex index 0; OBJ counts from 1"));
    CHECK(starts(refusal(kTriangle + "f 1 2 4\n"), "part:4: vertex index 4 but the file has 3"));
    CHECK(starts(refusal(kTriangle + "f 1 2 -4\n"), "part:4: vertex index -4 reaches before"));
    CHECK(starts(refusal(kTriangle + "f 1 2 99999999999999999999\n"), "part:4: vertex index"));
    CHECK(starts(refusal(kTriangle + "f 1 2 4294967297\n"), "part:4: vertex index 4294967297"));
    CHECK(starts(refusal(kTriangle + "f 1 2 3x\n"), "part:4: vertex index '3x' is not an integer"));
    CHECK(starts(refusal(kTriangle + "f 1 2 3/1/1/1\n"), "part:4: corner '3/1/1/1'"));
    CHECK(starts(refusal(kTriangle + "f 1 2 3///\n"), "part:4: corner '3///' has more than three"));
    CHECK(starts(refusal(kTriangle + "f 1 2 3/ /1\n"), "part:4: vertex index ''"));
    CHECK(starts(refusal(kTriangle + "f 1 2 3/x\n"), "part:4: texture or normal index 'x'"));
    CHECK(starts(refusal(kTriangle + "f 1 2 3/0\n"), "part:4: texture or normal index 0"));
    CHECK(starts(refusal("v 0 0\n"), "part:1: a vertex has 2 numbers"));
    CHECK(starts(refusal("v 0 0 0 0 0\n"), "part:1: a vertex has 5 numbers"));
    CHECK(starts(refusal("v 0 0 0 0.5\n"), "part:1: a vertex has the weight '0.5'"));
    CHECK(contains(refusal("v 0,5 0 0\n"), "has a comma; write numbers with a decimal point"));
    CHECK(contains(refusal("v nan 0 0\n"), "coordinate 'nan' is not finite"));
    CHECK(contains(refusal("v 0 -inf 0\n"), "coordinate '-inf' is not finite"));
    CHECK(contains(refusal("v 0 0 1e400\n"), "coordinate '1e400' is too large"));
    CHECK(contains(refusal("v 0 0 0x10\n"), "coordinate '0x10' is not a number"));
    CHECK(contains(refusal("v 0 0 1.0m\n"), "coordinate '1.0m' is not a number"));
    CHECK(contains(refusal("v 0 0 --1\n"), "is not a number"));
    CHECK(starts(refusal("v 0 0 0\n1 2 3\n"), "part:2: the line starts with '1'"));
    CHECK(starts(refusal("cstype bezier\n"), "part:1: free-form surfaces"));
    CHECK(starts(refusal(kTriangle), "part: the file holds no face"));
  }

  TEST_CASE("numbers too small for a double are zero") {
    CHECK(parse("v 1e-400 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").vertices[0][0] == 0.0);
  }

  TEST_CASE("any format: empty, UTF-16 and binary content are refused") {
    for (const MeshFormat format : {MeshFormat::kObj, MeshFormat::kStl, MeshFormat::kOff}) {
      CHECK(contains(refusal("", format), "the file is empty (0 bytes)"));
      CHECK(contains(refusal(std::string_view("\xFF\xFEv\0 \0", 6), format), "UTF-16"));
    }
    CHECK(contains(refusal(std::string_view("v\0 \0"
                                            "0\0",
                                            6)),
                   "UTF-16"));
    CHECK(starts(refusal(std::string_view("v 0 0\0 0\n", 9)), "part: byte 5: binary data"));
    CHECK(contains(refusal("OFF\n0 0 0\n"), "read as OBJ but the content is OFF"));
    CHECK(contains(refusal(kTextStl, MeshFormat::kOff), "read as OFF but the content is STL"));
    CHECK(contains(refusal("OFF\n3 1 0\n", MeshFormat::kStl), "the content is OFF"));
    CHECK(contains(refusal("ply\nformat ascii 1.0\n"), "the content is PLY"));
  }

  TEST_CASE("stl text: solids are groups, normals do not matter, keywords in any case") {
    std::string second = kTextStl;
    second.replace(second.find("normal 0 0 1"), 12, "NORMAL nan 7 x");
    const RawMesh mesh = parse(kTextStl + "\n" + second, MeshFormat::kStl);
    REQUIRE(mesh.faces.size() == 2);
    CHECK_FALSE(mesh.indexed);
    CHECK(mesh.faces[1].group == 1);
    CHECK(mesh.faces[1].vertices == std::vector<std::uint32_t>{3, 4, 5});
    CHECK(mesh.vertices[2] == Point3{0, 0.00125, 0});
    CHECK(mesh.print_resolution == 1.0e-5);
    CHECK(mesh.faces[0].source_place == 2);
  }

  TEST_CASE("stl text: defects") {
    const auto cut = [](std::string_view end) { return kTextStl.substr(0, kTextStl.find(end)); };
    CHECK(contains(refusal(cut("endsolid"), MeshFormat::kStl), "the file ends inside a solid"));
    CHECK(contains(refusal(cut("vertex 0 1"), MeshFormat::kStl), "the file ends inside a solid"));
    CHECK(starts(refusal(cut("endloop") + "vertex 0 0 0\n", MeshFormat::kStl),
                 "part:7: found 'vertex' where 'endloop' must be"));
    CHECK(starts(refusal(kTextStl + "junk\n", MeshFormat::kStl), "part:10: found 'junk'"));
    CHECK(contains(refusal("solid a\nendsolid a\n", MeshFormat::kStl), "holds no face"));
    CHECK(contains(refusal("hello\n", MeshFormat::kStl), "neither text STL"));
    std::string comma = kTextStl;
    comma.replace(comma.find("1.25e-3"), 7, "1,25");
    CHECK(starts(refusal(comma, MeshFormat::kStl), "part:6: coordinate '1,25' has a comma"));
  }

  TEST_CASE("stl binary: recognised by its size, even where the header says 'solid'") {
    const RawMesh mesh = parse(binary_stl(2, 2, "solid cube"), MeshFormat::kStl);
    REQUIRE(mesh.faces.size() == 2);
    CHECK_FALSE(mesh.places_are_lines);
    CHECK(mesh.faces[1].source_place == 134);
    CHECK(mesh.vertices[0] == Point3{0.75, 1.0, 1.25});
    CHECK(mesh.print_resolution == 0.0);
  }

  TEST_CASE("stl binary: bytes behind the last triangle are left out and noted") {
    const MeshFormat stl = MeshFormat::kStl;
    CHECK(parse(binary_stl(2, 2, "x"), stl).notes.empty());
    for (const std::string& rest :
         {std::string(1, '\0'), std::string(7, '\0'), std::string(300, '\0'),
          std::string("solid behind\r\n"), binary_stl(9, 1, "y")}) {
      CAPTURE(rest.size());
      const RawMesh mesh = parse(binary_stl(2, 2, "x") + rest, stl);
      CHECK(mesh.faces.size() == 2);
      REQUIRE(mesh.notes.size() == 1);
      CHECK(starts(mesh.notes[0], "part: " + std::to_string(rest.size()) + " byte"));
      CHECK(contains(mesh.notes[0], "behind the last of the 2 triangles"));
    }
    // The header may announce too few.
    CHECK(contains(parse(binary_stl(1, 3, "solid x"), stl).notes.at(0),
                   "2 more triangles would take as many: if the part lacks faces"));
    // Files that were put one behind the other are parts of one, as solids of a text are.
    const RawMesh joined = parse(binary_stl(2, 2, "x") + binary_stl(1, 1, "y"), stl);
    REQUIRE(joined.faces.size() == 3);
    CHECK(joined.faces[2].group != joined.faces[1].group);
    CHECK(joined.faces[2].source_place == 84 + 100 + 84);
    CHECK(joined.notes.at(0) == "part: 2 binary STL files one behind the other; all are read");
    std::string late = binary_stl(2, 2, "x") + binary_stl(1, 1, "y");
    late.replace(84 + 100 + 84 + 16, 4, std::string("\x00\x00\xC0\x7F", 4));
    CHECK(starts(refusal(late, stl), "part: byte 284: a coordinate of triangle 0"));
  }

  TEST_CASE("packed files of every format are refused with the command that unpacks them") {
    for (const MeshFormat format :
         {MeshFormat::kObj, MeshFormat::kStl, MeshFormat::kOff, MeshFormat::kPly}) {
      CHECK(starts(refusal(std::string("\x1F\x8B\x08\0", 4) + std::string(200, 'x'), format),
                   "part: the file is gzip-compressed; unpack it: gunzip < 'part' > "
                   "'unpacked_part'"));
      CHECK(contains(refusal(std::string("\xFD\x37\x7A\x58\x5A\0", 6), format), "unxz"));
      CHECK(contains(refusal("BZh91AY", format), "bzip2-compressed; unpack it: bunzip2"));
      CHECK(contains(refusal("\x28\xB5\x2F\xFD x", format), "unzstd"));
      CHECK(contains(refusal("PK\x03\x04 x", format), "is a ZIP archive; unpack it with unzip"));
    }
    CHECK_THROWS_WITH_AS(mesh_format_of("a/b.stl.GZ"),
                         "a/b.stl.GZ: the file is gzip-compressed; unpack it: gunzip < "
                         "'a/b.stl.GZ' > 'a/b.stl', and name the unpacked file",
                         InputError);
  }

  TEST_CASE("stl binary: defects") {
    const MeshFormat stl = MeshFormat::kStl;
    CHECK(
        starts(refusal(binary_stl(3, 2, "x"), stl),
               "part: byte 80: the header announces 3 triangles, 234 bytes, but the file has 184"));
    CHECK(starts(refusal(binary_stl(0, 2, "solid x"), stl), "part: byte 80: the header announces"));
    CHECK(starts(refusal(binary_stl(4294967295U, 2, "x"), stl), "part: byte 80:"));
    CHECK(contains(refusal(binary_stl(0, 0, "x"), stl), "holds no face"));
    CHECK(contains(refusal(std::string_view("abc\0def", 7), stl), "ends inside the header"));
    std::string not_finite = binary_stl(2, 2, "x");
    not_finite.replace(84 + 50 + 16, 4, std::string("\x00\x00\xC0\x7F", 4));
    CHECK(starts(refusal(not_finite, stl), "part: byte 150: a coordinate of triangle 1"));
  }

  TEST_CASE("off: counts, comments, n-gons, colours, counts on the header line") {
    const std::string body =
        "# square\n0 0 0\n1 0 0\n\n1 1 0\n0 1 0 # last\n4 0 1 2 3 255 0 0\n3 0 1 2 7\n";
    for (const std::string head : {"OFF\n4 2 0\n", "OFF 4 2 4\n", "# c\nOFF\n4 2\n"}) {
      const RawMesh mesh = parse(head + body, MeshFormat::kOff);
      REQUIRE(mesh.faces.size() == 2);
      CHECK(mesh.faces[0].vertices == std::vector<std::uint32_t>{0, 1, 2, 3});
      CHECK(mesh.indexed);
    }
    CHECK(parse("COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0\n0 1 0 1 0 0\n3 0 1 2\n", MeshFormat::kOff)
              .vertices[1] == Point3{1, 0, 0});
  }

  TEST_CASE("off: defects") {
    const auto off = [](std::string_view text) { return refusal(text, MeshFormat::kOff); };
    const std::string points = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
    CHECK(starts(off(points), "part:5: the file ends after 0 of 1 lines of kind face"));
    CHECK(starts(off(points + "3 0 1 3\n"), "part:6: vertex index 3 but the file has 3"));
    CHECK(starts(off(points + "3 0 1 -1\n"), "part:6: vertex index -1"));
    CHECK(starts(off(points + "2 0 1\n"), "part:6: a face with 2 corners"));
    CHECK(starts(off(points + "4 0 1 2\n"), "part:6: a face announces 4 corners but lists 3"));
    CHECK(starts(off(points + "3 0 1 2 9 9\n"), "part:6: 2 words after the corners"));
    CHECK(starts(off(points + "3 0 1 2\n3 0 1 2\n"), "part:7: text after the last of 1 faces"));
    CHECK(starts(off("OFF\n4000000000 1 0\n"), "part:2: vertex count 4000000000 does not fit"));
    CHECK(starts(off("OFF\n-3 1 0\n"), "part:2: vertex count -3"));
    CHECK(starts(off("NOFF\n3 1 0\n"), "part:1: the header is 'NOFF'"));
    CHECK(starts(off("OFF BINARY\n"), "part:1: binary OFF"));
    CHECK(starts(off("OFF\n3 1 0\n0 0 0 5\n"), "part:3: a vertex line with 4 numbers"));
  }

  TEST_CASE("PLY: text and both byte orders, other elements and properties skipped") {
    const std::string header =
        "comment c\nobj_info o\nelement vertex 3\nproperty uchar red\nproperty float x\n"
        "property double y\nproperty float32 z\nelement edge 1\nproperty list uchar short e\n"
        "element face 1\nproperty list uint8 int vertex_indices\nproperty short s\nend_header\n";
    const RawMesh text = parse(
        "ply\nformat ascii 1.0\n" + header + "9 0 0 0\n9 1.25 0 0\n9 0 1 0\n2 0 1\n3 0 1 2 -5\n",
        MeshFormat::kPly);
    REQUIRE(text.vertices.size() == 3);
    CHECK(text.vertices[1] == Point3{1.25, 0, 0});
    CHECK(text.faces.at(0).vertices == std::vector<std::uint32_t>{0, 1, 2});
    CHECK(text.faces[0].source_place == 20);
    CHECK(text.vertex_places[1] == 17);
    CHECK(text.print_resolution == doctest::Approx(0.01));
    for (const bool is_big : {false, true}) {
      std::string body;
      const auto put = [&](auto value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        if (is_big) std::reverse(bytes, bytes + sizeof value);
        body.append(bytes, sizeof value);
      };
      for (int v = 0; v < 3; ++v) {
        put(std::uint8_t{9});
        put(v == 1 ? 1.25F : 0.0F);
        put(v == 2 ? 1.0 : 0.0);
        put(0.0F);
      }
      put(std::uint8_t{2});
      put(std::int16_t{0});
      put(std::int16_t{1});
      put(std::uint8_t{3});
      for (const int v : {0, 1, 2}) put(v);
      put(std::int16_t{-5});
      const std::string start = std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
                                "_endian 1.0\n" + header;
      const RawMesh binary = parse(start + body, MeshFormat::kPly);
      CHECK_FALSE(binary.places_are_lines);
      CHECK(binary.vertices == text.vertices);
      CHECK(binary.faces.at(0).vertices == text.faces[0].vertices);
      CHECK(contains(refusal(start + body.substr(0, body.size() - 1), MeshFormat::kPly),
                     "the file ends early"));
      CHECK(contains(refusal(start + body + "x", MeshFormat::kPly), "data after the last element"));
      // The other byte order makes indices that are not there.
      CHECK(!refusal("ply\nformat binary_" + std::string(is_big ? "little" : "big") +
                         "_endian 1.0\n" + header + body,
                     MeshFormat::kPly)
                 .empty());
    }
  }

  TEST_CASE("PLY: defects are refused with their line") {
    const std::string head = "ply\nformat ascii 1.0\n";
    const std::string vertex =
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    const std::string face = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
    const std::string sound = head + vertex + face + points;
    CHECK(parse(sound + "3 0 1 2\n", MeshFormat::kPly).faces.size() == 1);
    const std::pair<std::string, const char*> defects[] = {
        {"plx\n", "part:1: the first line is not 'ply'"},
        {"ply", "part:1: the header has no end"},
        {"ply\nformat ebcdic 1.0\n", "part:2: the format is 'ebcdic'"},
        {"ply\n" + vertex + face, "names no format"},
        {head + "element vertex x\n", "part:3: count 'x'"},
        {head + "element vertex 99999\n", "part:3: the count 99999 does not fit"},
        {head + "element vertex -1\n", "part:3: the count -1"},
        {head + "property float x\n", "part:3: the header says 'property'"},
        {head + vertex + "property quad w\n", "part:7: no type 'quad'"},
        {head + vertex + "property list float int w\n", "part:7: a list is counted by reals"},
        {head + face, "needs one element vertex"},
        {head + vertex + "end_header\n", "needs one element vertex and one element face"},
        {head + vertex + "element face 1\nproperty int q\nend_header\n", "needs one list"},
        {head + "element vertex 3\nproperty float x\nproperty float y\n" + face, "x, y and z"},
        {head + "element e 3\n" + vertex + face, "'e' has no property"},
        {sound, "the file ends early"},
        {sound + "3 0 1", "part:13: the file ends early"},
        {sound + "3 0 1 3\n", "part:13: a vertex index does not fit the file's 3 vertices"},
        {sound + "3 0 1 -1\n", "part:13: a vertex index"},
        {sound + "3 0 1 1.5\n", "part:13: a vertex index"},
        {sound + "2 0 1\n", "part:13: a face with 2 corners"},
        {sound + "-1\n", "part:13: a list of -1"},
        {sound + "3 0 1 2\n7\n", "part:14: data after the last element"},
        {head + vertex + face + "0 0 nan\n", "part:10: coordinate 'nan'"}};
    for (const auto& defect : defects) {
      const auto& text = defect.first;
      const auto& says = defect.second;
      CAPTURE(text);
      const std::string said = refusal(text, MeshFormat::kPly);
      CAPTURE(said);
      CHECK(contains(said, says));
      CHECK(contains(said, "; "));
    }
  }

  TEST_CASE("files: extension, missing file and directory") {
    CHECK(mesh_format_of("b.PLY") == MeshFormat::kPly);
    CHECK(mesh_format_of("a/b.OBJ") == MeshFormat::kObj);
    CHECK(mesh_format_of("b.Stl") == MeshFormat::kStl);
    CHECK(mesh_format_of("b.off") == MeshFormat::kOff);
    CHECK_THROWS_WITH_AS(
        mesh_format_of("b.max"),
        "b.max: the extension '.max' names no mesh format; give a file named .obj, "
        ".stl, .off or .ply, or .3mf, .gltf, .glb, .dae, .amf or .step",
        InputError);
    CHECK_THROWS_AS(read_mesh("no/such/file.obj"), InputError);
    const auto folder = std::filesystem::temp_directory_path() / "haptic_mesh_reader_test";
    std::filesystem::create_directories(folder / "folder.obj");
    CHECK_THROWS_AS(read_mesh(folder / "folder.obj"), InputError);
    const auto path = folder / "tri.obj";
    std::ofstream(path, std::ios::binary) << kTriangle << "f 1 2 3\n";
    const RawMesh mesh = read_mesh(path);
    CHECK(mesh.file == path.string());
    CHECK(mesh.faces.size() == 1);
    std::filesystem::remove_all(folder);
  }

  TEST_CASE("damaged bytes either read or are refused, never anything else") {
    std::mt19937 random(7);
    const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 1\n";
    const std::string obj = kTriangle + "g a\nf 1/1/1 2//2 -1\n";
    const std::pair<std::string, MeshFormat> seeds[] = {
        {obj, MeshFormat::kObj},
        {off, MeshFormat::kOff},
        {kTextStl, MeshFormat::kStl},
        {binary_stl(2, 2, "solid"), MeshFormat::kStl}};
    std::size_t read = 0;
    std::size_t refused = 0;
    for (int round = 0; round < 4000; ++round) {
      const auto& [seed, format] = seeds[static_cast<std::size_t>(round) % 4];
      std::string bytes = seed;
      for (unsigned k = random() % 4; k-- > 0;) {
        const std::size_t at = random() % bytes.size();
        switch (random() % 3) {
          case 0:
            bytes[at] = static_cast<char>(random() % 256);
            break;
          case 1:
            bytes.erase(at, 1 + random() % 5);
            break;
          default:
            bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 9));
        }
        if (bytes.empty()) {
          break;
        }
      }
      try {
        for (const RawFace& face : parse(bytes, format).faces) {
          REQUIRE(face.vertices.size() >= 3);
        }
        ++read;
      } catch (const InputError&) {
        ++refused;
      }
    }
    CHECK(read > 500);
    CHECK(refused > 500);
  }
}

}  // namespace haptic::tools
