// SPDX-License-Identifier: Apache-2.0
// What a user types wrongly, program by program: the exit code, what is said, and that no file of
// the user's is lost.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/lab/optional/studies.hpp"
#include "tests/support/program_run.hpp"

namespace {

using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;

/// The user's files, made once for all rows.
class UserFolder {
 public:
  UserFolder() {
    namespace fs = std::filesystem;
    const fs::path scenes = fs::path(HAPTIC_SCENES_DIR) / "tetrahedron_on_box";
    for (const auto& entry : fs::directory_iterator(scenes))
      fs::copy(entry.path(), at(entry.path().filename().string()));
    fs::create_directory(at("folder"));
    const std::string made = at("peg.rtscene");
    REQUIRE(run_program(HAPTIC_GRAPH_COMPILER, at("scene.toml") + " -o " + made).exit_code == 0);
    REQUIRE(run_program(HAPTIC_HOST_SIM, "motion " + at("motion.toml") + " -o " + at("m.csv"))
                .exit_code == 0);
    write("limited.toml",
          text_of_file(at("scene.toml")) +
              "\n[motion_limits]\nworkspace = { min_m = [-1, -1, -1], max_m = [1, 1, "
              "1] }\norientation = { max_angle_rad = 0.5 }\n");
    REQUIRE(run_program(HAPTIC_GRAPH_COMPILER, at("limited.toml") + " -o " + at("limited.rtscene"))
                .exit_code == 0);
    write("closed.toml",
          "format = 1\nname = \"closed\"\n[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
          "position_m = [0, 0, 0.2]\n[[static]]\nshape = \"box\"\nas = \"surface\"\n"
          "size_m = [0.1, 0.1, 0.1]\n[rendering]\nk_f_n_per_m = 800.0\n");
    REQUIRE(run_program(HAPTIC_GRAPH_COMPILER, at("closed.toml") + " -o " + at("closed.rtscene"))
                .exit_code == 0);
    fs::create_symlink(at("m.csv"), at("link.csv"));
    fs::create_hard_link(at("m.csv"), at("twin.csv"));
    const std::string head = "t,x,y,z,qw,qx,qy,qz\n";
    write("slow.csv", head + "0,0,0,0.1,1,0,0,0\n1,0,0,0.1,1,0,0,0\n");
    write("fast.csv", head + "0,0,0,0.1,1,0,0,0\n0.0001,0,0,0.1,1,0,0,0\n0.0002,0,0,0.1,1,0,0,0\n");
    write("gap.csv", head + "0,0,0,0.1,1,0,0,0\n0.001,0,0,0.1,1,0,0,0\n5,0,0,0.1,1,0,0,0\n");
    write("mm.csv", head + "0,0,0,49,1,0,0,0\n0.001,0,0,49,1,0,0,0\n");
    write("jump.csv", head + "0,0,0,0.1,1,0,0,0\n0.001,0,0,1.1,1,0,0,0\n");
    write("utf16.toml", "\xFF\xFE f o r m a t");
    write("semicolons.csv", "t;x;y;z;qw;qx;qy;qz\n0;0;0;0;1;0;0;0\n");
  }

  [[nodiscard]] std::string at(const std::string& name) const { return folder_.file(name); }
  /// Words with every @ standing for the folder.
  [[nodiscard]] std::string words(std::string text) const {
    for (std::size_t i = text.find('@'); i != std::string::npos; i = text.find('@', i))
      text.replace(i, 1, at(""));
    return text;
  }
  /// Every file of the folder with its content.
  [[nodiscard]] std::string content() const {
    std::string all;
    std::vector<std::filesystem::path> files;
    for (const auto& e : std::filesystem::directory_iterator(at(""))) files.push_back(e.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files)
      all += file.filename().string() + "\n" +
             (std::filesystem::is_directory(file) ? "" : text_of_file(file.string()));
    return all;
  }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(at(name), std::ios::binary) << text;
  }
  ScratchFolder folder_{"command_lines"};
};

struct Row {
  const char* program;
  const char* arguments;  ///< @: the user's folder
  int exit_code;
  const char* says;
};

