// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Messages of Haply's Inverse service: which version answers, which devices it lists, the state of
/// one of them, and the message that carries a force. Pure functions; nothing is trusted: texts are
/// bounded in length and depth, numbers are finite and within what a device on a table can say.
///
/// Facts: docs.haply.co, inverseSDK 3.0 to 3.5 (websocket-protocol, control-commands, basis, http,
/// json-conventions), and clients that others have published (README.md of this folder names them).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/device.hpp"

namespace haptic::tools {

inline constexpr std::size_t kMostHaplyText_bytes = 64 * 1024;
inline constexpr int kMostHaplyDepth = 16;
inline constexpr std::size_t kMostHaplyDevices = 16;  ///< of a kind, in one inventory
inline constexpr std::size_t kMostHaplyName_bytes = 64;

/// The format of the messages, by the version of the service.
enum class HaplyFormat : std::uint8_t {
  k30 = 0,  ///< 3.0: devices keyed by name, and a force message that no public source shows
  k31,      ///< 3.1: the force is in "values"
  k35,      ///< 3.5: the force is in "vector"
  kOther
};

struct HaplyVersion {
  HaplyFormat format = HaplyFormat::kOther;
  std::string text;  ///< "3.5.1.0"
};

/// The answer to GET /version, with or without the envelope {"ok", "data"}. Empty: it is none.
[[nodiscard]] std::optional<HaplyVersion> read_haply_version(std::string_view body);

enum class HaplyVerdict : std::uint8_t {
  kOk = 0,
  kTooLong,
  kTooDeep,
  kNotJson,
  kBadNumber,   ///< no number where one belongs, not finite, or beyond a table's size
  kIncomplete,  ///< the device is listed without what its state needs
  kAbsent,      ///< well formed, and the device is not in it
  kCount
};
[[nodiscard]] const char* to_text(HaplyVerdict verdict) noexcept;

/// A device as the first message of the service lists it.
struct HaplyListed {
  std::string id;
  std::string group;  ///< "inverse3", "verse_grip", "wireless_verse_grip", "custom_verse_grip"
  std::string kind;   ///< config.type: "inverse3", "inverse3x", "minverse"; may be empty
  bool calibrated = false;
  bool in_use = false;       ///< commanded by some session
  bool powered = true;       ///< false only where it says so
  bool awake = true;         ///< of a grip; false only where it says so
  bool tells_force = false;  ///< its state has the force that the service exerts
};

struct HaplyInventory {
  std::vector<HaplyListed> devices, grips;  ///< kMostHaplyDevices each at most
};

/// The first message of a connection. Devices without a usable name are left out: names are of
/// letters, digits, '-', '_', '.' and at most kMostHaplyName_bytes.
[[nodiscard]] HaplyVerdict read_haply_inventory(std::string_view text, HaplyInventory& inventory);

/// Sessions by the answer to GET /sessions (3.5), our own among them. Empty: it says nothing.
[[nodiscard]] std::optional<std::size_t> read_haply_sessions(std::string_view body);

/// Which device of a message is read.
struct HaplyChoice {
  std::string device;
  std::string grip, grip_group;  ///< empty: without a grip
};

/// State of a device in Haply's axes, which are those of D: x right, y forward, z up; the origin is
/// the device's base. A member that a message leaves out keeps its value.
struct HaplyState {
  double position_m[3] = {0, 0, 0};
  double velocity_m_per_s[3] = {0, 0, 0};
  bool has_velocity = false;  ///< of this message, like all `has_`
  bool calibrated = false;    ///< and ready, where it says that
  bool powered = true;
  bool moved = false;  ///< another program has moved the workspace: positions are not the device's
  bool has_force = false;
  double force_n[3] = {0, 0, 0};  ///< exerted by the service for all its sessions
  bool has_grip = false;
  bool grip_awake = true;
  double q_xyzw[4] = {0, 0, 0, 1};  ///< unit; maps the grip to D
  std::uint32_t buttons = 0;        ///< bit 0 a or the wired grip's one, 1 b, 2 c, 3 home
};

/// Any other message. `state` is changed by kOk alone.
[[nodiscard]] HaplyVerdict read_haply_state(std::string_view text, const HaplyChoice& choice,
                                            HaplyState& state);

/// The message that exerts `force_n` until the next one; `out` is replaced. @param first  with what
/// a session of 3.5 sets once: its axes and origin. The numbers are finite, the name is one of an
/// inventory, the format is 3.1 or 3.5.
void write_haply_force(HaplyFormat format, const std::string& device, const double (&force_n)[3],
                       bool first, std::string& out);

}  // namespace haptic::tools
