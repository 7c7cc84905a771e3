// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_link.hpp"

#include <libusb.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>

#include "hal/clock/servo_clock.hpp"
#include "hal/usb/report_flow.hpp"
#include "hal/usb/usb_connection.hpp"
#include "hal/usb/usb_transfers.hpp"

namespace haptic::hal {
namespace {

// Longest phases of an orderly end, by the machine's clock: the ramp to zero, and the callbacks of
// cancelled transfers. A ramp from full force ends within half a device's watchdog.
constexpr std::int64_t kLongestRest_ns = 300'000'000, kLongestDrain_ns = 500'000'000;
constexpr std::int64_t kDrainWait_ns = 10'000'000;

// For how long libusb's list of devices is believed while ours is not on it. libusb keeps it by
// what udev says, which does not reach a network namespace or a container of one's own.
constexpr std::int64_t kListAge_ns = 1'000'000'000;

/// The connection's port, with every answer on the tape.
class TapedPort final : public UsbPort {
 public:
  TapedPort(UsbPort& port, LinkTape* tape) noexcept : port_(port), tape_(tape) {}

  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned timeout_ms) noexcept override {
    const HalStatus status = port_.control(request, bytes, moved, timeout_ms);
    if (tape_ == nullptr) return status;
    LinkEvent event;
    event.kind = LinkEventKind::kControl;
    event.code = static_cast<std::uint8_t>(status);
    event.number = request.request_type | std::uint64_t{request.request} << 8U |
                   std::uint64_t{request.value} << 16U | std::uint64_t{request.index} << 32U;
    if (status == HalStatus::kOk) event.bytes = bytes.first(std::min(moved, bytes.size()));
    tape_->on_event(event);
    return status;
  }
  HalStatus write(std::span<const std::uint8_t> bytes, unsigned timeout_ms) noexcept override {
    return port_.write(bytes, timeout_ms);
  }
  HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                 unsigned timeout_ms) noexcept override {
    return port_.read(bytes, moved, timeout_ms);
  }
  [[nodiscard]] bool cancelled() const noexcept override { return port_.cancelled(); }

 private:
  UsbPort& port_;
  LinkTape* tape_;
};

}  // namespace

struct UsbLink::Inside {
  Inside(Driver& its_driver, const DeviceMailbox& mailbox, const LinkSettings& its_settings,
         FlowWatch& its_flow_watch)
      : driver(its_driver),
        settings(its_settings),
        flow_watch(its_flow_watch),
        connection(context, cancelled),
        flow(driver, mailbox, settings),
        transfers(flow, flow.counters()) {
    flow.attach(transfers);
    wrapped_fd.store(settings.address.wrapped_fd);
    wraps.store(settings.address.wrapped_fd >= 0);
  }

  HalStatus poll(std::int64_t timeout_ns);
  HalStatus look_for_device(std::int64_t timeout_ns);
  [[nodiscard]] HalStatus connect();
  [[nodiscard]] HalStatus start_reports();
  void fail_connect(HalStatus why);
  void serve(std::int64_t timeout_ns);
  void lose();
  void put_away();
  void close();
  void tell(HalStatus why, std::string text);
  void note(LinkEventKind kind) const noexcept;

  Driver& driver;
  const LinkSettings settings;
  FlowWatch& flow_watch;
  LinkTape* tape = nullptr;
  std::atomic<bool> cancelled{false};
  std::atomic<bool> wraps{false};  ///< a descriptor is given, or will be: nothing is searched
  std::atomic<int> wrapped_fd{-1};
  std::atomic<std::uint32_t> wrapped_count{0};  ///< descriptors given so far
  std::uint32_t wrapped_tried = 0;              ///< the count at the last attempt
  std::uint32_t wrapped_used = ~0u;             ///< the count of the one whose device is gone
  UsbContext context;
  UsbConnection connection;
  ReportFlow flow;
  UsbTransfers transfers;
  std::int64_t listed_ns = 0;  ///< when the context was opened
  bool connected = false, tried = false;
  unsigned bus_errors = 0;  ///< of libusb's event handling, in a row
  std::int64_t next_try_ns = 0;
  HalStatus status = HalStatus::kDeviceNotFound;
  mutable std::mutex trouble_mutex;  ///< never taken while reports flow
  std::string trouble;
};