constexpr const char* kCompiler = HAPTIC_GRAPH_COMPILER;
constexpr const char* kInspect = HAPTIC_SCENE_INSPECT;
constexpr const char* kSim = HAPTIC_HOST_SIM;
constexpr const char* kRun = HAPTIC_RUN_DEVICE;

const Row kRows[] = {
    // An output over an input or another output.
    {kCompiler, "@scene.toml -o @tetrahedron.obj", 2, "would overwrite a mesh of the scene"},
    {kCompiler, "@scene.toml -o @scene.toml", 2, "would overwrite the scene file"},
    {kCompiler, "@scene.toml -o @a.rtscene --report @a.rtscene", 2, "would overwrite"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --out @m.csv", 2,
     "would overwrite the motion"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --out @link.csv", 2,
     "would overwrite the motion"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --out @twin.csv", 2,
     "would overwrite the motion"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --plot @peg.rtscene", 2, "peg."},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --out @o.svg --plot @./o.svg", 2,
     "would overwrite"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --plot @o.png", 2, "writes SVG"},
    {kSim, "motion @motion.toml --out @motion.toml", 2, "would overwrite"},
    {kSim, "motion --from @m.csv --out @m.csv", 2, "would overwrite the log"},
    {kSim, "view @peg.rtscene --html @peg.rtscene", 2, "would overwrite the compiled scene"},
    {kSim, "view @peg.rtscene @m.csv --html @m.csv", 2, "would overwrite the motion"},
    {kSim, "replay @peg.rtscene --motion @m.csv --html @m.csv", 2, "would overwrite the motion"},
    {kInspect, "@peg.rtscene --explode @m.csv", 4, "is a file"},
    // A place that cannot be written.
    {kCompiler, "@scene.toml -o @none/a.rtscene", 4, "does not exist; make it first"},
    {kCompiler, "@scene.toml -o @m.csv/a.rtscene", 4, "is a file, not a folder"},
    {kCompiler, "@scene.toml -o @folder", 4, "is a folder"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --out @none/a.csv", 4,
     "does not exist; make it first"},
    {kSim, "run @peg.rtscene --out @m.csv", 4, "is a file"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --out /dev/full", 4, "No space left"},
    // Not what it is taken for.
    {kCompiler, "@tetrahedron.obj -o @a.rtscene", 3, "is a mesh; give the scene file"},
    {kCompiler, "@utf16.toml -o @a.rtscene", 3, "is UTF-16; save it as UTF-8"},
    {kRun, "run @utf16.toml", 3, "is UTF-16; save it as UTF-8"},
    // A plan to where none can be, and numbers that are none.
    {kSim, "plan @limited.rtscene --goal 0,0,5 -o @a.plan", 3,
     "m, and [motion_limits] workspace max_m is 1 m; give a pose within the limits, or"},
    {kSim, "plan @limited.rtscene --goal 0,0,0.2,0,1,0,0 -o @a.plan", 3,
     "[motion_limits] orientation, and its max_angle_rad is 0.5"},
    {kSim, "plan @limited.rtscene --goal 0,0,0.2 --start 3,0,0.2 -o @a.plan", 3,
     "--start: the grip point's x is 2.98"},
    {kSim, "plan @peg.rtscene --goal 1e300,0,0 -o @a.plan", 2, "a plan holds places to 1e+06 m"},
    {kSim, "plan @peg.rtscene --goal 0,0,-2e6 -o @a.plan", 2, "a plan holds places to 1e+06 m"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 --seconds inf -o @a.plan", 2, "'inf' is no number"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 --shorten-millions nan -o @a.plan", 2,
     "'nan' is no number"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 --seed -1 -o @a.plan", 2, "no whole number"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 --seed 18446744073709551616 -o @a.plan", 2,
     "no whole number"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 -o ''", 2, "--out: is empty"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 --seconds 1e-9 --fallback -o @a.plan", 1, "OMPL"},
    {kSim, "plan @peg.rtscene --goal 0,0,0.3 --fallback --json -o @a.plan", 2, "--json"},
    {kSim, "plan-sampled @limited.rtscene --goal 0,0,5 -o @a.plan", 3,
     "m, and [motion_limits] workspace max_m is 1 m; give a pose within the limits, or"},
    {kSim, "plan-sampled @closed.rtscene --start 0,0,0 --goal 0.02,0,0 -o @a.plan", 3,
     "lie in one another there, within a closed surface; give a pose outside of it"},
    // Unknown names.
    {kCompiler, "@scene.toml --reprot @r.json", 2,
     "no option '--reprot'; did you mean '--report'?"},
    {kCompiler, "--wrong", 2, "no option '--wrong'"},
    {kInspect, "@peg.rtscene --jsn", 2, "did you mean '--json'?"},
    {kSim, "reply", 2, "no command 'reply'; did you mean 'replay'?"},
    {kSim, "stabilty", 2, "did you mean 'stability'?"},
    {kSim, "replay --scen @peg.rtscene", 2, "no option '--scen'; did you mean '--scene'?"},
    {kSim, "wcet --scen @peg.rtscene", 2, "did you mean '--scene'?"},
    {kRun, "docter", 2, "did you mean 'doctor'?"},
    {kSim, "replay --scene @peg.rtscene --motion @m.csv --literal --delta foo", 2, "dx-rotation"},
    {kSim, "stability --out @s --laws foo", 2, "paper"},
    {kSim, "stability --out @s --parts 99", 2, "the parts are 1"},
    {kSim, "wcet @peg.rtscene --quick --fault foo", 2, "its bounds are"},
    {kSim, "pareto --out @p --pairs W7", 2, "W7"},
    {kSim, "compare-laws @peg.rtscene --motion @m.csv --out @c --towards 0,0,0", 2, "no direction"},
    {kCompiler, "@scene.toml -o @a.rtscene --simplify -1", 2, "is no positive number"},
    // Motions that cannot be meant.
    {kSim, "replay @peg.rtscene --motion @slow.csv", 3,
     "slow.csv:3: 1000 ms after the sample before"},
    {kSim, "replay @peg.rtscene --motion @fast.csv", 3, "resample it"},
    {kSim, "replay @peg.rtscene --motion @gap.csv", 3, "gap.csv:4: "},
    {kSim, "replay @peg.rtscene --motion @mm.csv", 3, "are these millimetres?"},
    {kSim, "replay @peg.rtscene --motion @jump.csv", 3, "jump.csv:3: the part jumps by 1 m"},
    {kSim, "replay @peg.rtscene --motion @semicolons.csv", 3, "separate the columns by commas"},
    {kSim, "replay @peg.rtscene --motion @semicolons.csv", 3, "host_sim motion --from"},
    {kSim, "motion @semicolons.csv --out @a.csv", 2, "host_sim motion --from"},
    {kSim, "motion --from @semicolons.csv --out @a.csv", 3, "holds 1 samples"},
    {kSim, "motion @motion.toml --from @m.csv --out @a.csv", 2, "or --from LOG"},
    {kSim, "motion @motion.toml", 2, "--out is required"},
    {kSim, "replay @peg.rtscene --motion @motion.toml", 3, "host_sim motion"},
    {kSim, "replay @peg.rtscene --motion @folder", 3, "is a folder"},
    {kSim, "replay @scene.toml --motion @m.csv", 3, "graph_compiler"},
    // What is there for the asking.
    {kSim, "help replay", 0, "Example:"},
    {kSim, "help wcet", 0, "Exit codes: 0 every bound holds"},
    {kSim, "--help", 0, "stability"},
    {kSim, "--help", 0, "Example:"},
    {kRun, "--help", 0, "Example:"},
    {kRun, "doctor --help", 0, "Exit codes: 0 it can"},
    {kInspect, "--help", 0, "Example:"},
    {kCompiler, "help", 0, "Exit codes: 0 done"},
    {kCompiler, "-V", 0, "graph_compiler "},
    {kRun, "--version", 0, "run_device "},
    {kInspect, "--scene @peg.rtscene --brief", 0, "tetrahedron"},
};

TEST_SUITE_BEGIN("programs.command_line");

TEST_CASE("wrong words are answered with their name and the fix, and no file is lost") {
  const UserFolder user;
  const std::string before = user.content();
  for (const Row& row : kRows) {
    const std::string words = user.words(row.arguments);
    INFO(row.program, " ", words);
    const ProgramResult run = run_program(row.program, words);
    const std::string text = run.out + run.err;
    INFO(text);
    CHECK(run.exit_code == row.exit_code);
    CHECK(text.find(row.says) != std::string::npos);
    CHECK(text.find('\0') == std::string::npos);
    CHECK(user.content() == before);
  }
}

TEST_CASE("a study that is not in the build says how to get it, and no file is made") {
  if (haptic::sim::studies_built()) return;
  const UserFolder user;
  const std::string before = user.content();
  for (const char* arguments :
       {"reproduce-paper --out @paper --quick", "pegs --out @pegs", "planners --out @p",
        "guide-study --out @s --runs 3", "guide-limits --out @l", "rates @peg.rtscene",
        "stability --out @s --parts 3,1", "pareto --out @p --pairs W1"}) {
    const ProgramResult run = run_program(kSim, user.words(arguments));
    INFO(arguments, "\n", run.err);
    CHECK(run.exit_code == 2);
    CHECK(run.err.find(" is not in this build; to get it: cmake --preset release "
                       "-DHAPTIC_BUILD_STUDIES=ON && cmake --build --preset release --target "
                       "host_lab\n") != std::string::npos);
    CHECK(user.content() == before);
  }
}

TEST_CASE("what nobody could read was not given: a full device, in every program") {
  const UserFolder user;
  const std::pair<const char*, const char*> calls[] = {
      {kCompiler, "--help"},      {kCompiler, "@scene.toml -o @b.rtscene"},
      {kInspect, "@peg.rtscene"}, {kSim, "replay --scene @peg.rtscene --motion @m.csv"},
      {kSim, "wcet --help"},      {kRun, "doctor --help"}};
  for (const auto& [program, arguments] : calls) {
    const std::string err = user.at("err");
    const std::string line =
        "'" + std::string(program) + "' " + user.words(arguments) + " >/dev/full 2>'" + err + "'";
    INFO(line);
    const int status = std::system(line.c_str());
    CHECK(WEXITSTATUS(status) == 4);
    CHECK(text_of_file(err).find("standard output cannot be written: No space left") !=
          std::string::npos);
  }
}

TEST_CASE("every help is text, names its exit codes and an example") {
  const char* lab[] = {"accept",    "calm",       "compare-laws", "cost",
                       "crossings", "faults",     "flight",       "friction",
                       "hold",      "pareto",     "pegs",         "plan-sampled",
                       "planners",  "proxy-fuzz", "rates",        "reproduce-paper",
                       "soak",      "stability",  "surface-fuzz", "vectors",
                       "verify",    "wcet",       "bodies-fuzz",  "bodies",
                       "growth"};
  const char* sim[] = {"motion", "plan", "play", "replay", "run", "serve", "usb-device", "view"};
  std::vector<std::pair<const char*, std::string>> calls{
      {kCompiler, ""}, {kInspect, ""}, {kRun, "doctor"}, {kRun, "run"}};
  for (const char* name : lab) calls.emplace_back(kSim, name);
  for (const char* name : sim) calls.emplace_back(kSim, name);
  for (const auto& call : calls) {
    const char* program = call.first;
    const std::string& command = call.second;
    const ProgramResult run = run_program(program, command + " --help");
    const std::string& text = run.out;
    INFO(program, " ", command, "\n", text);
    CHECK(run.exit_code == 0);
    CHECK(text.find("Exit codes: 0 ") != std::string::npos);
    CHECK(text.find("Example:") != std::string::npos);
    CHECK(text.find_first_of(std::string("\0\x01\x02\x03", 4)) == std::string::npos);
  }
}

TEST_SUITE_END();

}  // namespace
