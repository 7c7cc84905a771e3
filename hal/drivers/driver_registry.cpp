// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/driver_registry.hpp"

#include <array>
#include <cmath>
#include <sstream>

#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/polhem_driver.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/sha256.hpp"
#include "hal/drivers/spacemouse_driver.hpp"

namespace haptic::hal {
namespace {

using Kind = DriverKey::Kind;

std::unique_ptr<Driver> make_reference(const DriverOptions& /*options*/, DriverDefect& /*defect*/) {
  return std::make_unique<ReferenceDriver>();
}

constexpr std::array kFalconKeys = {
    DriverKey{"firmware", Kind::kPath, "Novint's image; needed once after each power-up"},
    DriverKey{"firmware_sha256", Kind::kText,
              "the image must have one of these hashes: digits of sha256sum, separated by spaces"},
    DriverKey{"firmware_accept_unknown", Kind::kFlag, "load an image whose hash is not known"}};

std::unique_ptr<Driver> make_falcon(const DriverOptions& options, DriverDefect& defect) {
  FalconSettings settings;
  const auto* const path = options.value<std::string>("firmware");
  const auto* const hashes = options.value<std::string>("firmware_sha256");
  const bool* const accept = options.value<bool>("firmware_accept_unknown");
  if (path == nullptr && (hashes != nullptr || accept != nullptr)) {
    defect = {hashes != nullptr ? "firmware_sha256" : "firmware_accept_unknown",
              "says how to check the firmware, and none is named; add firmware or remove the key"};
    return nullptr;
  }
  if (path != nullptr) settings.firmware_path = *path;
  if (accept != nullptr) settings.accept_unknown_firmware = *accept;
  std::istringstream words(hashes != nullptr ? *hashes : "");
  for (std::string word; words >> word;) {
    Sha256Digest digest;
    if (!parse_sha256(word, digest)) {
      defect = {"firmware_sha256",
                "'" + word + "' is no SHA-256; give the 64 digits that sha256sum FILE prints"};
      return nullptr;
    }
    settings.known_firmware.push_back(digest);
  }
  return std::make_unique<FalconDriver>(std::move(settings));
}

std::unique_ptr<Driver> make_spacemouse(const DriverOptions& options, DriverDefect& /*defect*/) {
  SpaceMouseSettings settings;
  if (options.vendor_id != 0) {
    settings.vendor_id = options.vendor_id;
    settings.product_id = options.product_id;
  }
  return std::make_unique<SpaceMouseDriver>(settings);
}

std::vector<UsbIdentity> spacemouse_identities() {
  std::vector<UsbIdentity> all;
  for (const SpaceMouseModel& m : spacemouse_models()) all.push_back({m.vendor_id, m.product_id});
  return all;
}

// Keys of every bridge (tools/bridges/record).
constexpr DriverKey kRecord{
    "record", Kind::kPath,
    "a file: bridge and device, word by word, to be replayed; the one before is kept as FILE.1"};
constexpr DriverKey kRecordMb{"record_mb", Kind::kNumber, "its largest size; 256 without it", 1,
                              1024};

constexpr std::array kSpacenavKeys = {
    DriverKey{"socket", Kind::kPath,
              "of spacenavd; else SPNAV_SOCKET, `socket =` of /etc/spnavrc, /var/run/spnav.sock"},
    DriverKey{"full_scale", Kind::kNumber,
              "what the daemon sends at full push; else 500 for absolute axes, 350 for relative", 1,
              32768},
    kRecord, kRecordMb};

/// Driver of a bridge: it is known before the device is there what may be driven at the most.
template <std::uint32_t driven_dof>
std::unique_ptr<Driver> make_bridged(const DriverOptions& /*options*/, DriverDefect& /*defect*/) {
  ReferenceSettings settings;
  settings.capabilities.driven_dof = driven_dof;
  return std::make_unique<ReferenceDriver>(settings);
}

/// A device has one name, and its number is whole.
std::unique_ptr<Driver> make_force_dimension(const DriverOptions& options, DriverDefect& defect) {
  const double* const serial = options.value<double>("serial");
  const double* const index = options.value<double>("index");
  const auto is_whole = [](const double* v) { return v == nullptr || *v == std::floor(*v); };
  if (serial != nullptr && index != nullptr) {
    defect = {"index", "names a device that serial names too; remove one of the two"};
    return nullptr;
  }
  if (!is_whole(serial) || !is_whole(index)) {
    defect = {is_whole(serial) ? "index" : "serial", "must be a whole number"};
    return nullptr;
  }
  return make_bridged<kDofAll>(options, defect);
}

std::unique_ptr<Driver> make_polhem(const DriverOptions& options, DriverDefect& /*defect*/) {
  PolhemSettings settings;
  settings.has_deadman = options.has_deadman;
  return std::make_unique<PolhemDriver>(settings);
}

constexpr std::array kHaplyKeys = {
    DriverKey{"service", Kind::kText, "host of Haply's Inverse service; 127.0.0.1 without it"},
    DriverKey{"http_port", Kind::kNumber, "of the service; 10000 without it", 1, 65535},
    DriverKey{"websocket_port", Kind::kNumber, "of the service; 10001 without it", 1, 65535},
    DriverKey{"device", Kind::kText, "serial of the device, where the service lists several"},
    DriverKey{"grip", Kind::kText, "serial of the grip, where there are several, or none"},
    DriverKey{"max_force", Kind::kNumber, "in N, by the data sheet of the model; 2 without it", 0.1,
              10},
    DriverKey{"accept_other_forces", Kind::kFlag,
              "go on while the service exerts forces of other programs"},
    kRecord,
    kRecordMb};

constexpr std::array kOpenHapticsKeys = {
    DriverKey{"library", Kind::kPath, "the vendor's library; absent: the usual names are tried"},
    DriverKey{"device", Kind::kText, "its name in the vendor's set-up; absent: the default one"},
    DriverKey{"rate", Kind::kNumber, "reports a second", 500, 1000},
    DriverKey{"device_velocity", Kind::kFlag, "velocity by the library, not from poses"},
    kRecord,
    kRecordMb};

constexpr std::array kForceDimensionKeys = {
    DriverKey{"library", Kind::kPath, "the vendor's library; absent: the usual names are tried"},
    DriverKey{"serial", Kind::kNumber, "of the device, where there are several", 0, 65535},
    DriverKey{"index", Kind::kNumber, "the same by its place", 0, 15},
    DriverKey{"rate", Kind::kNumber, "reports a second", 500, 4000},
    DriverKey{"gripper_closed", Kind::kNumber,
              "the gripper is a switch, 0x10000, below this angle [rad]", 0.01, 0.6},
    DriverKey{"device_velocity", Kind::kFlag, "velocity by the library, not from poses"},
    DriverKey{"no_gravity_compensation", Kind::kFlag,
              "the library adds nothing that carries the handle's weight"},
    kRecord,
    kRecordMb};
// Keys of the bridges to arms (tools/bridges/arm/arm_settings.hpp).
constexpr DriverKey kArmPort{"port", Kind::kPath, "the adapter, as /dev/serial/by-id/usb-..."};
constexpr DriverKey kArmBaud{"baud", Kind::kNumber, "rate of the servos; 1000000 if absent", 9600,
                             4'500'000};
constexpr DriverKey kArmIds{"ids", Kind::kText,
                            "ids of the servos from the base to the handle; 1 2 3 ... if absent"};
constexpr DriverKey kArmUrdf{"urdf", Kind::kPath, "the arm's robot description"};
constexpr DriverKey kArmBase{"base_link", Kind::kText, "link of it that stands still"};
constexpr DriverKey kArmTip{"tip_link", Kind::kText, "link of it that the hand holds"};
constexpr DriverKey kArmOffsets{"offsets_rad", Kind::kText,
                                "angle of each servo where its joint is at 0; 0 if absent"};
constexpr DriverKey kArmSigns{
    "signs", Kind::kText, "1 or -1 a joint: it turns with its servo or against it; 1 if absent"};
constexpr DriverKey kArmTurns{
    "base_rpy_deg", Kind::kText,
    "turns of the base about fixed x, y, z (x right, y away, z up); 0 0 90 if absent"};
constexpr DriverKey kArmOrigin{"origin_m", Kind::kText,
                               "middle of the workspace in the base's frame; 0 0 0 if absent"};
constexpr DriverKey kArmTrigger{"trigger_id", Kind::kNumber,
                                "servo that the hand pulls as the first switch", 0, 252};
constexpr DriverKey kArmPull{"trigger_rad", Kind::kText, "its angles open and closed"};

constexpr std::array kDynamixelKeys = {
    kArmPort,
    kArmBaud,
    kArmIds,
    kArmUrdf,
    kArmBase,
    kArmTip,
    kArmOffsets,
    kArmSigns,
    kArmTurns,
    kArmOrigin,
    kArmTrigger,
    kArmPull,
    DriverKey{"pose_only", Kind::kFlag, "give no servo torque"},
    DriverKey{"torque_limits_nm", Kind::kText,
              "largest torque of each joint; a third of what the servos can if absent"},
    DriverKey{"torque_nm_per_a", Kind::kText, "of each servo's output; its model's if absent"},
    DriverKey{"max_force_n", Kind::kNumber, "largest force; what every pose allows if absent", 0.01,
              100},
    DriverKey{"gravity_share", Kind::kNumber,
              "share of the arm's weight that it carries; 1 if absent", 0, 1.2},
    kRecord,
    kRecordMb};

constexpr std::array kFeetechKeys = {kArmPort,    kArmBaud,    kArmIds,   kArmUrdf,  kArmBase,
                                     kArmTip,     kArmOffsets, kArmSigns, kArmTurns, kArmOrigin,
                                     kArmTrigger, kArmPull,    kRecord,   kRecordMb};

constexpr std::array kRows = {
    DriverRow{"reference",
              "Reference device",
              "This is a test identity of pid.codes, for a bench and for the device model; who "
              "builds hardware puts an identity of their own here.",
              "our model of it, also over emulated USB",
              {},
              make_reference},
    DriverRow{"falcon", "Novint Falcon", "", "our model of it alone", kFalconKeys, make_falcon},
    DriverRow{"spacemouse",
              "3Dconnexion",
              "The six-axis models, and no others.",
              "our model of it alone",
              {},
              make_spacemouse,
              spacemouse_identities},
    DriverRow{"polhem",
              "Polhem (WoodenHaptics over USB)",
              "The number is its board library's default, not a registered identity: another "
              "device may have it too.",
              "our model of it alone",
              {},
              make_polhem},
    DriverRow{
        "spacenav", "3Dconnexion by spacenavd",
        "All that the daemon finds, wireless ones too; other programs keep them.",
        "spacenavd 1.1 with a simulated serial device, and our model of it, which libspnav 1.0 has "
        "judged",
        kSpacenavKeys, make_bridged<0>, nullptr, true},
    DriverRow{"haply", "Haply Inverse3, Inverse3x, Minverse",
              "By Haply's Inverse service, which must run.",
              "our stand-in for its service, which a client of others judges", kHaplyKeys,
              make_bridged<kDofTranslation>, nullptr, true},
    DriverRow{"openhaptics", "3D Systems Phantom; Touch, Touch X (force alone)",
              "By libHD of OpenHaptics 3.x, which you install.", "a stand-in of ours for libHD",
              kOpenHapticsKeys, make_bridged<kDofAll>, nullptr, true},
    DriverRow{"forcedimension", "Force Dimension sigma, lambda; omega, delta (force alone)",
              "By libdhd of the Force Dimension SDK 3.x, which you install.",
              "a stand-in of ours for libdhd", kForceDimensionKeys, make_force_dimension, nullptr,
              true},
    DriverRow{"dynamixel", "Leader arms on DYNAMIXEL X servos",
              "GELLO, FACTR, Koch and their kin, by their URDF: a cue, not a surface.",
              "our model of its servos, which the official SDK reads and writes; never on hardware",
              kDynamixelKeys, make_bridged<kDofAll>, nullptr, true},
    DriverRow{"feetech", "Leader arms on Feetech STS servos",
              "SO-100 and SO-101, by their URDF: poses, no force.",
              "our model of its servos, which the official SDK reads and writes; never on hardware",
              kFeetechKeys, make_bridged<0>, nullptr, true}};

}  // namespace

std::span<const DriverRow> driver_rows() noexcept { return kRows; }

const DriverRow* find_driver(std::string_view name) noexcept {
  for (const DriverRow& row : kRows) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

std::vector<UsbIdentity> identities_of(const DriverRow& row) {
  if (row.is_bridged) return {};
  if (row.identities != nullptr) return row.identities();
  const std::unique_ptr<Driver> driver = standard_driver(row);
  return {{driver->profile().vendor_id, driver->profile().product_id}};
}

std::unique_ptr<Driver> standard_driver(const DriverRow& row) {
  DriverOptions options;
  options.has_deadman = true;
  DriverDefect defect;
  return row.make(options, defect);
}

}  // namespace haptic::hal
