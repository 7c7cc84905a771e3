// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/laboratory.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <system_error>

#include "tools/common/error.hpp"
#include "tools/common/left_out.hpp"

namespace haptic::sim {
namespace {

struct LaboratoryCommand {
  std::string_view name, does;
};
constexpr LaboratoryCommand kLaboratory[] = {
    {"accept", "Which meshes the compiler takes, as what, and whether what it says is true."},
    {"bodies",
     "Drivers that squeeze, push and carry a hand's part, and what a tick of several bodies "
     "costs."},
    {"bodies-fuzz",
     "Random hands, drivers and loose parts against each other; every tick and step judged."},
    {"calm",
     "Presses, holds and withdraws by every hand and encoder: rest, and nothing in free space."},
    {"compare-laws", "Runs a motion under the paper's law and the proxy law, side by side."},
    {"cost", "Counts the work of a tick on seven scenes; compares with an earlier build."},
    {"crossings",
     "Drives rods, blades and sheets through each other; the way of every pass judged."},
    {"faults", "Makes every fault of device, bus and servo loop happen in every state."},
    {"flight", "Flies parts of 10 um to 10 m freely and along a wall: no force at all."},
    {"friction",
     "Slides, stops and screws parts in tight fits: friction against Coulomb's law and screw "
     "mechanics."},
    {"growth",
     "Compiles parts that get larger: time, memory, bytes, and the powers they grow with."},
    {"guide-limits", "Measures the loop with a guide on and off, and the most that a guide does."},
    {"guide-study",
     "Lets simulated hands put a peg into its hole: contact alone, a guide, wrong guides."},
    {"hold", "Holds the device still after stress: a fixed point, balanced, no energy gained."},
    {"pareto", "Error against run time of the core and of other collision methods."},
    {"pegs", "Leads pegs into their holes and tells what the hand feels: steps, holds, forces."},
    {"plan-sampled", "Finds a plan by OMPL's planners, where they are built in."},
    {"planners", "Compares the planner with those of OMPL, where it is built in, on puzzles."},
    {"proxy-fuzz", "Random, jittering and jumping devices against the proxy; every tick judged."},
    {"rates", "Finds the highest rate of the servo loop that holds on this machine."},
    {"reproduce-paper", "Makes every table and figure of the paper, ours next to the paper's."},
    {"soak",
     "Runs the stack for a long time with a fault every few seconds, and watches memory and "
     "descriptors."},
    {"stability", "Measures where the haptic loop is stable, compared with the theory."},
    {"strangers",
     "Brings pairs of parts as people draw them, by defaults: what the programs give is judged."},
    {"surface-fuzz",
     "Random devices against triangle meshes; every felt pose judged by triangles."},
    {"vectors", "Compares the core with golden vectors."},
    {"verify", "Checks certificates, D_near and near sets of the core by independent code."},
    {"wcet", "Looks for the worst tick: counted work, time, and a search for bad motions."}};

}  // namespace

bool is_laboratory_command(std::string_view name) {
  return std::ranges::any_of(kLaboratory, [&](const auto& c) { return c.name == name; });
}

std::vector<std::string> laboratory_commands() {
  std::vector<std::string> names;
  for (const LaboratoryCommand& command : kLaboratory) names.emplace_back(command.name);
  return names;
}

std::string laboratory_help() {
  std::string text = "Subcommands of the laboratory (program host_lab, next to this one):\n";
  for (const LaboratoryCommand& command : kLaboratory) {
    std::string line = "  " + std::string(command.name);
    line.resize(std::max<std::size_t>(line.size() + 1, 30), ' ');
    text += line + std::string(command.does) + "\n";
  }
  return text;
}

void become_laboratory(char** argv) {
  char self[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
  if (length < 0) throw std::system_error(errno, std::generic_category(), "/proc/self/exe");
  std::string path(self, static_cast<std::size_t>(length));
  path.replace(path.rfind('/') + 1, std::string::npos, "host_lab");
  execv(path.c_str(), argv);
  if (errno == ENOENT)
    throw tools::UsageError(tools::left_out_text(argv[1], tools::build_command("host_lab")));
  throw std::system_error(errno, std::generic_category(), path);
}

}  // namespace haptic::sim
