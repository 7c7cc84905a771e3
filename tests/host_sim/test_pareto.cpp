// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "host_sim/lab/optional/studies.hpp"
#include "host_sim/lab/pareto/pareto_report.hpp"
#include "host_sim/lab/peers/exhaustive_peer.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/timing/tick_times.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// A method that answers right except for a constant shift of the depth, a turned normal, and the
/// wrong verdict at every n-th query.
class LyingPeer final : public PeerQuery {
 public:
  LyingPeer(const Solid& a, const Solid& b, double shift_m, double turn_rad, unsigned wrong_every)
      : honest_(peer_solid(a), peer_solid(b)),
        shift_m_(shift_m),
        turn_rad_(turn_rad),
        wrong_every_(wrong_every) {}
  void prepare(const PeerPose& pose) override { honest_.prepare(pose); }
  void query() override {
    honest_.query();
    ++queries_;
  }
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer = honest_.answer();
    answer.depth_m += shift_m_;
    const PeerVector n = answer.normal_w;
    const Vector normal(n[0], n[1], n[2]);
    const Vector turned = Eigen::AngleAxisd(turn_rad_, normal.unitOrthogonal()) * normal;
    answer.normal_w = {turned[0], turned[1], turned[2]};
    if (wrong_every_ != 0 && queries_ % wrong_every_ == 0) answer.penetrating = !answer.penetrating;
    return answer;
  }

 private:
  ExhaustivePeer honest_;
  double shift_m_, turn_rad_;
  unsigned wrong_every_, queries_ = 0;
};

MeasurePlan short_plan() {
  MeasurePlan plan;
  plan.passes = 1;
  return plan;
}

OraclePiece piece_of(const Solid& solid) {
  std::vector<WideVec> vertices;
  for (const Vector& v : solid.vertices) vertices.push_back({v[0], v[1], v[2]});
  return make_oracle_piece(std::move(vertices), solid.loops);
}

PoseSample sample_of(std::size_t pose, double ns, bool penetrating, double depth_m) {
  PoseSample sample;
  sample.pose = pose;
  sample.tick_ns = sample.query_ns = ns;
  sample.answer.penetrating = penetrating;
  sample.answer.depth_m = depth_m;
  return sample;
}

NearTruth truth_at(double d_near_m) {
  NearTruth truth;
  truth.truth = {d_near_m, d_near_m, d_near_m};
  truth.normals = {{0, 0, 1}};
  return truth;
}

}  // namespace

TEST_SUITE_BEGIN("host_sim.pareto");

TEST_CASE("figures: ranks of known lists") {
  std::vector<double> values;
  for (int k = 1000; k >= 0; --k) values.push_back(k);
  const TimeFigures f = figures(values);
  CHECK(f.count == 1001);
  CHECK(f.median == 500);
  CHECK(f.p99 == 990);
  CHECK(f.p999 == 999);
  CHECK(f.largest == 1000);
  CHECK(figures({3.0}).p999 == 3.0);
  CHECK(figures({2.0, 1.0}).median == 2.0);
  CHECK(figures({}).count == 0);
}

