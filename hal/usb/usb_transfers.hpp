// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The transfers of one connection: some IN ones always queued, one OUT. Made once, submitted again
/// and again; what fails is tried again a bounded number of times, then the connection counts as
/// lost.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "hal/usb/report_transfers.hpp"
#include "hal/usb/usb_connection.hpp"

struct libusb_transfer;

namespace haptic::hal {

struct LinkCounters;
class LinkTape;
enum class LinkEventKind : std::uint8_t;

/// Errors in a row, of one direction, after which the connection is given up.
inline constexpr unsigned kMostUsbErrorsInRow = 10;
/// Longest answer to the request that clears a halt: what USB 2.0 allows (9.2.6.4).
inline constexpr std::int64_t kLongestClear_ns = 50'000'000;

/// Owner: the USB thread. Nothing is allocated between `open` and `close` but what libusb allocates
/// itself on a submit.
class UsbTransfers final : public ReportTransfers {
 public:
  UsbTransfers(TransferSink& sink, LinkCounters& counters) noexcept;
  ~UsbTransfers() override;
  UsbTransfers(const UsbTransfers&) = delete;
  UsbTransfers& operator=(const UsbTransfers&) = delete;

  void tape(LinkTape* tape) noexcept { tape_ = tape; }

  /// Makes the transfers and queues the IN ones. @return a libusb code. Allocates.
  int open(const UsbConnection& connection, const UsbProfile& profile, int in_count);

  [[nodiscard]] std::span<std::uint8_t> out_bytes() noexcept override;
  [[nodiscard]] bool busy() const noexcept override;
  SendOutcome send(std::size_t bytes) noexcept override;
  void cancel_out() noexcept override;

  /// After handle_events: clears stalled endpoints and queues what could not be queued; what is
  /// refused again is left alone for two milliseconds. Never waits: the request that clears a halt
  /// is a transfer like the others, and one that is not answered within kLongestClear_ns ends the
  /// connection. (libusb_clear_halt waits up to 5 s, and the kernel lets nothing be submitted
  /// meanwhile, from any thread.) What the kernel's call does besides is to reset its own data
  /// toggle; a host controller that has not done so at the stall loses one transfer more.
  void requeue(std::int64_t now_ns) noexcept;

  /// Nothing is queued any more, and all that is in flight is cancelled.
  void stop() noexcept;
  [[nodiscard]] unsigned in_flight() const noexcept;
  /// Frees the transfers. Those still in flight, which the kernel may yet write to, are left alone
  /// for ever.
  void close() noexcept;

  /// The bus itself failed with this libusb code: counts as lost.
  void give_up(int code) noexcept;
  [[nodiscard]] bool lost() const noexcept override { return lost_code_ < 0; }
  [[nodiscard]] ZeroCommand zero_target() const noexcept override { return zero_target_; }
  [[nodiscard]] int lost_code() const noexcept { return lost_code_; }  ///< of libusb; 0: not lost

 private:
  struct Slot;
  struct Pool;
  static void on_end(libusb_transfer* transfer);
  void on_in_end(Slot& slot) noexcept;
  void on_out_end(Slot& slot) noexcept;
  int submit(Slot& slot) noexcept;
  void queue(Slot& slot) noexcept;
  void note(LinkEventKind kind, std::uint8_t code) noexcept;
  void failed(unsigned& in_row, std::uint64_t& counter, int code) noexcept;
  void begin_clear(std::uint8_t endpoint, std::int64_t now_ns) noexcept;
  void on_clear_end(Slot& slot) noexcept;
  [[nodiscard]] bool follow_halts(std::int64_t now_ns) noexcept;

  TransferSink& sink_;
  LinkCounters& counters_;
  LinkTape* tape_ = nullptr;
  std::unique_ptr<Pool> pool_;
  int lost_code_ = 0;
  ZeroCommand zero_target_;
  std::int64_t next_queue_ns_ = 0;  ///< nothing is queued by `requeue` before
  std::int64_t clear_since_ns_ = 0;
  unsigned in_errors_ = 0, out_errors_ = 0;  ///< in a row
  bool in_halted_ = false, out_halted_ = false;
  bool stopping_ = false;
};

}  // namespace haptic::hal
