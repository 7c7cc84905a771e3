// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The first entry of a recording: which bridge it is of, and its keys.

#include <string>

#include "hal/drivers/driver_registry.hpp"
#include "tools/bridges/record/recording.hpp"

namespace haptic::tools {

/// {"bridge", "keys"}. Of a path the name of the file alone, of a serial port and of a host
/// nothing: a recording is made to be given away.
[[nodiscard]] std::string begin_text(const hal::DriverRow& row, const hal::DriverOptions& options);

/// The keys of a recording's first entry, which it takes; a key of `given` stands instead.
/// @throws InputError  it is none, or of another bridge than `row`.
[[nodiscard]] hal::DriverOptions recorded_options(Recording& recording, const hal::DriverRow& row,
                                                  const hal::DriverOptions& given);

}  // namespace haptic::tools
