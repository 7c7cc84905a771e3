// SPDX-License-Identifier: Apache-2.0
// No output replaces a file of another kind: what a file is by its content, and every output of
// every program over files of every kind.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/all_checks.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_kind.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"

namespace {

namespace fs = std::filesystem;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;
using haptic::test::all_checks;
using haptic::tools::FileFormat;
using haptic::tools::kind_of;

std::string kind_text(const std::string& content) {
  const auto kind = kind_of(content);
  return kind ? to_text(*kind) : "empty";
}

void write(const std::string& file, const std::string& content) {
  std::ofstream(file, std::ios::binary) << content;
}

/// Binary STL of `count` facets.
std::string binary_stl(std::uint32_t count) {
  std::string stl(80, ' ');
  stl.append(reinterpret_cast<const char*>(&count), sizeof count);
  return stl + std::string(std::size_t{50} * count, '\0');
}

/// Whether the page that the simulator fills in has been built: what takes more than a compiler.
bool has_page() {
  return fs::exists(fs::path(HAPTIC_HOST_SIM).parent_path().parent_path() / "share" /
                    "haptic_view" / "page.html");
}

/// Files of every kind, by a name for it; pages where there is one to fill in.
class Kinds {
 public:
  Kinds() {
    const bool pages = has_page();
    if (!pages) MESSAGE("skipped: outputs that are pages, for the page has not been built");
    for (const auto& entry :
         fs::directory_iterator(fs::path(HAPTIC_SCENES_DIR) / "tetrahedron_on_box"))
      fs::copy(entry.path(), at(entry.path().filename().string()));
    made(HAPTIC_GRAPH_COMPILER, "@scene.toml -o @s.rtscene --report @s.json --traits @s.hpp");
    made(HAPTIC_HOST_SIM, "motion @motion.toml -o @m.csv");
    made(HAPTIC_HOST_SIM,
         std::string("replay @s.rtscene --motion @m.csv --out @ticks.csv --contacts "
                     "@contacts.csv --plot @p.svg") +
             (pages ? " --html @p.html" : ""));
    made(HAPTIC_HOST_SIM, "plan @s.rtscene --goal 0,0,0.12 --shorten-millions 1 -o @s.plan");
    made(HAPTIC_HOST_SIM,
         "run @s.rtscene --seconds 0.2 --out @run --carrier usb --record @s.hrec --mcap @s.mcap");
    of_ = {{"scene", "s.rtscene"},
           {"report", "s.json"},
           {"traits", "s.hpp"},
           {"scene file", "scene.toml"},
           {"script", "motion.toml"},
           {"mesh", "tetrahedron.obj"},
           {"motion", "m.csv"},
           {"ticks", "ticks.csv"},
           {"contacts", "contacts.csv"},
           {"picture", "p.svg"},
           {"plan", "s.plan"},
           {"record", "s.hrec"},
           {"mcap", "s.mcap"}};
    if (pages) of_["page"] = "p.html";
    const std::pair<const char*, std::string> more[] = {
        {"stl", binary_stl(3)},
        {"notes", "Two parts, drawn by hand.\nThe second one is of steel.\n"},
        {"other json", "{\"asset\": {\"version\": \"2.0\"}, \"meshes\": []}"},
        {"json lines", "{\"t\": 0}\n{\"t\": 1}\n"},
        {"log", "stamp,px,py,pz\n0,1,2,3\n"},
        {"picture of bytes", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16)}};
    for (const auto& [name, content] : more) {
      of_[name] = name;
      write(at(name), content);
    }
  }
  [[nodiscard]] std::string at(const std::string& name) const { return folder_.file(name); }
  [[nodiscard]] std::string words(std::string text) const {
    for (std::size_t i = text.find('@'); i != std::string::npos; i = text.find('@', i))
      text.replace(i, 1, at(""));
    return text;
  }
  [[nodiscard]] const std::map<std::string, std::string>& all() const { return of_; }

 private:
  void made(const char* program, const std::string& text) const {
    const ProgramResult run = run_program(program, words(text));
    INFO(text, "\n", run.out, run.err);
    REQUIRE(run.exit_code == 0);
  }
  ScratchFolder folder_{"file_kinds"};
  std::map<std::string, std::string> of_;
};

struct Output {
  const char* program;
  const char* arguments;  ///< @: the folder of Kinds; the output is @out
  const char* kind;       ///< that is written, of Kinds; null: none of them
  bool runs = true;       ///< is written in this test
};

