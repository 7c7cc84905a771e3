// SPDX-License-Identifier: Apache-2.0
/// Names, extensions, folders, contents of another kind.
#include "tests/tools/mesh_table/mesh_row.hpp"
#include "tests/tools/mesh_table/mesh_text.hpp"

namespace haptic::tools::test {

std::vector<Row> file_rows() {
  MeshBuilder cube;
  cube.box({0, 0, 0}, {1, 1, 1});
  const std::string obj = obj_text(cube);
  const std::string off = off_text(cube);
  const std::string stl = stl_text(cube);
  const std::string binary = stl_binary(cube);
  const auto good = [](const char* name, const char* file, const std::string& bytes) {
    return accepted(std::string("file: ") + name, file, bytes, 1, 1, 1.0, 8);
  };
  const auto bad = [](const char* name, const char* file, const std::string& bytes,
                      const char* place, const char* fix) {
    return refused(std::string("file: ") + name, file, bytes, Stage::kRead, place, fix);
  };
  std::vector<Row> rows = {
      good("capitals, obj", "CUBE.OBJ", obj),
      good("capitals, stl", "CUBE.STL", stl),
      good("mixed case, off", "Cube.Off", off),
      good("capitals, binary stl", "CUBE.Stl", binary),
      good("two extensions", "cube.stl.obj", obj),
      good("a name with blanks", "a cube.obj", obj),
      good("a name that is not ASCII", "W\xC3\xBCrfel \xE7\xAB\x8B\xE6\x96\xB9.off", off),
      good("a name that is not UTF-8", "cube\xFF.obj", obj),
      bad("no extension", "cube", obj, "the extension '' names no mesh format", ".obj, .stl"),
      bad("only an extension", ".obj", obj, "the extension '' names no mesh format", ".obj"),
      bad("unknown extension", "cube.xyz", "0 0 0\n", "the extension '.xyz'", "give a file named"),
      bad("an extension behind the true one", "cube.obj.txt", obj, "the extension '.txt'",
          "give a file named"),
      bad("OFF named obj", "cube.obj", off, "cube.obj:1: read as OBJ but the content is OFF",
          "rename the file"),
      bad("STL named obj", "cube.obj", stl, "cube.obj:1: read as OBJ but the content is STL",
          "rename the file"),
      bad("binary STL named obj", "cube.obj", binary, "cube.obj: byte", "extension"),
      bad("OBJ named off", "cube.off", obj, "cube.off:1: read as OFF but the content is OBJ",
          "rename the file"),
      bad("STL named off", "cube.off", stl, "cube.off:1: read as OFF but the content is STL",
          "rename the file"),
      bad("binary STL named off", "cube.off", binary, "cube.off: byte", "extension"),
      bad("OBJ named stl", "cube.stl", obj, "cube.stl: byte 0: neither text STL", "extension"),
      bad("OFF named stl", "cube.stl", off, "cube.stl:1: read as STL but the content is OFF",
          "rename the file"),
      bad("PLY named obj", "cube.obj", "ply\nformat ascii 1.0\n", "the content is PLY", "convert"),
      bad("PLY named stl", "cube.stl", "ply\nformat ascii 1.0\n", "the content is PLY", "convert"),
      bad("XML named off", "cube.off", "<?xml version=\"1.0\"?>\n", "the content is XML",
          "convert"),
      bad("JSON named obj", "cube.obj", "{\"asset\": 1}\n", "the content is JSON", "convert"),
      bad("a folder", "folder.obj", "", "folder.obj: there is no such file", "check the path"),
      bad("no such file", "missing.stl", "", "missing.stl: there is no such file",
          "check the path"),
  };
  rows[rows.size() - 2].source = Row::Source::kFolder;
  rows[rows.size() - 1].source = Row::Source::kMissing;
  return rows;
}

}  // namespace haptic::tools::test
