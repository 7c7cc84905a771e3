// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts of 10 um to 10 m moved at speeds of a hand, large or small: no force where nothing is
/// near nor along a wall, and no drag on a table without friction.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/proxy_fuzz/proxy_fault.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

enum class FlightKind : std::uint8_t { kFree, kAlongWall, kOnTable };
[[nodiscard]] const char* to_text(FlightKind kind);

struct FlightSize {
  std::uint32_t ticks = 400;  ///< of every flight
  std::uint64_t seed = 1;
  std::optional<ProxyFault> fault;
};

struct FlightRow {
  FlightKind kind = FlightKind::kFree;
  double radius_m = 0, speed_m_per_s = 0, turn_rad_per_s = 0, distance_m = 0;
  bool device = false;
  std::uint64_t ticks = 0, forced = 0;  ///< forced: ticks with force, or with drag beyond its bound
  Wide largest_force_n = 0;  ///< torque over the length of the coupling; on a table: drag
  Wide allowed_n = 0;        ///< 0 but on the table: what the tolerance makes of it
  Wide worst_end_m = 0;      ///< scaled to a part of 50 mm
  bool deep = false;
  std::string failure;

  [[nodiscard]] bool failed() const { return forced > 0 || deep; }
};

struct FlightResult {
  FlightSize size;
  std::vector<FlightRow> rows;
  [[nodiscard]] std::uint64_t failed() const;
};

[[nodiscard]] FlightResult run_flight(const FlightSize& size, const RunOptions& options);

[[nodiscard]] std::string flight_page(const FlightResult& result);
/// With flight.csv, .json and .md.
[[nodiscard]] CampaignEnd flight_end(const FlightResult& result);

}  // namespace haptic::sim
