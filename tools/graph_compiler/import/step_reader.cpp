// SPDX-License-Identifier: Apache-2.0
/// The part that Open CASCADE does: STEP text to bodies with exact faces, and these to triangles
/// within a deflection that is measured afterwards.
#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepGProp.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Poly_Triangulation.hxx>
#include <Precision.hxx>
#include <STEPConstruct_UnitContext.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepData_StepModel.hxx>
#include <StepGeom_GeomRepContextAndGlobUnitAssCtxAndGlobUncertaintyAssCtx.hxx>
#include <StepGeom_GeometricRepresentationContextAndGlobalUnitAssignedContext.hxx>
#include <StepRepr_GlobalUnitAssignedContext.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <limits>
#include <set>
#include <streambuf>
#include <string>
#include <vector>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"
#include "tools/graph_compiler/import/import_readers.hpp"
#include "tools/graph_compiler/import/step_products.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// Open CASCADE converts lengths to millimetres from any unit of the file.
constexpr double kReaderUnit_m = 1e-3;
/// Between the normals of neighbouring facets of a round face [rad]: a small round gets as many.
constexpr double kMostTurn_rad = 0.5;
/// How often the mesh is made finer where a middle lies farther off than asked.
constexpr int kMostRefinements = 5;
/// In these the format must be named.
constexpr std::size_t kHeaderBytes = 4096;

/// Bytes that can only be read.
class MemoryBuffer final : public std::streambuf {
 public:
  explicit MemoryBuffer(std::span<const char> bytes) {
    char* begin = const_cast<char*>(bytes.data());  // the interface of streambuf; never written
    setg(begin, begin, begin + bytes.size());
  }
};

[[noreturn]] void refuse_export(const std::string& file, const std::string& defect) {
  refuse_file(file, defect, "export the part again, or as 3MF or STL");
}

/// Metres for the unit of length that the representations of the file share.
double unit_of(const STEPControl_Reader& reader, const std::string& file) {
  const Handle(StepData_StepModel) model = reader.StepModel();
  double unit_m = 0.0;
  for (Standard_Integer k = 1; k <= model->NbEntities(); ++k) {
    const auto context = Handle(StepRepr_GlobalUnitAssignedContext)::DownCast(model->Value(k));
    // A context of several kinds at once holds one of these.
    Handle(StepRepr_GlobalUnitAssignedContext) units = context;
    if (units.IsNull()) {
      const auto all =
          Handle(StepGeom_GeomRepContextAndGlobUnitAssCtxAndGlobUncertaintyAssCtx)::DownCast(
              model->Value(k));
      if (!all.IsNull()) units = all->GlobalUnitAssignedContext();
    }
    if (units.IsNull()) {
      const auto both =
          Handle(StepGeom_GeometricRepresentationContextAndGlobalUnitAssignedContext)::DownCast(
              model->Value(k));
      if (!both.IsNull()) units = both->GlobalUnitAssignedContext();
    }
    if (units.IsNull()) continue;
    STEPConstruct_UnitContext factors;
    factors.ComputeFactors(units);
    if (!factors.LengthDone()) continue;
    const double found_m = factors.LengthFactor() * kReaderUnit_m;
    if (unit_m > 0.0 && std::abs(found_m - unit_m) > 1e-9 * unit_m) {
      refuse_file(file,
                  formatted("it has lengths in units of %.9g m and of %.9g m", unit_m, found_m),
                  "export the parts in one unit");
    }
    unit_m = found_m;
  }
  if (!(std::isfinite(unit_m) && unit_m > 0.0)) {
    refuse_file(file, "it states no unit of length", "export the part with a unit");
  }
  return unit_m;
}

TopoDS_Shape shape_of(STEPControl_Reader& reader, const std::string& file) {
  const Standard_Integer roots = reader.NbRootsForTransfer();
  if (roots < 1) refuse_export(file, "it holds no part");
  const Standard_Integer done = reader.TransferRoots();
  if (done < roots) {
    refuse_export(file, "only " + std::to_string(done) + " of its " + std::to_string(roots) +
                            " parts can be read");
  }
  const TopoDS_Shape shape = reader.OneShape();
  if (shape.IsNull() || !TopExp_Explorer(shape, TopAbs_FACE).More()) {
    refuse_export(file, "it holds no face");
  }
  return shape;
}

Point3 point_of(const gp_Pnt& p) { return {p.X(), p.Y(), p.Z()}; }

