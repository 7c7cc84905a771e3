// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/block_program.hpp"

#include <algorithm>

#include "rt_core/proxy/dual_search.hpp"

namespace haptic {
namespace {

/// Vectors of the search in the arena, of one island's unknowns each: z, multipliers, lengths and
/// inverse lengths; rest, part and coefficients of a split; two of scratch; two of a mark.
constexpr std::size_t kVectors = 11;
/// The same of row numbers: the active rows and those of a mark.
constexpr std::size_t kNumberVectors = 2;

/// As of the search of one body, so that one block gives the same bits.
inline Real dot_block(const Real* l, const Real* r) noexcept {
  return ((l[0] * r[0] + l[1] * r[1]) + (l[2] * r[2] + l[3] * r[3])) + (l[4] * r[4] + l[5] * r[5]);
}

/// The g of a row: six numbers at one place of the island's unknowns, or at two.
struct BlockNormal {
  const Real* g_a;
  const Real* g_b;  ///< null: one block
  std::uint32_t at_a, at_b;
};

inline Real height_of(const BlockNormal& g, const Real* z) noexcept {
  const Real height = dot_block(g.g_a, z + g.at_a);
  return g.g_b == nullptr ? height : height + dot_block(g.g_b, z + g.at_b);
}

struct Scaled {
  Real factor;
  const Real* at;
};

/// Elements in the arena. A copy is the same elements; an assignment copies them.
template <typename T>
class Slice {
 public:
  Slice(T* at, std::uint32_t size) noexcept : at_(at), size_(size) {}
  Slice(const Slice&) noexcept = default;
  ~Slice() = default;
  Slice& operator=(const Slice& from) noexcept {
    if (this != &from) std::copy_n(from.at_, size_, at_);
    return *this;
  }
  Slice& operator=(const BlockNormal& g) noexcept {
    fill(0);
    std::copy_n(g.g_a, kBlockSize, at_ + g.at_a);
    if (g.g_b != nullptr) std::copy_n(g.g_b, kBlockSize, at_ + g.at_b);
    return *this;
  }
  [[nodiscard]] T& operator[](std::uint32_t i) const noexcept { return at_[i]; }
  [[nodiscard]] T* begin() const noexcept { return at_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  void fill(T value) noexcept { std::fill_n(at_, size_, value); }
  void operator+=(const Scaled& v) noexcept {
    for (std::uint32_t i = 0; i < size_; ++i) at_[i] += v.factor * v.at[i];
  }
  void operator-=(const Scaled& v) noexcept {
    for (std::uint32_t i = 0; i < size_; ++i) at_[i] -= v.factor * v.at[i];
  }

 private:
  T* at_;
  std::uint32_t size_;
};

using Vector = Slice<Real>;
inline Scaled operator*(Real factor, const Vector& v) noexcept { return {factor, v.begin()}; }

/// Vectors one behind the other.
class Table {
 public:
  Table(Real* at, std::uint32_t size) noexcept : at_(at), size_(size) {}
  [[nodiscard]] Vector operator[](std::uint32_t j) const noexcept {
    return {at_ + std::size_t{j} * size_, size_};
  }

 private:
  Real* at_;
  std::uint32_t size_;
};

/// Rows and memory of one island's search (proxy/dual_search.hpp); the unknowns of its blocks stand
/// in the order of the blocks.
class BlockSpace {
 public:
  static constexpr std::uint32_t kMostUnknowns = kBlockSize * kMostBlocks;
  static constexpr std::uint32_t kMostRows = kMostBlockRows;

  /// `place`: of a block in the island. `reals`: (kVectors + 2 n) n, `numbers`: kNumberVectors n
  /// for an island of n unknowns.
  BlockSpace(const BlockRow* rows, const std::uint8_t* place, std::uint32_t unknowns, Real* reals,
             std::uint16_t* numbers) noexcept
      : z_(reals, unknowns),
        row_(numbers, unknowns),
        multiplier_(reals + unknowns, unknowns),
        length2_(reals + std::size_t{2} * unknowns, unknowns),
        inverse_length2_(reals + std::size_t{3} * unknowns, unknowns),
        orthogonal_(reals + kVectors * unknowns, unknowns),
        factor_(reals + (kVectors + unknowns) * unknowns, unknowns),
        rows_(rows),
        place_(place) {
    z_.fill(0);
  }

