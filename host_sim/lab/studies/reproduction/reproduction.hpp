// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every table and figure of the paper, ours next to the paper's: the parts in their order and the
/// index that shows them all.

#include <span>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// The index page: findings next to the paper's, then the section of every part.
[[nodiscard]] std::string index_page(std::span<const PartReport> parts, bool quick);

/// Makes all parts and writes their files and README.md into `folder`, which is made when absent.
/// Files appear whole, each as soon as its part is done; the index last.
/// @return true when everything that must hold does.
/// @throws tools::InputError when the folder cannot be made or written.
/// Cost: about a minute; with `size.quick` a few seconds.
[[nodiscard]] bool reproduce_paper(const std::string& folder, const ReproductionSize& size);

}  // namespace haptic::sim