/// All faces of a product as triangles [mm], a group for each solid and for the faces of none.
class Facets {
 public:
  Facets(const StepProduct& product, std::size_t& faces, RawMesh& mesh)
      : mesh_(mesh), faces_(faces) {
    for (TopExp_Explorer solid(product.shape, TopAbs_SOLID); solid.More(); solid.Next()) {
      const auto named = product.solid_nodes.find(solid.Current().TShape().get());
      begin_group(named != product.solid_nodes.end() ? named->second : product.node);
      add_faces(solid.Current(), TopAbs_SHAPE);
    }
    begin_group(product.loose_node);
    add_faces(product.shape, TopAbs_SOLID);  // those of no solid
  }
  /// Largest distance found between a middle of a triangle, or of an edge of it, and the face.
  [[nodiscard]] double deviation() const { return deviation_; }
  /// Where the first face is that has an area and no triangles: Open CASCADE may fail at one
  /// deflection and not at another. Empty: there is none.
  [[nodiscard]] const std::string& missing() const { return missing_; }
  /// Faces without area, and so without triangles.
  [[nodiscard]] std::size_t slivers() const { return slivers_; }

 private:
  void begin_group(std::uint32_t node) {
    group_ = static_cast<std::uint32_t>(mesh_.group_nodes.size());
    mesh_.group_nodes.push_back(node);
  }

  void add_faces(const TopoDS_Shape& shape, TopAbs_ShapeEnum but_of) {
    for (TopExp_Explorer face(shape, TopAbs_FACE, but_of); face.More(); face.Next()) {
      ++faces_;
      add_face(TopoDS::Face(face.Current()));
    }
  }

  void add_face(const TopoDS_Face& face) {
    TopLoc_Location location;
    const Handle(Poly_Triangulation) facets = BRep_Tool::Triangulation(face, location);
    if (facets.IsNull() || facets->NbTriangles() == 0) return miss(face);
    if (mesh_.vertices.size() + static_cast<std::size_t>(facets->NbNodes()) > kMaxMeshVertices ||
        mesh_.faces.size() + static_cast<std::size_t>(facets->NbTriangles()) > kMaxMeshFaces) {
      refuse_file(mesh_.file, "it has more than " + std::to_string(kMaxMeshFaces) + " triangles",
                  "give a larger deflection_m");
    }
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (Standard_Integer k = 1; k <= facets->NbNodes(); ++k) {
      mesh_.vertices.push_back(point_of(facets->Node(k).Transformed(location.Transformation())));
    }
    const BRepAdaptor_Surface surface(face);
    const bool round = surface.GetType() != GeomAbs_Plane;
    if (round && !facets->HasUVNodes()) {
      refuse_export(mesh_.file, "the deflection of face " + std::to_string(faces_) +
                                    " of the part cannot be measured");
    }
    for (Standard_Integer k = 1; k <= facets->NbTriangles(); ++k) {
      std::array<Standard_Integer, 3> corner{};
      facets->Triangle(k).Get(corner[0], corner[1], corner[2]);
      if (round) measure(*facets, surface, corner, first);
      if (face.Orientation() == TopAbs_REVERSED) std::swap(corner[1], corner[2]);
      RawFace triangle;
      triangle.group = group_;
      for (const Standard_Integer c : corner) {
        triangle.vertices.push_back(first + static_cast<std::uint32_t>(c - 1));
      }
      mesh_.faces.push_back(std::move(triangle));
    }
  }

  void miss(const TopoDS_Face& face) {
    Bnd_Box box;
    BRepBndLib::Add(face, box, Standard_False);
    GProp_GProps properties;
    BRepGProp::SurfaceProperties(face, properties);
    const double size = box.IsVoid() || box.IsOpen() ? 0.0 : std::sqrt(box.SquareExtent());
    if (std::abs(properties.Mass()) <= Precision::Confusion() * size) {
      ++slivers_;
      return;
    }
    if (!missing_.empty()) return;
    const Point3 low = point_of(box.CornerMin()), high = point_of(box.CornerMax());
    missing_ = formatted("face %zu of the part, near (%.6g, %.6g, %.6g) mm,", faces_,
                         (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2);
  }

  void measure(const Poly_Triangulation& facets, const BRepAdaptor_Surface& surface,
               const std::array<Standard_Integer, 3>& corner, std::uint32_t first) {
    ShellInterior::Triangle triangle;
    std::array<gp_XY, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) {
      triangle[k] = mesh_.vertices[first + static_cast<std::uint32_t>(corner[k] - 1)];
      uv[k] = facets.UVNode(corner[k]).XY();
    }
    const std::array<gp_XY, 4> middles{(uv[0] + uv[1]) / 2, (uv[1] + uv[2]) / 2,
                                       (uv[2] + uv[0]) / 2, (uv[0] + uv[1] + uv[2]) / 3};
    for (const gp_XY& at : middles) {
      const double distance = triangle_distance(point_of(surface.Value(at.X(), at.Y())), triangle);
      if (std::isfinite(distance)) deviation_ = std::max(deviation_, distance);
    }
  }

  RawMesh& mesh_;
  std::size_t& faces_;  ///< of the file so far, for messages
  std::uint32_t group_ = 0;
  double deviation_ = 0.0;
  std::string missing_;
  std::size_t slivers_ = 0;
};

