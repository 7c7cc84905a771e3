// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/traits_header.hpp"

#include <algorithm>
#include <cstdio>

#include "rt_core/scene/scene_needs.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

struct Feature {
  const char* name;
  bool SceneTraits::*member;
};

/// In the order of SceneTraits: designated initialisers must keep it.
constexpr Feature kFeatures[] = {{"friction", &SceneTraits::friction},
                                 {"free_orientation", &SceneTraits::free_orientation},
                                 {"facets", &SceneTraits::facets},
                                 {"many_pairs", &SceneTraits::many_pairs},
                                 {"goal_contact", &SceneTraits::goal_contact},
                                 {"device", &SceneTraits::device},
                                 {"guide", &SceneTraits::guide},
                                 {"contact_geometry", &SceneTraits::contact_geometry},
                                 {"table_checks", &SceneTraits::table_checks}};

const Feature& feature_of(const std::string& name) {
  for (const Feature& f : kFeatures) {
    if (name == f.name) return f;
  }
  throw InputError("no feature of an image is called '" + name + "'");
}

/// The name without what cannot stand in a comment of one line.
std::string printable(const std::string& name) {
  std::string text;
  for (const char c : name) text += c >= ' ' && c <= '~' && c != '\\' ? c : '?';
  return text;
}

}  // namespace

const std::vector<std::string>& optional_traits() {
  static const std::vector<std::string> names{"contact_geometry"};
  return names;
}

std::vector<std::string> trait_names() {
  std::vector<std::string> names;
  for (const LawRow& law : kLaws) names.emplace_back(law.name);
  for (const Feature& f : kFeatures) names.emplace_back(f.name);
  return names;
}

SceneTraits image_traits(const SceneView& scene, const std::vector<std::string>& without,
                         const std::vector<std::string>& with) {
  for (const SectionEntry& section : scene.sections()) {
    if (section.id == SectionId::kParts)
      throw InputError(
          "an image has one moving part, and the hand may hold several of this scene; "
          "leave out --traits, or write the parts as [moving] and [[static]]");
  }
  SceneTraits traits = needs_of(scene);
  traits.contact_geometry = true;
  const auto& optional = optional_traits();
  for (const std::string& name : without) {
    if (std::find(optional.begin(), optional.end(), name) == optional.end()) {
      throw InputError("an image cannot be built without '" + name + "'; it can without " +
                       optional[0]);
    }
    traits.*feature_of(name).member = false;
  }
  for (const std::string& name : with) {
    if (const LawRow* const law = find_law(name.c_str())) {
      traits.laws |= law_set(law->id);
    } else {
      traits.*feature_of(name).member = true;
    }
  }
  if (traits.friction) traits.qp_rows = SceneTraits{}.qp_rows;
  return traits;
}

std::string traits_header(const SceneTraits& traits, const std::string& scene_name) {
  char hash[32];
  std::snprintf(hash, sizeof hash, "0x%016llxu",
                static_cast<unsigned long long>(traits.content_hash));
  std::string text =
      "// Written by graph_compiler --traits from the scene '" + printable(scene_name) +
      "'.\n#pragma once\n\n#include \"rt_core/scene/scene_traits.hpp\"\n\nnamespace haptic {\n\n"
      "inline constexpr SceneTraits kSceneTraits{\n    .image = true,\n    .content_hash = " +
      std::string(hash) + ",\n    .laws = " + std::to_string(traits.laws) + "u,\n";
  for (const Feature& f : kFeatures) {
    text += std::string("    .") + f.name + (traits.*f.member ? " = true,\n" : " = false,\n");
  }
  return text + "    .qp_rows = " + std::to_string(traits.qp_rows) +
         ",\n    .valid_visits = " + std::to_string(traits.valid_visits) +
         "};\n\n}  // namespace haptic\n";
}

}  // namespace haptic::tools
