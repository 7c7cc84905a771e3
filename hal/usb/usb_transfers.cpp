// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_transfers.hpp"

#include <libusb.h>

#include <algorithm>
#include <array>
#include <limits>

#include "hal/device_link.hpp"
#include "hal/usb/link_tape.hpp"
#include "hal/usb/usb_text.hpp"

namespace haptic::hal {
namespace {

constexpr std::size_t kMostIn = 4;
// After a refused submit. Errors in a row are counted: tried at every turn, they would be used up
// before the output, whose transfers may well work, has come down for want of reports.
constexpr std::int64_t kRefusedWait_ns = 2'000'000;
constexpr std::size_t kMostInBytes = 2048;  // a report, rounded up to whole packets

}  // namespace

struct UsbTransfers::Slot {
  UsbTransfers* owner = nullptr;
  libusb_transfer* transfer = nullptr;
  bool in_flight = false;
};

struct UsbTransfers::Pool {
  std::array<Slot, kMostIn> in;
  Slot out, clear;
  libusb_device_handle* handle = nullptr;
  std::array<std::uint8_t, LIBUSB_CONTROL_SETUP_SIZE> setup{};
  std::array<std::array<std::uint8_t, kMostInBytes>, kMostIn> in_bytes{};
  std::array<std::uint8_t, kMaxReportBytes> out_bytes{};
  std::size_t out_room = 0;
};

UsbTransfers::UsbTransfers(TransferSink& sink, LinkCounters& counters) noexcept
    : sink_(sink), counters_(counters) {}

UsbTransfers::~UsbTransfers() { close(); }

int UsbTransfers::open(const UsbConnection& connection, const UsbProfile& profile, int in_count) {
  close();
  pool_ = std::make_unique<Pool>();
  pool_->handle = connection.handle();
  zero_target_ = ZeroCommand{};
  zero_target_.descriptor = connection.descriptor();
  zero_target_.endpoint = connection.out().address;
  lost_code_ = 0;
  in_errors_ = out_errors_ = 0;
  next_queue_ns_ = std::numeric_limits<std::int64_t>::min();
  in_halted_ = out_halted_ = stopping_ = false;

  // Whole packets: a device that says too much is then a long report, and not a broken bus.
  const std::size_t packet = connection.in().packet_bytes;
  const std::size_t room = (profile.in_bytes + packet - 1) / packet * packet;
  if (room == 0 || room > kMostInBytes || profile.out_bytes > kMaxReportBytes)
    return LIBUSB_ERROR_INVALID_PARAM;
  const auto make = [&](Slot& slot, const UsbEndpoint& endpoint, std::uint8_t* bytes,
                        std::size_t size) {
    slot.owner = this;
    slot.transfer = libusb_alloc_transfer(0);
    if (slot.transfer == nullptr) return false;
    const auto fill = endpoint.bulk ? libusb_fill_bulk_transfer : libusb_fill_interrupt_transfer;
    // Timeout 0: libusb keeps no timer, the link has its own watchdog.
    fill(slot.transfer, pool_->handle, endpoint.address, bytes, static_cast<int>(size), on_end,
         &slot, 0);
    return true;
  };
  const auto count = static_cast<std::size_t>(std::clamp(in_count, 2, static_cast<int>(kMostIn)));
  for (std::size_t i = 0; i < count; ++i) {
    if (!make(pool_->in[i], connection.in(), pool_->in_bytes[i].data(), room))
      return LIBUSB_ERROR_NO_MEM;
  }
  if (connection.out().address != 0) {
    pool_->out_room = profile.out_bytes;
    if (!make(pool_->out, connection.out(), pool_->out_bytes.data(), pool_->out_room))
      return LIBUSB_ERROR_NO_MEM;
  }
  pool_->clear.owner = this;
  pool_->clear.transfer = libusb_alloc_transfer(0);
  if (pool_->clear.transfer == nullptr) return LIBUSB_ERROR_NO_MEM;
  libusb_fill_control_transfer(pool_->clear.transfer, pool_->handle, pool_->setup.data(), on_end,
                               &pool_->clear, 0);
  for (std::size_t i = 0; i < count && !lost(); ++i) queue(pool_->in[i]);
  return lost_code_;
}

std::span<std::uint8_t> UsbTransfers::out_bytes() noexcept {
  if (pool_ == nullptr) return {};
  return std::span(pool_->out_bytes).first(pool_->out_room);
}

bool UsbTransfers::busy() const noexcept { return pool_ != nullptr && pool_->out.in_flight; }

unsigned UsbTransfers::in_flight() const noexcept {
  if (pool_ == nullptr) return 0;
  unsigned count = (pool_->out.in_flight ? 1u : 0u) + (pool_->clear.in_flight ? 1u : 0u);
  for (const Slot& slot : pool_->in) count += slot.in_flight ? 1 : 0;
  return count;
}

void UsbTransfers::failed(unsigned& in_row, std::uint64_t& counter, int code) noexcept {
  count_one(counter);
  if (code == LIBUSB_ERROR_NO_DEVICE || ++in_row > kMostUsbErrorsInRow) give_up(code);
}

void UsbTransfers::give_up(int code) noexcept {
  if (!lost() && !stopping_) note(LinkEventKind::kLost, 0);
  lost_code_ = code;
}

void UsbTransfers::note(LinkEventKind kind, std::uint8_t code) noexcept {
  if (tape_ == nullptr) return;
  LinkEvent event;
  event.kind = kind;
  event.code = code;
  tape_->on_event(event);
}

int UsbTransfers::submit(Slot& slot) noexcept {
  const int code = libusb_submit_transfer(slot.transfer);
  slot.in_flight = code == 0;
  return code;
}

// The device may have gone since the last completion: nothing but this code will ever say so.
void UsbTransfers::queue(Slot& slot) noexcept {
  const int code = submit(slot);
  if (code < 0) failed(in_errors_, counters_.in_failed, code);
}

SendOutcome UsbTransfers::send(std::size_t bytes) noexcept {
  if (pool_ == nullptr || pool_->out.transfer == nullptr || stopping_ || lost() || out_halted_ ||
      bytes > pool_->out_room)
    return SendOutcome::kFailed;
  Slot& slot = pool_->out;
  if (slot.in_flight) return SendOutcome::kBusy;
  slot.transfer->length = static_cast<int>(bytes);
  const int code = submit(slot);
  if (code == 0) return SendOutcome::kSent;
  failed(out_errors_, counters_.send_failed, code);
  note(LinkEventKind::kSendRefused, 0);
  return SendOutcome::kFailed;
}

void UsbTransfers::cancel_out() noexcept {
  if (busy()) (void)libusb_cancel_transfer(pool_->out.transfer);
}

void UsbTransfers::on_end(libusb_transfer* transfer) {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  slot.in_flight = false;
  if (slot.owner == nullptr) return;  // given up in close
  UsbTransfers& self = *slot.owner;
  if (&slot == &self.pool_->clear) return self.on_clear_end(slot);
  &slot == &self.pool_->out ? self.on_out_end(slot) : self.on_in_end(slot);
}

void UsbTransfers::on_in_end(Slot& slot) noexcept {
  const int code = code_of_transfer(slot.transfer->status);
  const bool reported = code == 0 && !stopping_ && !lost();
  if (reported) {
    in_errors_ = 0;
    sink_.on_report(
        {slot.transfer->buffer, static_cast<std::size_t>(slot.transfer->actual_length)});
  } else if (code < 0 && code != LIBUSB_ERROR_INTERRUPTED && !stopping_) {
    failed(in_errors_, counters_.in_failed, code);
    if (code == LIBUSB_ERROR_PIPE) in_halted_ = true;
  }
  if (!stopping_ && !lost() && !in_halted_) queue(slot);
  if (reported && !lost()) sink_.on_report_done();
}

void UsbTransfers::on_out_end(Slot& slot) noexcept {
  if (stopping_) return;
  const int code = code_of_transfer(slot.transfer->status);
  const bool whole = code == 0 && slot.transfer->actual_length == slot.transfer->length;
  if (whole) {
    out_errors_ = 0;
  } else {
    failed(out_errors_, counters_.send_failed, code < 0 ? code : LIBUSB_ERROR_IO);
    if (code == LIBUSB_ERROR_PIPE) out_halted_ = true;
  }
  const OutEnd end = whole ? OutEnd::kDelivered : out_halted_ ? OutEnd::kStalled : OutEnd::kFailed;
  if (!lost()) note(LinkEventKind::kOutEnd, static_cast<std::uint8_t>(end));
  sink_.on_out_end(whole);
}

void UsbTransfers::begin_clear(std::uint8_t endpoint, std::int64_t now_ns) noexcept {
  constexpr std::uint8_t kToEndpoint = 0x02;  // standard, from the host
  constexpr std::uint16_t kEndpointHalt = 0;
  libusb_fill_control_setup(pool_->setup.data(), kToEndpoint, LIBUSB_REQUEST_CLEAR_FEATURE,
                            kEndpointHalt, endpoint, 0);
  const bool is_out = (endpoint & LIBUSB_ENDPOINT_IN) == 0;
  clear_since_ns_ = now_ns;
  if (const int code = submit(pool_->clear); code < 0)
    failed(is_out ? out_errors_ : in_errors_, is_out ? counters_.send_failed : counters_.in_failed,
           code);
}

void UsbTransfers::on_clear_end(Slot& slot) noexcept {
  const int code = code_of_transfer(slot.transfer->status);
  if (stopping_ || lost() || code == LIBUSB_ERROR_INTERRUPTED) return;
  const bool is_out =
      (libusb_le16_to_cpu(libusb_control_transfer_get_setup(slot.transfer)->wIndex) &
       LIBUSB_ENDPOINT_IN) == 0;
  if (code < 0)
    return failed(is_out ? out_errors_ : in_errors_,
                  is_out ? counters_.send_failed : counters_.in_failed, code);
  (is_out ? out_halted_ : in_halted_) = false;
  if (is_out) note(LinkEventKind::kOutCleared, 0);
}

// True if IN transfers may be queued.
bool UsbTransfers::follow_halts(std::int64_t now_ns) noexcept {
  if (pool_->clear.in_flight) {
    if (now_ns - clear_since_ns_ > kLongestClear_ns) give_up(LIBUSB_ERROR_TIMEOUT);
    return !in_halted_;
  }
  bool queued = false;
  for (const Slot& slot : pool_->in) queued = queued || slot.in_flight;
  if (out_halted_) {
    begin_clear(pool_->out.transfer->endpoint, now_ns);
  } else if (in_halted_ && !queued) {
    begin_clear(pool_->in[0].transfer->endpoint, now_ns);
  }
  if (in_halted_ && queued) {  // the device may want an empty queue when a halt is cleared
    for (const Slot& slot : pool_->in) {
      if (slot.in_flight) (void)libusb_cancel_transfer(slot.transfer);
    }
  }
  return !in_halted_;
}

void UsbTransfers::requeue(std::int64_t now_ns) noexcept {
  if (pool_ == nullptr || stopping_ || lost()) return;
  if (!follow_halts(now_ns) || lost()) return;
  if (now_ns < next_queue_ns_) return;
  for (Slot& slot : pool_->in) {
    if (slot.transfer == nullptr || slot.in_flight || in_halted_ || lost()) continue;
    queue(slot);
    if (!slot.in_flight) {
      next_queue_ns_ = now_ns + kRefusedWait_ns;
      return;
    }
  }
}

void UsbTransfers::stop() noexcept {
  stopping_ = true;
  if (pool_ == nullptr) return;
  for (const Slot& slot : pool_->in) {
    if (slot.in_flight) (void)libusb_cancel_transfer(slot.transfer);
  }
  cancel_out();
  if (pool_->clear.in_flight) (void)libusb_cancel_transfer(pool_->clear.transfer);
}

void UsbTransfers::close() noexcept {
  if (pool_ == nullptr) return;
  if (in_flight() == 0) {
    for (const Slot& slot : pool_->in) libusb_free_transfer(slot.transfer);
    libusb_free_transfer(pool_->out.transfer);
    libusb_free_transfer(pool_->clear.transfer);
    pool_.reset();
  } else {
    for (Slot& slot : pool_->in) slot.owner = nullptr;
    pool_->out.owner = pool_->clear.owner = nullptr;
    (void)pool_.release();
  }
}

}  // namespace haptic::hal