UsbLink::UsbLink(Driver& driver, const DeviceMailbox& mailbox, const LinkSettings& settings)
    : inside_(std::make_unique<Inside>(driver, mailbox, settings, flow_watch_)) {}

UsbLink::~UsbLink() { close(); }

void UsbLink::observe(LinkObserver* observer) noexcept { inside_->flow.observe(observer); }

void UsbLink::tape(LinkTape* tape) noexcept {
  inside_->tape = tape;
  inside_->flow.tape(tape);
  inside_->transfers.tape(tape);
}

void UsbLink::set_wrapped_fd(int fd) noexcept {
  inside_->wrapped_fd.store(fd);
  inside_->wraps.store(true);
  inside_->wrapped_count.fetch_add(1, std::memory_order_release);
  inside_->context.wake();
}

HalStatus UsbLink::poll(std::int64_t timeout_ns) noexcept {
  try {
    return inside_->poll(timeout_ns);
  } catch (const std::exception&) {  // strings and buffers made while connecting
    inside_->fail_connect(HalStatus::kNoMemory);
    return HalStatus::kNoMemory;
  }
}

void UsbLink::close() noexcept { inside_->close(); }

void UsbLink::cancel() noexcept {
  inside_->cancelled.store(true);
  inside_->context.wake();
}

void UsbLink::servo_lost() noexcept { inside_->flow.servo_lost(); }
void UsbLink::emergency_stop() noexcept { inside_->flow.emergency_stop(); }
void UsbLink::use_mailbox(const DeviceMailbox& mailbox) noexcept {
  inside_->flow.use_mailbox(mailbox);
}
LinkState UsbLink::state() const noexcept { return inside_->flow.state(); }
HeldWrench UsbLink::held() const noexcept { return inside_->flow.held(); }
std::optional<double> UsbLink::gap_m() const noexcept { return inside_->flow.gap_m(); }
LinkCounters UsbLink::counters() const noexcept { return snapshot(inside_->flow.counters()); }

std::string UsbLink::trouble() const {
  const std::lock_guard lock(inside_->trouble_mutex);
  return inside_->trouble;
}

void UsbLink::Inside::tell(HalStatus why, std::string text) {
  status = why;
  const std::lock_guard lock(trouble_mutex);
  trouble = std::move(text);
}

void UsbLink::Inside::note(LinkEventKind kind) const noexcept {
  LinkEvent event;
  event.kind = kind;
  if (tape != nullptr) tape->on_event(event);
}

HalStatus UsbLink::Inside::poll(std::int64_t timeout_ns) {
  note(cancelled.load() ? LinkEventKind::kClose : LinkEventKind::kTurn);
  if (!connected) return look_for_device(timeout_ns);
  serve(cancelled.load() ? 0 : timeout_ns);
  return status;
}

HalStatus UsbLink::Inside::look_for_device(std::int64_t timeout_ns) {
  if (cancelled.load()) return status;
  const std::int64_t now = flow.now_ns();
  const std::uint32_t count = wrapped_count.load(std::memory_order_acquire);
  const bool used = wraps.load() && count == wrapped_used;
  const bool arrived = context.arrived() || count != wrapped_tried;
  if (used || (tried && now < next_try_ns && !arrived)) {
    const std::int64_t left_ns = used ? timeout_ns : next_try_ns - now;
    (void)context.handle_events(std::min(timeout_ns, left_ns));
    return status;
  }
  tried = true;
  next_try_ns = now + settings.retry_ns;
  wrapped_tried = count;
  const HalStatus result = connect();
  if (result == HalStatus::kOk) {
    connected = true;
    bus_errors = 0;
    tell(HalStatus::kOk, flow.is_other_device() ? other_device_text(flow.stated()) : "");
    return status;
  }
  if (wraps.load() && result == HalStatus::kDeviceGone) wrapped_used = count;
  fail_connect(result);
  return status;
}

void UsbLink::Inside::fail_connect(HalStatus why) {
  status = why;
  connected = false;
  flow_watch.tell(false);
  put_away();
  if (flow.state() != LinkState::kAbsent) flow.end(false, why);
}

