// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which near nodes of one tick are the same contact of the uncut bodies (contact_identity.hpp):
/// sorted once, so that no node has to be compared with those that are other contacts.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/contact_identity.hpp"

namespace haptic {

/// Nodes are numbers in the tick's list of near nodes, classes numbers below the room for nodes.
class ContactClasses {
 public:
  /// Room for `near_nodes` nodes.
  void place(Arena& arena, std::size_t near_nodes) noexcept;
  void clear() noexcept { order_.clear(); }
  /// Takes in node `k` of patch `patch`; each node at most once between two calls of `clear`.
  void add(std::uint32_t k, std::uint32_t patch, std::uint32_t body_b,
           const ContactIdentity& identity) noexcept;
  /// Forms the classes of what was added. Cost: O(n log n); no recursion.
  void form() noexcept;
  [[nodiscard]] std::uint32_t patch_of(std::uint32_t k) const noexcept { return nodes_[k].patch; }
  [[nodiscard]] std::uint32_t class_of(std::uint32_t k) const noexcept { return nodes_[k].begin; }

  struct Member {
    std::uint64_t key = 0;  ///< equal for equal identities
    std::uint32_t node = 0;
  };
  /// Nodes of the class of `k`, itself among them, by ascending number.
  [[nodiscard]] std::span<const Member> same_as(std::uint32_t k) const noexcept {
    return order_.view().subspan(nodes_[k].begin, nodes_[nodes_[k].first].count);
  }

 private:
  struct Node {
    ContactIdentity identity;
    std::uint32_t body_b = 0, patch = 0;
    std::uint32_t begin = 0;  ///< of its class in the order
    std::uint32_t first = 0;  ///< node of the class, which has its count
    std::uint32_t count = 0;
  };
  [[nodiscard]] bool comes_before(const Member& l, const Member& r) const noexcept;
  [[nodiscard]] bool are_one(const Member& l, const Member& r) const noexcept;

  std::span<Node> nodes_;  ///< by near node
  BoundedList<Member> order_;
};

}  // namespace haptic
