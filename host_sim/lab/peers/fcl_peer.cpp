// SPDX-License-Identifier: Apache-2.0
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision.h>

#include <limits>

#include "host_sim/lab/peers/foreign_peers.hpp"

namespace haptic::sim {
namespace {

std::shared_ptr<fcl::Convexd> convex_of(const PeerSolid& solid) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (const PeerVector& v : solid.vertices) vertices->emplace_back(v[0], v[1], v[2]);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& loop : solid.loops) {
    faces->push_back(static_cast<int>(loop.size()));
    for (const std::uint32_t v : loop) faces->push_back(static_cast<int>(v));
  }
  auto convex =
      std::make_shared<fcl::Convexd>(vertices, static_cast<int>(solid.loops.size()), faces, true);
  convex->computeLocalAABB();
  return convex;
}

class FclPeer final : public PeerQuery {
 public:
  FclPeer(const PeerSolid& a, const PeerSolid& b, double tolerance_m)
      : a_(convex_of(a)), b_(convex_of(b)) {
    pose_a_.setIdentity();
    pose_b_.setIdentity();
    request_.num_max_contacts = 1;
    request_.enable_contact = true;
    request_.gjk_solver_type = fcl::GST_LIBCCD;
    request_.gjk_tolerance = tolerance_m;
  }

  void prepare(const PeerPose& pose) override {
    for (int i = 0; i < 3; ++i) {
      const auto row = static_cast<std::size_t>(i);
      for (int j = 0; j < 3; ++j)
        pose_a_.linear()(i, j) = pose.r_wa[row][static_cast<std::size_t>(j)];
      pose_a_.translation()[i] = pose.p_wa[row];
    }
  }
  void query() override {
    result_.clear();
    fcl::collide<double>(b_.get(), pose_b_, a_.get(), pose_a_, request_, result_);
  }
  // B first: FCL's normal points from its first object to the second.
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.penetrating = result_.isCollision();
    answer.depth_m = std::numeric_limits<double>::quiet_NaN();
    if (result_.numContacts() > 0) {
      const fcl::Contactd& contact = result_.getContact(0);
      answer.depth_m = -contact.penetration_depth;
      for (int i = 0; i < 3; ++i) answer.normal_w[static_cast<std::size_t>(i)] = contact.normal[i];
      answer.patch_points = 1;
    }
    return answer;
  }

 private:
  std::shared_ptr<fcl::Convexd> a_, b_;
  fcl::Transform3d pose_a_, pose_b_;
  fcl::CollisionRequestd request_;
  fcl::CollisionResultd result_;
};

}  // namespace

std::unique_ptr<PeerQuery> make_fcl_peer(const PeerSolid& a, const PeerSolid& b,
                                         double tolerance_m) {
  return std::make_unique<FclPeer>(a, b, tolerance_m);
}

}  // namespace haptic::sim
