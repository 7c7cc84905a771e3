// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_urdf_link: links of every form.
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

std::string robot(const std::string& collisions) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"r\">\n<link name=\"b\"/>\n<link name=\"a\">\n" +
         collisions + "</link>\n</robot>\n";
}

std::string collision(const std::string& form, const std::string& origin = "") {
  return "<collision>" + origin + "<geometry>" + form + "</geometry></collision>\n";
}

}  // namespace

std::vector<Seed> seeds() {
  return {
      {"forms", robot(collision("<box size=\"0.1 0.2 0.3\"/>",
                                "<origin xyz=\"1 2 3\" rpy=\"0.1 0.2 0.3\"/>") +
                      collision("<cylinder radius=\"0.1\" length=\"1\"/>") +
                      collision("<sphere radius=\"1e-3\"/>"))},
      {"mesh", robot(collision("<mesh filename=\"tetrahedron.obj\" scale=\"1 2 0.5\"/>",
                               "<origin xyz=\"0 0 1\"/>"))},
      {"package", robot(collision("<mesh filename=\"package://tetrahedron_on_box/box.stl\"/>"))},
      {"joints",
       "<robot><link name=\"w\"/><link name=\"a\">" + collision("<box size=\"1 1 1\"/>") +
           "</link><link name=\"b\">" + collision("<sphere radius=\"1\"/>") +
           "</link><joint name=\"j\" type=\"revolute\"><origin xyz=\"0 0 1\" rpy=\"0 0 1.5\"/>"
           "<parent link=\"w\"/><child link=\"a\"/><limit lower=\"0.5\" upper=\"1\"/></joint>"
           "<joint name=\"k\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>"
           "</robot>"},
      {"bare", robot("")},
      {"unknown", robot(collision("<torus radius=\"1\"/>"))}};
}

}  // namespace haptic::fuzz
