// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/surface_fuzz/surface_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/quantile.hpp"
#include "rt_core/proxy/proxy_law.hpp"

namespace haptic::sim {
namespace {

constexpr Real kHeld_n = 1e-3_r;
constexpr double kFaulty_m = 1e-3;
constexpr double kTop_m = 0.01;  ///< of the blocks with a flat top
/// A force this far from the vertical [N] comes from more than the flat top.
constexpr double kUpright_n = 1e6 * static_cast<double>(std::numeric_limits<Real>::epsilon());

struct ComparedScene {
  SurfaceScene scene;
  std::vector<Vector> stations;  ///< of the device, one after another
  bool flat_top = false;         ///< at kTop_m
};

struct Gait {
  double speed_m_per_s;
  bool turning;
};
constexpr Gait kGaits[] = {{0.1, false}, {0.1, true}, {0.3, true}};

/// A block whose top is one rectangle on its left and four strips on its right: corners of the
/// strips lie within the edge of the rectangle.
FuzzMesh block_with_junctions(const Vector& half) {
  FuzzMesh mesh = box_mesh_of(half);
  mesh.name = "flat top with T-junctions";
  // The two triangles of the top come first and third: corners 4 to 7, counter-clockwise.
  std::erase_if(mesh.triangles, [](const auto& t) { return t[0] >= 4 && t[1] >= 4 && t[2] >= 4; });
  constexpr std::uint32_t kStrips = 4;
  const auto add = [&](double x, double y) {
    mesh.vertices.emplace_back(x, y, half[2]);
    return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  };
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  std::uint32_t middle = add(0, -half[1]), right = 5;
  const std::uint32_t first = middle;
  for (std::uint32_t k = 1; k <= kStrips; ++k) {
    const double y = half[1] * (2.0 * k / kStrips - 1);
    const std::uint32_t next_middle = add(0, y), next_right = k == kStrips ? 6 : add(half[0], y);
    quad(middle, right, next_right, next_middle);
    middle = next_middle;
    right = next_right;
  }
  quad(4, first, middle, 7);
  return mesh;
}

std::vector<ComparedScene> compared_scenes() {
  const FuzzMesh box = box_mesh_of({0.010, 0.008, 0.006});
  std::vector<ComparedScene> scenes(4);
  const auto set = [&](std::size_t k, FuzzMesh around, const char* name) {
    scenes[k].scene.part = box;
    scenes[k].scene.around = std::move(around);
    scenes[k].scene.name = name;
  };
  set(0, block_with_junctions({0.04, 0.03, kTop_m}), "flat top with T-junctions");
  scenes[0].stations = {{-0.02, -0.01, 0.02},   {-0.02, -0.01, 0.013}, {0.02, 0.005, 0.013},
                        {0.015, -0.012, 0.013}, {-0.02, 0.012, 0.013}, {-0.02, 0.012, 0.02}};
  set(1, box_mesh_of({0.04, 0.03, kTop_m}), "convex edge of a block");
  scenes[1].stations = {{0.02, 0.003, 0.02},    {0.02, 0.003, 0.013},  {0.0475, -0.004, 0.0135},
                        {0.0475, 0.002, -0.01}, {0.047, 0.005, 0.004}, {0.03, -0.002, 0.013},
                        {0.02, 0, 0.02}};
  scenes[0].flat_top = scenes[1].flat_top = true;
  set(2, cylinder_mesh(32, 0.02, 0.02), "cylinder of 32 sides");
  for (int k = 0; k <= 48; ++k) {
    const double angle = std::numbers::pi * k / 48;
    scenes[2].stations.emplace_back(0.027 * std::cos(angle), 0.025 * std::sin(angle),
                                    0.001 * k / 48);
  }
  scenes[2].stations.insert(scenes[2].stations.begin(), Vector(0.035, 0, 0));
  // Inner faces at x = y = -0.018.
  set(3, ell_mesh(0.06, 0.012, 0.02), "floor and wall");
  scenes[3].stations = {{0.01, 0.01, 0},         {0.005, -0.012, 0},       {-0.011, -0.0125, 0.003},
                        {-0.0105, 0.005, 0.003}, {-0.012, -0.013, -0.004}, {0.008, -0.0115, 0},
                        {0.008, 0.01, 0}};
  return scenes;
}

/// Poses of the device, tick by tick.
std::vector<Pose> walked(const std::vector<Vector>& stations, const Gait& gait) {
  std::vector<Pose> poses;
  const double step_m = gait.speed_m_per_s * kMotionPeriod_s;
  Vector p = stations.front();
  for (std::size_t k = 1; k < stations.size();) {
    const Vector way = stations[k] - p;
    const double distance = way.norm();
    if (distance <= step_m) {
      p = stations[k++];
    } else {
      p += way * (step_m / distance);
    }
    const double t = static_cast<double>(poses.size()) * kMotionPeriod_s;
    const auto swing = [&](double angle_rad, double hz) {
      return gait.turning ? angle_rad * std::sin(2 * std::numbers::pi * hz * t) : 0.0;
    };
    const Rotation yaw(Eigen::AngleAxisd(swing(0.3, 0.9), Vector::UnitZ()));
    const Rotation roll(Eigen::AngleAxisd(swing(0.2, 0.6), Vector::UnitX()));
    poses.push_back(pose_at(p, yaw * roll));
  }
  return poses;
}

bool upright(const Wrench& wrench_w) {
  return wrench_w.force_w.z() > kHeld_n &&
         static_cast<double>(wrench_w.force_w.head<2>().norm()) < kUpright_n;
}

/// What the spring to a device at height `device_m` gives to the part, turned by `q_wa` and at rest
/// with its lowest corner on the flat top or, in a scene with facets, the skin above it [N].
double force_on_top_n(const FuzzMesh& part, const SceneView& view, const Rotation& q_wa,
                      double device_m) {
  double lowest_m = 0;
  for (const Vector& corner : part.vertices) lowest_m = std::min(lowest_m, (q_wa * corner).z());
  const double skin_m = view.has_facets() ? static_cast<double>(proxy_scale(view).skin_m) : 0;
  return view.parameters().coupling.k_t_n_per_m * (kTop_m + skin_m - lowest_m - device_m);
}

SurfaceComparisonRow compared(const ComparedScene& scene, const Gait& gait,
                              const CompiledSurface& solid, const CompiledSurface& other,
                              bool faulty) {
  CoreSession one(solid.blob, solid.name, GoalContact::kLeftOut);
  CoreSession two(other.blob, other.name, GoalContact::kLeftOut);
  SurfaceComparisonRow row;
  row.scene = scene.scene.name;
  row.speed_m_per_s = gait.speed_m_per_s;
  row.turning = gait.turning;
  std::vector<double> differences;
  StepInput input;
  for (const Pose& pose : walked(scene.stations, gait)) {
    ++input.sequence;
    input.pose_wa = pose;
    const StepResult a = one.core().step(input);
    if (faulty) input.pose_wa.p_wa.z() += static_cast<Real>(kFaulty_m);
    const StepResult b = two.core().step(input);
    ++row.ticks;
    const Real force_a = a.wrench_w.force_w.norm(), force_b = b.wrench_w.force_w.norm();
    row.largest_force_n = std::max(row.largest_force_n, static_cast<double>(force_a));
    if (force_a < kHeld_n && force_b < kHeld_n) continue;
    ++row.held;
    differences.push_back(static_cast<double>((a.wrench_w.force_w - b.wrench_w.force_w).norm()));
    if (!scene.flat_top || !upright(a.wrench_w) || !upright(b.wrench_w)) continue;
    ++row.on_top;
    const auto off_n = [&](const CoreSession& session, const StepResult& result) {
      const double exact_n =
          force_on_top_n(scene.scene.part, session.view(), result.proxy_pose_wa.q_wa.cast<double>(),
                         static_cast<double>(pose.p_wa.z()));
      return std::abs(exact_n - static_cast<double>(result.wrench_w.force_w.z()));
    };
    const double solid_off_n = off_n(one, a);
    row.solid_off_n = std::max(row.solid_off_n, solid_off_n);
    row.farther_off_n = std::max(row.farther_off_n, off_n(two, b) - solid_off_n);
  }
  if (differences.empty()) return row;
  std::ranges::sort(differences);
  row.median_n = quantile(differences, 0.5);
  row.p99_n = quantile(differences, 0.99);
  row.largest_n = differences.back();
  return row;
}

ReportTable table_of(const SurfaceComparison& comparison) {
  ReportTable table(
      "scene,speed m/s,yaw and roll,ticks,held,largest force N,median N,p99 N,"
      "max N,on the top,solid off N,other farther off N");
  for (const SurfaceComparisonRow& r : comparison.rows) {
    table.add({quoted(r.scene), shown_as("%g", r.speed_m_per_s), yes_or_no(r.turning), r.ticks,
               r.held, shown_as("%.3f", r.largest_force_n), shown_as("%.1e", r.median_n),
               shown_as("%.1e", r.p99_n), shown_as("%.1e", r.largest_n), r.on_top,
               shown_as("%.1e", r.solid_off_n), shown_as("%.1e", r.farther_off_n)});
  }
  return table;
}

}  // namespace

bool SurfaceComparison::failed() const {
  return std::ranges::any_of(rows, [](const SurfaceComparisonRow& row) { return row.failed(); });
}

SurfaceComparison compare_surfaces(PartKind as, bool faulty, const RunOptions& options) {
  const std::vector<ComparedScene> scenes = compared_scenes();
  std::vector<CompiledSurface> solids(scenes.size()), others(scenes.size());
  run_shards(
      scenes.size(), options, "scenes", [] { return 0; },
      [&](int, std::size_t k) {
        SurfaceScene scene = scenes[k].scene;
        scene.part_as = scene.around_as = as;
        others[k] = compiled_surface(scene, 0, kDefaultProxyPasses);
        scene.part_as = scene.around_as = PartKind::kSolid;
        scene.has_bystander = as == PartKind::kSurface;
        solids[k] = compiled_surface(scene, 0, kDefaultProxyPasses);
      });
  SurfaceComparison comparison;
  comparison.as = as;
  comparison.rows.resize(scenes.size() * std::size(kGaits));
  run_shards(
      comparison.rows.size(), options, "comparison", [] { return 0; },
      [&](int, std::size_t k) {
        const std::size_t at = k / std::size(kGaits);
        comparison.rows[k] =
            compared(scenes[at], kGaits[k % std::size(kGaits)], solids[at], others[at], faulty);
      });
  return comparison;
}

std::string surface_comparison_page(const SurfaceComparison& comparison) {
  std::string text = "# Parts as solids and as surfaces\n\n";
  text +=
      std::string("Same meshes, same motions; the second time the parts are compiled as ") +
      to_text(comparison.as) + ". Differences of the force over the ticks with a force; at most " +
      number_text(widen(kMostApart_n)) +
      " N pass. Scenes with facets hold all parts apart by a skin, "
      "so a facet out of reach stands beside the solids. Where a flat top alone holds the part, "
      "the force is known: k (top + skin + height of the part - device).\n\n";
  return text + table_of(comparison).markdown();
}

CampaignEnd surface_comparison_end(const SurfaceComparison& comparison) {
  nlohmann::ordered_json j;
  j["as"] = to_text(comparison.as);
  j["passed"] = !comparison.failed();
  j["rows"] = table_of(comparison).json();
  const std::string page = surface_comparison_page(comparison);
  return {page, campaign_files("surface_compare", table_of(comparison).csv(), j, page),
          !comparison.failed()};
}

}  // namespace haptic::sim
