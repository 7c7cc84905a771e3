// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/command_tap.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <string>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "hal/local/carrier_memory.hpp"

namespace haptic::sim {
namespace {

constexpr int kTapPriority = 82;  // above the device, which stands for hardware
constexpr std::int64_t kLook_ns = 500'000, kLookForMemory_ns = 20'000'000;

/// The commands' half that a process holds open, mapped by us; null: it has none.
class TappedHalf {
 public:
  ~TappedHalf() { close(); }
  TappedHalf() = default;
  TappedHalf(const TappedHalf&) = delete;
  TappedHalf& operator=(const TappedHalf&) = delete;

  /// True: it is another memory than before.
  bool open(pid_t process) {
    std::error_code error;
    const std::filesystem::path folder = "/proc/" + std::to_string(process) + "/fd";
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error)) {
      std::error_code gone;
      const std::string name = std::filesystem::read_symlink(at->path(), gone).string();
      if (gone || name.rfind("/memfd:haptic commands", 0) != 0) continue;
      const int file = ::open(at->path().c_str(), O_RDONLY | O_CLOEXEC);
      if (file < 0) continue;
      struct stat found {};
      const bool is_known = fstat(file, &found) == 0 && found.st_ino == inode_;
      if (is_known || found.st_size < static_cast<off_t>(sizeof(hal::CarrierHalf))) {
        ::close(file);
        return false;
      }
      close();
      void* const memory = mmap(nullptr, sizeof(hal::CarrierHalf), PROT_READ, MAP_SHARED, file, 0);
      ::close(file);
      if (memory == MAP_FAILED) return false;
      half_ = static_cast<const hal::CarrierHalf*>(memory);
      inode_ = found.st_ino;
      return true;
    }
    return false;
  }
  [[nodiscard]] const hal::CarrierHalf* half() const { return half_; }

 private:
  void close() {
    if (half_ != nullptr) munmap(const_cast<hal::CarrierHalf*>(half_), sizeof(hal::CarrierHalf));
    half_ = nullptr;
  }
  const hal::CarrierHalf* half_ = nullptr;
  ino_t inode_ = 0;
};

bool decoded(const hal::CarriedBytes& carried, TappedCommand& to) {
  hal::ReferenceCommand command;
  if (hal::decode(carried.used(), command) != hal::CodecVerdict::kOk) return false;
  to = {carried.stamp_ns, {}};
  for (int k = 0; command.drives_on && k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    to.wrench.force_w[k] = command.force[at] * hal::kReferenceForceUnit_n;
    to.wrench.torque_w[k] = command.torque[at] * hal::kReferenceTorqueUnit_nm;
  }
  return true;
}

}  // namespace

void CommandTap::begin(pid_t process) {
  thread_ = std::thread([this, process] { follow(process); });
}

std::vector<TappedCommand> CommandTap::end() {
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
  std::stable_sort(commands_.begin(), commands_.end(),
                   [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  return std::move(commands_);
}

void CommandTap::follow(pid_t process) {
  (void)hal::set_fifo_priority(kTapPriority);
  TappedHalf tapped;
  std::int64_t look_again_ns = 0;
  RecordWord seen = 0;
  while (!stop_.load()) {
    const std::int64_t now = hal::monotonic_ns();
    if (now >= look_again_ns) {
      look_again_ns = now + kLookForMemory_ns;
      if (tapped.open(process)) seen = 0;
    }
    if (const hal::CarrierHalf* const half = tapped.half()) {
      const RecordWord newest = half->newest.load(std::memory_order_acquire);
      // Those that came since the last look, as far as they are still in their slots.
      const RecordWord slots = half->ring.size();
      for (RecordWord k = std::min<RecordWord>(newest - seen, slots); k-- > 0;) {
        hal::CarrierHalf::Words words;
        const RecordWord stamp = newest - k;
        if (!half->ring[hal::CarrierHalf::slot_of(stamp)].record.copy(stamp, words)) continue;
        TappedCommand command;
        if (decoded(std::bit_cast<hal::CarriedBytes>(words), command)) commands_.push_back(command);
      }
      seen = newest;
    }
    (void)hal::sleep_until(now + kLook_ns);
  }
}

}  // namespace haptic::sim
