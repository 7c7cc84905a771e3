// SPDX-License-Identifier: Apache-2.0
/// The examples of hal/drivers/PROTOCOL.md are what the codec makes of them, and its descriptors
/// are those that the driver opens.
#include <doctest/doctest.h>

#include <sstream>
#include <string>
#include <vector>

#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/reference_short.hpp"
#include "tests/hal/protocol_text.hpp"

using namespace haptic::hal;
using haptic::hal::test::bytes_in;
using haptic::hal::test::fenced;

namespace {

/// "name value value ..." per line, as the document writes it.
class Listing {
 public:
  template <typename Value>
  Listing& add(const char* name, const Value& value) {
    text_ << name;
    if constexpr (requires { value.size(); }) {
      for (const auto x : value) text_ << ' ' << x;
    } else {
      text_ << ' ' << +value;
    }
    text_ << '\n';
    return *this;
  }
  Listing& add_bits(const char* name, std::uint32_t value, int digits) {
    std::ostringstream hex;
    hex << std::hex << value;
    const auto missing = static_cast<std::size_t>(digits) -
                         std::min<std::size_t>(static_cast<std::size_t>(digits), hex.str().size());
    text_ << name << " 0x" << std::string(missing, '0') << hex.str() << '\n';
    return *this;
  }
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
};

std::string listing_of(const ReferenceReport& r) {
  return Listing()
      .add_bits("status", r.status, 2)
      .add("sequence", r.sequence)
      .add("time_us", r.time_us)
      .add("position_nm", r.position)
      .add("orientation", r.orientation)
      .add("velocity_um_per_s", r.velocity)
      .add("angular_velocity_urad_per_s", r.angular_velocity)
      .add_bits("switches", r.switches, 1)
      .add_bits("faults", r.faults, 1)
      .add("accepted_tick", r.accepted_tick)
      .add("rejected", r.rejected)
      .add("accepted_sequence", r.accepted_sequence)
      .text();
}

std::string listing_of(const ReferenceShortReport& r) {
  return Listing()
      .add_bits("status", r.status, 2)
      .add("sequence", r.sequence)
      .add("time_us", r.time_us)
      .add("position_nm", r.position)
      .add("orientation", r.orientation)
      .add("velocity_100um_per_s", r.velocity)
      .add("angular_velocity_mrad_per_s", r.angular_velocity)
      .add_bits("switches", r.switches, 1)
      .add_bits("faults", r.faults, 1)
      .add("rejected", r.rejected)
      .add("accepted_sequence", r.accepted_sequence)
      .text();
}

std::string listing_of(const ReferenceCommand& c) {
  return Listing()
      .add("drives_on", c.drives_on)
      .add("sequence", c.sequence)
      .add("tick", c.tick)
      .add("force_10un", c.force)
      .add("torque_100nnm", c.torque)
      .text();
}

std::string listing_of(const ReferenceBlock& b) {
  return Listing()
      .add("twist_sensed", b.twist_sensed)
      .add_bits("sensed_dof", b.sensed_dof, 2)
      .add_bits("driven_dof", b.driven_dof, 2)
      .add("report_period_us", b.report_period_us)
      .add("watchdog_ms", b.watchdog_ms)
      .add("max_force_10un", b.max_force)
      .add("max_torque_100nnm", b.max_torque)
      .add("max_force_rate_mn_per_s", b.max_force_rate_mn_per_s)
      .add("max_torque_rate_mnm_per_s", b.max_torque_rate_mnm_per_s)
      .add("max_stiffness_mn_per_m", b.max_stiffness_mn_per_m)
      .add("max_damping_mns_per_m", b.max_damping_mns_per_m)
      .add("mass_mg", b.mass_mg)
      .add("damping_uns_per_m", b.damping_uns_per_m)
      .add("friction_10un", b.friction)
      .add("encoder_step_nm", b.encoder_step_nm)
      .add("encoder_step_nrad", b.encoder_step_nrad)
      .add("workspace_radius_um", b.workspace_radius_um)
      .text();
}

template <std::size_t N, typename Record>
void check_example(const std::string& name) {
  CAPTURE(name);
  const std::vector<std::uint8_t> bytes = bytes_in("hex " + name);
  Record record;
  REQUIRE(decode(bytes, record) == CodecVerdict::kOk);
  CHECK(listing_of(record) == fenced("text " + name));
  std::array<std::uint8_t, N> again{};
  encode(record, again);
  CHECK(std::vector<std::uint8_t>(again.begin(), again.end()) == bytes);
}

unsigned u16_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return bytes[at] + 256u * bytes[at + 1];
}

}  // namespace

