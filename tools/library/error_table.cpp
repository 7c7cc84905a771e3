// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "tools/library/haptic.h"

namespace {

struct ErrorEntry {
  const char* name;
  const char* text;
};

constexpr std::array kErrors = {
    ErrorEntry{"HAPTIC_OK", "done"},
    ErrorEntry{"HAPTIC_ERROR_NULL", "a pointer that must not be null is null"},
    ErrorEntry{"HAPTIC_ERROR_SIZE", "a size or count is 0 or too small"},
    ErrorEntry{"HAPTIC_ERROR_VERSION",
               "the structure has a size that this library does not know; begin it with its INIT "
               "macro, and compile with the header of the library that is loaded"},
    ErrorEntry{"HAPTIC_ERROR_CLOSED", "the handle has been closed; open another one"},
    ErrorEntry{"HAPTIC_ERROR_HANDLE", "the pointer is not a handle of this kind"},
    ErrorEntry{"HAPTIC_ERROR_BUSY",
               "another thread is in a function of the same handle, which is for one at a time; or "
               "the hand has not yet let go of what it holds"},
    ErrorEntry{"HAPTIC_ERROR_NUMBER", "a number is not finite, or outside its range"},
    ErrorEntry{"HAPTIC_ERROR_POSE",
               "a pose is not finite, or its quaternion is not of unit length; give x y z and the "
               "quaternion x y z w"},
    ErrorEntry{"HAPTIC_ERROR_SCENE",
               "the bytes are no scene that this library can use; compile it again"},
    ErrorEntry{"HAPTIC_ERROR_MEMORY",
               "too little memory, or memory that is not aligned to HAPTIC_ALIGNMENT"},
    ErrorEntry{"HAPTIC_ERROR_INPUT", "a file or mesh cannot be used; the messages say why"},
    ErrorEntry{"HAPTIC_ERROR_LIMIT",
               "the scene exceeds a limit of time or memory; the messages say which"},
    ErrorEntry{"HAPTIC_ERROR_DEVICE",
               "there is no device of that name, it cannot be had, or it has no simulated hand; "
               "\"sim\" is always there, and a configuration of run_device ends in .toml"},
    ErrorEntry{"HAPTIC_ERROR_SYSTEM", "the operating system refused"},
    ErrorEntry{"HAPTIC_ERROR_INTERNAL",
               "a fault of the library; please report it with the input that led to it"},
    ErrorEntry{"HAPTIC_ERROR_NO_PLAN",
               "no way to the goal was found; the text says how far it got"},
    ErrorEntry{
        "HAPTIC_ERROR_PART",
        "there is no such hand, or no such part that it may hold: a scene has parts where it "
        "was compiled with [[part]] tables, or with fixed parts that may be held"},
};
static_assert(kErrors.size() == HAPTIC_ERROR_COUNT);

}  // namespace

const char* haptic_version(void) { return HAPTIC_VERSION; }

const char* haptic_error_name(int error) {
  return error >= 0 && error < HAPTIC_ERROR_COUNT ? kErrors[static_cast<std::size_t>(error)].name
                                                  : "HAPTIC_ERROR_UNKNOWN";
}

const char* haptic_error_text(int error) {
  return error >= 0 && error < HAPTIC_ERROR_COUNT ? kErrors[static_cast<std::size_t>(error)].text
                                                  : "no error number of this library";
}
