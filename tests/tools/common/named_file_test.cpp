// SPDX-License-Identifier: Apache-2.0
#include "tools/common/named_file.hpp"

#include <doctest/doctest.h>

#include <fstream>

#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {

using sim::test::ScratchFolder;

TEST_SUITE("tools.named_file") {
  TEST_CASE("names as they are written, with blanks and with backslashes need no note") {
    const ScratchFolder folder("named_file");
    const std::filesystem::path top = folder.file("");
    std::filesystem::create_directories(top / "Meshes");
    std::ofstream(top / "Meshes/Part 1.STL") << "x";
    for (const char* name : {"Meshes/Part 1.STL", " Meshes/Part 1.STL\n", "Meshes\\Part 1.STL",
                             ".\\Meshes\\..\\Meshes\\Part 1.STL"}) {
      CAPTURE(name);
      const auto found = named_file(top, name);
      REQUIRE(found);
      CHECK(std::filesystem::equivalent(found->path, top / "Meshes/Part 1.STL"));
      CHECK(found->note.empty());
    }
    for (const char* name :
         {"", " ", "/", ".", "Meshes", "Meshes/", "Meshes/Part 2.STL", "x/y/z"}) {
      CAPTURE(name);
      CHECK_FALSE(named_file(top, name));
    }
    CHECK_FALSE(named_file(top, std::string(100'000, 'a')));
  }

  TEST_CASE("letters of another case are found with a note; two such files are refused") {
    const ScratchFolder folder("named_file_case");
    const std::filesystem::path top = folder.file("");
    std::filesystem::create_directories(top / "Meshes");
    std::filesystem::create_directories(top / "meshes");  // has no such file
    std::ofstream(top / "Meshes/Part.STL") << "x";
    for (const std::string& name : {std::string("meshes/part.stl"), std::string("MESHES\\PART.STL"),
                                    (top / "meshes/part.stl").string()}) {
      CAPTURE(name);
      const auto found = named_file(top, name);
      REQUIRE(found);
      CHECK(std::filesystem::equivalent(found->path, top / "Meshes/Part.STL"));
      CHECK(found->note.find("'" + name + "' was found as '") == 0);
      CHECK_FALSE(file_as_named(top, name));
    }
    std::ofstream(top / "meshes/part.STL") << "y";
    CHECK_THROWS_AS(named_file(top, "meshes/part.stl"), InputError);
    CHECK(named_file(top, "meshes/part.STL")->note.empty());
  }
}

}  // namespace haptic::tools