constexpr const char* kGraphCompiler = HAPTIC_GRAPH_COMPILER;
constexpr const char* kHostSim = HAPTIC_HOST_SIM;

const Output kOutputs[] = {
    {kGraphCompiler, "@scene.toml -o @out", "scene"},
    {kGraphCompiler, "@scene.toml -o @z.rtscene --report @out", "report"},
    {kGraphCompiler, "@scene.toml -o @z.rtscene --traits @out", "traits"},
    {kHostSim, "motion @motion.toml -o @out", "motion"},
    {kHostSim, "motion --for @s.rtscene -o @out", "motion"},
    {kHostSim, "motion --from @m.csv -o @out", "motion"},
    {kHostSim, "replay @s.rtscene --motion @m.csv --out @out", "ticks"},
    {kHostSim, "replay @s.rtscene --motion @m.csv --contacts @out", "contacts"},
    {kHostSim, "replay @s.rtscene --motion @m.csv --plot @out", "picture"},
    {kHostSim, "replay @s.rtscene --motion @m.csv --html @out", "page"},
    {kHostSim, "view @s.rtscene @m.csv --html @out", "page"},
    {kHostSim, "plan @s.rtscene --goal 0,0,0.12 --shorten-millions 1 -o @out", "plan"},
    {kHostSim, "play @s.hrec --scene @s.rtscene --html @out", "page"},
    {kHostSim, "run @s.rtscene --seconds 1 --out @z --html @out", "page"},
    {kHostSim, "run @s.rtscene --seconds 1 --out @z --mcap @out", "mcap"},
    {kHostSim, "run @s.rtscene --seconds 0.2 --out @z --carrier usb --record @out", "record"},
    {kHostSim, "plan-sampled @s.rtscene --goal 0,0,0.12 -o @out", "plan", false},
    {kHostSim, "wcet @s.rtscene --quick --flow-facts @out", nullptr},
    {HAPTIC_RUN_DEVICE, "doctor --histogram @out", nullptr},
};

}  // namespace

TEST_SUITE_BEGIN("programs.file_kinds");

TEST_CASE("what a file is, by its content") {
  const std::pair<std::string, const char*> rows[] = {
      {"", "empty"},
      {std::string("RTSCENE\0\1\2", 10), "a compiled scene"},
      {"haptic-plan 2\ngeometry 0\n", "a plan"},
      {"format = 1\nname = \"x\"\n[moving]\nmesh = \"a.obj\"\n", "a scene file (TOML)"},
      {"# a device\n[device]\nmass_kg = 1\n", "a TOML file"},
      {"t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n", "CSV with the columns t,x,y,.."},
      {"# it stopped\ntick,sequence,stamp_ns\n1,1,1\n",
       "CSV with the columns tick,sequence,stamp_ns,.."},
      {"{\n \"scene\": 1}", "JSON that begins with \"scene\""},
      {"[[1, 2]]", "JSON"},
      {"<!DOCTYPE html>\n<p>", "an HTML page"},
      {"<?xml version=\"1.0\"?>\n<!-- x -->\n<svg xmlns=\"a\">", "an SVG picture"},
      {"<?xml version=\"1.0\"?><COLLADA>", "a mesh (COLLADA)"},
      {"<robot name=\"r\"/>", "an XML file (robot)"},
      {"v 0 0 0\nv 1 0 0\n", "a mesh (OBJ)"},
      {"solid x\n facet normal 0 0 1\n", "a mesh (STL)"},
      {binary_stl(3), "a mesh (STL)"},
      {"OFF\n8 6 0\n", "a mesh (OFF)"},
      {"ply\nformat ascii 1.0\n", "a mesh (PLY)"},
      {"PK\x03\x04xx", "a mesh (an archive, as 3MF)"},
      {"{\"asset\": {}, \"meshes\": []}", "a mesh (glTF)"},
      {"# Histogram\n000000 000001\n", "a text that begins with '# Histogram'"},
      {"Parts of 2026, drawn\n", "a text that begins with 'Parts of ,'"},
      {std::string("\0\1\2", 3), "a file of an unknown kind"}};
  for (const auto& [content, says] : rows) {
    const auto& tried = content;
    CAPTURE(tried);
    CHECK(kind_text(content) == says);
  }
}

