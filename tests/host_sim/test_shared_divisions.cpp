// SPDX-License-Identifier: Apache-2.0
// Real parts in two divisions: as the compiler cuts them, and as it cuts them when their faces are
// numbered otherwise; where that makes no difference, cut once more by a plane aslant. Skipped
// where the folder is absent.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "host_sim/lab/stability/division_comparison.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "rt_core/base/scalar.hpp"
#include "tests/support/program_run.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// How the compiler is made to choose another division where it has a choice between equals: its
/// faces and vertices are numbered differently, or fewer strategies are tried.
struct Choice {
  bool reversed = false;  ///< vertices and faces from the last one
  std::size_t first = 0;  ///< eighths of the faces that are moved to the end
  int strategies = tools::DecompositionLimits{}.strategies;
};

std::vector<Choice> choices() {
  std::vector<Choice> result;
  const int all = tools::DecompositionLimits{}.strategies;
  for (const int strategies : {all, 1, 2, 4}) {
    for (const bool reversed : {true, false}) {
      for (std::size_t first = 0; first < 8; ++first)
        result.push_back({reversed, first, strategies});
    }
  }
  return result;
}

void renumber(tools::RawMesh& raw, const Choice& choice) {
  if (choice.reversed) {
    std::ranges::reverse(raw.vertices);
    std::ranges::reverse(raw.vertex_places);
    std::ranges::reverse(raw.faces);
    const auto last = static_cast<std::uint32_t>(raw.vertices.size() - 1);
    for (tools::RawFace& face : raw.faces) {
      for (std::uint32_t& v : face.vertices) v = last - v;
    }
  }
  const auto middle = raw.faces.size() * choice.first / 8;
  std::rotate(raw.faces.begin(), raw.faces.begin() + static_cast<std::ptrdiff_t>(middle),
              raw.faces.end());
}

struct Part {
  tools::Body body;  ///< about `centre`
  Vector centre = Vector::Zero();
};

Part decomposed(const std::string& file, const std::array<double, 3>& scale, const Choice& choice) {
  tools::RawMesh raw = tools::read_mesh(file);
  renumber(raw, choice);
  tools::CleaningOptions options;
  options.scale_to_m = scale;
  tools::FlatBody flat = tools::flatten(tools::clean_surface(raw, options), {});
  tools::DecompositionLimits limits;
  limits.strategies = choice.strategies;
  const tools::Decomposition pieces = tools::decompose(flat, raw.file, limits);
  const std::array<double, 3> centre = std::exchange(flat.world.centre_m, {0, 0, 0});
  return {tools::to_body(flat, pieces, "part"), {centre[0], centre[1], centre[2]}};
}

std::array<double, 3> scale_of(const nlohmann::json& scale) {
  if (scale.is_number()) {
    const double s = scale.get<double>();
    return {s, s, s};
  }
  return scale.get<std::array<double, 3>>();
}

/// Whether the middles of the pieces' vertices are the same.
bool same_pieces(const tools::Body& a, const tools::Body& b) {
  const auto middle = [](const tools::ConvexPiece& piece) {
    Vector sum = Vector::Zero();
    for (const auto& v : piece.vertices) sum += Vector(v[0], v[1], v[2]);
    return Vector(sum / static_cast<double>(piece.vertices.size()));
  };
  return a.pieces.size() == b.pieces.size() &&
         std::ranges::all_of(a.pieces, [&](const tools::ConvexPiece& x) {
           return std::ranges::any_of(b.pieces, [&](const tools::ConvexPiece& y) {
             return (middle(x) - middle(y)).norm() < 1e-7;
           });
         });
}

struct DividedTask {
  Part moving;
  Part fixed, other;  ///< the static part twice
  nlohmann::json json;
  std::string folder;
};

/// The task's parts; nothing, with a message, when it is not there.
std::optional<DividedTask> divided(const std::string& name) {
  const std::string folder = std::string(HAPTIC_SHARED_DIR) + "/data/" + name;
  if (!std::filesystem::exists(folder + "/task.json")) {
    MESSAGE("skipped: no folder ", folder);
    return std::nullopt;
  }
  DividedTask task;
  task.folder = folder;
  task.json = nlohmann::json::parse(sim::test::text_of_file(folder + "/task.json"));
  const auto part = [&](const char* role, const Choice& choice) {
    const nlohmann::json& p = task.json.at(role);
    return decomposed(folder + "/" + p.at("file").get<std::string>(), scale_of(p.at("scale_to_m")),
                      choice);
  };
  task.moving = part("moving", {});
  task.fixed = part("static", {});
  for (const Choice& choice : choices()) {
    task.other = part("static", choice);
    if (!same_pieces(task.fixed.body, task.other.body)) return task;
  }
  // One plane through the part's own middle.
  const auto& c = task.fixed.body.centre_of_volume_m;
  CutPlane plane;
  plane.normal = Vector(0.48, 0.6, 0.64).normalized();
  plane.offset_m = plane.normal.dot(Vector(c[0], c[1], c[2]));
  task.other = {cut_body(task.fixed.body, plane), task.fixed.centre};
  return task;
}

/// Pose of the moving body about its centre in the frame of the static body about its own.
PathPose centred(const DividedTask& task, const Vector& p, const Rotation& q) {
  return {p + q * task.moving.centre - task.fixed.centre, q};
}

