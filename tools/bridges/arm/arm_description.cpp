// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/arm/arm_description.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/files.hpp"
#include "tools/common/named_file.hpp"
#include "tools/graph_compiler/import/urdf_tree.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kMaxUrdfBytes = std::size_t{16} << 20;
constexpr std::size_t kMostNamed = 30;
/// Leader arms weigh one or two kilograms; ten times that is a mistake of units.
constexpr double kMostMass_kg = 50;
constexpr double kLeastAxis = 1e-6;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

Column3 column(const Point3& p) { return {p[0], p[1], p[2]}; }

Square3 square(const Turn& turn) {
  Square3 m;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      m(i, j) = turn[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    }
  }
  return m;
}

std::string listed(const std::vector<PlacedLink>& links) {
  std::string text = "its links:";
  for (std::size_t k = 0; k < std::min(links.size(), kMostNamed); ++k) {
    text += (k == 0 ? " " : ", ") + shown_name(links[k].name);
  }
  return links.size() > kMostNamed
             ? text + " and " + std::to_string(links.size() - kMostNamed) + " more"
             : text;
}

class ArmReader {
 public:
  ArmReader(const std::string& file, const XMLElement& robot) : file_(file) {
    std::vector<std::string> notes;
    links_ = links_at_zero(robot, file, notes);
    if (links_.empty()) {
      refuse_file(file, "the robot has no <link>",
                  "expand xacro files first: xacro FILE > robot.urdf");
    }
  }

  ArmDescription read(const std::string& base, const std::string& tip) {
    base_ = found(base, "base_link");
    const std::size_t handle = found(tip, "tip_link");
    turn_of_base_ = square(links_[base_].in_root.turn);
    // From the handle to the base, then turned round.
    std::vector<std::size_t> moved;
    for (std::size_t link = handle; link != base_; link = links_[link].parent) {
      if (links_[link].joint == nullptr) {
        refuse_file(file_, "link " + shown_name(tip) + " is not below link " + shown_name(base),
                    "name a base_link between the robot's root and the handle");
      }
      if (attribute(*links_[link].joint, "type") != "fixed") moved.push_back(link);
    }
    std::ranges::reverse(moved);
    if (moved.empty() || moved.size() > kMaxJoints) {
      refuse_file(file_,
                  "between link " + shown_name(base) + " and link " + shown_name(tip) + " are " +
                      std::to_string(moved.size()) + " moving joints",
                  "an arm has 1 to " + std::to_string(kMaxJoints));
    }
    ArmDescription arm;
    arm.model.joint_count = moved.size();
    for (std::size_t k = 0; k < moved.size(); ++k) {
      arm.model.joints[k] = joint_above(links_[moved[k]]);
      arm.joint_names.push_back(without_blanks(attribute(*links_[moved[k]].joint, "name")));
    }
    arm.model.tip_b = in_base(column(links_[handle].in_root.origin));
    arm.model.turn_bh = turn_of_base_.transpose() * square(links_[handle].in_root.turn);
    add_masses(moved, arm);
    return arm;
  }

 private:
  [[noreturn]] void refuse(const XMLElement& at, const std::string& defect,
                           const std::string& fix) const {
    refuse_line(file_, line_of(at), defect, fix);
  }

  std::size_t found(const std::string& name, const std::string& key) const {
    const auto at = std::ranges::find(links_, without_blanks(name), &PlacedLink::name);
    if (at == links_.end()) {
      refuse_file(file_, "no link " + shown_name(name) + ", which " + key + " names",
                  listed(links_));
    }
    return static_cast<std::size_t>(at - links_.begin());
  }

  Column3 in_base(const Column3& point_root) const {
    return turn_of_base_.transpose() * (point_root - column(links_[base_].in_root.origin));
  }

  ArmJoint joint_above(const PlacedLink& link) const {
    const XMLElement& at = *link.joint;
    const std::string type = attribute(at, "type");
    const std::string name = "joint " + shown_name(without_blanks(attribute(at, "name")));
    if (type != "revolute" && type != "continuous") {
      refuse(at, name + " is " + shown_word(type),
             "joints of an arm are fixed, revolute or continuous");
    }
    if (at.FirstChildElement("mimic") != nullptr) {
      refuse(at, name + " follows another one (<mimic>)", "give it a servo of its own");
    }
    ArmJoint joint;
    joint.axis_b = turn_of_base_.transpose() * (square(link.in_root.turn) * axis_of(at, name));
    joint.point_b = in_base(column(link.in_root.origin));
    joint.limited = type == "revolute";
    if (joint.limited) set_limits(at, name, joint);
    return joint;
  }