TEST_SUITE("hal.reference_protocol") {
  TEST_CASE("PROTOCOL.md: each example decodes to the values next to it and back") {
    check_example<kReferenceReportBytes, ReferenceReport>("report");
    check_example<kReferenceShortReportBytes, ReferenceShortReport>("short-report");
    check_example<kReferenceCommandBytes, ReferenceCommand>("command");
    check_example<kReferenceBlockBytes, ReferenceBlock>("block");
  }

  TEST_CASE("PROTOCOL.md: the block of 1.1 is that of 1.0 and what follows it, and back") {
    const std::vector<std::uint8_t> bytes = bytes_in("hex long-block");
    ReferenceLongBlock block;
    REQUIRE(decode(bytes, block) == CodecVerdict::kOk);
    CHECK(block.first == ReferenceBlock{});
    CHECK(Listing()
                  .add("minor", block.minor)
                  .add("displacement", block.is_displacement)
                  .add("latency_us", block.latency_us)
                  .add("largest_gap_um", block.largest_gap_um)
                  .text() +
              "name " + std::string(text_of(block.name)) + "\nserial " +
              std::string(text_of(block.serial)) + "\n" ==
          fenced("text long-block"));
    std::array<std::uint8_t, kReferenceLongBlockBytes> again{};
    encode(block, again);
    CHECK(std::vector<std::uint8_t>(again.begin(), again.end()) == bytes);
  }

  TEST_CASE("PROTOCOL.md: the example block is what the driver assumes unasked") {
    ReferenceBlock block;
    REQUIRE(decode(bytes_in("hex block"), block) == CodecVerdict::kOk);
    CHECK(block == ReferenceBlock{});
    const DeviceCapabilities c = reference_capabilities();
    CHECK(static_cast<double>(c.max_force_n) == doctest::Approx(12.0));
    CHECK(static_cast<double>(c.max_torque_nm) == doctest::Approx(0.3));
    CHECK(static_cast<double>(c.max_force_rate_n_per_s) == doctest::Approx(2000.0));
    CHECK(static_cast<double>(c.max_torque_rate_nm_per_s) == doctest::Approx(40.0));
    CHECK(static_cast<double>(c.mass_kg) == doctest::Approx(0.1));
    CHECK(static_cast<double>(c.damping_ns_per_m) == doctest::Approx(1.0));
    CHECK(static_cast<double>(c.encoder_step_m) == doctest::Approx(1.0e-6));
    CHECK(static_cast<double>(c.encoder_step_rad) == doctest::Approx(1.0e-5));
    CHECK(c.watchdog_ns == 20'000'000);
    CHECK(c.report_period_ns == 1'000'000);
    CHECK(c.sensed_dof == kDofAll);
    CHECK(c.driven_dof == kDofAll);
    CHECK(is_plausible(c));
  }

  TEST_CASE("PROTOCOL.md: identity, interface and endpoints are the driver's") {
    const ReferenceDriver driver;
    const UsbProfile& profile = driver.profile();
    const std::vector<std::uint8_t> device = bytes_in("hex device-descriptor");
    REQUIRE(device.size() == 18);
    CHECK(device[0] == 18);
    CHECK(u16_at(device, 8) == profile.vendor_id);
    CHECK(u16_at(device, 10) == profile.product_id);
    for (const bool full_speed : {false, true}) {
      CAPTURE(full_speed);
      const std::vector<std::uint8_t> all = bytes_in(
          full_speed ? "hex full-speed-configuration-descriptor" : "hex configuration-descriptor");
      REQUIRE(all.size() == 32);
      CHECK(u16_at(all, 2) == all.size());
      CHECK(all[9 + 2] == profile.interface_number);
      CHECK(all[9 + 5] == 0xff);
      CHECK(all[18 + 2] == profile.in_endpoint);
      // Longer than the short report, so that this one ends its transfer.
      CHECK(u16_at(all, 18 + 4) == (full_speed ? 64 : profile.in_bytes));
      CHECK(all[25 + 2] == profile.out_endpoint);
      CHECK(u16_at(all, 25 + 4) == profile.out_bytes);
      for (const std::size_t endpoint : {18u, 25u}) {
        CHECK(all[endpoint] == 7);
        CHECK(all[endpoint + 3] == 3);  // interrupt
        CHECK(all[endpoint + 6] == 1);
      }
    }
    CHECK(kReferenceShortReportBytes < 64);
    CHECK(kReferenceShortGripperBytes < 64);
    CHECK_FALSE(profile.bulk);
  }
}
