// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/import/step_files.hpp"

#include <cstdio>
#include <initializer_list>
#include <vector>

namespace haptic::tools::test {
namespace {

using Numbers = std::array<double, 3>;

std::string real(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%#.17g", x);
  return text;
}

/// The data section of a file, an entity a line.
class StepText {
 public:
  std::string add(const std::string& entity) {
    text_ += "#" + std::to_string(++last_) + "=" + entity + ";\n";
    return "#" + std::to_string(last_);
  }
  std::string point(const Numbers& p) { return add("CARTESIAN_POINT(''," + triple(p) + ")"); }
  std::string direction(const Numbers& d) { return add("DIRECTION(''," + triple(d) + ")"); }
  std::string vertex(const std::string& at) { return add("VERTEX_POINT(''," + at + ")"); }
  std::string axes(const Numbers& at, const Numbers& z, const Numbers& x) {
    const std::string p = point(at), a = direction(z), b = direction(x);
    return add("AXIS2_PLACEMENT_3D(''," + p + "," + a + "," + b + ")");
  }
  std::string line(const Numbers& from, const Numbers& along, double length) {
    const std::string p = point(from), d = direction(along);
    const std::string vector = add("VECTOR(''," + d + "," + real(length) + ")");
    return add("LINE(''," + p + "," + vector + ")");
  }
  std::string edge(const std::string& from, const std::string& to, const std::string& curve) {
    return add("EDGE_CURVE(''," + from + "," + to + "," + curve + ",.T.)");
  }
  std::string oriented(const std::string& edge, bool forward) {
    return add("ORIENTED_EDGE('',*,*," + edge + (forward ? ",.T.)" : ",.F.)"));
  }
  std::string face(const std::vector<std::string>& edges, const std::string& surface) {
    const std::string loop = add("EDGE_LOOP('',(" + list(edges) + "))");
    const std::string bound = add("FACE_OUTER_BOUND(''," + loop + ",.T.)");
    return add("ADVANCED_FACE('',(" + bound + ")," + surface + ",.T.)");
  }
  static std::string list(const std::vector<std::string>& items) {
    std::string text;
    for (const std::string& item : items) text += (text.empty() ? "" : ",") + item;
    return text;
  }

  /// A product, as other entities refer to it.
  struct Product {
    std::string definition, representation, frame;
  };

  /// What all products share.
  void begin(const std::string& unit) {
    context_ = context_of(unit);
    application_ = add("APPLICATION_CONTEXT('automotive design')");
  }

  /// With one body for each list of faces.
  Product solids(const std::string& name, const std::vector<std::vector<std::string>>& bodies) {
    const std::string frame = axes({0, 0, 0}, {0, 0, 1}, {1, 0, 0});
    std::string items = frame;
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const std::string shell = add("CLOSED_SHELL('',(" + list(bodies[k]) + "))");
      const std::string body = bodies.size() > 1 ? "body" + std::to_string(k + 1) : "";
      items += "," + add("MANIFOLD_SOLID_BREP('" + body + "'," + shell + ")");
    }
    const std::string shape =
        add("ADVANCED_BREP_SHAPE_REPRESENTATION('',(" + items + ")," + context_ + ")");
    return product(name, shape, frame);
  }

  struct Component {
    Product product;
    Numbers at{};  ///< turned by a right angle about z too
  };
  Product assembly(const std::string& name, const std::vector<Component>& components) {
    const std::string frame = axes({0, 0, 0}, {0, 0, 1}, {1, 0, 0});
    std::string items = frame;
    std::vector<std::string> places;
    for (const Component& component : components) {
      places.push_back(axes(component.at, {0, 0, 1}, {0, 1, 0}));
      items += "," + places.back();
    }
    const std::string shape = add("SHAPE_REPRESENTATION('',(" + items + ")," + context_ + ")");
    const Product whole = product(name, shape, frame);
    for (std::size_t k = 0; k < components.size(); ++k) {
      const Product& part = components[k].product;
      const std::string map =
          add("ITEM_DEFINED_TRANSFORMATION('',''," + part.frame + "," + places[k] + ")");
      const std::string relation =
          add("(REPRESENTATION_RELATIONSHIP('',''," + part.representation + "," +
              whole.representation + ") REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(" + map +
              ") SHAPE_REPRESENTATION_RELATIONSHIP())");
      const std::string use = add("NEXT_ASSEMBLY_USAGE_OCCURRENCE('" + std::to_string(k + 1) +
                                  "','',''," + whole.definition + "," + part.definition + ",$)");
      const std::string placed = add("PRODUCT_DEFINITION_SHAPE('Placement',''," + use + ")");
      add("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(" + relation + "," + placed + ")");
    }
    return whole;
  }

