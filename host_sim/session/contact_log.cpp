// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/contact_log.hpp"

#include <algorithm>
#include <set>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

std::string number_text(std::int32_t source) {
  return source == kMadeByCut ? "*" : std::to_string(source);
}

std::string feature_text(const MeshFeature& feature) {
  switch (feature.kind) {
    case FeatureKind::kVertex:
      return "v" + number_text(feature.source[0]);
    case FeatureKind::kEdge:
      return "e" + number_text(feature.source[0]) + "-" + number_text(feature.source[1]);
    case FeatureKind::kFace:
      break;
  }
  return "f" + number_text(feature.source[0]);
}

void append_vector(std::string& text, const Vec3& v, char before) {
  for (int k = 0; k < 3; ++k) {
    if (before != '\0') text += before;
    append_number(text, static_cast<double>(v[k]));
    if (before == '\0') before = ' ';
  }
}

}  // namespace

std::string contact_text(const ContactId& id) {
  const char type = static_cast<char>('A' + static_cast<int>(id.type));
  return std::string(1, type) + ":" + feature_text(id.of_a) + "/" + feature_text(id.of_b);
}

ContactLog::ContactLog(const SceneView& scene)
    : csv_(std::string(kContactCsvHeader) + "\n"),
      of_felt_(scene.parameters().law == LawId::kProxy) {
  const std::uint32_t room = scene.header().capacity.largest_near;
  corners_.resize(room);
  ids_.resize(room);
  contact_.polygon_w = BoundedList<Vec3>(corners_);
  contact_.ids = BoundedList<ContactId>(ids_);
}

void ContactLog::add(HapticCore& core, const StepInput& input, double t_s) {
  const auto add_pair = [&](PairIndex pair) {
    core.contact_geometry(pair, contact_);
    if (!contact_.ids.empty()) append(input, t_s, pair);
  };
  if (!of_felt_) {
    for (PairIndex pair = 0; pair < core.pair_count(); ++pair) add_pair(pair);
    return;
  }
  const FeltContact& felt = core.felt_contact();
  std::set<PairIndex> pairs;
  for (std::uint32_t k = 0; k < felt.plane_count; ++k) pairs.insert(felt.planes[k].pair);
  for (const PairIndex pair : pairs) add_pair(pair);
}

void ContactLog::append(const StepInput& input, double t_s, PairIndex pair) {
  csv_ += std::to_string(input.sequence) + ',';
  append_number(csv_, t_s);
  csv_ += ',' + std::to_string(pair) + ',' + std::to_string(contact_.body_b) + ',' +
          to_text(contact_.situation) + ',';
  append_number(csv_, static_cast<double>(contact_.d_near_m));
  for (const Vec3& v : {contact_.point_w, contact_.normal_w, contact_.e1_w})
    append_vector(csv_, v, ',');
  csv_ += ',';
  for (std::uint32_t k = 0; k < contact_.polygon_w.size(); ++k) {
    if (k > 0) csv_ += ';';
    append_vector(csv_, contact_.x0_w + contact_.polygon_w[k], '\0');
  }
  csv_ += ',';
  for (std::uint32_t k = 0; k < contact_.ids.size(); ++k) {
    if (k > 0) csv_ += ';';
    csv_ += contact_text(contact_.ids[k]);
  }
  csv_ += '\n';
}

}  // namespace haptic::sim
