// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/urdf_tree.hpp"

#include <cmath>
#include <map>

#include "tools/common/formatted.hpp"
#include "tools/common/named_file.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

class JointTree {
 public:
  JointTree(const std::string& file, std::vector<std::string>& notes)
      : file_(file), notes_(notes) {}

  std::vector<PlacedLink> read(const XMLElement& robot) {
    for (const XMLElement* l = robot.FirstChildElement("link"); l != nullptr;
         l = l->NextSiblingElement("link")) {
      add_link(*l);
    }
    joints_.resize(links_.size());
    below_.resize(links_.size());
    for (const XMLElement* j = robot.FirstChildElement("joint"); j != nullptr;
         j = j->NextSiblingElement("joint")) {
      add_joint(*j);
    }
    place_from_root();
    return std::move(links_);
  }

 private:
  [[noreturn]] void refuse(const XMLElement& at, const std::string& defect,
                           const std::string& fix) const {
    refuse_line(file_, line_of(at), defect, fix);
  }

  void add_link(const XMLElement& link) {
    const std::string name = without_blanks(attribute(link, "name"));
    const auto [known, is_new] = index_.try_emplace(name, links_.size());
    if (!is_new) {
      refuse(link,
             "link " + shown_name(name) + " is in line " +
                 std::to_string(line_of(*links_[known->second].element)) + " too",
             "give every link a name of its own");
    }
    links_.push_back({name, &link});
  }

  /// The link that <parent> or <child> of a joint names.
  std::size_t end_of(const XMLElement& joint, const char* which) const {
    const XMLElement* end = joint.FirstChildElement(which);
    if (end == nullptr) {
      refuse(joint, shown_joint(joint) + " has no <" + which + ">",
             std::string("give it one, as <") + which + " link=\"NAME\"/>");
    }
    const std::string name = without_blanks(attribute(*end, "link"));
    const auto found = index_.find(name);
    if (found == index_.end()) {
      refuse(*end,
             shown_joint(joint) + " names the link " + shown_name(name) +
                 ", which the robot does not have",
             "correct the name, or add the link");
    }
    return found->second;
  }
  static std::string shown_joint(const XMLElement& joint) {
    return "joint " + shown_name(without_blanks(attribute(joint, "name")));
  }

  void add_joint(const XMLElement& joint) {
    const std::size_t parent = end_of(joint, "parent"), child = end_of(joint, "child");
    if (joints_[child] != nullptr) {
      refuse(joint,
             "link " + shown_name(links_[child].name) + " is below " + shown_joint(joint) +
                 " and below that of line " + std::to_string(line_of(*joints_[child])),
             "keep one of the two");
    }
    joints_[child] = &joint;
    below_[parent].push_back(child);
    note_limits(joint);
  }

  void note_limits(const XMLElement& joint) {
    const XMLElement* limit = joint.FirstChildElement("limit");
    const std::string type = attribute(joint, "type");
    if (limit == nullptr || (type != "revolute" && type != "prismatic")) return;
    const auto bound = [&](const char* name) {
      return limit->Attribute(name) == nullptr ? 0.0 : attribute_numbers<1>(file_, *limit, name)[0];
    };
    const double lower = bound("lower"), upper = bound("upper");
    if (lower <= 0.0 && upper >= 0.0) return;
    notes_.push_back(file_ + ": " + shown_joint(joint) + " stands at 0, outside its limits " +
                     short_number(lower, 4) + " to " + short_number(upper, 4));
  }

  void place_from_root() {
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < links_.size(); ++k) {
      if (joints_[k] != nullptr) continue;
      if (!order.empty()) {
        refuse(*links_[k].element,
               "links " + shown_name(links_[order[0]].name) + " and " + shown_name(links_[k].name) +
                   " are below no joint",
               "a robot has one root: join them by a <joint>, or name a link with its frame as "
               "FILE#LINK beside the mesh of a fixed part");
      }
      order.push_back(k);
    }
    for (std::size_t k = 0; k < order.size(); ++k) {
      const PlacedLink& parent = links_[order[k]];
      for (const std::size_t child : below_[order[k]]) {
        links_[child].joint = joints_[child];
        links_[child].parent = order[k];
        links_[child].in_root = parent.in_root.of(origin_below(*joints_[child], file_));
        for (const double x : links_[child].in_root.origin) {
          if (std::isfinite(x)) continue;
          refuse(*joints_[child], "the link below it is not at a finite place",
                 "correct its origin");
        }
        order.push_back(child);
      }
    }
    if (order.size() == links_.size()) return;
    // Every link that was not reached is in a circle, or below one.
    std::vector<bool> reached(links_.size(), false);
    for (const std::size_t k : order) reached[k] = true;
    for (std::size_t k = 0; k < links_.size(); ++k) {
      if (reached[k]) continue;
      refuse(*joints_[k],
             "link " + shown_name(links_[k].name) + " is in a circle of joints, or below one",
             "joints make a tree: remove the one that closes the circle");
    }
  }

  const std::string& file_;
  std::vector<std::string>& notes_;
  std::vector<PlacedLink> links_;
  std::map<std::string, std::size_t> index_;
  std::vector<const XMLElement*> joints_;        ///< of each link: the one above
  std::vector<std::vector<std::size_t>> below_;  ///< of each link
};

}  // namespace

Point3 Placing::of(const Point3& p) const {
  Point3 to = origin;
  for (std::size_t i = 0; i < 3; ++i) {
    to[i] += turn[i][0] * p[0] + turn[i][1] * p[1] + turn[i][2] * p[2];
  }
  return to;
}

Placing Placing::of(const Placing& inner) const {
  Placing both;
  both.origin = of(inner.origin);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      both.turn[i][j] = 0.0;
      for (std::size_t k = 0; k < 3; ++k) both.turn[i][j] += turn[i][k] * inner.turn[k][j];
    }
  }
  return both;
}

Placing origin_below(const XMLElement& element, const std::string& file) {
  Placing placing;
  const XMLElement* origin = element.FirstChildElement("origin");
  if (origin == nullptr) return placing;
  if (origin->Attribute("xyz") != nullptr) {
    placing.origin = attribute_numbers<3>(file, *origin, "xyz");
  }
  if (origin->Attribute("rpy") != nullptr) {
    placing.turn = turn_about_fixed_axes(attribute_numbers<3>(file, *origin, "rpy"));
  }
  return placing;
}

std::vector<PlacedLink> links_at_zero(const XMLElement& robot, const std::string& file,
                                      std::vector<std::string>& notes) {
  return JointTree(file, notes).read(robot);
}

}  // namespace haptic::tools
