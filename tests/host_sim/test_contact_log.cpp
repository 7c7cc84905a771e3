// SPDX-License-Identifier: Apache-2.0
// Contacts of replays of the project's own scenes, against the mesh files that they were compiled
// from: every number in an id must name the mesh feature that really touches.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/session/contact_log.hpp"
#include "host_sim/session/motion_script.hpp"
#include "host_sim/session/replay.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

using Vector3 = Eigen::Vector3d;
using Turn = Eigen::Quaterniond;

Turn turn_of(const std::array<double, 4>& q) { return Turn(q[0], q[1], q[2], q[3]).normalized(); }

/// A mesh file where it stands in W.
struct PlacedMesh {
  explicit PlacedMesh(const tools::ScenePart& part)
      : mesh(tools::read_mesh(part.path)),
        scale(part.scale_to_m[0], part.scale_to_m[1], part.scale_to_m[2]),
        position(part.position_m[0], part.position_m[1], part.position_m[2]),
        turn(turn_of(part.quaternion_wxyz)) {}
  [[nodiscard]] Vector3 vertex(std::int32_t v) const {
    const tools::Point3& p = mesh.vertices[static_cast<std::size_t>(v)];
    return position + turn * scale.cwiseProduct(Vector3(p[0], p[1], p[2]));
  }
  /// Outward unit normal of a face and its offset, by the sum over its corners.
  [[nodiscard]] std::pair<Vector3, double> plane(std::int32_t f) const {
    const auto& loop = mesh.faces[static_cast<std::size_t>(f)].vertices;
    const Vector3 first = vertex(static_cast<std::int32_t>(loop[0]));
    Vector3 normal = Vector3::Zero();
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      normal += (vertex(static_cast<std::int32_t>(loop[k])) - first)
                    .cross(vertex(static_cast<std::int32_t>(loop[k + 1])) - first);
    }
    normal.normalize();
    return {normal, normal.dot(first)};
  }

  tools::RawMesh mesh;
  Vector3 scale, position;
  Turn turn;
};

/// Distance of p, a point of the plane of H, from H.
double outside(const std::vector<Vector3>& corners, const Vector3& n, const Vector3& p) {
  double distance = 1e9;
  bool inside = corners.size() > 2;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector3& from = corners[k];
    const Vector3 side = corners[(k + 1) % corners.size()] - from;
    const double length2 = side.squaredNorm();
    const double s = length2 > 0 ? std::clamp(side.dot(p - from) / length2, 0.0, 1.0) : 0.0;
    distance = std::min(distance, (p - from - s * side).norm());
    inside = inside && n.cross(side).dot(p - from) >= 0;
  }
  return inside ? 0.0 : distance;
}

struct Tally {
  int faces = 0, edges = 0, cut = 0, aside = 0, wrong = 0, polygons = 0;
  void add(const Tally& other) {
    faces += other.faces;
    edges += other.edges;
    cut += other.cut;
    aside += other.aside;
    wrong += other.wrong;
  }
};

/// The contact of one pair against the meshes: a vertex that touches a face lies on it when it is
/// lifted by its depth, and then in H; an edge passes a corner of H at its own height.
class MeshCheck {
 public:
  MeshCheck(const PlacedMesh& a, const PlacedMesh& b, const ContactGeometry& contact,
            const Vector3& x0_w, double epsilon_m)
      : a_(a), b_(b), n_(contact.normal_w.cast<double>()), epsilon_m_(epsilon_m) {
    for (const Vec3& corner : contact.polygon_w) corners_.push_back(x0_w + corner.cast<double>());
    offset_ = n_.dot(contact.point_w.cast<double>());
  }

