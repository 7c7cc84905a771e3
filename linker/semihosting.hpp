// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Files and exit of the machine that an Arm image is debugged or emulated on (Arm's "Semihosting
/// for AArch32 and AArch64"), M profile. A call stops the core until the host has answered: for
/// tests, never within a servo loop.

#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::semihosting {

enum class Mode : std::uint32_t { kRead = 1, kWrite = 5 };  ///< "rb", "wb" of C

/// A file of the host; negative: it could not be opened.
using File = std::int32_t;

/// `name`: zero-terminated.
[[nodiscard]] File open(const char* name, Mode mode) noexcept;
/// @return whether the host took all that was written.
[[nodiscard]] bool close(File file) noexcept;
/// Reads up to bytes.size(). @return the count of bytes read; 0 at the end or on an error.
[[nodiscard]] std::size_t read(File file, std::span<std::byte> bytes) noexcept;
/// @return false when not all bytes were written.
[[nodiscard]] bool write(File file, std::span<const std::byte> bytes) noexcept;
/// Zero-terminated text on the host's console.
void print(const char* text) noexcept;

/// Copies the image's command line, words joined by one blank, zero-terminated. @return false when
/// the host has none or it is longer.
[[nodiscard]] bool command_line(std::span<char> text) noexcept;

/// Ends the emulation with this exit code.
[[noreturn]] void exit(int code) noexcept;

}  // namespace haptic::semihosting
