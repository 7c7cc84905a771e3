// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/flight.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

constexpr double kFlightTick_s = 1e-3;
constexpr double kRadii_m[] = {1e-5, 1e-4, 1e-3, 1e-2, 5e-2, 1.0, 10.0};
constexpr double kSpeeds_m_per_s[] = {0.01, 0.1, 0.5, 2.0};
constexpr double kTurns_rad_per_s[] = {0.0, 1.0, 10.0};
/// Distance from the wall, of r_A.
constexpr double kDistances[] = {0.01, 1.0};

/// A box of three different sides whose farthest vertex is at `radius_m`.
Solid flying_box(double radius_m) {
  const Vector half = radius_m * Vector(0.7, 0.6, std::sqrt(1 - 0.49 - 0.36)).normalized();
  return centred_box("box", half[0], half[1], half[2]);
}

/// The obstacle fills z < 0, as wide as the way needs.
FuzzScene scene_of_flight(const FlightRow& row, double way_m) {
  FuzzScene scene;
  scene.name = to_text(row.kind);
  scene.part = flying_box(row.radius_m);
  const double half = way_m + 4 * row.radius_m;
  const double thick = std::max(row.radius_m, 1e-3);
  scene.pieces = {box_solid("wall", {-half, -half, -thick}, {half, half, 0})};
  scene.device = row.device;
  scene.start = Vector(0, 0, row.kind == FlightKind::kFree ? half : row.radius_m + row.distance_m);
  return scene;
}

void fly(FlightRow& row, const FlightSize& size, std::uint64_t seed) {
  const double lasts_s = size.ticks * kFlightTick_s;
  const double way_m = 2 * row.speed_m_per_s * lasts_s + 0.01;
  const FuzzScene scene = scene_of_flight(row, way_m);
  const std::vector<std::byte> blob = compiled(scene, 0);
  CoreSession session(blob, scene.name);
  ProxyJudge judge(scene, session.view());
  if (size.fault) damage(session, *size.fault);
  const CouplingParameters& coupling = session.view().parameters().coupling;
  const Wide k_t = widen(coupling.k_t_n_per_m);
  const Wide length_m = std::sqrt(widen(coupling.k_r_nm_per_rad) / k_t);
  const bool on_table = row.kind == FlightKind::kOnTable;
  if (on_table) row.allowed_n = 2 * k_t * judge.tolerance_m();
  Seeded random(seed);
  const double heading = random.uniform(0, 6.28);
  Vector along(std::cos(heading), std::sin(heading), 0);
  Vector axis = Vector::UnitZ();
  Rotation turn = Rotation::Identity();
  double start_z = scene.start[2];
  if (row.kind == FlightKind::kFree) {
    along = random.direction();
    axis = random.direction();
    turn = random.rotation();
    start_z += way_m;
  } else if (row.kind == FlightKind::kAlongWall) {
    axis = random.direction();
    turn = random.rotation();
  } else {
    start_z = 1.5 * row.radius_m;  // lowered onto the table first
  }
  const double half_z = scene.part.vertices[7][2];
  const double press = std::min(1e-3, row.radius_m);
  const double low_z = half_z - press;
  const auto lower =
      static_cast<std::uint32_t>(std::ceil((start_z - low_z) / (0.1 * kFlightTick_s)));
  const std::uint32_t lowering = on_table ? std::min(lower, 2000u) : 0;
  const std::uint32_t settling = on_table ? 300 : 0;
  const Wide share = judge.radius_m() / 0.05L, allowed = judge.allowed_depth_m();
  StepInput input;
  StepResult result;
  for (std::uint32_t t = 0; t < lowering + settling + size.ticks; ++t) {
    const std::uint32_t flown = t < lowering + settling ? 0 : t - lowering - settling;
    const double s = flown * kFlightTick_s;
    Vector p = row.speed_m_per_s * s * along;
    p[2] += start_z;
    if (on_table) {
      p[2] = low_z +
             (start_z - low_z) * (t < lowering ? 1.0 - static_cast<double>(t) / lowering : 0.0);
    }
    const Rotation q = Rotation(Eigen::AngleAxisd(row.turn_rad_per_s * s, axis)) * turn;
    input.pose_wa = pose_at(p, q);
    ++input.sequence;
    if (size.fault == ProxyFault::kRestless && t % 64 == 63) {
      displace(session, result, Vec3(static_cast<Real>(0.1 * row.radius_m), 0, 0));
    }
    result = session.core().step(input);
    const WidePose after = wide_pose(result.proxy_pose_wa);
    const Wide end = judge.end_gap_m(after, -allowed);
    row.worst_end_m = std::min(row.worst_end_m, end / share);
    row.deep = row.deep || end < -allowed;
    if (t < lowering + settling) continue;
    ++row.ticks;
    const Wrench& w = result.wrench_w;
    Wide fx = widen(w.force_w[0]), fy = widen(w.force_w[1]), tz = widen(w.torque_w[2]);
    Wide force = std::hypot(fx, fy);
    Wide torque = std::abs(tz);
    if (!on_table) {
      force = std::hypot(force, widen(w.force_w[2]));
      torque = std::hypot(torque, std::hypot(widen(w.torque_w[0]), widen(w.torque_w[1])));
    }
    const Wide both = force + torque / length_m;
    row.largest_force_n = std::max(row.largest_force_n, both);
    if (both > row.allowed_n || std::isnan(both)) {
      if (row.forced++ == 0) {
        row.failure =
            failure_text("tick " + std::to_string(flown) + ", part", result.proxy_pose_wa,
                         failure_text("goal", result.goal_pose_wa, number_text(both) + " N"));
      }
    }
  }
}

