// SPDX-License-Identifier: Apache-2.0
/// Report flow, output guard and driver against anything that bus, servo, operator and clock may
/// do: the language is that of tests/hal/link_bench.hpp, the judge its monitor.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/hal/link_bench.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  haptic::test::LinkBench bench;
  if (const std::string broken = bench.run({data, size}); !broken.empty())
    throw haptic::fuzz::PropertyBroken(broken);
  return 0;
}
