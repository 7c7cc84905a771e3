// SPDX-License-Identifier: Apache-2.0
// A program with a session on a device, to be killed: session_owner SCENE CONFIG [--megabytes N]
// [--fork] Says "open", or why not; then goes on for a minute. --megabytes: so much memory that the
// kernel has to take back when it dies. --fork: with a child that has all its descriptors and
// outlives it.
#include <haptic.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  std::vector<char> ballast;
  bool forks = false;
  for (int k = 3; k < argc; ++k) {
    if (std::strcmp(argv[k], "--fork") == 0) forks = true;
    if (std::strcmp(argv[k], "--megabytes") == 0 && k + 1 < argc)
      ballast.assign(std::strtoul(argv[k + 1], nullptr, 10) << 20, 1);
  }
  std::ifstream file(argv[1], std::ios::binary);
  const std::vector<char> scene{std::istreambuf_iterator<char>(file), {}};
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  options.device = argv[2];
  haptic_session* session = nullptr;
  char text[4096] = "";
  const int error =
      haptic_session_open_text(scene.data(), scene.size(), &options, &session, text, sizeof text);
  if (error != HAPTIC_OK) {
    std::fprintf(stderr, "%s: %s\n", haptic_error_name(error), text);
    return 1;
  }
  if (forks && fork() == 0) {
    haptic_state state = HAPTIC_STATE_INIT;
    const bool is_refused = haptic_session_state(session, &state) == HAPTIC_ERROR_CLOSED &&
                            haptic_session_stop(session) == HAPTIC_ERROR_CLOSED &&
                            haptic_session_free(&session) == HAPTIC_OK && session == nullptr;
    std::printf("child: %s\n", is_refused ? "has no session" : "has a session");
    std::fflush(stdout);
    sleep(20);
    _exit(0);
  }
  std::printf("open\n");
  std::fflush(stdout);
  sleep(60);
  return ballast.empty() ? 0 : ballast.back() - 1;
}
