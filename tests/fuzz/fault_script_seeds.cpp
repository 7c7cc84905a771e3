// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_fault_script: every kind with what it may say, and scripts that are refused.
#include "host_sim/device/device_fault.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  std::string all = "format = 1\n";
  std::vector<Seed> list;
  unsigned report = 0;
  for (const sim::DeviceFaultRule& rule : sim::device_fault_kinds()) {
    std::string one = "[[fault]]\nkind = \"" + std::string(rule.name) +
                      "\"\nreport = " + std::to_string(++report) + "\n";
    if (rule.counted) one += "count = 3\n";
    if (rule.low < rule.high) one += "amount = 1\n";
    if (rule.has_endpoint) one += "endpoint = \"out\"\n";
    all += one;
    list.push_back({rule.name, "format = 1\n" + one + one});
  }
  const std::string lost = "format = 1\n[[fault]]\nkind = \"lost\"\n";
  list.push_back({"all", all});
  list.push_back({"none", "format = 1\n"});
  list.push_back({"by_time", lost + "t_s = 0.0205\ncount = 1000000\n"});
  list.push_back({"late_twice",
                  "format=1\nfault=[{kind='late',report=1,count=4,amount=7},{kind='late',report=2,"
                  "count=2,amount=3},{kind='doubled',report=1,count=40},{kind='reordered',report="
                  "3,count=9},{kind='frozen',report=1000000000}]\n"});
  list.push_back({"both_times", lost + "t_s = 1\nreport = 1\n"});
  list.push_back({"no_list", "format = 1\nfault = 3\n"});
  list.push_back({"other_format", "format = 2\nextra = 1\n"});
  list.push_back({"beyond", lost + "report = 1000000001\ncount = -1\n"});
  list.push_back({"not_finite", lost + "t_s = nan\n"});
  list.push_back({"not_toml", "format = = 1"});
  return list;
}

}  // namespace haptic::fuzz
