// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/contact_classes.hpp"

#include <algorithm>

namespace haptic {
namespace {

/// Sorts most nodes in one comparison; those with equal keys are compared as a whole.
std::uint64_t key_of(const ContactIdentity& identity, std::uint32_t body_b) noexcept {
  std::uint64_t key = std::uint64_t{body_b} << 8 | static_cast<std::uint64_t>(identity.type);
  for (const std::uint32_t word :
       {identity.of_a[0], identity.of_a[1], identity.of_b[0], identity.of_b[1]}) {
    key = (key ^ word) * 0x9e3779b97f4a7c15ull;
    key ^= key >> 29;
  }
  return key;
}

}  // namespace

void ContactClasses::place(Arena& arena, std::size_t near_nodes) noexcept {
  nodes_ = arena.take<Node>(near_nodes);
  order_ = BoundedList<Member>(arena.take<Member>(near_nodes));
}

void ContactClasses::add(std::uint32_t k, std::uint32_t patch, std::uint32_t body_b,
                         const ContactIdentity& identity) noexcept {
  nodes_[k].identity = identity;
  nodes_[k].body_b = body_b;
  nodes_[k].patch = patch;
  static_cast<void>(order_.push({key_of(identity, body_b), k}));
}

bool ContactClasses::are_one(const Member& l, const Member& r) const noexcept {
  return l.key == r.key && nodes_[l.node].body_b == nodes_[r.node].body_b &&
         nodes_[l.node].identity == nodes_[r.node].identity;
}

bool ContactClasses::comes_before(const Member& l, const Member& r) const noexcept {
  if (l.key != r.key) return l.key < r.key;
  const Node &p = nodes_[l.node], &q = nodes_[r.node];
  if (p.body_b != q.body_b) return p.body_b < q.body_b;
  const auto order = p.identity <=> q.identity;
  return order != 0 ? order < 0 : l.node < r.node;
}

void ContactClasses::form() noexcept {
  const auto before = [this](const Member& l, const Member& r) { return comes_before(l, r); };
  std::make_heap(order_.begin(), order_.end(), before);
  std::sort_heap(order_.begin(), order_.end(), before);
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < order_.size(); ++i) {
    if (!are_one(order_[begin], order_[i])) begin = i;
    const std::uint32_t first = order_[begin].node;
    nodes_[order_[i].node].begin = begin;
    nodes_[order_[i].node].first = first;
    nodes_[first].count = i + 1 - begin;
  }
}

}  // namespace haptic