PathPose pose_in(const DividedTask& task, const char* key) {
  const auto& pose = task.json.at(key);
  const auto p = pose.at("position_m").get<std::array<double, 3>>();
  const auto q = pose.at("quaternion_wxyz").get<std::array<double, 4>>();
  return centred(task, {p[0], p[1], p[2]}, Rotation(q[0], q[1], q[2], q[3]).normalized());
}

/// The static part in both divisions, on one path.
DivisionCase case_of(const DividedTask& task, DivisionContact contact, TimedPath path) {
  DivisionCase result;
  result.name = task.json.at("name").get<std::string>();
  result.title = task.json.at("title").get<std::string>();
  result.contact = contact;
  REQUIRE((task.other.centre - task.fixed.centre).norm() < 1e-15);
  CHECK(task.other.body.volume_m3 == doctest::Approx(task.fixed.body.volume_m3).epsilon(1e-9));
  CHECK_FALSE(same_pieces(task.fixed.body, task.other.body));
  result.divisions = {{"as it is", task.moving.body, task.fixed.body},
                      {"cut otherwise", task.moving.body, task.other.body}};
  result.path = std::move(path);
  // Stiff enough in rotation that a contact at the part's side hardly gives way through turning,
  // and a peg led upright is not left hanging on the rim.
  const double length_m = farthest_m(task.moving.body);
  result.scene.k_r_nm_per_rad = 2 * result.scene.k_t_n_per_m * length_m * length_m;
  return result;
}

void compare(const DivisionCase& contact) {
  CAPTURE(contact.title);
  const DivisionComparison found = compare_divisions(contact);
  const DivisionDifference& d = found.differences.front();
  MESSAGE(contact.name, ", ", contact.divisions[0].fixed.pieces.size(), " and ",
          contact.divisions[1].fixed.pieces.size(), " pieces, ", found.ticks, " ticks: median ",
          d.quantile_n(0.5), " p99 ", d.quantile_n(0.99), " largest ", d.quantile_n(1),
          " N, k_t tol ", found.tolerance_n, ", over 0.01 N: ", 100 * d.share_over(0.01),
          " %; mean force ", found.proxy_mean_n, " N, paper ", found.paper_mean_n, " N over ",
          found.contact_ticks, " of ", found.pushed_ticks);
  CHECK(found.contact_ticks > found.ticks / 10);
  CHECK(d.worst_gap_m >= -2 * found.tolerance_n / contact.scene.k_t_n_per_m);
  CHECK(agrees(d, contact.contact, found.tolerance_n));
  if (contact.other_strength.empty()) CHECK(found.same_strength());
}

}  // namespace

TEST_SUITE("host_sim.shared_divisions") {
  TEST_CASE("pressed aside where it is assembled: faces in every tick") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    for (const std::string name : {"square_peg", "cube_in_cup", "rect_peg_16mm", "octagon_peg",
                                   "ell_fixture", "corner_bracket", "plug_socket"}) {
      const auto task = divided(name);
      if (!task) continue;
      const PathPose end = pose_in(*task, "assembled_pose"), start = pose_in(*task, "start_pose");
      const Vector in = (end.p - start.p).normalized();
      const Vector aside = in.unitOrthogonal(), across = in.cross(aside);
      TimedPath path;
      // Backed out by 3 mm, then deeper by half of it and 2 mm beyond the walls, round about.
      const double most_m = 0.002 + task->json.at("clearance").at("per_side_m").get<double>();
      path.pose = [=](double t) -> PathPose {
        const double grown = std::min(t, 1.0);
        const double push = grown * most_m;
        return {end.p - 0.003 * (1 - 0.5 * grown) * in + push * std::cos(2 * t) * aside +
                    push * std::sin(2 * t) * across,
                end.q};
      };
      path.duration_s = 4;
      path.retreat_w = -0.002 * in;
      DivisionCase contact = case_of(*task, DivisionContact::kFace, path);
      if (name == "octagon_peg")
        contact.other_strength = "walls less than a right angle apart, which the paper's law adds";
      compare(contact);
    }
  }

  TEST_CASE("their own motions: differences by share") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    for (const std::string name : {"square_peg", "cube_in_cup", "rect_peg_16mm"}) {
      const auto task = divided(name);
      if (!task) continue;
      const auto motion = read_motion_csv(task->folder + "/trajectory.csv");
      std::vector<PathPose> poses;
      for (const MotionSample& s : motion) {
        poses.push_back(centred(*task, Vector(s.p[0], s.p[1], s.p[2]),
                                Rotation(s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3])));
      }
      TimedPath path;
      path.pose = [&](double t) {
        const auto k = static_cast<std::size_t>(std::lround(t / kTracePeriod_s));
        return poses[std::min(k, poses.size() - 1)];
      };
      path.duration_s = kTracePeriod_s * static_cast<double>(poses.size() - 1);
      path.approach_s = 0.001;
      path.retreat_w = Vector::Zero();
      DivisionCase contact = case_of(*task, DivisionContact::kMixed, path);
      if (name == "square_peg")
        contact.other_strength = "on the rim it stands on two pieces, which the paper's law adds";
      compare(contact);
    }
  }
}