TEST_CASE("a file is written over one of its kind and over an empty one, over others nothing is") {
  using haptic::tools::write_files;
  const ScratchFolder folder("kinds_written");
  const std::string file = folder.file("a");
  const auto put = [&](const std::string& content) {
    write_files({{file, std::as_bytes(std::span(content))}});
  };
  put("a,b,c,d\n1,2,3,4\n");
  put("a,b,c,e\n1,2,3,5\n");
  CHECK(text_of_file(file) == "a,b,c,e\n1,2,3,5\n");
  const std::string good = "x\n", other = folder.file("b");
  CHECK_THROWS_WITH_AS(write_files({{other, std::as_bytes(std::span(good))},
                                    {file, std::as_bytes(std::span(good))}}),
                       doctest::Contains("the file that is there is CSV with the columns a,b,c,.."),
                       haptic::tools::UsageError);
  CHECK_FALSE(fs::exists(other));  // all or none
  CHECK(text_of_file(file) == "a,b,c,e\n1,2,3,5\n");
  write(file, "");
  put(good);
  CHECK(text_of_file(file) == good);
}

TEST_CASE("a folder of results that holds files of another kind under these names is refused") {
  const Kinds kinds;
  const std::pair<const char*, const char*> rows[] = {
      {"run @s.rtscene --seconds 1 --out @dir", "run.csv"},
      {"run @s.rtscene --seconds 1 --out @dir", "run.json"},
      {"accept --damaged 0 --out @dir", "accept.json"},
      {"verify --queries 1 --ticks 0 --near-poses 0 --out @dir", "verify.json"}};
  for (const auto& [words, name] : rows) {
    const std::string said = words;
    CAPTURE(said);
    const std::string file = kinds.at("dir/") + name;
    fs::create_directories(kinds.at("dir"));
    write(file, "v 0 0 0\nv 1 0 0\n");
    const ProgramResult run = run_program(kHostSim, kinds.words(words));
    CHECK(run.exit_code == 2);
    CHECK(run.err.find(std::string(name) + ": --out writes ") != std::string::npos);
    CHECK(run.err.find("a mesh (OBJ); it is kept") != std::string::npos);
    CHECK(text_of_file(file) == "v 0 0 0\nv 1 0 0\n");
    fs::remove_all(kinds.at("dir"));
  }
  // With and without a device between hand and core: the same files.
  for (const char* carrier : {"", " --carrier direct", ""}) {
    const ProgramResult run = run_program(
        kHostSim, kinds.words(std::string("run @s.rtscene --seconds 1 --out @dir") + carrier));
    CAPTURE(run.err);
    CHECK(run.exit_code == 0);
  }
}

TEST_CASE("every output of every program keeps files of other kinds, and replaces its own") {
  const Kinds kinds;
  const std::string out = kinds.at("out");
  const std::size_t period = all_checks() ? 1 : 4;  // of the kinds that an output meets
  std::size_t met = 0;
  for (const Output& output : kOutputs) {
    if (output.kind != nullptr && output.kind == std::string_view("page") && !has_page()) continue;
    const std::string words = kinds.words(output.arguments);
    for (const auto& [kind, name] : kinds.all()) {
      const bool own = output.kind != nullptr && kind == output.kind;
      if (own && !output.runs) continue;
      if (!own && ++met % period != 0) continue;
      const std::string over = kind;
      INFO(output.program, " ", words, " over ", over);
      fs::copy_file(kinds.at(name), out, fs::copy_options::overwrite_existing);
      const std::string before = text_of_file(out);
      const ProgramResult run = run_program(output.program, words);
      INFO(run.err);
      CHECK(run.exit_code == (own ? 0 : 2));
      if (own) continue;
      CHECK(text_of_file(out) == before);
      CHECK(run.err.find(out + ": --") != std::string::npos);
      CHECK(run.err.find("it is kept: give another name, or remove it first") != std::string::npos);
    }
    fs::remove(out);
    if (output.kind == nullptr || !output.runs) continue;
    write(out, "");
    CHECK(run_program(output.program, words).exit_code == 0);
    CHECK(fs::file_size(out) > 0);
    fs::remove(out);
  }
}

TEST_CASE("init writes over no file at all: a scene file is edited by hand") {
  const Kinds kinds;
  for (const char* name : {"scene.toml", "m.csv", "notes"}) {
    const std::string file = kinds.at(name), before = text_of_file(file);
    const ProgramResult run = run_program(
        kGraphCompiler, kinds.words("init @tetrahedron.obj @box.stl -o '" + file + "'"));
    CHECK(run.exit_code == 2);
    CHECK(run.err.find("exists already; give another name, or remove it") != std::string::npos);
    CHECK(text_of_file(file) == before);
  }
}

TEST_SUITE_END();