  Column3 axis_of(const XMLElement& joint, const std::string& name) const {
    const XMLElement* element = joint.FirstChildElement("axis");
    if (element == nullptr) return Column3::UnitX();
    const Column3 axis = column(attribute_numbers<3>(file_, *element, "xyz"));
    const double length = axis.norm();
    if (!(length > kLeastAxis) || !std::isfinite(length)) {
      refuse(*element, "the axis of " + name + " has no direction",
             "give a unit vector, as xyz=\"0 0 1\"");
    }
    return axis / length;
  }

  void set_limits(const XMLElement& at, const std::string& name, ArmJoint& joint) const {
    const XMLElement* limit = at.FirstChildElement("limit");
    if (limit == nullptr) {
      refuse(at, name + " is revolute and has no <limit>",
             "give it one with lower and upper, or make it continuous");
    }
    // Absent means 0 in URDF.
    if (limit->Attribute("lower") != nullptr) {
      joint.lower_rad = attribute_numbers<1>(file_, *limit, "lower")[0];
    }
    if (limit->Attribute("upper") != nullptr) {
      joint.upper_rad = attribute_numbers<1>(file_, *limit, "upper")[0];
    }
    if (!(joint.lower_rad < joint.upper_rad)) {
      refuse(*limit, "the limits of " + name + " leave it no way", "give lower below upper");
    }
  }

  /// The joint of the arm that carries each link: index into `moved`; kNone: the base does.
  std::vector<std::size_t> carriers(const std::vector<std::size_t>& moved) const {
    constexpr std::size_t kOpen = kNone - 1;
    std::vector<std::size_t> carrier(links_.size(), kOpen);
    carrier[base_] = kNone;
    for (std::size_t k = 0; k < moved.size(); ++k) carrier[moved[k]] = k;
    std::vector<std::size_t> way;
    for (std::size_t link = 0; link < links_.size(); ++link) {
      way.clear();
      std::size_t at = link;
      for (; carrier[at] == kOpen && links_[at].joint != nullptr; at = links_[at].parent) {
        way.push_back(at);
      }
      if (carrier[at] == kOpen) carrier[at] = kNone;
      for (const std::size_t below : way) carrier[below] = carrier[at];
    }
    return carrier;
  }

  void add_masses(const std::vector<std::size_t>& moved, ArmDescription& arm) const {
    const std::vector<std::size_t> carrier = carriers(moved);
    std::array<Column3, kMaxJoints> moments;
    moments.fill(Column3::Zero());
    for (std::size_t link = 0; link < links_.size(); ++link) {
      if (carrier[link] == kNone) continue;
      const XMLElement* inertial = links_[link].element->FirstChildElement("inertial");
      const XMLElement* mass = inertial != nullptr ? inertial->FirstChildElement("mass") : nullptr;
      if (mass == nullptr) continue;
      const double mass_kg = attribute_numbers<1>(file_, *mass, "value")[0];
      arm.mass_kg += mass_kg;
      if (!(mass_kg >= 0) || !(arm.mass_kg <= kMostMass_kg)) {
        refuse(*mass,
               "the mass of link " + shown_name(links_[link].name) +
                   " or of all is below 0 or above 50 kg",
               "give kilograms");
      }
      const Point3 centre = links_[link].in_root.of(origin_below(*inertial, file_)).origin;
      const Column3 centre_b = in_base(column(centre));
      if (!centre_b.allFinite())
        refuse(*inertial, "the centre of mass is not finite", "correct it");
      arm.model.joints[carrier[link]].carried.mass_kg += mass_kg;
      moments[carrier[link]] += mass_kg * centre_b;
    }
    for (std::size_t k = 0; k < moved.size(); ++k) {
      ArmMass& carried = arm.model.joints[k].carried;
      if (carried.mass_kg > 0) carried.centre_b = moments[k] / carried.mass_kg;
    }
  }

  const std::string& file_;
  std::vector<PlacedLink> links_;
  std::size_t base_ = 0;
  Square3 turn_of_base_ = Square3::Identity();
};

}  // namespace

bool can_read_arms() { return true; }

ArmDescription arm_of(const std::string& text, const std::string& file, const std::string& base,
                      const std::string& tip) {
  tinyxml2::XMLDocument document;
  return ArmReader(file, parse_xml(document, text, "robot", file)).read(base, tip);
}

ArmDescription read_arm(const std::filesystem::path& urdf, const std::string& base,
                        const std::string& tip) {
  return arm_of(read_text_file(urdf, kMaxUrdfBytes, "the description of the arm"), urdf.string(),
                base, tip);
}

}  // namespace haptic::tools
