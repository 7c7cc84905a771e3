// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pairs of bodies that the verification runs on, and one of them under test: a core over its
/// compiled scene with everything that judges what the core returns.

#include <memory>
#include <string>
#include <vector>

#include "host_sim/oracle/certificate_check.hpp"
#include "host_sim/oracle/sifted_pair.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Two bodies and how much of a run is spent on them.
struct VerifiedBodies {
  std::string name;
  Solid a, b;
  double query_share = 0;   ///< of the verdict queries
  double judged_share = 0;  ///< of the queries that the exhaustive search judges
  double near_share = 0;    ///< of the near sets compared; 0: none
};

/// The six classes from 128 to half a million nodes, by number from 0: tetrahedron and box, two
/// boxes, 12-prism and box, hulls of 32, 64 and 200 vertices; parts of 3 to 10 cm.
inline constexpr std::size_t kClassCount = 6;
[[nodiscard]] VerifiedBodies class_pair(std::size_t number);
[[nodiscard]] std::vector<VerifiedBodies> class_pairs();
/// Needles (1 : 0.03 : 0.03) and plates (1 : 1 : 0.02) against a box and each other.
[[nodiscard]] std::vector<VerifiedBodies> sliver_pairs();

/// One pair under test. Not movable: it holds pointers into itself.
class VerifiedPair {
 public:
  /// Compiles the scene. @throws tools::InputError when the core refuses it.
  VerifiedPair(const VerifiedBodies& bodies, double epsilon_m);
  VerifiedPair(const VerifiedPair&) = delete;
  VerifiedPair& operator=(const VerifiedPair&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] HapticCore& core() { return session_.core(); }
  [[nodiscard]] CoreSession& session() { return session_; }
  [[nodiscard]] const SceneView& view() const { return session_.view(); }
  [[nodiscard]] const CertificateCheck& certificates() const { return certificates_; }

  /// Pose of A in B's geometry frame, from the numbers that the core is given.
  [[nodiscard]] OraclePose oracle_pose(const Pose& pose_wa) const;
  /// What D_near must be, by the exhaustive search: in long double throughout for small pieces,
  /// with the sieve in double for larger ones.
  [[nodiscard]] PairTruth truth(const OraclePose& pose);
  /// Nodes that may be near, in long double (SiftedPair::near_candidates).
  [[nodiscard]] std::vector<NodeValue> near_candidates(const OraclePose& pose, Wide d_m,
                                                       Wide margin_m, Wide least_sine);

  [[nodiscard]] Wide size_m() const { return size_m_; }  ///< larger diameter of the two bodies
  [[nodiscard]] Wide epsilon_m() const { return epsilon_m_; }
  [[nodiscard]] const OraclePiece& piece_a() const { return a_; }
  [[nodiscard]] const OraclePiece& piece_b() const { return b_; }

 private:
  std::string name_;
  CoreSession session_;
  OraclePiece a_, b_;
  Wide size_m_, epsilon_m_;
  CertificateCheck certificates_;
  SiftedPair sifted_;
};

}  // namespace haptic::sim