  [[nodiscard]] BlockNormal normal(std::uint32_t row) const noexcept {
    const BlockRow& r = rows_[row];
    if (r.b == kNoBlock) return {r.g_a.data(), nullptr, place_[r.a] * kBlockSize, 0};
    return {r.g_a.data(), r.g_b.data(), place_[r.a] * kBlockSize, place_[r.b] * kBlockSize};
  }
  [[nodiscard]] Real violation(std::uint32_t row) const noexcept {
    return rows_[row].h - height_of(normal(row), z_.begin());
  }

 protected:
  using RowNumber = std::uint16_t;
  struct Split {
    explicit Split(const BlockSpace& s) noexcept
        : rest(s.vector(4)), part(s.vector(5)), coefficient(s.vector(6)) {
      part.fill(0);
    }
    Vector rest;
    Real rest2 = 0;
    Vector part, coefficient;
  };
  struct Scratch : Vector {
    explicit Scratch(const BlockSpace& s) noexcept : Vector(s.vector(7)) {}
  };
  template <std::uint32_t k>
  struct Zeros : Vector {
    explicit Zeros(const BlockSpace& s) noexcept : Vector(s.vector(7 + k)) { fill(0); }
  };
  struct Mark {
    Mark(const BlockSpace& s, std::uint32_t active) noexcept
        : z(s.vector(9)),
          multiplier(s.vector(10)),
          row(s.row_.begin() + s.row_.size(), s.row_.size()),
          count(active) {
      z = s.z_;
      multiplier = s.multiplier_;
      row = s.row_;
    }
    Vector z, multiplier;
    Slice<RowNumber> row;
    std::uint32_t count;
  };

  [[nodiscard]] std::uint32_t dimension() const noexcept { return z_.size(); }
  [[nodiscard]] std::uint32_t most_steps() const noexcept {
    return kMaxBlockIterations * (z_.size() / kBlockSize);
  }
  [[nodiscard]] Real height(std::uint32_t row) const noexcept { return rows_[row].h; }
  [[nodiscard]] static Real dot(const Vector& l, const Vector& r) noexcept {
    Real sum = dot_block(l.begin(), r.begin());
    for (std::uint32_t i = kBlockSize; i < l.size(); i += kBlockSize)
      sum += dot_block(l.begin() + i, r.begin() + i);
    return sum;
  }
  [[nodiscard]] static Real dot(const BlockNormal& g, const BlockNormal&) noexcept {
    const Real length2 = dot_block(g.g_a, g.g_a);
    return g.g_b == nullptr ? length2 : length2 + dot_block(g.g_b, g.g_b);
  }

  Vector z_;
  std::uint32_t count_ = 0;
  std::uint32_t iterations_ = 0;
  std::uint32_t skipped_ = 0;
  RowSet<kMostRows> closed_;
  Slice<RowNumber> row_;
  Vector multiplier_, length2_, inverse_length2_;
  Table orthogonal_, factor_;

 private:
  [[nodiscard]] Vector vector(std::uint32_t k) const noexcept {
    return {z_.begin() + std::size_t{k} * z_.size(), z_.size()};
  }