  void check(const ContactId& id, double depth_m, Tally& tally) const {
    if (id.type == ContactType::kC) {
      check_edge(a_, id.of_a, depth_m, tally);
      check_edge(b_, id.of_b, 0, tally);
      return;
    }
    const bool a_face = id.type == ContactType::kA;
    const MeshFeature& vertex = a_face ? id.of_b : id.of_a;
    const MeshFeature& face = a_face ? id.of_a : id.of_b;
    if (vertex.source[0] == kMadeByCut || face.source[0] == kMadeByCut) {
      ++tally.cut;
      return;
    }
    const auto [normal, offset] = (a_face ? a_ : b_).plane(face.source[0]);
    if ((normal - (a_face ? -n_ : n_)).norm() > kOtherPlane_rad) {
      ++tally.aside;
      return;
    }
    ++tally.faces;
    const double slack = 3 * epsilon_m_ + kRounding_m;
    const Vector3 p = (a_face ? b_ : a_).vertex(vertex.source[0]);
    tally.wrong += std::abs(normal.dot(p) - offset + depth_m) > slack ? 1 : 0;
    const Vector3 in_plane = p - (n_.dot(p) - offset_) * n_;
    tally.wrong += outside(corners_, n_, in_plane) > slack ? 1 : 0;
  }

 private:
  /// An edge lies along the plane, A's under it by the depth and B's in it, where it passes H.
  void check_edge(const PlacedMesh& mesh, const MeshFeature& edge, double depth_m,
                  Tally& tally) const {
    if (edge.source[0] == kMadeByCut) {
      ++tally.cut;
      return;
    }
    const Vector3 from = mesh.vertex(edge.source[0]);
    const Vector3 along = mesh.vertex(edge.source[1]) - from;
    const double slope = along.normalized().dot(n_);
    if (std::abs(slope) > kOtherPlane_rad) {
      ++tally.aside;
      return;
    }
    ++tally.edges;
    double distance = 1e9, height = 0;
    for (const Vector3& corner : corners_) {
      const Vector3 lifted = corner - depth_m * n_;
      const double s = std::clamp(along.dot(lifted - from) / along.squaredNorm(), 0.0, 1.0);
      const Vector3 way = lifted - from - s * along;
      const double in_plane = (way - n_.dot(way) * n_).norm();
      if (in_plane < distance) {
        distance = in_plane;
        height = n_.dot(way);
      }
    }
    const double slack = 3 * epsilon_m_ + kRounding_m;
    tally.wrong += distance > slack || std::abs(height) > slack ? 1 : 0;
  }

  /// The label waits out tremor, so that a contact of one plane may hold a node of another.
  static constexpr double kOtherPlane_rad = 0.06;
  static constexpr double kRounding_m = sizeof(Real) == sizeof(float) ? 1e-6 : 1e-9;
  const PlacedMesh& a_;
  const PlacedMesh& b_;
  Vector3 n_;
  double epsilon_m_;
  double offset_ = 0;
  std::vector<Vector3> corners_;
};

Tally run(const std::string& name, bool shuffled) {
  const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / name;
  const tools::CompiledScene scene =
      tools::compile_scene(tools::read_scene_file(folder / "scene.toml"), {});
  CoreSession session(scene.bytes, name);
  PlacedMesh a(scene.scene.moving);
  if (shuffled)
    std::rotate(a.mesh.vertices.begin(), a.mesh.vertices.begin() + 1, a.mesh.vertices.end());
  std::vector<PlacedMesh> statics;
  for (const tools::ScenePart& part : scene.scene.statics) statics.emplace_back(part);
  const std::vector<MotionSample> motion =
      make_motion(read_motion_script((folder / "motion.toml").string()));
  const std::uint32_t room = session.view().header().capacity.largest_near;
  std::vector<Vec3> corners(room);
  std::vector<ContactId> ids(room);
  ContactGeometry contact;
  contact.polygon_w = BoundedList<Vec3>(corners);
  contact.ids = BoundedList<ContactId>(ids);
  Tally tally;
  for (std::size_t t = 0; t < motion.size(); ++t) {
    const StepInput input = input_of(motion[t], t);
    const StepResult result = session.core().step(input);
    a.position = result.proxy_pose_wa.p_wa.cast<double>();  // where the part is felt
    a.turn = result.proxy_pose_wa.q_wa.cast<double>().normalized();
    const double(&grip)[3] = session.view().bodies()[0].reference_m;
    const Vector3 x0_w = a.position + a.turn * Vector3(grip[0], grip[1], grip[2]);
    for (std::uint32_t pair = 0; pair < session.core().pair_count(); ++pair) {
      session.core().contact_geometry(pair, contact);
      if (contact.ids.empty() || contact.situation == ContactSituation::kSeveralPlanes) continue;
      CHECK_FALSE(contact.cut);
      tally.polygons += contact.polygon_w.size() > 2 ? 1 : 0;
      const MeshCheck check(a, statics[contact.body_b - 1], contact, x0_w,
                            session.view().parameters().epsilon_m);
      Tally found;
      for (const ContactId& id : contact.ids)
        check.check(id, -static_cast<double>(contact.d_near_m), found);
      if (found.aside > 0) found.wrong = 0;  // two planes at once under a label that waits
      tally.add(found);
    }
  }
  MESSAGE(name, ": ", tally.faces, " vertices on faces, ", tally.edges, " edges, ", tally.cut,
          " of cuts, ", tally.aside, " of other planes, ", tally.wrong, " wrong; ", tally.polygons,
          " polygons");
  return tally;
}

}  // namespace