HalStatus UsbLink::Inside::connect() {
  const bool wrap = wraps.load();
  const int descriptor = wrap ? wrapped_fd.load() : -1;
  if (wrap && descriptor < 0) {
    tell(HalStatus::kDeviceNotFound, "no descriptor to wrap was given yet");
    return HalStatus::kDeviceNotFound;
  }
  std::string text;
  const bool first = context.get() == nullptr;
  const HalStatus opened = connection.open(driver.profile(), settings.address, descriptor, text);
  if (first && !wrap && context.get() != nullptr) {
    listed_ns = flow.now_ns();
    context.watch_arrivals(connection.name().vendor_id, connection.name().product_id);
  }
  if (opened != HalStatus::kOk) {
    tell(opened, std::move(text));
    if (opened == HalStatus::kDeviceNotFound && !wrap && flow.now_ns() - listed_ns >= kListAge_ns)
      context.close();  // the next attempt lists afresh
    return opened;
  }
  return start_reports();
}

HalStatus UsbLink::Inside::start_reports() {
  flow.begin_start();
  TapedPort port(connection, tape);
  const HalStatus started = driver.start(port);
  if (started != HalStatus::kOk) {
    tell(started, usb_trouble(connection.name(), UsbAction::kStart, 0, started));
    return started;
  }
  std::string defect = flow.defect(connection.in().interval_ns);
  if (!defect.empty()) {
    tell(HalStatus::kNotAccepted, std::move(defect));
    return HalStatus::kNotAccepted;
  }
  const int code = transfers.open(connection, driver.profile(), settings.in_transfers);
  if (code < 0) {
    const HalStatus why = status_of_libusb(code, UsbAction::kTransfer);
    tell(why, usb_trouble(connection.name(), UsbAction::kTransfer, code, why));
    return why;
  }
  flow_watch.tell(true);
  flow.begin_reports();
  return HalStatus::kOk;
}

void UsbLink::Inside::serve(std::int64_t timeout_ns) {
  const int code = context.handle_events(std::min(timeout_ns, flow.until_turn_ns()));
  bus_errors = code < 0 && code != LIBUSB_ERROR_INTERRUPTED ? bus_errors + 1 : 0;
  if (bus_errors > kMostUsbErrorsInRow) transfers.give_up(code);
  if (!transfers.lost()) transfers.requeue(flow.now_ns());
  if (!transfers.lost()) flow.turn();
  if (transfers.lost()) lose();
}

void UsbLink::Inside::lose() {
  const int code = transfers.lost_code();
  HalStatus why = status_of_libusb(code, UsbAction::kTransfer);
  if (why != HalStatus::kDeviceGone && why != HalStatus::kNoMemory)
    why = HalStatus::kTransferFailed;
  connected = false;
  flow.end(true, why);  // first of all: the servo thread waits for it
  flow_watch.tell(false);
  put_away();
  if (wraps.load() && why == HalStatus::kDeviceGone) wrapped_used = wrapped_tried;
  next_try_ns = flow.now_ns() + settings.retry_ns;
  tell(why, usb_trouble(connection.name(), UsbAction::kTransfer, code, why));
}

// Transfers in flight belong to the kernel: they are waited for until every callback has run.
void UsbLink::Inside::put_away() {
  transfers.stop();
  const std::int64_t end_ns = monotonic_ns() + kLongestDrain_ns;
  while (transfers.in_flight() > 0 && monotonic_ns() < end_ns)
    (void)context.handle_events(kDrainWait_ns);
  transfers.close();
  connection.close();
}

void UsbLink::Inside::close() {
  note(LinkEventKind::kClose);
  if (connected) {
    flow.begin_rest();
    const std::int64_t end_ns = monotonic_ns() + kLongestRest_ns;
    while (connected && !flow.is_at_rest() && monotonic_ns() < end_ns) serve(kDrainWait_ns);
  }
  flow_watch.tell(false);
  if (connected) {
    connected = false;
    put_away();
    flow.end(false, HalStatus::kOk);
  }
  context.close();
  tried = false;
  cancelled.store(false);
}

}  // namespace haptic::hal
