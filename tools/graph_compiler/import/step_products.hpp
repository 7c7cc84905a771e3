// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Products of a STEP file at the places where its assemblies have them. Needs Open CASCADE; not
/// used outside this folder.

#include <STEPControl_Reader.hxx>
#include <Standard_Transient.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Shape.hxx>
#include <cstdint>
#include <map>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// A product with shapes of its own at one of its places.
struct StepProduct {
  TopoDS_Shape shape;     ///< its own shapes in one, at their place in the file
  TopLoc_Location place;  ///< of the product
  const Standard_Transient* definition = nullptr;  ///< the same for all instances; null: none
  std::uint32_t node = 0;                          ///< index of its node
  std::uint32_t loose_node = 0;                    ///< of the faces that are of no solid
  /// Nodes of its solids, where they have their own: the product is the only one, and has several.
  std::map<const Standard_Transient*, std::uint32_t> solid_nodes;

  /// All of these.
  [[nodiscard]] std::vector<std::uint32_t> nodes() const {
    std::vector<std::uint32_t> all{node, loose_node};
    for (const auto& [solid, own] : solid_nodes) all.push_back(own);
    return all;
  }
};

/// Adds the nodes of the file: assemblies above the products that they place, under the names of
/// the products. Parts are the products with shapes of their own; of a single one with several
/// solids these, under the names of their bodies.
/// @param shape  what was transferred, all roots in one.
std::vector<StepProduct> step_products(const STEPControl_Reader& reader, const TopoDS_Shape& shape,
                                       std::vector<MeshNode>& nodes);

}  // namespace haptic::tools
