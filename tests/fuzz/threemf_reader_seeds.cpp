// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_threemf_reader: components, a further model, mirrored places, what is left out,
/// and settings of slicers.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/tools/import/import_files.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  using namespace haptic::tools::test;
  const std::string zero(1, '\0'), item = "<item objectid=\"1\"/>";
  const std::string object = object_of_3mf("1");
  const std::string components =
      "<object id=\"2\"><components><component objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 5 6 "
      "7\"/><component objectid=\"1\" p:path=\"/a.model\"/></components></object>";
  return {
      {"plain", metre_model_of_3mf(object, item)},
      {"models", metre_model_of_3mf(object + components, "<item objectid=\"2\"/>",
                                    "requiredextensions=\"p m\"") +
                     zero + metre_model_of_3mf(object, "")},
      {"nodes", metre_model_of_3mf(object_of_3mf("1", "name=\"a\"") + components,
                                   item + "<item objectid=\"2\"/>" + item) +
                    zero + metre_model_of_3mf(object, "")},
      {"left_out", metre_model_of_3mf(object + object_of_3mf("2", "type=\"support\"") +
                                          object_of_3mf("3", "name=\"n\""),
                                      item + "<item objectid=\"2\"/>"
                                             "<item objectid=\"3\" printable=\"0\"/>")},
      {"slicers", metre_model_of_3mf(object + components, item + "<item objectid=\"2\"/>") + zero +
                      metre_model_of_3mf(object, "") + zero +
                      "<config><object id=\"1\"><volume firstid=\"3\" lastid=\"3\"><metadata "
                      "key=\"volume_type\" value=\"SupportBlocker\"/></volume></object></config>" +
                      zero +
                      "<config><object id=\"2\"><part id=\"1\" subtype=\"modifier_part\"/></object>"
                      "</config>"}};
}

}  // namespace haptic::fuzz
