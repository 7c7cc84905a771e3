// SPDX-License-Identifier: Apache-2.0
// The mistakes that people make most, by the kind of what they bring: what each is answered with,
// and that nothing is said where nothing is wrong.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/program_run.hpp"

namespace haptic::sim::mistakes {
namespace {

using test::ProgramResult;
using test::run_program;
using test::ScratchFolder;
using test::text_of_file;

constexpr const char* kCompiler = HAPTIC_GRAPH_COMPILER;
constexpr const char* kSim = HAPTIC_HOST_SIM;
constexpr const char* kRun = HAPTIC_RUN_DEVICE;
constexpr const char* kInspect = HAPTIC_SCENE_INSPECT;

/// A tetrahedron over a box: files that are right, to be spoiled one at a time.
class Bench {
 public:
  Bench() {
    namespace fs = std::filesystem;
    const fs::path scenes = fs::path(HAPTIC_SCENES_DIR) / "tetrahedron_on_box";
    for (const auto& entry : fs::directory_iterator(scenes))
      fs::copy(entry.path(), at(entry.path().filename().string()));
    scene = text_of_file(at("scene.toml"));
    script = text_of_file(at("motion.toml"));
    REQUIRE(compiled("scene.toml", "s.rtscene").exit_code == 0);
    REQUIRE(run_program(kSim, "motion " + at("motion.toml") + " -o " + at("m.csv")).exit_code == 0);
    motion = text_of_file(at("m.csv"));
  }

  [[nodiscard]] std::string at(const std::string& name) const { return folder_.file(name); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(at(name), std::ios::binary) << text;
  }
  [[nodiscard]] ProgramResult compiled(const std::string& name, const std::string& out) const {
    return run_program(kCompiler, at(name) + " --quiet -o " + at(out));
  }

  std::string scene, script, motion;