  [[nodiscard]] std::string file() const {
    return "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
           "FILE_NAME('part','',(''),(''),'','','');\n"
           "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n" +
           text_ + "ENDSEC;\nEND-ISO-10303-21;\n";
  }

 private:
  Product product(const std::string& name, const std::string& shape, const std::string& frame) {
    const std::string context = add("PRODUCT_CONTEXT(''," + application_ + ",'mechanical')");
    const std::string made = add("PRODUCT('" + name + "','" + name + "','',(" + context + "))");
    const std::string formation = add("PRODUCT_DEFINITION_FORMATION('',''," + made + ")");
    const std::string design =
        add("PRODUCT_DEFINITION_CONTEXT('part definition'," + application_ + ",'design')");
    const std::string definition =
        add("PRODUCT_DEFINITION('design',''," + formation + "," + design + ")");
    const std::string defined = add("PRODUCT_DEFINITION_SHAPE('',''," + definition + ")");
    add("SHAPE_DEFINITION_REPRESENTATION(" + defined + "," + shape + ")");
    return {definition, shape, frame};
  }

  static std::string triple(const Numbers& p) {
    return "(" + real(p[0]) + "," + real(p[1]) + "," + real(p[2]) + ")";
  }

  std::string context_of(const std::string& unit) {
    if (unit.empty()) {
      return add("(GEOMETRIC_REPRESENTATION_CONTEXT(3) REPRESENTATION_CONTEXT('',''))");
    }
    std::string length;
    if (unit == kStepInch) {
      const std::string mm =
          add(std::string("(LENGTH_UNIT() NAMED_UNIT(*) ") + kStepMillimetre + ")");
      const std::string dimensions = add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
      const std::string measure = add("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4)," + mm + ")");
      length = add("(CONVERSION_BASED_UNIT('INCH'," + measure + ") LENGTH_UNIT() NAMED_UNIT(" +
                   dimensions + "))");
    } else {
      length = add("(LENGTH_UNIT() NAMED_UNIT(*) " + unit + ")");
    }
    const std::string angle = add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))");
    const std::string solid_angle =
        add("(NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT())");
    const std::string uncertainty = add("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07)," +
                                        length + ",'distance_accuracy_value','')");
    return add("(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((" +
               uncertainty + ")) GLOBAL_UNIT_ASSIGNED_CONTEXT((" + length + "," + angle + "," +
               solid_angle + ")) REPRESENTATION_CONTEXT('',''))");
  }

  std::string text_, context_, application_;
  int last_ = 0;
};

/// The faces of a box from `low` on.
std::vector<std::string> box_faces(StepText& step, const Numbers& low, const Numbers& size) {
  std::array<Numbers, 8> corners{};
  std::vector<std::string> vertices;
  for (std::size_t k = 0; k < 8; ++k) {
    for (std::size_t i = 0; i < 3; ++i)
      corners[k][i] = low[i] + (((k >> i) & 1) != 0 ? size[i] : 0.0);
    vertices.push_back(step.vertex(step.point(corners[k])));
  }
  // By the lower corner and the axis.
  std::array<std::array<std::string, 3>, 8> edges;
  for (std::size_t k = 0; k < 8; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (((k >> i) & 1) != 0) continue;
      Numbers along{};
      along[i] = 1;
      edges[k][i] = step.edge(vertices[k], vertices[k | (std::size_t{1} << i)],
                              step.line(corners[k], along, size[i]));
    }
  }
  std::vector<std::string> faces;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, l = (i + 2) % 3;
    const std::size_t up_j = std::size_t{1} << j, up_l = std::size_t{1} << l;
    for (const bool high : {false, true}) {
      const std::size_t at = high ? std::size_t{1} << i : 0;
      Numbers normal{}, x{};
      normal[i] = high ? 1 : -1;
      x[j] = 1;
      // Counter-clockwise about +i; the lower face runs the other way round.
      std::vector<std::string> loop;
      if (high) {
        loop = {step.oriented(edges[at][j], true), step.oriented(edges[at | up_j][l], true),
                step.oriented(edges[at | up_l][j], false), step.oriented(edges[at][l], false)};
      } else {
        loop = {step.oriented(edges[at][l], true), step.oriented(edges[at | up_l][j], true),
                step.oriented(edges[at | up_j][l], false), step.oriented(edges[at][j], false)};
      }
      const std::string plane = step.add("PLANE(''," + step.axes(corners[at], normal, x) + ")");
      faces.push_back(step.face(loop, plane));
    }
  }
  return faces;
}

}  // namespace

