// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A handle in memory of the caller, for the time of one call: known by its first word, and one
/// thread's alone.

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rt_core/haptic_core.hpp"
#include "tools/library/haptic.h"

namespace haptic::tools {

static_assert(HAPTIC_ALIGNMENT == kStateAlignment && HAPTIC_ALIGNMENT == kSceneAlignment);

/// Latest time that a caller may give; in nanoseconds it fits 64 bits.
inline constexpr double kMostTime_s = 9.0e9;

[[nodiscard]] inline bool is_aligned(const void* p) noexcept {
  return reinterpret_cast<std::uintptr_t>(p) % HAPTIC_ALIGNMENT == 0;
}

[[nodiscard]] constexpr std::size_t aligned_size(std::size_t bytes) noexcept {
  return (bytes + kStateAlignment - 1) / kStateAlignment * kStateAlignment;
}

/// HAPTIC_OK, or why `handle` is no open one. `Handle` has `magic`, `busy`, kOpenMagic and
/// kClosedMagic.
template <class Handle>
[[nodiscard]] int open_error(const Handle* handle) noexcept {
  if (handle == nullptr) return HAPTIC_ERROR_NULL;
  if (!is_aligned(handle)) return HAPTIC_ERROR_HANDLE;
  const std::uint64_t magic = handle->magic.load(std::memory_order_relaxed);
  if (magic == Handle::kOpenMagic) return HAPTIC_OK;
  return magic == Handle::kClosedMagic ? HAPTIC_ERROR_CLOSED : HAPTIC_ERROR_HANDLE;
}

template <class Handle>
class HandleCall {
 public:
  explicit HandleCall(Handle* handle) noexcept {
    error_ = take(handle);
    if (error_ == HAPTIC_OK) handle_ = handle;
  }
  ~HandleCall() {
    // Release: the next call finds what this one has written.
    if (handle_ != nullptr) handle_->busy.store(false, std::memory_order_release);
  }
  HandleCall(const HandleCall&) = delete;
  HandleCall& operator=(const HandleCall&) = delete;

  [[nodiscard]] int error() const noexcept { return error_; }
  [[nodiscard]] Handle& operator*() const noexcept { return *handle_; }

 private:
  static int take(Handle* handle) noexcept {
    if (const int error = open_error(handle); error != HAPTIC_OK) return error;
    if (handle->busy.exchange(true, std::memory_order_acquire)) return HAPTIC_ERROR_BUSY;
    const int error = open_error(handle);  // closed meanwhile
    if (error != HAPTIC_OK) handle->busy.store(false, std::memory_order_release);
    return error;
  }

  Handle* handle_ = nullptr;
  int error_ = HAPTIC_OK;
};

}  // namespace haptic::tools