ReportTable flight_table(const FlightResult& result) {
  ReportTable table(
      "flight,radius_m,speed_m_per_s,turn_rad_per_s,distance_m,device,ticks,ticks_with_force,"
      "largest_force_n,allowed_n,worst_end_um,passed");
  for (const FlightRow& r : result.rows) {
    table.add({to_text(r.kind), shown_as("%g", r.radius_m), shown_as("%g", r.speed_m_per_s),
               shown_as("%g", r.turn_rad_per_s), shown_as("%g", r.distance_m), r.device ? 1 : 0,
               r.ticks, r.forced, number_text(r.largest_force_n), number_text(r.allowed_n),
               number_text(r.worst_end_m * 1e6L), yes_or_no(!r.failed())});
  }
  return table;
}

}  // namespace

const char* to_text(FlightKind kind) {
  switch (kind) {
    case FlightKind::kFree:
      return "free";
    case FlightKind::kAlongWall:
      return "along a wall";
    case FlightKind::kOnTable:
      break;
  }
  return "on a table";
}

std::uint64_t FlightResult::failed() const {
  return static_cast<std::uint64_t>(std::ranges::count_if(rows, &FlightRow::failed));
}

FlightResult run_flight(const FlightSize& size, const RunOptions& options) {
  FlightResult result{size, {}};
  for (const bool device : {false, true}) {
    for (const double radius : kRadii_m) {
      for (const double speed : kSpeeds_m_per_s) {
        for (const double turn : kTurns_rad_per_s) {
          FlightRow row;
          row.radius_m = radius;
          row.speed_m_per_s = speed;
          row.turn_rad_per_s = turn;
          row.device = device;
          result.rows.push_back(row);
          row.kind = FlightKind::kAlongWall;
          for (const double distance : kDistances) {
            row.distance_m = distance * radius;
            result.rows.push_back(row);
          }
          row.kind = FlightKind::kOnTable;
          row.distance_m = 0;
          result.rows.push_back(row);
        }
      }
    }
  }
  run_shards(
      result.rows.size(), options, "flight", [] { return 0; },
      [&](int, std::size_t k) { fly(result.rows[k], size, seed_of(size.seed, k)); });
  return result;
}

std::string flight_page(const FlightResult& result) {
  std::string text = "# Free flight\n\n";
  text += std::to_string(result.rows.size()) + " flights, seed " +
          std::to_string(result.size.seed) + ", " + std::to_string(result.failed()) +
          " of them failed. Without contact the wrench is zero in every tick; on a table without "
          "friction the drag (force along it, and torque about its normal over the length of the "
          "coupling) stays below what twice the tolerance makes of the spring.\n\n";
  text += flight_table(result).markdown();
  std::size_t listed = 0;
  for (const FlightRow& r : result.rows) {
    if (r.failure.empty() || listed == 20) continue;
    if (listed++ == 0) text += "\n## Failures\n\n";
    text += "- " + std::string(to_text(r.kind)) + ", r_A " + number_text(widen(r.radius_m)) +
            " m, " + number_text(widen(r.speed_m_per_s)) + " m/s, " + r.failure + "\n";
  }
  return text;
}

CampaignEnd flight_end(const FlightResult& result) {
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["passed"] = result.failed() == 0;
  j["failed"] = result.failed();
  j["flights"] = flight_table(result).json();
  const std::string page = flight_page(result);
  return {page, campaign_files("flight", flight_table(result).csv(), j, page),
          result.failed() == 0};
}

}  // namespace haptic::sim