  const BlockRow* rows_;
  const std::uint8_t* place_;
};

/// The row among `rows` that z violates most, by more than `tolerance`, of those that are not
/// closed; the first of them at ties. kMostBlockRows: none.
struct Violation {
  Real amount;
  std::uint32_t row;
};

Violation most_violated(const DualSearch<BlockSpace>& search, std::span<const std::uint16_t> rows,
                        Real tolerance) noexcept {
  Violation worst{tolerance, kMostBlockRows};
  for (const std::uint16_t row : rows) {
    const Real violation = search.violation(row);
    if (violation > worst.amount && !search.closed().contains(row)) worst = {violation, row};
  }
  return worst;
}

}  // namespace

void BlockProgram::place(Arena& arena, std::uint32_t blocks, std::uint32_t most_rows) noexcept {
  blocks = std::min(blocks, kMostBlocks);
  most_rows = std::min(most_rows, kMostBlockRows);
  const std::size_t unknowns = std::size_t{kBlockSize} * blocks;
  rows_ = BoundedList<BlockRow>(arena.take<BlockRow>(most_rows));
  sorted_ = arena.take<std::uint16_t>(most_rows);
  z_ = arena.take<std::array<Real, kBlockSize>>(blocks);
  active_ = BoundedList<std::uint16_t>(arena.take<std::uint16_t>(unknowns));
  multipliers_ = BoundedList<Real>(arena.take<Real>(unknowns));
  search_reals_ = arena.take<Real>((kVectors + 2 * unknowns) * unknowns);
  search_numbers_ = arena.take<std::uint16_t>(kNumberVectors * unknowns);
  find_islands();
}

bool BlockProgram::push(const BlockRow& row) noexcept {
  if (row.a >= z_.size() || rows_.size() == rows_.capacity()) return false;
  BlockRow own = row;
  if (own.b == own.a)
    for (std::uint32_t i = 0; i < kBlockSize; ++i) own.g_a[i] += own.g_b[i];
  if (own.b == own.a || own.b >= z_.size()) own.b = kNoBlock;
  return rows_.push(own);
}

void BlockProgram::find_islands() noexcept {
  for (std::uint32_t k = 0; k < kMostBlocks; ++k) island_[k] = static_cast<std::uint8_t>(k);
  for (const BlockRow& row : rows_) {
    if (row.b == kNoBlock || island_[row.a] == island_[row.b]) continue;
    // At most seven times, so that a pass over the blocks is cheap enough.
    const auto [low, high] = std::minmax({island_[row.a], island_[row.b]});
    for (std::uint8_t& island : island_) island = island == high ? low : island;
  }
  size_.fill(0);
  for (std::uint32_t k = 0; k < z_.size(); ++k) place_[k] = size_[island_[k]]++;
}

void BlockProgram::sort_rows() noexcept {
  count_.fill(0);
  for (const BlockRow& row : rows_) ++count_[island_[row.a]];
  std::uint32_t end = 0;
  for (std::uint32_t k = 0; k < kMostBlocks; ++k) {
    begin_[k] = static_cast<std::uint16_t>(end);
    end += count_[k];
  }
  std::array<std::uint16_t, kMostBlocks> next = begin_;
  for (std::uint32_t row = 0; row < rows_.size(); ++row)
    sorted_[next[island_[rows_[row].a]]++] = static_cast<std::uint16_t>(row);
}

void BlockProgram::solve(Real tolerance, std::span<const std::uint16_t> first) noexcept {
  active_.clear();
  multipliers_.clear();
  for (std::array<Real, kBlockSize>& z : z_) z.fill(0);
  steps_ = skipped_ = programs_ = more_units_ = 0;
  capped_ = false;
  find_islands();
  sort_rows();
  for (std::uint32_t island = 0; island < z_.size(); ++island)
    if (count_[island] > 0) solve_island(island, tolerance, first);
}

void BlockProgram::solve_island(std::uint32_t island, Real tolerance,
                                std::span<const std::uint16_t> first) noexcept {
  const std::span<const std::uint16_t> rows = sorted_.subspan(begin_[island], count_[island]);
  DualSearch<BlockSpace> search(rows_.begin(), place_.data(), kBlockSize * size_[island],
                                search_reals_.data(), search_numbers_.data());
  for (const std::uint16_t row : first) {
    if (row >= rows_.size() || island_[rows_[row].a] != island || search.closed().contains(row))
      continue;
    const Real violation = search.violation(row);
    if (violation > tolerance) search.enter(row, violation);
  }
  Violation worst = most_violated(search, rows, tolerance);
  while (worst.row != kMostBlockRows && !search.exhausted()) {
    search.enter(worst.row, worst.amount);
    worst = most_violated(search, rows, tolerance);
  }
  capped_ |= worst.row != kMostBlockRows;
  ++programs_;
  steps_ += search.iterations();
  more_units_ += search.iterations() * (kBlockStepUnits[size_[island] - 1u] - kBlockStepUnits[0]);
  skipped_ += search.skipped();
  for (std::uint32_t block = island; block < z_.size(); ++block)
    if (island_[block] == island)
      std::copy_n(search.z().begin() + std::size_t{place_[block]} * kBlockSize, kBlockSize,
                  z_[block].begin());
  for (std::uint32_t j = 0; j < search.count(); ++j) {
    // Rows that touch z but do not hold it are none of the active.
    if (!(search.multiplier(j) > 0)) continue;
    // An island has no more active rows than unknowns, so that there is room.
    static_cast<void>(active_.push(search.row(j)) && multipliers_.push(search.multiplier(j)));
  }
}

}  // namespace haptic