 private:
  ScratchFolder folder_{"mistakes"};
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  REQUIRE_MESSAGE(at != std::string::npos, what);
  return text.replace(at, what.size(), by);
}

std::string with_ends(const std::string& text, const std::string& end) {
  std::string out;
  for (const char c : text) out += c == '\n' ? end : std::string(1, c);
  return out;
}

/// Every sample of a motion changed by a function of its eight cells.
using Cells = std::vector<std::string>;
std::string each_sample(const std::string& motion, const std::function<void(Cells&)>& change) {
  std::string out = motion.substr(0, motion.find('\n') + 1);
  std::size_t begin = out.size();
  for (std::size_t end; (end = motion.find('\n', begin)) != std::string::npos; begin = end + 1) {
    Cells cells(1);
    for (const char c : motion.substr(begin, end - begin)) {
      if (c == ',') {
        cells.emplace_back();
      } else {
        cells.back() += c;
      }
    }
    change(cells);
    for (std::size_t k = 0; k < cells.size(); ++k) out += (k > 0 ? "," : "") + cells[k];
    out += '\n';
  }
  return out;
}

/// What was made wrong, the exit code, and the words that must be said; nullptr: none at all.
struct Row {
  const char* what;
  std::string input;
  int exit_code;
  const char* says;
};

void check_row(const Row& row, const ProgramResult& run, bool quiet_output = true) {
  INFO(row.what);
  const std::string said = run.err + (quiet_output ? run.out : "");
  INFO(said);
  CHECK(run.exit_code == row.exit_code);
  if (row.says == nullptr) {
    CHECK(run.err.empty());
  } else {
    CHECK(said.find(row.says) != std::string::npos);
  }
}

}  // namespace

TEST_SUITE("programs.mistakes") {
  TEST_CASE("a scene file: what is wrong is said with its place and the fix, else nothing is") {
    const Bench bench;
    const std::string& s = bench.scene;
    const std::string mesh = "\"tetrahedron.obj\"";
    const auto with = [&](const std::string& what, const std::string& by) {
      return replaced(s, what, by);
    };
    const auto more = [&](const std::string& text) { return s + "\n" + text; };
    const std::string moving = "mesh = " + mesh;
    const auto of_materials = [&](const std::string& a, const std::string& b,
                                  const std::string& pair) {
      return replaced(replaced(s, moving, moving + "\nmaterial = \"" + a + "\""),
                      "mesh = \"box.stl\"", "mesh = \"box.stl\"\nmaterial = \"" + b + "\"") +
             "\n[[friction]]\nmaterials = " + pair + "\nmu = 0.3\n";
    };
    const Row rows[] = {
        {"nothing", s, 0, nullptr},
        {"line ends CR LF", with_ends(s, "\r\n"), 0, nullptr},
        {"line ends CR", with_ends(s, "\r"), 0, nullptr},
        {"byte order mark", "\xEF\xBB\xBF" + s, 0, nullptr},
        {"whole numbers", with("800.0", "800"), 0, nullptr},
        {"UTF-16", "\xFF\xFE" + s, 3, "v.toml:1:1: the file is UTF-16; save it as UTF-8"},
        {"a path of Windows", with(mesh, "\"C:\\parts\\tetrahedron.obj\""), 3,
         "v.toml:7:11: not valid TOML: in double quotes a backslash begins an escape, and \\p is "
         "none; put a path in single quotes, 'C:\\parts\\tetrahedron.obj', or write /"},
        {"a path of Windows whose escapes are known", with(mesh, "\"C:\\temp\\new.obj\""), 3,
         "v.toml:7:8: [moving] mesh: a backslash has made a control character in it"},
        {"a path of Windows with a user", with(mesh, "\"C:\\users\\me\\peg.obj\""), 3,
         "and \\u is none; put a path in single quotes"},
        {"a drive of Windows", with(mesh, "'C:\\parts\\tetrahedron.obj'"), 3,
         "this is a path of another system; give the one on this machine"},
        {"backslashes in single quotes", with(mesh, "'.\\tetrahedron.obj'"), 0, nullptr},
        {"typographic quotes", with(mesh, "\xE2\x80\x9Ctetrahedron.obj\xE2\x80\x9D"), 3,
         "v.toml:7:8: not valid TOML: a typographic quote; write straight ones: \"text\""},
        {"a typographic minus",
         with("-0.015, 0.025",
              "\xE2\x88\x92"
              "0.015, 0.025"),
         3, "v.toml:9:21: not valid TOML: a typographic minus; write -"},
        {"a no-break space",
         with("= 800.0",
              "=\xC2\xA0"
              "800.0"),
         3, "not valid TOML: a no-break space; type a plain one"},
        {"a decimal comma", with("800.0", "800,0"), 3, "write decimals with a point"},
        {"no quotes", with(mesh, "tetrahedron.obj"), 3, "v.toml:7:"},
        {"a misprint", with("k_f_n_per_m", "k_f_n_pr_m"), 3, "did you mean 'k_f_n_per_m'?"},
        {"a number in quotes", with("800.0", "\"800\""), 3,
         "[rendering] k_f_n_per_m is a string; give a number"},
        {"no such mesh", with("tetrahedron.obj", "peg.obj"), 3,
         "no file 'peg.obj'; the path counts from the scene file's folder"},
        {"no unit", with("scale_to_m = 0.001\n", ""), 3,
         "scale_to_m is missing; give metres per file unit: 0.001 for millimetres"},
        {"a unit of 1", with("scale_to_m = 0.001", "scale_to_m = 1"), 0,
         "warning: tetrahedron.obj: the part is 64.7 m large; scale_to_m is metres per unit"},
        // In single precision numbers lie 4 um apart there: no scene of law proxy.
        {"a start in millimetres", with("[0.02, -0.015, 0.025]", "[20, -15, 50]"),
         HAPTIC_REAL_IS_FLOAT ? 3 : 0,
         HAPTIC_REAL_IS_FLOAT
             ? "coordinates reach 55.9 m from the origin of W"
             : "the part starts 55.8 m away from the nearest fixed part, 'box.stl'"},
        {"a grip in millimetres", with("[-0.02, 0.012, 0.025]", "[-20, 12, 25]"), 0,
         "the grip point is 34.2 m away from a part of 0.0647 m"},
        {"a stiffness in N/km", with("800.0", "8e6"), 0,
         "v.toml:20:15: [rendering] k_f_n_per_m is 8000000: hands and devices feel 50 to 20 000 "
         "N/m; is it of the unit that the key names?"},
        {"a stiffness in N/mm", with("800.0", "0.8"), 0, "[rendering] k_f_n_per_m is 0.8: "},
        {"a rate in kHz", with("rate_hz = 1000", "rate_hz = 1"), 0, "[loop] rate_hz is 1: "},
        {"a mass in grams", with("[[static]]", "mass_kg = 250\n[[static]]"), 0,
         "[moving] mass_kg is 250: a part in the hand has 0.01 to 2 kg"},
        {"gravity in mm/s2",
         with("[[static]]", "mass_kg = 0.1\ngravity_m_per_s2 = [0, 0, -9810]\n[[static]]"), 0,
         "gravity_m_per_s2 is 9810: the Earth has 9.81 m/s2"},
        {"a delay in ms",
         more("[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1\ndelay_s = 1\n"
              "[coupling]\nallow_active = true\n"),
         0, "[device] delay_s is 1: devices have 0.0005 to 0.01 s"},
        {"a coefficient of 12",
         of_materials("steel", "pom", "[\"steel\", \"pom\"]") + "mu_static = 12\n", 3,
         "mu_static is 12; give a number from 0 to 2"},
        {"friction of a name that no part has",
         of_materials("steel", "pom", "[\"steal\", \"pom\"]"), 3,
         "[[friction]] materials: no part is of 'steal'; did you mean 'steel'?"},
        {"friction without any material",
         more("[[friction]]\nmaterials = [\"steel\", \"pom\"]\nmu = 0.3\n"), 3,
         "no part is of 'steel'; write material = \"steel\" in the table of the part"},
        {"friction that matches", of_materials("steel", "pom", "[\"pom\", \"steel\"]"), 0, nullptr},
        {"friction between fixed parts", of_materials("steel", "pom", "[\"pom\", \"pom\"]"), 0,
         "'pom' and 'pom' never meet: the part in the hand is of 'steel'"},
        {"a motion script", bench.script, 3, "is a motion script; make the motion from it with"},
        {"a motion", bench.motion.substr(0, 1000), 3, "not valid TOML"},
        {"a compiled scene", text_of_file(bench.at("s.rtscene")), 3, "is a compiled scene"}};
    for (const Row& row : rows) {
      bench.write("v.toml", row.input);
      check_row(row, bench.compiled("v.toml", "v.rtscene"));
    }
  }

  TEST_CASE("a motion script: what is wrong is said with its line and the fix") {
    const Bench bench;
    const std::string& s = bench.script;
    const auto with = [&](const std::string& what, const std::string& by) {
      return replaced(s, what, by);
    };
    const Row rows[] = {
        {"nothing", s, 0, nullptr},
        {"line ends CR LF", with_ends(s, "\r\n"), 0, nullptr},
        {"line ends CR", with_ends(s, "\r"), 0, nullptr},
        {"byte order mark", "\xEF\xBB\xBF" + s, 0, nullptr},
        {"whole numbers", with("t_s = 2.0", "t_s = 2"), 0, nullptr},
        {"typographic quotes", with("\"start\"", "\xE2\x80\x9Cstart\xE2\x80\x9D"), 3,
         "v.toml:15:9: not valid TOML: a typographic quote"},
        {"millimetres", with("[0.02000, -0.01500, 0.02500]", "[20, -15, 25]"), 3,
         "v.toml:17: position_m must be a number from -10 to 10, and is 20; it is in metres: are "
         "these millimetres?"},
        {"degrees", with("angle_rad = 0.4", "angle_rad = 45"), 3,
         "angle_rad must be a number from -6.28318531 to 6.28318531, and is 45; it is in radians: "
         "are these degrees?"},
        {"milliseconds", with("t_s = 13.2", "t_s = 132000"), 3, "are these milliseconds?"},
        {"a misprint", with("position_m = [0.02000, -0.01500, 0.02500]", "positon_m = [0, 0, 0]"),
         3, "v.toml:17: unknown key 'positon_m'; did you mean 'position_m'?"},
        {"another heading", replaced(s, "[[waypoint]]", "[[waypoints]]"), 3,
         "did you mean 'waypoint'?"},
        {"a number in quotes", with("t_s = 2.0", "t_s = \"2.0\""), 3,
         "t_s must be a number, without quotes"},
        {"a decimal comma", with("t_s = 2.0", "t_s = 2,0"), 3, "write decimals with a point"},
        {"a time that repeats", with("t_s = 1.2", "t_s = 0.0"), 3,
         "t_s must be later than that of the way point before, 0 s, and is 0 s"},
        {"a quaternion as an array",
         with("{ w = 0.969061487, x = 0.196438488, y = 0.146459319, z = -0.029688774 }",
              "[0.97, 0.2, 0.15, -0.03]"),
         3, "quaternion must be a table, as { w = 1, x = 0, y = 0, z = 0 }"},
        {"a quaternion of another length", with("w = 0.969061487", "w = 0.5"), 3,
         "the quaternion has length 0.557602, not 1; normalise it"},
        {"another format", with("format = 1", "format = 2"), 3, "v.toml:5: format must be 1"},
        {"a scene file", bench.scene, 3, "is a scene file; compile it with 'graph_compiler"}};
    for (const Row& row : rows) {
      bench.write("v.toml", row.input);
      check_row(row,
                run_program(kSim, "motion " + bench.at("v.toml") + " -o " + bench.at("v.csv")));
    }
  }

  TEST_CASE("a motion: what is wrong is said with its line and the fix") {
    const Bench bench;
    const std::string& m = bench.motion;
    const auto scaled = [&](std::size_t first, std::size_t last, double by) {
      return each_sample(m, [=](Cells& cells) {
        for (std::size_t k = first; k <= last; ++k)
          cells[k] = std::to_string(by * std::stod(cells[k]));
      });
    };
    const std::string second = m.substr(0, m.find('\n', m.find('\n') + 1) + 1);
    std::string semicolons = m, blanks;
    std::ranges::replace(semicolons, ',', ';');
    for (const char c : m) blanks += c == ',' ? std::string(", ") : std::string(1, c);
    const Row rows[] = {
        {"nothing", m, 0, nullptr},
        {"line ends CR LF", with_ends(m, "\r\n"), 0, nullptr},
        {"line ends CR", with_ends(m, "\r"), 0, nullptr},
        {"byte order mark", "\xEF\xBB\xBF" + m, 0, nullptr},
        {"UTF-16", std::string("\xFF\xFEt\0,\0", 6), 3, "save the file as UTF-8 text"},
        {"empty", "", 3, "is empty; the first line must be t,x,y,z,qw,qx,qy,qz"},
        {"no line of names", m.substr(m.find('\n') + 1), 3,
         "v.csv:1: the header is not t,x,y,z,qw,qx,qy,qz; it has no line of names"},
        {"other names", replaced(m, "t,x,y,z", "time,px,py,pz"), 3, "host_sim motion --from"},
        {"semicolons", semicolons, 3, "separate the columns by commas"},
        {"blanks behind commas", blanks, 3, "host_sim motion --from"},
        {"millimetres", scaled(1, 3, 1000), 3,
         "v.csv:2: the part is 35.38 m from the origin; positions are in metres: are these "
         "millimetres?"},
        {"milliseconds", scaled(0, 0, 1000), 3,
         "v.csv:3: 1000 ms after the sample before; a motion has one sample in each millisecond, "
         "with times in seconds (are these milliseconds?)"},
        {"not a number", second + "0.001,nan,0,0,1,0,0,0\n", 3,
         "v.csv:3: column x is not finite; drop or fix the sample"},
        {"an empty cell", second + "0.001,,0,0,1,0,0,0\n", 3, "v.csv:3: column x is not a number"},
        {"a quaternion of another length", scaled(4, 7, 2), 3,
         "the quaternion has length 2.000000, not 1; normalise it (order: qw,qx,qy,qz)"},
        {"a quaternion that begins with x",
         each_sample(
             m,
             [](Cells& cells) { std::rotate(cells.begin() + 4, cells.begin() + 5, cells.end()); }),
         0, "read as wxyz, the quaternion turns the part by 2.77 rad from the scene's start"},
        {"a motion script", bench.script, 3, "the header is not t,x,y,z,qw,qx,qy,qz"},
        {"a compiled scene", text_of_file(bench.at("s.rtscene")), 3, "give it as --scene"}};
    for (const Row& row : rows) {
      bench.write("v.csv", row.input);
      check_row(row, run_program(kSim, "replay " + bench.at("s.rtscene") + " " + bench.at("v.csv")),
                row.says != nullptr);
    }
  }

  TEST_CASE("a mesh: what is wrong is said with its place and the fix") {
    const Bench bench;
    const std::string box = text_of_file(bench.at("box.stl"));
    const std::string tetrahedron = text_of_file(bench.at("tetrahedron.obj"));
    // A roof that rounding would take for flat.
    const auto roof = [](const char* corners) {
      return std::string(corners) +
             "f 4 3 2 1\nf 5 6 7\nf 5 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    };
    const struct {
      const char* name;
      Row row;
    } files[] = {
        {"a.obj", {"nothing", tetrahedron, 0, nullptr}},
        {"a.obj", {"line ends CR LF", with_ends(tetrahedron, "\r\n"), 0, nullptr}},
        {"a.obj", {"line ends CR", with_ends(tetrahedron, "\r"), 0, nullptr}},
        {"a.obj",
         {"whole numbers of few digits",
          roof("v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nv 0 0 10\nv 10 0 10\nv 10 10 11\n"
               "v 0 10 11\n"),
          0, nullptr}},
        {"a.obj",
         {"whole numbers with a point",
          roof("v 0.0 0.0 0.0\nv 10.0 0.0 0.0\nv 10.0 10.0 0.0\nv 0.0 10.0 0.0\nv 0.0 0.0 10.0\n"
               "v 10.0 0.0 10.0\nv 10.0 10.0 11.0\nv 0.0 10.0 11.0\n"),
          0, nullptr}},
        {"a.stl", {"empty", "", 3, "a.stl: the file is empty (0 bytes); export the part again"}},
        {"a.stl",
         {"a web page", "<!DOCTYPE html>\n<html></html>\n", 3,
          "a.stl: the file is a web page, not a mesh; download the file itself again"}},
        {"a.stl",
         {"a pointer of Git LFS", "version https://git-lfs.github.com/spec/v1\noid sha256:1\n", 3,
          "a pointer of Git LFS, not the mesh; fetch the mesh with git lfs pull"}},
        {"a.stl", {"a ZIP archive", "PK\x03\x04", 3, "is a ZIP archive; unpack it"}},
        {"a.stl", {"cut", box.substr(0, 200), 3, "the file ends inside a solid"}},
        {"a.stl",
         {"OBJ by another name", tetrahedron, 3, "check that the extension names the true"}},
        {"a.obj", {"STL by another name", box, 3, "read as OBJ but the content is STL"}},
        {"a.obj", {"no faces", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", 3, "the file holds no face"}},
        {"a.obj",
         {"an index beyond the file", "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3 9\n", 3,
          "a.obj:4: vertex index 9 but the file has 3 vertices"}},
        {"a.obj",
         {"a decimal comma", "v 0,5 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n", 3,
          "a.obj:1: coordinate '0,5' has a comma; write numbers with a decimal point"}},
        {"a.obj",
         {"not a number", "v nan 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n", 3,
          "a.obj:1: coordinate 'nan' is not finite"}},
        {"a.sldprt",
         {"a format of a program", box, 3, "the extension '.sldprt' names no mesh format; give"}}};
    for (const auto& [name, row] : files) {
      bench.write(name, row.input);
      bench.write("v.toml", replaced(bench.scene, "tetrahedron.obj", name));
      check_row(row, bench.compiled("v.toml", "v.rtscene"));
    }
  }

  TEST_CASE("a command line: what is wrong is said with what to do instead") {
    const Bench bench;
    bench.write("log.csv", bench.motion);
    const struct {
      const char *program, *arguments;  ///< @: the folder
      int exit_code;
      const char* says;
    } rows[] = {
        {kSim, "run @s.rtscene --motion @m.csv --out @run", 2,
         "run has no option '--motion'; in a run a hand follows way points: --script MOTION.toml"},
        {kSim, "run @s.rtscene --script @m.csv --out @run", 2,
         "a motion is played by 'host_sim replay SCENE.rtscene --motion"},
        {kSim, "replay @s.rtscene --script @motion.toml", 2,
         "replay has no option '--script'; replay plays a motion: make it with 'host_sim motion"},
        {kSim, "replay @s.rtscene --motion @motion.toml", 3,
         "this is a script: make the motion from it with 'host_sim motion"},
        {kSim, "wcet @s.rtscene --script @motion.toml", 2, "it plays a motion: make it with"},
        {kSim, "view @s.rtscene --script @motion.toml", 2, "it plays a motion: make it with"},
        {kSim, "usb-device --motion @m.csv", 2, "a hand follows way points: --script"},
        {kSim, "motion @s.rtscene -o @a.csv", 2, "host_sim motion --for"},
        {kSim, "motion --script @motion.toml -o @a.csv", 0, "a.csv: 13201 samples"},
        {kSim, "replay @s.rtscene @m.csv", 0, "followed the hand"},
        {kSim, "replay @scene.toml --motion @m.csv", 3, "compile it first: graph_compiler"},
        {kSim, "replay @s.rtscene", 2, "--motion is required"},
        {kSim, "replay @s.rtscene --motion @none.csv", 3, "none.csv"},
        {kCompiler, "@scene.toml", 2, "--out is required"},
        {kCompiler, "@none.toml -o @a.rtscene", 3, "none.toml: no such file; check the path"},
        {kCompiler, "@box.stl -o @a.rtscene", 3, "is a mesh; give the scene file"},
        {kCompiler, "@s.rtscene -o @a.rtscene", 3, "is a compiled scene"},
        {kInspect, "@scene.toml", 3, "compile it first: graph_compiler"},
        {kRun, "run @scene.toml", 3, "is a scene file; compile it with 'graph_compiler"},
        {kRun, "run @s.rtscene", 3, "is a compiled scene"}};
    for (const auto& row : rows) {
      std::string words = row.arguments;
      for (std::size_t i; (i = words.find('@')) != std::string::npos;)
        words.replace(i, 1, bench.at(""));
      const ProgramResult run = run_program(row.program, words);
      const std::string text = run.out + run.err;
      INFO(row.program, " ", words, "\n", text);
      CHECK(run.exit_code == row.exit_code);
      CHECK(text.find(row.says) != std::string::npos);
    }
  }
}
}  // namespace haptic::sim::mistakes