double diagonal_of(const TopoDS_Shape& shape, const std::string& file) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box, Standard_False);
  const double diagonal = box.IsVoid() || box.IsOpen() ? 0.0 : std::sqrt(box.SquareExtent());
  if (!(std::isfinite(diagonal) && diagonal > 0.0)) refuse_export(file, "the part has no extent");
  return diagonal;
}

/// The facets of a product [mm], made finer until they are within what is asked.
/// @param is_made  the faces have triangles already, as those of a further instance.
/// @param slivers  grows by the faces that have no area and are left out.
Deflection add_facets(const StepProduct& product, bool is_made, const ImportOptions& options,
                      std::size_t& faces, std::size_t& slivers, RawMesh& mesh) {
  const double asked =
      options.deflection_m
          ? *options.deflection_m / kReaderUnit_m
          : kDeflectionShare *
                diagonal_of(product.shape.Moved(product.place.Inverted()), mesh.file);
  const std::size_t first_vertex = mesh.vertices.size(), first_face = mesh.faces.size(),
                    first_group = mesh.group_nodes.size(), first_of_file = faces;
  const auto made_with = [&](double deflection) {
    if (!is_made) {
      BRepTools::Clean(product.shape);
      const BRepMesh_IncrementalMesh made(product.shape, deflection, Standard_False, kMostTurn_rad);
    }
    mesh.vertices.resize(first_vertex);
    mesh.faces.resize(first_face);
    mesh.group_nodes.resize(first_group);
    faces = first_of_file;
    return Facets(product, faces, mesh);
  };
  double deflection = asked, found = std::numeric_limits<double>::infinity(), best = 0.0;
  std::string missing;
  std::size_t more_slivers = 0;
  for (int k = 0;; ++k, deflection /= 2) {
    const Facets made = made_with(deflection);
    if (made.missing().empty() && made.deviation() < found) {
      found = made.deviation();
      best = deflection;
      more_slivers = made.slivers();
    }
    missing = made.missing();
    if (found <= asked || k == kMostRefinements || is_made) break;
  }
  if (best == 0.0) refuse_export(mesh.file, missing + " cannot be made of triangles");
  if (best != deflection) static_cast<void>(made_with(best));
  slivers += more_slivers;
  return {asked * kReaderUnit_m, found * kReaderUnit_m};
}

ImportedMesh read_parts(std::span<const char> bytes, const std::string& file,
                        const ImportOptions& options) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  MemoryBuffer buffer(bytes);
  std::istream stream(&buffer);
  STEPControl_Reader reader;
  if (reader.ReadStream("part", stream) != IFSelect_RetDone) {
    refuse_export(file, "it is no STEP file that Open CASCADE reads");
  }
  ImportedMesh imported;
  imported.unit_m = unit_of(reader, file);
  const TopoDS_Shape shape = shape_of(reader, file);
  RawMesh& mesh = imported.mesh;
  mesh.file = file;
  const std::vector<StepProduct> products = step_products(reader, shape, mesh.nodes);
  imported.deflection = Deflection{};
  imported.node_deflections.resize(mesh.nodes.size());
  std::set<const Standard_Transient*> made;
  std::size_t faces = 0, slivers = 0;
  for (const StepProduct& product : products) {
    const bool is_made = product.definition != nullptr && !made.insert(product.definition).second;
    const Deflection deflection = add_facets(product, is_made, options, faces, slivers, mesh);
    imported.deflection->asked_m = std::max(imported.deflection->asked_m, deflection.asked_m);
    imported.deflection->found_m = std::max(imported.deflection->found_m, deflection.found_m);
    for (const std::uint32_t node : product.nodes()) imported.node_deflections[node] = deflection;
  }
  for (Point3& p : mesh.vertices) p = vec::scaled(p, kReaderUnit_m);
  if (slivers > 0) {
    mesh.warnings.push_back("left out: " + std::to_string(slivers) +
                            (slivers == 1 ? " face" : " faces") +
                            " without area, narrower than 1e-10 m");
  }
  return imported;
}

ImportedMesh read(std::span<const char> bytes, const std::string& file,
                  const ImportOptions& options) {
  try {
    return read_parts(bytes, file, options);
  } catch (const Standard_Failure& failure) {
    const char* reason = failure.GetMessageString();
    refuse_export(file, "Open CASCADE gives it up" + (reason != nullptr && *reason != '\0'
                                                          ? " (" + shown_word(reason) + ")"
                                                          : std::string()));
  }
}

}  // namespace

bool can_import_step() { return true; }

ImportedMesh import_step(std::span<const char> bytes, const std::string& file,
                         const ImportOptions& options) {
  check_mesh_bytes(bytes.size(), file);
  const std::string_view text(bytes.data(), bytes.size());
  if (text.substr(0, kHeaderBytes).find("ISO-10303-21") == std::string_view::npos) {
    refuse_file(file, "it does not begin with ISO-10303-21, as a STEP file does",
                "rename the file, or export the part again");
  }
  return guarded(file, [&] { return read(bytes, file, options); });
}

}  // namespace haptic::tools
