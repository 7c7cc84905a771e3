// SPDX-License-Identifier: Apache-2.0
#include "tests/bridges/sessions/device_session.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "hal/clock/servo_clock.hpp"

namespace haptic::test {
namespace {

using nlohmann::json;
using sim::test::text_of_file;

constexpr std::int64_t kMs_ns = 1'000'000;

/// Stiffness and mass as `list` asks for them.
std::string peg_scene(double stiffness_n_per_m) {
  const std::string folder = HAPTIC_SCENES_DIR "/square_peg_five/";
  return "format = 1\nname = \"square_peg\"\n[moving]\nmesh = \"" + folder +
         "peg.off\"\nscale_to_m = 0.001\nposition_m = [0.0, 0.0, " + std::to_string(kPegGap_m) +
         "]\ngrip_m = [0.0, 0.0, 0.05]\n[[static]]\nmesh = \"" + folder +
         "socket.obj\"\nscale_to_m = 0.001\n[rendering]\nk_f_n_per_m = " +
         std::to_string(stiffness_n_per_m) + "\n[device]\nmass_kg = 0.2\ndamping_ns_per_m = 1.0\n";
}

}  // namespace

InRealTime::InRealTime() {
  const sched_param below_the_loop{60};
  (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &below_the_loop);
}
InRealTime::~InRealTime() {
  const sched_param ordinary{0};
  (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
}

DeviceSession::DeviceSession(EmulatedHand& hand)
    : hand_(hand), folder_("device_session_" + std::to_string(hal::monotonic_ns())) {
  std::ofstream(folder_.file("scene.toml")) << peg_scene(hand.stiffness_n_per_m());
  const sim::test::ProgramResult r =
      sim::test::run_program(HAPTIC_GRAPH_COMPILER, "'" + folder_.file("scene.toml") + "' -o '" +
                                                        folder_.file("peg.rtscene") + "'");
  if (r.exit_code != 0) throw std::runtime_error("the peg does not compile: " + r.err);
}

DeviceSession::~DeviceSession() {
  if (pid_ <= 0 || is_over_) return;
  kill(pid_, SIGKILL);  // its bridge and its servo process go with it
  waitpid(pid_, nullptr, 0);
}

std::string DeviceSession::with_environment(const std::string& command) const {
  std::string words = "env";
  for (const auto& [name, value] : hand_.environment()) words += " " + name + "='" + value + "'";
  return words + " " + command;
}

json DeviceSession::list() {
  const std::string out = folder_.file("list.json");
  const std::string command = with_environment(std::string("'") + HAPTIC_RUN_DEVICE + "'") +
                              " list --json " + hand_.list_arguments() + " > '" + out + "'";
  if (std::system(command.c_str()) < 0) return {};
  return json::parse(text_of_file(out), nullptr, false);
}

bool DeviceSession::start(const json& listed, const std::string& driver) {
  std::string toml;
  for (const char* const group : {"devices", "possible"})
    for (const json& device : listed.at(group))
      if (device["driver"] == driver) toml = device["toml"];
  const std::string gap = "SCENE.rtscene";
  const std::size_t at = toml.find(gap);
  if (at == std::string::npos) return false;
  toml.replace(at, gap.size(), folder_.file("peg.rtscene"));
  const std::string config = folder_.file("run.toml");
  std::ofstream(config) << hand_.filled(toml);

  std::vector<std::string> variables;
  for (const auto& [name, value] : hand_.environment()) variables.push_back(name + "=" + value);
  pid_ = fork();
  if (pid_ < 0) return false;
  if (pid_ > 0) return true;
  for (std::string& variable : variables) putenv(variable.data());
  const int out = open(folder_.file("out").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  const int err = open(folder_.file("err").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  if (dup2(out, STDOUT_FILENO) < 0 || dup2(err, STDERR_FILENO) < 0) _exit(126);
  execl(HAPTIC_RUN_DEVICE, "run_device", "run", config.c_str(), "--json", "--status-every", "0.02",
        "--seconds", "60", "--allow-degraded", nullptr);
  _exit(127);
}

void DeviceSession::lead(double seconds, const std::function<Vec3(double t_s)>& way,
                         const std::function<bool()>& done) {
  const InRealTime here;
  const std::int64_t begin_ns = hal::monotonic_ns();
  for (std::int64_t now_ns = begin_ns; 1e-9 * static_cast<double>(now_ns - begin_ns) < seconds;
       now_ns = hal::monotonic_ns()) {
    hand_.move(way(1e-9 * static_cast<double>(now_ns - begin_ns)));
    if (done && done()) return;
    (void)hal::sleep_until(now_ns + kMs_ns);
  }
}

bool DeviceSession::arm(const Vec3& way_d) {
  const auto stays = [&](double) { return way_d; };
  const auto arming = [&] { return newest("status").value("arming", std::string()); };
  hand_.press(false);
  lead(0.1, stays);
  for (int k = 0; k < 200 && newest("status").value("link", std::string()) != "ready"; ++k) {
    if (has_ended()) return false;
    lead(0.02, stays);
  }
  lead(0.15, stays);
  hand_.press(true);
  for (int k = 0; k < 100 && arming() != "armed"; ++k) {
    if (has_ended()) return false;
    lead(0.02, stays);
  }
  return arming() == "armed";
}

bool DeviceSession::has_ended() {
  int status = 0;
  if (!is_over_ && pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) {
    is_over_ = true;
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  return is_over_;
}

void DeviceSession::end() {
  if (has_ended() || pid_ <= 0) return;
  kill(pid_, SIGTERM);
  for (int k = 0; k < 1'000 && !has_ended(); ++k)
    (void)hal::sleep_until(hal::monotonic_ns() + 10 * kMs_ns);
}

std::vector<json> DeviceSession::lines() const {
  std::vector<json> lines;
  std::istringstream stream(text_of_file(folder_.file("out")));
  for (std::string line; std::getline(stream, line);) {
    if (stream.eof()) break;  // in the making
    lines.push_back(json::parse(line, nullptr, false));
  }
  return lines;
}

json DeviceSession::newest(const std::string& kind) const {
  const std::vector<json> all = lines();
  for (auto line = all.rbegin(); line != all.rend(); ++line)
    if (line->is_object() && (*line)["kind"] == kind) return *line;
  return json::object();
}

std::string DeviceSession::errors() const { return text_of_file(folder_.file("err")); }

bool DeviceSession::has_said(const std::string& words) const {
  return errors().find(words) != std::string::npos ||
         text_of_file(folder_.file("out")).find(words) != std::string::npos;
}

std::vector<pid_t> DeviceSession::bridges() const {
  std::vector<pid_t> found;
  const std::string parent = std::string("--parent") + '\0' + std::to_string(pid_) + '\0';
  DIR* const all = opendir("/proc");
  while (const dirent* const each = all != nullptr ? readdir(all) : nullptr) {
    const std::string command = text_of_file(std::string("/proc/") + each->d_name + "/cmdline");
    if (command.find("device_bridge") == std::string::npos ||
        (command + '\0').find(parent) == std::string::npos)
      continue;
    found.push_back(std::atoi(each->d_name));
  }
  if (all != nullptr) closedir(all);
  return found;
}

}  // namespace haptic::test
