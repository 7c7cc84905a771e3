// SPDX-License-Identifier: Apache-2.0
#include "tools/common/run_main.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::tools {

int run_main(const char* program, const std::function<int()>& body) {
  const auto say = [&](const char* text) { std::fprintf(stderr, "%s: %s\n", program, text); };
  try {
    const int code = body();
    // If the output could not be written, the program has not done what it was asked for.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      say(("standard output cannot be written: " + std::string(std::strerror(errno))).c_str());
      return kExitDeviceOrOs;
    }
    return code;
  } catch (const UsageError& error) {
    say(error.what());
    return kExitUsage;
  } catch (const InputError& error) {
    say(error.what());
    return kExitBadInput;
  } catch (const OsError& error) {
    say(error.what());
    return kExitDeviceOrOs;
  } catch (const std::bad_alloc&) {
    say("out of memory");
    return kExitDeviceOrOs;
  } catch (const std::runtime_error& error) {
    std::fprintf(stderr, "%s: the operating system refused: %s\n", program, error.what());
    return kExitDeviceOrOs;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: internal error, please report it with the input: %s\n", program,
                 error.what());
    return kExitCheckFailed;
  }
}

}  // namespace haptic::tools
