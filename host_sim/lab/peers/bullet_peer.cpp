// SPDX-License-Identifier: Apache-2.0
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include "host_sim/lab/peers/foreign_peers.hpp"

#if !defined(BT_USE_DOUBLE_PRECISION)
#error "the Bullet peer is measured in double: build with the flags of bullet-float64"
#endif

namespace haptic::sim {
namespace {

void fill(btConvexHullShape& shape, const PeerSolid& solid) {
  for (const PeerVector& v : solid.vertices) shape.addPoint(btVector3(v[0], v[1], v[2]), false);
  shape.recalcLocalAabb();
  shape.setMargin(0);
}

class BulletPeer final : public PeerQuery {
 public:
  BulletPeer(const PeerSolid& a, const PeerSolid& b) : detector_(&a_, &b_, &simplex_, &epa_) {
    fill(a_, a);
    fill(b_, b);
    // The detector copies the margins when it is made.
    detector_ = btGjkPairDetector(&a_, &b_, &simplex_, &epa_);
    first_axis_ = detector_.getCachedSeparatingAxis();
    input_.m_transformB.setIdentity();
  }

  void prepare(const PeerPose& pose) override {
    const auto& r = pose.r_wa;
    input_.m_transformA.setBasis(btMatrix3x3(r[0][0], r[0][1], r[0][2], r[1][0], r[1][1], r[1][2],
                                             r[2][0], r[2][1], r[2][2]));
    input_.m_transformA.setOrigin(btVector3(pose.p_wa[0], pose.p_wa[1], pose.p_wa[2]));
  }
  void query() override {
    point_ = btPointCollector();
    detector_.getClosestPoints(input_, point_, nullptr);
  }
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.separated = SeparatedValue::kDistance;
    answer.depth_m = point_.m_distance;
    answer.penetrating = point_.m_hasResult && point_.m_distance <= 0;
    if (point_.m_hasResult) {
      const btVector3& n = point_.m_normalOnBInWorld;
      answer.normal_w = {n.x(), n.y(), n.z()};
      answer.patch_points = 1;
    }
    return answer;
  }
  void reset() override { detector_.setCachedSeparatingAxis(first_axis_); }
  [[nodiscard]] bool coherent() const override { return true; }

 private:
  btConvexHullShape a_, b_;
  btVoronoiSimplexSolver simplex_;
  btGjkEpaPenetrationDepthSolver epa_;
  btGjkPairDetector detector_;
  btVector3 first_axis_;
  btGjkPairDetector::ClosestPointInput input_;
  btPointCollector point_;
};

}  // namespace

std::unique_ptr<PeerQuery> make_bullet_peer(const PeerSolid& a, const PeerSolid& b) {
  return std::make_unique<BulletPeer>(a, b);
}

}  // namespace haptic::sim
