// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_amf_reader: the AMF files of the tests, as text and zipped, with volumes and
/// constellations.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/tools/import/import_files.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  using namespace haptic::tools::test;
  return {{"plain", tetrahedron_amf()},
          {"zipped", zip_of({{"a.amf", tetrahedron_amf("unit=\"inch\"")}}, Packing::kDeflated)},
          {"named", amf_of("<object id=\"a\"><metadata type=\"name\">gear</metadata>" +
                           amf_object("a").substr(15))},
          {"volumes", amf_of(amf_object("1", 2) + amf_object("2"))},
          {"constellations",
           amf_of(amf_object("1") +
                  "<constellation id=\"2\"><instance objectid=\"1\"><deltax>1</deltax></instance>"
                  "<instance objectid=\"1\"><rx>90</rx><ry>90</ry><rz>9</rz></instance>"
                  "</constellation><constellation id=\"3\"><instance objectid=\"2\"/>"
                  "</constellation>")}};
}

}  // namespace haptic::fuzz