std::string step_box(const std::array<double, 3>& size, const std::string& unit) {
  StepText step;
  step.begin(unit);
  step.solids("part", {box_faces(step, {0, 0, 0}, size)});
  return step.file();
}

std::string step_box_with_sliver() {
  StepText step;
  step.begin(kStepMillimetre);
  std::vector<std::string> faces = box_faces(step, {0, 0, 0}, {10, 20, 30});
  const std::string from = step.vertex(step.point({0, 0, 30})),
                    to = step.vertex(step.point({10, 0, 30}));
  const std::string edge = step.edge(from, to, step.line({0, 0, 30}, {1, 0, 0}, 10));
  faces.push_back(
      step.face({step.oriented(edge, true), step.oriented(edge, false)},
                step.add("PLANE(''," + step.axes({0, 0, 30}, {0, 0, 1}, {1, 0, 0}) + ")")));
  step.solids("part", {faces});
  return step.file();
}

std::string step_bodies() {
  StepText step;
  step.begin(kStepMillimetre);
  step.solids("part", {box_faces(step, {0, 0, 0}, {10, 20, 30}),
                       box_faces(step, {100, 0, 0}, {10, 20, 30})});
  return step.file();
}

std::string step_assembly() {
  StepText step;
  step.begin(kStepMillimetre);
  const auto plate = step.solids("plate", {box_faces(step, {0, 0, 0}, {100, 100, 10})});
  const auto bolt = step.solids("bolt", {box_faces(step, {0, 0, 0}, {10, 20, 30})});
  const auto nut = step.solids("nut", {box_faces(step, {0, 0, 0}, {8, 8, 8})});
  const auto pair = step.assembly("pair", {{bolt, {0, 0, 0}}, {bolt, {0, 50, 0}}});
  step.assembly("machine", {{plate, {0, 0, 0}}, {pair, {0, 0, 10}}, {nut, {0, 0, 50}}});
  return step.file();
}

std::string step_cylinder(double radius, double height, const std::string& unit) {
  StepText step;
  step.begin(unit);
  const Numbers low{radius, 0, 0}, high{radius, 0, height};
  const std::string v_low = step.vertex(step.point(low)), v_high = step.vertex(step.point(high));
  const auto circle = [&](double z) {
    return step.add("CIRCLE(''," + step.axes({0, 0, z}, {0, 0, 1}, {1, 0, 0}) + "," + real(radius) +
                    ")");
  };
  const std::string e_low = step.edge(v_low, v_low, circle(0));
  const std::string e_high = step.edge(v_high, v_high, circle(height));
  const std::string seam = step.edge(v_low, v_high, step.line(low, {0, 0, 1}, height));
  const std::string around =
      step.add("CYLINDRICAL_SURFACE(''," + step.axes({0, 0, 0}, {0, 0, 1}, {1, 0, 0}) + "," +
               real(radius) + ")");
  const std::vector<std::string> faces{
      step.face({step.oriented(e_low, true), step.oriented(seam, true),
                 step.oriented(e_high, false), step.oriented(seam, false)},
                around),
      step.face({step.oriented(e_low, false)},
                step.add("PLANE(''," + step.axes({0, 0, 0}, {0, 0, -1}, {1, 0, 0}) + ")")),
      step.face({step.oriented(e_high, true)},
                step.add("PLANE(''," + step.axes({0, 0, height}, {0, 0, 1}, {1, 0, 0}) + ")"))};
  step.solids("part", {faces});
  return step.file();
}

}  // namespace haptic::tools::test
