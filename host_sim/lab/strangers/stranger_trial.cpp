// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/stranger_trial.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/tick_csv.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;
using tools::formatted;

/// More than any tick of a family needs.
constexpr const char* kLargeBudgets =
    "[budget]\nnear_pairs = 32768\nwork_units = 65536\n[coupling]\npasses = 10\n";
constexpr const char* kMaterial = "steel";
/// Processor time of a program.
constexpr const char* kLimit_s = "300";
constexpr double kRunSeconds = 4;
/// Least share of its ticks in which a motion that is made to touch does.
constexpr double kLeastContact = 0.01;

bool starts_with_key(const std::string& line, const std::string& key) {
  const std::size_t at = line.find_first_not_of(" \t");
  if (at == std::string::npos || line.compare(at, key.size(), key) != 0) return false;
  const std::size_t next = line.find_first_not_of(" \t", at + key.size());
  return next != std::string::npos && line[next] == '=';
}

std::string key_of(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t"), end = line.find_first_of(" \t=", begin);
  return line.substr(begin, end - begin);
}

std::string trimmed(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_last_not_of(" \t\r") - begin + 1);
}

/// "[coupling]" and "[[static]]", without what comes after.
std::string header_of(const std::string& line) {
  const std::string text = trimmed(line);
  if (text.empty() || text[0] != '[') return "";
  const std::size_t end = text.starts_with("[[") ? text.find("]]") : text.find(']');
  return end == std::string::npos ? "" : text.substr(0, end + (text.starts_with("[[") ? 2 : 1));
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string place_lines(const Vector& p_m, const Rotation& q) {
  std::string text;
  append_line(text, "position_m = [%.9g, %.9g, %.9g]", p_m[0], p_m[1], p_m[2]);
  append_line(text, "quaternion = { w = %.15g, x = %.15g, y = %.15g, z = %.15g }", q.w(), q.x(),
              q.y(), q.z());
  return text;
}

/// Runs programs in a folder and remembers how they ended.
class Bench {
 public:
  Bench(std::string folder, std::vector<FoundFault>& faults)
      : folder_(std::move(folder)), faults_(faults) {}

  [[nodiscard]] std::string file(const std::string& name) const { return folder_ + "/" + name; }
  /// @return the exit code; 128 and more: ended by a signal. The output is in LABEL.txt and
  /// LABEL.err of the folder.
  int run(const std::string& label, const std::string& program, std::vector<std::string> words) {
    std::vector<std::string> command{"prlimit", std::string("--cpu=") + kLimit_s,
                                     program_beside(program)};
    command.insert(command.end(), words.begin(), words.end());
    const int status = run_to_end(command, file(label + ".txt"), file(label + ".err"));
    if (status < 0) throw tools::InputError("prlimit cannot be started; install util-linux");
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  /// The same; an end other than 0 is a fault.
  bool must_run(const std::string& label, const std::string& program,
                std::vector<std::string> words) {
    const int code = run(label, program, std::move(words));
    if (code == 0) return true;
    faults_.push_back(
        {StrangerFault::kExit, formatted("%s: %s ended with %d: %s", label.c_str(), program.c_str(),
                                         code, said(label).c_str())});
    return false;
  }
  [[nodiscard]] std::string said(const std::string& label) const {
    const std::string error = last_line(file_text(file(label + ".err")));
    return (error.empty() ? last_line(file_text(file(label + ".txt"))) : error).substr(0, 200);
  }
  [[nodiscard]] bool exists(const std::string& name) const {
    return std::filesystem::exists(file(name));
  }

 private:
  std::string folder_;
  std::vector<FoundFault>& faults_;
};

class Trial {
 public:
  Trial(const StrangerPair& pair, const TrialOptions& options, const std::string& folder)
      : pair_(pair), options_(options), bench_(folder, out_.faults), triangles_(pair) {}

  StrangerTrial run() {
    out_.family = pair_.family;
    out_.seed = pair_.seed;
    out_.clearance_mm = pair_.clearance_mm;
    write_meshes();
    write_motions();
    begin_scene();
    if (compile("own", false, 0, "")) {
      describe();
      play_hand();
      play_open_air();
      if (!options_.is_short) {
        play_touching();
        for (const std::string& hand : options_.hands) run_loop(hand);
        play_friction();
      }
      play_reference();
    }
    std::ranges::stable_sort(out_.faults, {}, &FoundFault::kind);
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool made(StrangerFault fault) const { return options_.fault == fault; }

  void write_meshes() {
    const auto write = [&](const std::string& name, const DrawnMesh& mesh) {
      write_whole_file(bench_.file(name), stl_file(mesh, pair_.as_text));
    };
    write("moving.stl", made(StrangerFault::kRefused) ? DrawnMesh{} : pair_.moving);
    out_.moving_triangles = pair_.moving.triangles.size();
    for (std::size_t k = 0; k < pair_.fixed.size(); ++k) {
      fixed_files_.push_back("fixed_" + std::to_string(k) + ".stl");
      write(fixed_files_.back(), pair_.fixed[k]);
      out_.fixed_triangles += pair_.fixed[k].triangles.size();
    }
  }

  void write_motions() {
    write_motion_csv(bench_.file("hand.csv"), hand_.samples);
    write_motion_csv(bench_.file("air.csv"), air_.samples);
  }

  void begin_scene() {
    std::vector<std::string> words{"init", bench_.file("moving.stl")};
    for (const std::string& name : fixed_files_) words.push_back(bench_.file(name));
    words.insert(words.end(), {"-o", bench_.file("init.toml")});
    out_.init_exit = bench_.run("init", "graph_compiler", words);
    if (out_.init_exit == 0) {
      base_ = file_text(bench_.file("init.toml"));
      return;
    }
    // What init would have written.
    base_ = "format = 1\nname = \"pair\"\n[moving]\nmesh = \"moving.stl\"\nscale_to_m = 0.001\n";
    for (const std::string& name : fixed_files_)
      base_ += "[[static]]\nmesh = \"" + name + "\"\nscale_to_m = 0.001\n";
    base_ += "[rendering]\nk_f_n_per_m = 800\n";
  }

  /// Refused: a fault of that kind.
  bool compile(const std::string& name, bool as_meant, double friction, const std::string& more) {
    std::string text = placed_scene(base_, pair_, as_meant, friction);
    text = with_keys(with_keys(text, options_.more), more);
    write_whole_file(bench_.file(name + ".toml"), text);
    const std::string label = "compile_" + name;
    const int code = bench_.run(label, "graph_compiler",
                                {bench_.file(name + ".toml"), "-o", scene(name), "--quiet",
                                 "--report", bench_.file(name + ".json")});
    if (code == 0) return true;
    out_.faults.push_back({StrangerFault::kRefused, formatted("%s: exit %d: %s", label.c_str(),
                                                              code, bench_.said(label).c_str())});
    return false;
  }
  [[nodiscard]] std::string scene(const std::string& name) const {
    return bench_.file(name + ".rtscene");
  }

  void describe() {
    const auto report = nlohmann::json::parse(file_text(bench_.file("own.json")));
    for (const auto& part : report.at("parts")) {
      const bool solid = part.at("as") == "solid";
      const std::size_t count =
          solid ? part.at("pieces").size() : part.at("surface").at("facets").get<std::size_t>();
      out_.parts +=
          formatted("%s%s %zu", out_.parts.empty() ? "" : ", ", solid ? "solid" : "surface", count);
    }
    const auto& capacity = report.at("capacity");
    out_.pairs = capacity.at("pair_count").get<std::size_t>();
    out_.near_slots = capacity.at("near_slots").get<std::size_t>();
    out_.certifiable = capacity.at("certifiable").get<bool>();
    const CoreSession session(scene("own"), GoalContact::kLeftOut);
    const auto& coupling = session.view().parameters().coupling;
    springs_.k_t_n_per_m = coupling.k_t_n_per_m;
    springs_.k_r_nm_per_rad = coupling.k_r_nm_per_rad;
    springs_.grip_m = grip_in_part(session.view()).cast<double>();
  }

  /// A motion through `replay`; empty where that writes nothing.
  std::vector<PlayedTick> replayed(const std::string& label, const std::string& scene_name,
                                   const std::string& motion) {
    const std::string csv = label + "_ticks.csv";
    std::vector<std::string> words{"replay", scene(scene_name), "--motion", bench_.file(motion),
                                   "--out",  bench_.file(csv)};
    if (made(StrangerFault::kExit)) words.push_back("--no-such-option");
    bench_.must_run(label, "host_sim", words);
    if (!bench_.exists(csv)) return {};
    return read_played_ticks(bench_.file(csv));
  }

  void judge(const std::string& name, const std::vector<PlayedTick>& ticks, const HandMotion* hand,
             double touching_m) {
    const PlayedAccount account = account_of(ticks, hand, springs_, triangles_, touching_m);
    find_faults(name, account, hand, out_.faults);
    out_.motions.push_back({name, account});
  }

  void play_hand() {
    own_ = replayed("hand", "own", "hand.csv");
    constexpr StrangerFault kOfTicks[] = {
        StrangerFault::kStuck, StrangerFault::kLeft, StrangerFault::kRecovery, StrangerFault::kFree,
        StrangerFault::kLate,  StrangerFault::kMore, StrangerFault::kWall};
    for (const StrangerFault fault : kOfTicks)
      if (made(fault) && !own_.empty()) falsify(own_, hand_, fault);
    judge("hand", own_, &hand_, kTouching_m);
  }

  void play_open_air() {
    std::vector<PlayedTick> ticks = replayed("air", "own", "air.csv");
    if (made(StrangerFault::kAir) && !ticks.empty()) falsify(ticks, air_, StrangerFault::kAir);
    double force_n = 0;
    for (const PlayedTick& tick : ticks) force_n = std::max(force_n, tick.force_n.norm());
    // Moves shorter than a nanometre are none for the law; no spring here is stiffer than 1000 N/m.
    constexpr double kRounding_n = 1e-6;
    if (force_n > kRounding_n) {
      out_.faults.push_back({StrangerFault::kAir,
                             formatted("50 mm away and back: up to %.3g N in the open", force_n)});
    }
    out_.motions.push_back({"air", account_of(ticks, nullptr, springs_, triangles_, kTouching_m)});
  }

  void play_touching() {
    if (!bench_.must_run("motion_for", "host_sim",
                         {"motion", "--for", scene("own"), "-o", bench_.file("for.csv")}) &&
        !bench_.exists("for.csv"))
      return;
    HandMotion motion;
    motion.samples = read_motion_csv(bench_.file("for.csv"));
    motion.phases.assign(motion.samples.size(), "motion --for");
    const std::vector<PlayedTick> ticks = replayed("touching", "own", "for.csv");
    judge("motion --for", ticks, &motion, kTouching_m);
    const PlayedAccount& account = out_.motions.back().account;
    if (account.ticks == 0) return;
    out_.contact_share = static_cast<double>(account.contact) / static_cast<double>(account.ticks);
    if (made(StrangerFault::kNoTouch)) out_.contact_share = 0;
    if (out_.contact_share >= kLeastContact) return;
    out_.faults.push_back(
        {StrangerFault::kNoTouch,
         formatted("motion --for touches in %.2g %% of its ticks", 100 * out_.contact_share)});
  }

  void run_loop(const std::string& hand) {
    const std::string name = "run_" + hand;
    bench_.must_run(name, "host_sim",
                    {"run", scene("own"), "--hand", hand, "--out", bench_.file(name), "--seconds",
                     formatted("%g", kRunSeconds), "--json"});
    if (!bench_.exists(name + "/run.csv")) return;
    judge("run " + hand, read_played_ticks(bench_.file(name + "/run.csv")), nullptr,
          kTouchingLoosely_m);
  }

  void play_friction() {
    if (!(options_.friction > 0) || !compile("rub", false, options_.friction, "")) return;
    rubbed_ = replayed("friction", "rub", "hand.csv");
    judge(formatted("hand, friction %g", options_.friction), rubbed_, &hand_, kTouchingLoosely_m);
  }

  /// The parts as they are meant, with large budgets: where something is odd, or where the places
  /// have lost digits.
  void play_reference() {
    bool odd = options_.full || !pair_.meant.empty() || made(StrangerFault::kMore) ||
               made(StrangerFault::kWall);
    for (const NamedAccount& motion : out_.motions) {
      const PlayedAccount& a = motion.account;
      odd = odd || a.stuck > kPassingTicks || a.behind > kPassingTicks || a.loose > kPassingTicks ||
            a.late > 0;
    }
    if (!odd || own_.empty()) return;
    const bool as_meant = !pair_.meant.empty() || made(StrangerFault::kWall);
    if (compile("reference", true, 0, kLargeBudgets)) {
      find_excess("hand", excess_of(own_, replayed("reference", "reference", "hand.csv")), hand_,
                  as_meant, out_.faults);
    }
    if (!options_.full || rubbed_.empty()) return;
    if (compile("rub_reference", true, options_.friction, kLargeBudgets)) {
      find_excess("hand, friction",
                  excess_of(rubbed_, replayed("rub_reference", "rub_reference", "hand.csv")), hand_,
                  as_meant, out_.faults);
    }
  }

  const StrangerPair& pair_;
  const TrialOptions& options_;
  StrangerTrial out_;
  Bench bench_;
  PairTriangles triangles_;
  HandMotion hand_ = insertion_motion(pair_), air_ = open_air_motion(pair_);
  std::vector<std::string> fixed_files_;
  std::string base_;
  HandSprings springs_;
  std::vector<PlayedTick> own_, rubbed_;
};

}  // namespace

std::string StrangerTrial::verdict() const {
  std::string words;
  const FoundFault* last = nullptr;
  for (const FoundFault& fault : faults) {
    if (last == nullptr || last->kind != fault.kind)
      words += (words.empty() ? "" : "+") + std::string(to_text(fault.kind));
    last = &fault;
  }
  return words.empty() ? "right" : words;
}

StrangerTrial try_pair(const StrangerPair& pair, const TrialOptions& options) {
  if (options.keep.empty()) {
    const TemporaryFolder folder;
    return Trial(pair, options, folder.file(".")).run();
  }
  const std::string folder =
      formatted("%s/%s_%llu_%g", options.keep.c_str(), pair.family.c_str(),
                static_cast<unsigned long long>(pair.seed), pair.clearance_mm);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return Trial(pair, options, folder).run();
}

std::string with_keys(const std::string& scene, const std::string& lines) {
  std::vector<std::string> text = lines_of(scene);
  std::string section;
  for (const std::string& line : lines_of(lines)) {
    if (trimmed(line).empty()) continue;
    if (!header_of(line).empty()) {
      section = header_of(line);
      if (section.starts_with("[[") ||
          std::ranges::none_of(text, [&](const auto& l) { return header_of(l) == section; }))
        text.push_back(section);
      continue;
    }
    // The last section of that name; a key of it gives way.
    auto begin = text.end();
    for (auto at = text.begin(); at != text.end(); ++at)
      if (header_of(*at) == section) begin = at + 1;
    auto end = begin;
    while (end != text.end() && header_of(*end).empty()) ++end;
    const std::string key = key_of(line);
    const auto old =
        std::find_if(begin, end, [&](const auto& l) { return starts_with_key(l, key); });
    if (old != end) {
      *old = line;
    } else {
      text.insert(begin, line);
    }
  }
  std::string out;
  for (const std::string& line : text) out += line + "\n";
  return out;
}

std::string placed_scene(const std::string& init, const StrangerPair& pair, bool as_meant,
                         double friction) {
  const std::vector<PartPlace>& places = as_meant && !pair.meant.empty() ? pair.meant : pair.places;
  std::string text, section;
  std::size_t part = 0;
  const std::string material = friction > 0 ? formatted("material = \"%s\"\n", kMaterial) : "";
  for (const std::string& line : lines_of(init)) {
    if (!header_of(line).empty()) section = header_of(line);
    const bool placed = section == "[moving]" || section == "[[static]]";
    if (placed && (starts_with_key(line, "position_m") || starts_with_key(line, "quaternion")))
      continue;
    if (placed && starts_with_key(line, "scale_to_m")) {
      text += "scale_to_m = 0.001\n";
      continue;
    }
    text += line + "\n";
    if (!placed || !starts_with_key(line, "mesh")) continue;
    if (section == "[moving]") {
      const MotionSample start = pair.pose(pair.start(), 0);
      text += place_lines({start.p[0], start.p[1], start.p[2]},
                          {start.q_wxyz[0], start.q_wxyz[1], start.q_wxyz[2], start.q_wxyz[3]});
    } else {
      const PartPlace& place = places.at(part++);
      text += place_lines(1e-3 * place.position_mm, place.rotation());
    }
    text += material;
  }
  if (friction > 0) {
    append_line(text, "[[friction]]\nmaterials = [\"%s\", \"%s\"]\nmu = %g", kMaterial, kMaterial,
                friction);
  }
  return text;
}

}  // namespace haptic::sim
