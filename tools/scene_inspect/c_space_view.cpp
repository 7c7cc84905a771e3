// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/c_space_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kMostTried = 256;

/// Largest angle between two orientations that are one, as far as a scene file gives them [rad].
constexpr double kSameTurn_rad = 1e-6;

void require_orientation(const SceneView& view, const Pose& pose_wa) {
  if (!view.is_locked()) return;
  const double* q = view.parameters().start_q_wa_xyzw;
  const Quat start(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                   static_cast<Real>(q[2]));
  if (static_cast<double>(start.angularDistance(pose_wa.q_wa)) <= kSameTurn_rad) return;
  throw UsageError(
      "--cspace: the part of this scene never turns, and the pose has another orientation; leave "
      "the quaternion out");
}

DrawnObstacle drawn_obstacle(const SceneView& view, NearObstacle near, const Pose& pose_wa,
                             const PlacedMoving& moving) {
  DrawnObstacle drawn;
  const PairIndex index = near.pair;
  const PairView pair = view.pair(index);
  const BodyRecord& body = view.bodies()[pair.b.record->body];
  drawn.pair = index;
  drawn.piece_a = pair.record.piece_a - view.bodies()[0].piece_begin;
  drawn.piece_b = pair.record.piece_b - body.piece_begin;
  drawn.body = view.text(body.name_offset, body.name_bytes);
  drawn.obstacle = std::move(near.obstacle);
  drawn.distance_m = near.distance_m;
  FlatPair flat(view, index);
  flat.place(moving);
  const Mat3 r_wa = pose_wa.q_wa.normalized().toRotationMatrix();
  for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
    const NodeFeatures features = node_features(pair, node);
    const FlatPair::Value value = flat.evaluate(node);
    ContactAtPose contact{node, features.type, features.i, features.j};
    contact.applicable = value.violation_m <= kApplicable_m;
    if (contact.applicable) {
      Point normal{}, application{};
      flat.contact(node, normal, application);
      contact.depth_m = value.depth_m;
      contact.hidden = only_separates(pair, r_wa, node, vector_of(normal));
      drawn.applicable += 1;
    }
    drawn.contacts.push_back(contact);
  }
  for (std::size_t f = 0; f < drawn.obstacle.faces.size(); ++f) {
    const CFace& face = drawn.obstacle.faces[f];
    drawn.hidden_faces += face.hidden ? 1 : 0;
    for (const std::uint32_t node : face.nodes)
      drawn.contacts[node].face = static_cast<std::int32_t>(f);
  }
  return drawn;
}

}  // namespace

CSpaceView c_space_view(const SceneView& view, const Pose& pose_wa) {
  require_orientation(view, pose_wa);
  const PlacedMoving moving = place_moving(view, pose_wa);
  CSpaceView space;
  space.scene = view.text(view.parameters().name_offset, view.parameters().name_bytes);
  space.pose_wa = pose_wa;
  space.point = vector_of(moving.grip_w);
  space.pairs = view.pair_count();
  ObstacleSearch search(view, {kMostObstacles, kMostContacts, kMostTried});
  for (NearObstacle& near : search.nearest(pose_wa, space.too_large))
    space.obstacles.push_back(drawn_obstacle(view, std::move(near), pose_wa, moving));
  return space;
}

std::string c_space_csv(const CSpaceView& space) {
  std::string csv = "pair,piece_a,piece_b,node,type,of_a,of_b,applicable,hidden,face,depth_m\n";
  constexpr const char* kFeatures[3][2] = {{"f", "v"}, {"v", "f"}, {"e", "e"}};
  for (const DrawnObstacle& drawn : space.obstacles) {
    for (const ContactAtPose& c : drawn.contacts) {
      const auto& feature = kFeatures[static_cast<std::size_t>(c.type)];
      append_line(csv, "%llu,%u,%u,%u,%c,%s%u,%s%u,%d,%d,%s,%s",
                  static_cast<unsigned long long>(drawn.pair), drawn.piece_a, drawn.piece_b, c.node,
                  "ABC"[static_cast<std::size_t>(c.type)], feature[0], c.of_a, feature[1], c.of_b,
                  c.applicable ? 1 : 0, c.hidden ? 1 : 0,
                  c.face < 0 ? "" : std::to_string(c.face).c_str(),
                  c.applicable ? short_number(unsigned_zero(c.depth_m), 17).c_str() : "");
    }
  }
  return csv;
}

std::string c_space_text(const CSpaceView& space) {
  std::string text = formatted("C-space at the point %.6g, %.6g, %.6g m", space.point[0],
                               space.point[1], space.point[2]);
  if (!space.axes.empty()) text += " in the axes of '" + space.axes + "'";
  text += formatted(": %zu of %zu pairs drawn", space.obstacles.size(), space.pairs);
  if (space.too_large > 0)
    text += formatted("; %zu have more than %u basic contacts", space.too_large, kMostContacts);
  text += "\n";
  for (const DrawnObstacle& d : space.obstacles) {
    append_line(text,
                "  pair %llu: piece %u of %s, piece %u of '%s': %zu of %zu basic contacts "
                "applicable, in %zu faces, %zu of them hidden; %s %.6g mm",
                static_cast<unsigned long long>(d.pair), d.piece_a, space.a.c_str(), d.piece_b,
                d.body.c_str(), d.applicable, d.contacts.size(), d.obstacle.faces.size(),
                d.hidden_faces, d.distance_m < 0 ? "overlap" : "largest plane distance",
                1e3 * std::abs(d.distance_m));
  }
  return text;
}

}  // namespace haptic::tools