TEST_SUITE("host_sim.contact_log") {
  TEST_CASE("ids of own scenes name what touches in the mesh files") {
    for (const char* name : {"square_peg_five", "ell_insert", "tetrahedron_on_box"}) {
      CAPTURE(name);
      const Tally tally = run(name, false);
      CHECK(tally.wrong == 0);
      CHECK(tally.faces > 500);
      CHECK(tally.aside * 100 < tally.faces);
      CHECK(tally.polygons > 0);
    }
  }

  TEST_CASE("a mesh with its vertices numbered otherwise is distinguished") {
    CHECK(run("square_peg_five", true).wrong > 100);
  }

  TEST_CASE("text of ids") {
    const MeshFeature face{FeatureKind::kFace, {3, 3}}, vertex{FeatureKind::kVertex, {5, 5}};
    const MeshFeature edge{FeatureKind::kEdge, {0, 3}}, half{FeatureKind::kEdge, {kMadeByCut, 4}};
    const MeshFeature cut{FeatureKind::kFace, {kMadeByCut, kMadeByCut}};
    CHECK(contact_text({ContactType::kA, face, vertex}) == "A:f3/v5");
    CHECK(contact_text({ContactType::kB, vertex, cut}) == "B:v5/f*");
    CHECK(contact_text({ContactType::kC, edge, half}) == "C:e0-3/e*-4");
  }

  TEST_CASE("a replay writes a line per touching pair and tick, and its ticks are the same") {
    const std::string name = "square_peg_five";
    const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / name;
    const tools::CompiledScene scene =
        tools::compile_scene(tools::read_scene_file(folder / "scene.toml"), {});
    CoreSession session(scene.bytes, name);
    std::vector<MotionSample> motion =
        make_motion(read_motion_script((folder / "motion.toml").string()));
    ReplayOptions options;
    options.contacts = true;
    const ReplayResult with = replay(session, motion, options);
    const ReplayResult without = replay(session, motion, {});
    CHECK(without.contact_csv.empty());
    CHECK(tick_csv(with.ticks) == tick_csv(without.ticks));
    const auto touching =
        std::count_if(with.ticks.begin(), with.ticks.end(),
                      [](const TickRecord& t) { return t.situation != ContactSituation::kNone; });
    CHECK(with.contact_csv.starts_with(std::string(kContactCsvHeader) + "\n"));
    const auto columns = std::count(kContactCsvHeader,
                                    kContactCsvHeader + std::string(kContactCsvHeader).size(), ',');
    std::size_t begin = with.contact_csv.find('\n') + 1;
    std::vector<std::string> ticks;
    while (begin < with.contact_csv.size()) {
      const std::size_t end = with.contact_csv.find('\n', begin);
      const std::string line = with.contact_csv.substr(begin, end - begin);
      CHECK(std::count(line.begin(), line.end(), ',') == columns);
      CHECK(line.find("none") == std::string::npos);
      const std::string tick = line.substr(0, line.find(','));
      if (ticks.empty() || ticks.back() != tick) ticks.push_back(tick);
      begin = end + 1;
    }
    CHECK(static_cast<std::ptrdiff_t>(ticks.size()) == touching);
  }
}