TEST_CASE("pair classes: the counts of basic contacts, closed bodies of 3 to 10 cm") {
  const std::uint64_t expected[] = {128, 240, 688, 11940, 50468, 511236};
  const std::vector<PairClass> pairs = pair_classes(3);
  REQUIRE(pairs.size() == 6);
  for (std::size_t k = 0; k < 6; ++k) {
    CHECK(pairs[k].nodes == expected[k]);
    CHECK(pairs[k].name == "W" + std::to_string(k + 1));
    for (const Solid* solid : {&pairs[k].a, &pairs[k].b}) {
      Vector low = solid->vertices[0], high = low;
      for (const Vector& v : solid->vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
      CHECK((high - low).maxCoeff() <= 0.1);
      CHECK((high - low).minCoeff() >= 0.03);
      CHECK_NOTHROW(static_cast<void>(piece_of(*solid)));  // every edge has two faces
    }
  }
}

TEST_CASE("near reference: the truth of the search over every node in long double") {
  for (const PairClass& pair : pair_classes(4)) {
    CAPTURE(pair.name);
    const std::size_t step = pair.nodes > 100'000 ? 100 : pair.nodes > 1000 ? 7 : 1;
    const OraclePiece a = piece_of(pair.a), b = piece_of(pair.b);
    const Wide size = std::max(diameter(a.vertices), diameter(b.vertices));
    const TruthfulWorkload workload = truthful_workload(pair, pair.nodes > 100'000 ? 400 : 800, 4);
    NearReference reference(a, b);
    CHECK(reference.node_count() == pair.nodes);
    for (std::size_t k = 0; k < workload.poses.size(); k += step) {
      const Rotation& q = workload.motion.poses[k].q_wa;
      const Vector& p = workload.motion.poses[k].p_wa;
      const OraclePose pose{rotation_of(q.w(), q.x(), q.y(), q.z()), {p[0], p[1], p[2]}};
      const PairTruth plain = search_pair(a, b, pose, size, NearReference::precision());
      const PairTruth& fast = workload.truths[k].truth;
      CAPTURE(k);
      CHECK(fast.reference_m == plain.reference_m);
      CHECK(fast.lower_m == plain.lower_m);
      CHECK(fast.upper_m == plain.upper_m);
      CHECK_FALSE(workload.truths[k].normals.empty());
    }
  }
}

TEST_CASE("rows: states, percentiles, errors and verdicts of known samples") {
  const std::vector<NearTruth> truths = {truth_at(-0.001), truth_at(-0.002), truth_at(-0.008),
                                         truth_at(0.001), truth_at(0.02)};
  std::vector<PoseSample> samples = {
      sample_of(0, 100, true, -0.0011), sample_of(1, 300, true, -0.0022),
      sample_of(2, 200, true, -0.0085), sample_of(3, 50, true, -0.5),
      sample_of(4, 60, false, std::numeric_limits<double>::quiet_NaN())};
  samples[0].answer.normal_w = {0, std::sin(0.01), std::cos(0.01)};
  samples[1].answer.patch_points = 3;
  samples[2].heap_calls = 6;
  const std::vector<ParetoRow> rows = rows_of(samples, truths);
  REQUIRE(rows.size() == 3);
  const ParetoRow &contact = rows[0], &near = rows[1], &far = rows[2];
  CHECK(contact.state == "contact");
  CHECK(contact.poses == 3);
  CHECK(contact.median_ns == 200);
  CHECK(contact.max_ns == 300);
  CHECK(contact.max_error_m == doctest::Approx(2e-4));
  CHECK(contact.max_error_deep_m == doctest::Approx(5e-4));
  CHECK(contact.median_error_m == doctest::Approx(2e-4));
  CHECK(contact.normal_error_deg == doctest::Approx(0.01 * 180 / std::numbers::pi));
  CHECK(contact.wrong_verdicts == 0);
  CHECK(contact.patch_points == 1);
  CHECK(contact.heap_calls == 2);
  CHECK(near.state == "near");
  CHECK(near.wrong_verdicts == 1);
  CHECK(std::isnan(near.max_error_m));  // a bare no outside: no value to compare
  CHECK(far.state == "far");
  CHECK(far.wrong_verdicts == 0);
  CHECK(std::isnan(far.patch_points));
}

TEST_CASE("csv: header, one line a row, empty cells for what a method does not give") {
  ParetoRow row;
  row.pair = "W1", row.method = "m", row.setting = "s", row.scalar = "double", row.state = "near";
  row.median_ns = 12.25;
  row.max_error_m = std::numeric_limits<double>::quiet_NaN();
  const std::string text = pareto_csv({&row, 1});
  CHECK(text ==
        "pair,method,setting,scalar,state,query_ns,median_ns,p99_ns,p999_ns,max_ns,median_error_m,"
        "max_error_m,max_error_deep_m,normal_error_deg,wrong_verdicts,patch_points,heap_calls\n"
        "W1,m,s,double,near,0.0,12.2,0.0,0.0,0.0,0,,0,0,0,0.00,0.00\n");
}

TEST_CASE("measuring: a method that lies is reported with its lie") {
  const PairClass pair = pair_classes(1)[1];
  const TruthfulWorkload workload = truthful_workload(pair, 800, 11);
  const TickClock clock;
  LyingPeer liar(pair.a, pair.b, 3e-4, 0.02, 0);
  const auto samples = measure_motion(liar, workload, 1, short_plan(), clock);
  REQUIRE(samples.size() == 800);
  for (const ParetoRow& row : rows_of(samples, workload.truths)) {
    if (row.state == "contact") CHECK(row.max_error_m == doctest::Approx(3e-4).epsilon(1e-9));
    if (row.state == "contact") CHECK(row.median_error_m == doctest::Approx(3e-4).epsilon(1e-9));
    // Where two normals are tied the nearer of them counts.
    CHECK(row.normal_error_deg <= 0.02 * 180 / std::numbers::pi + 1e-9);
    CHECK(row.normal_error_deg > 0.0199 * 180 / std::numbers::pi);
    CHECK(row.wrong_verdicts == 0);
  }
  LyingPeer denier(pair.a, pair.b, 0, 0, 10);
  std::uint64_t wrong = 0;
  for (const ParetoRow& row :
       rows_of(measure_motion(denier, workload, 1, short_plan(), clock), workload.truths))
    wrong += row.wrong_verdicts;
  CHECK(wrong == 80);
}

TEST_CASE("measuring: the first pose of a recording is a first tick of a coherent method") {
  const PairClass pair = pair_classes(1)[0];
  const TruthfulWorkload workload = truthful_workload(pair, 160, 2);
  const TickClock clock;
  for (const PeerEntry& entry : peer_catalog()) {
    if (entry.boxes_only) continue;
    CAPTURE(entry.method);
    const auto peer = entry.make(pair.a, pair.b);
    const auto samples = measure_motion(*peer, workload, 1, short_plan(), clock);
    CHECK(samples.size() == (peer->coherent() ? 160 - workload.motion.recordings.size() : 160));
    CHECK(measure_first_ticks(*peer, workload, 40, short_plan(), clock).size() == 4);
  }
}

TEST_CASE("the core has one row, drawn and exact") {
  const PairClass pair = pair_classes(1)[1];
  const TruthfulWorkload workload = truthful_workload(pair, 2000, 5);
  const TickClock clock;
  const double exact_m = sizeof(Real) == sizeof(float) ? 1e-7 : 1e-15;
  int rows_of_core = 0;
  for (const PeerEntry& entry : peer_catalog()) {
    if (entry.method != "ours") continue;
    ++rows_of_core;
    CHECK(entry.setting == "tick");
    CHECK(entry.drawn);
    for (const ParetoRow& row : measure_method(entry, pair, workload, short_plan(), clock).rows) {
      CHECK(row.wrong_verdicts == 0);
      if (row.state != "contact") continue;
      CHECK(row.max_error_m <= exact_m);
    }
  }
  CHECK(rows_of_core == 1);
}

TEST_CASE("report: an unknown pair is refused") {
  ParetoOptions options;
  options.pairs = {"W7"};
  CHECK_THROWS_AS(static_cast<void>(measure_pareto(options)), tools::InputError);
  if (studies_built()) return;
  options.pairs = {"W1"};
  CHECK_THROWS_AS(static_cast<void>(measure_pareto(options)), tools::UsageError);
}

TEST_CASE("log panel: powers of ten at equal distances, values outside at the edge") {
  const LogPanel panel{10, 20, 300, 200, 1, 1000, 1e-6, 1e-2};
  CHECK(panel.x_of(1) == doctest::Approx(10));
  CHECK(panel.x_of(10) == doctest::Approx(110));
  CHECK(panel.x_of(1e9) == doctest::Approx(310));
  CHECK(panel.y_of(1e-2) == doctest::Approx(20));
  CHECK(panel.y_of(0) == doctest::Approx(220));
  CHECK(time_label(1) == "1 ns");
  CHECK(time_label(1e5) == "100 us");
  CHECK(time_label(1e6) == "1 ms");
}

TEST_SUITE_END();
