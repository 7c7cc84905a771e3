// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/step_products.hpp"

#include <BRep_Builder.hxx>
#include <StepBasic_Product.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionFormation.hxx>
#include <StepData_StepModel.hxx>
#include <StepRepr_NextAssemblyUsageOccurrence.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepShape_SolidModel.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Iterator.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <set>
#include <string>

#include "tools/graph_compiler/mesh/mesh_nodes.hpp"

namespace haptic::tools {
namespace {

constexpr int kDeepestProduct = 200;

std::string text_of(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? std::string() : std::string(text->ToCString());
}

class ProductReader {
 public:
  ProductReader(const STEPControl_Reader& reader, std::vector<MeshNode>& nodes) : nodes_(nodes) {
    const Handle(XSControl_TransferReader) transfer = reader.WS()->TransferReader();
    const Handle(Transfer_TransientProcess) process = transfer->TransientProcess();
    const Handle(StepData_StepModel) model = reader.StepModel();
    std::set<const Standard_Transient*> assemblies;
    for (Standard_Integer k = 1; k <= model->NbEntities(); ++k) {
      const auto use = Handle(StepRepr_NextAssemblyUsageOccurrence)::DownCast(model->Value(k));
      if (!use.IsNull()) assemblies.insert(use->RelatingProductDefinition().get());
    }
    for (Standard_Integer k = 1; k <= model->NbEntities(); ++k) {
      const Handle(Standard_Transient) entity = model->Value(k);
      const auto definition = Handle(StepBasic_ProductDefinition)::DownCast(entity);
      const auto solid = Handle(StepShape_SolidModel)::DownCast(entity);
      if (definition.IsNull() && solid.IsNull()) continue;
      const TopoDS_Shape shape = TransferBRep::ShapeResult(process, entity);
      if (shape.IsNull()) continue;
      const Standard_Transient* key = shape.TShape().get();
      if (!solid.IsNull()) {
        solids_.try_emplace(key, tidy_name(text_of(solid->Name()), "solid"));
      } else if (assemblies.contains(definition.get())) {
        // An assembly of one part may have the shape of the part.
        products_.try_emplace(key, name_of(definition));
      } else {
        products_.insert_or_assign(key, name_of(definition));
      }
    }
  }

  std::vector<StepProduct> read(const TopoDS_Shape& shape) {
    StepProduct all;  // shapes of no product
    add(shape, MeshNode::kNone, all, 0);
    if (!all.shape.IsNull()) {
      all.node = node("part", MeshNode::kNone);
      all.definition = nullptr;
      found_.push_back(std::move(all));
    }
    for (StepProduct& product : found_) {
      product.loose_node = product.node;
      nodes_[product.node].is_part = true;
    }
    if (found_.size() == 1) name_solids(found_.front());
    return std::move(found_);
  }

 private:
  static std::string name_of(const Handle(StepBasic_ProductDefinition) & definition) {
    const Handle(StepBasic_ProductDefinitionFormation) formation = definition->Formation();
    const Handle(StepBasic_Product) product =
        formation.IsNull() ? Handle(StepBasic_Product)() : formation->OfProduct();
    if (product.IsNull()) return "part";
    return tidy_name(text_of(product->Name()), tidy_name(text_of(product->Id()), "part"));
  }

  std::uint32_t node(const std::string& name, std::uint32_t parent) {
    nodes_.push_back({name, parent, false});
    return static_cast<std::uint32_t>(nodes_.size() - 1);
  }

  static void add_own(const TopoDS_Shape& shape, StepProduct& product) {
    const BRep_Builder builder;
    if (product.shape.IsNull()) {
      TopoDS_Compound compound;
      builder.MakeCompound(compound);
      product.shape = compound;
    }
    builder.Add(product.shape, shape);
  }

  /// @param above  the product that the shape stands in.
  void add(const TopoDS_Shape& shape, std::uint32_t parent, StepProduct& above, int depth) {
    const auto named = products_.find(shape.TShape().get());
    if (named == products_.end()) return add_shapes(shape, parent, above, depth);
    StepProduct product;
    product.place = shape.Location();
    product.definition = shape.TShape().get();
    product.node = node(named->second, parent);
    add_shapes(shape, product.node, product, depth);
    if (!product.shape.IsNull()) found_.push_back(std::move(product));
  }

  void add_shapes(const TopoDS_Shape& shape, std::uint32_t parent, StepProduct& of, int depth) {
    if (shape.ShapeType() != TopAbs_COMPOUND || depth > kDeepestProduct) {
      return add_own(shape, of);
    }
    for (TopoDS_Iterator it(shape); it.More(); it.Next()) add(it.Value(), parent, of, depth + 1);
  }

  void name_solids(StepProduct& product) {
    std::vector<const Standard_Transient*> solids;
    for (TopExp_Explorer solid(product.shape, TopAbs_SOLID); solid.More(); solid.Next()) {
      solids.push_back(solid.Current().TShape().get());
    }
    const bool is_loose = TopExp_Explorer(product.shape, TopAbs_FACE, TopAbs_SOLID).More();
    if (solids.size() + (is_loose ? 1 : 0) < 2) return;
    nodes_[product.node].is_part = false;
    for (const Standard_Transient* solid : solids) {
      const auto named = solids_.find(solid);
      const auto [at, is_new] = product.solid_nodes.try_emplace(solid, 0);
      if (!is_new) continue;
      at->second = node(named != solids_.end() ? named->second : "solid", product.node);
      nodes_[at->second].is_part = true;
    }
    if (!is_loose) return;
    product.loose_node = node("faces", product.node);
    nodes_[product.loose_node].is_part = true;
  }

  std::vector<MeshNode>& nodes_;
  std::map<const Standard_Transient*, std::string> products_, solids_;
  std::vector<StepProduct> found_;
};

}  // namespace

std::vector<StepProduct> step_products(const STEPControl_Reader& reader, const TopoDS_Shape& shape,
                                       std::vector<MeshNode>& nodes) {
  return ProductReader(reader, nodes).read(shape);
}

}  // namespace haptic::tools
