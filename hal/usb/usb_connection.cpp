// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_connection.hpp"

#include <libusb.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "hal/usb/usb_link.hpp"

namespace haptic::hal {
namespace {

// Longest part of a blocking transfer: how soon a cancelled start notices.
constexpr unsigned kSlice_ms = 50;

constexpr unsigned kString_ms = 200;
constexpr std::size_t kMostControlBytes = 4096;

constexpr unsigned kPacketBits = 0x7ff;  // of wMaxPacketSize; above them: transactions per frame
constexpr std::size_t kMostPacketBytes = kPacketBits + 1;

bool is_in(std::uint8_t address) { return (address & LIBUSB_ENDPOINT_IN) != 0; }

UsbEndpoint described(const libusb_endpoint_descriptor& e, int speed) {
  const bool bulk = (e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == LIBUSB_TRANSFER_TYPE_BULK;
  const bool known = !bulk && speed != LIBUSB_SPEED_UNKNOWN;
  return {e.bEndpointAddress, bulk, static_cast<std::uint16_t>(e.wMaxPacketSize & kPacketBits),
          known ? interrupt_interval_ns(speed >= LIBUSB_SPEED_HIGH, e.bInterval) : 0};
}

// The endpoint of this address, or else the first of its kind and direction: gadgets built on a
// kernel's framework get other numbers than they asked for.
UsbEndpoint choose(const libusb_interface_descriptor& interface, std::uint8_t address, bool bulk,
                   int speed) {
  UsbEndpoint chosen;
  for (int i = 0; i < interface.bNumEndpoints; ++i) {
    const libusb_endpoint_descriptor& e = interface.endpoint[i];
    const unsigned type = e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK;
    const unsigned wanted = bulk ? LIBUSB_TRANSFER_TYPE_BULK : LIBUSB_TRANSFER_TYPE_INTERRUPT;
    if (type != wanted || is_in(e.bEndpointAddress) != is_in(address)) continue;
    if (e.bEndpointAddress == address) return described(e, speed);
    if (chosen.address == 0) chosen = described(e, speed);
  }
  return chosen;
}

// libusb does not say which descriptor it has opened: the one of ours that leads to the device's
// file.
int usbfs_descriptor(libusb_device_handle* handle) {
  libusb_device* const device = libusb_get_device(handle);
  char wanted[64] = {};
  (void)std::snprintf(wanted, sizeof wanted, "/dev/bus/usb/%03u/%03u",
                      unsigned{libusb_get_bus_number(device)},
                      unsigned{libusb_get_device_address(device)});
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::filesystem::path target = std::filesystem::read_symlink(entry.path(), error);
    if (!error && target == wanted) return std::atoi(entry.path().filename().c_str());
  }
  return -1;
}

void on_control_end(libusb_transfer* transfer) { *static_cast<int*>(transfer->user_data) = 1; }

// As in /sys/bus/usb/devices; a root hub has no ports.
std::string bus_path_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string path = std::to_string(libusb_get_bus_number(device));
  for (int k = 0; k < depth; ++k)
    path += (k == 0 ? "-" : ".") + std::to_string(ports[static_cast<std::size_t>(k)]);
  return path;
}

}  // namespace

std::int64_t interrupt_interval_ns(bool high_speed, std::uint8_t b_interval) noexcept {
  constexpr std::int64_t kFrame_ns = 1'000'000, kMicroframe_ns = 125'000;
  if (b_interval == 0 || (high_speed && b_interval > 16)) return 0;
  return high_speed ? kMicroframe_ns << (b_interval - 1) : kFrame_ns * b_interval;
}

HalStatus UsbConnection::open(const UsbProfile& profile, const UsbAddress& address, int wrapped_fd,
                              std::string& trouble) {
  close();
  name_.name = profile.name;
  name_.vendor_id = address.vendor_id != 0 ? address.vendor_id : profile.vendor_id;
  name_.product_id = address.product_id != 0 ? address.product_id : profile.product_id;
  // A descriptor to wrap was opened by somebody else, who has decided this already.
  const std::string held = wrapped_fd < 0 && profile.holder != nullptr ? profile.holder() : "";
  if (!held.empty()) {
    trouble = usb_held(name_, held);
    return HalStatus::kDeviceBusy;
  }
  UsbAction action = UsbAction::kInitialise;
  int code = context_.open(wrapped_fd < 0);
  if (code >= 0 && wrapped_fd >= 0) {
    action = UsbAction::kWrap;
    code = libusb_wrap_sys_device(context_.get(), wrapped_fd, &handle_);
    if (code >= 0) code = claim(profile, action);
  } else if (code >= 0) {
    code = find(profile, address, action);
  }
  if (code >= 0) descriptor_ = wrapped_fd >= 0 ? wrapped_fd : usbfs_descriptor(handle_);
  if (code >= 0) return HalStatus::kOk;
  const HalStatus status = status_of_libusb(code, action);
  trouble = usb_trouble(name_, action, code, status);
  close();
  return status;
}

// Opens and claims the first device that the address names and nobody else holds.
int UsbConnection::find(const UsbProfile& profile, const UsbAddress& address,
                        UsbAction& action) noexcept {
  libusb_device** list = nullptr;
  action = UsbAction::kFind;
  const ssize_t count = libusb_get_device_list(context_.get(), &list);
  if (count < 0) return static_cast<int>(count);
  int code = LIBUSB_ERROR_NOT_FOUND;
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor device{};
    if (libusb_get_device_descriptor(list[i], &device) < 0 || device.idVendor != name_.vendor_id ||
        device.idProduct != name_.product_id)
      continue;
    if (!address.bus_path.empty() && bus_path_of(list[i]) != address.bus_path) continue;
    // Found and not to be had is another trouble than not found.
    UsbAction tried = UsbAction::kOpen;
    int result = libusb_open(list[i], &handle_);
    if (result < 0) {
      handle_ = nullptr;
    } else if (!address.serial.empty() && !has_serial(list[i], address.serial)) {
      close_handle();
      continue;
    } else {
      result = claim(profile, tried);
    }
    code = result;
    action = tried;
    if (code >= 0) break;
    close_handle();
  }
  libusb_free_device_list(list, 1);
  return code;
}

// Not libusb's own call, which waits for a second, twice.
bool UsbConnection::has_serial(libusb_device* device, const std::string& serial) noexcept {
  constexpr std::uint8_t kToHost = 0x80, kGetDescriptor = 6;
  constexpr std::uint16_t kStrings = 0x0300;
  libusb_device_descriptor descriptor{};
  std::array<std::uint8_t, 255> text{};
  std::size_t moved = 0;
  if (libusb_get_device_descriptor(device, &descriptor) < 0 || descriptor.iSerialNumber == 0)
    return false;
  if (request({kToHost, kGetDescriptor, kStrings, 0}, text, moved, kString_ms) < 0 || moved < 4)
    return false;
  const auto language = static_cast<std::uint16_t>(text[2] | text[3] << 8);
  const auto which = static_cast<std::uint16_t>(kStrings | descriptor.iSerialNumber);
  if (request({kToHost, kGetDescriptor, which, language}, text, moved, kString_ms) < 0 || moved < 2)
    return false;
  const std::size_t length = (std::min<std::size_t>(moved, text[0]) - 2) / 2;
  bool same = text[0] >= 2 && serial.size() == length;
  for (std::size_t k = 0; same && k < length; ++k)
    same = text[2 + 2 * k] == static_cast<std::uint8_t>(serial[k]) && text[3 + 2 * k] == 0;
  return same;
}

int UsbConnection::claim(const UsbProfile& profile, UsbAction& action) noexcept {
  action = UsbAction::kConfigure;
  if (const int code = choose_endpoints(profile); code < 0) return code;
  action = UsbAction::kClaim;
  // Also gives the interface back when it is released.
  if (profile.kernel_driver) {
    const int code = libusb_set_auto_detach_kernel_driver(handle_, 1);
    if (code < 0 && code != LIBUSB_ERROR_NOT_SUPPORTED) return code;
  }
  const int code = libusb_claim_interface(handle_, profile.interface_number);
  if (code >= 0) claimed_interface_ = profile.interface_number;
  return code;
}

int UsbConnection::choose_endpoints(const UsbProfile& profile) noexcept {
  in_ = out_ = UsbEndpoint{};
  libusb_config_descriptor* config = nullptr;
  const int code = libusb_get_active_config_descriptor(libusb_get_device(handle_), &config);
  if (code < 0) return code;
  const int speed = libusb_get_device_speed(libusb_get_device(handle_));
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    const libusb_interface& each = config->interface[i];
    if (each.num_altsetting == 0 || each.altsetting[0].bInterfaceNumber != profile.interface_number)
      continue;
    in_ = choose(each.altsetting[0], profile.in_endpoint, profile.bulk, speed);
    if (profile.out_endpoint != 0)
      out_ = choose(each.altsetting[0], profile.out_endpoint, profile.bulk, speed);
  }
  libusb_free_config_descriptor(config);
  const bool complete =
      in_.address != 0 && in_.packet_bytes != 0 && (profile.out_endpoint == 0 || out_.address != 0);
  return complete ? 0 : LIBUSB_ERROR_NOT_FOUND;
}

void UsbConnection::close() noexcept {
  if (handle_ == nullptr) return;
  if (claimed_interface_ >= 0) (void)libusb_release_interface(handle_, claimed_interface_);
  claimed_interface_ = -1;
  close_handle();
}

void UsbConnection::close_handle() noexcept {
  if (handle_ != nullptr) libusb_close(handle_);
  handle_ = nullptr;
  descriptor_ = -1;
}

HalStatus UsbConnection::control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                                 std::size_t& moved, unsigned timeout_ms) noexcept {
  moved = 0;
  if (handle_ == nullptr) return HalStatus::kDeviceGone;
  return status_of_libusb(this->request(request, bytes, moved, timeout_ms), UsbAction::kStart);
}

// One request, sent once: twice may mean something else than once. Waited for in slices, so that
// the end of the program does not wait for a device that says nothing.
int UsbConnection::request(const ControlRequest& request, std::span<std::uint8_t> bytes,
                           std::size_t& moved, unsigned timeout_ms) noexcept {
  moved = 0;
  if (cancelled()) return LIBUSB_ERROR_TIMEOUT;
  std::array<std::uint8_t, LIBUSB_CONTROL_SETUP_SIZE + kMostControlBytes> packet{};
  if (bytes.size() > kMostControlBytes) return LIBUSB_ERROR_INVALID_PARAM;
  const bool to_host = is_in(request.request_type);
  libusb_fill_control_setup(packet.data(), request.request_type, request.request, request.value,
                            request.index, static_cast<std::uint16_t>(bytes.size()));
  if (!to_host) std::copy(bytes.begin(), bytes.end(), packet.begin() + LIBUSB_CONTROL_SETUP_SIZE);
  libusb_transfer* const transfer = libusb_alloc_transfer(0);
  if (transfer == nullptr) return LIBUSB_ERROR_NO_MEM;
  int ended = 0;
  libusb_fill_control_transfer(transfer, handle_, packet.data(), on_control_end, &ended, 0);
  int code = libusb_submit_transfer(transfer);
  if (code >= 0) {
    unsigned left_ms = std::max(timeout_ms, 1u);
    while (ended == 0 && left_ms > 0 && !cancelled()) {
      const unsigned slice_ms = std::min(left_ms, kSlice_ms);
      left_ms -= slice_ms;
      timeval slice{0, static_cast<suseconds_t>(slice_ms * 1000)};
      (void)libusb_handle_events_timeout_completed(context_.get(), &slice, &ended);
    }
    const bool over = ended == 0;
    // Memory that the kernel may still write to must stay: a cancelled transfer ends at once.
    if (over) (void)libusb_cancel_transfer(transfer);
    while (ended == 0) {
      timeval slice{0, static_cast<suseconds_t>(kSlice_ms * 1000)};
      (void)libusb_handle_events_timeout_completed(context_.get(), &slice, &ended);
    }
    code = over ? LIBUSB_ERROR_TIMEOUT : code_of_transfer(transfer->status);
    if (code >= 0) moved = static_cast<std::size_t>(transfer->actual_length);
    if (to_host && moved > 0)
      std::copy_n(libusb_control_transfer_get_data(transfer), moved, bytes.begin());
  }
  libusb_free_transfer(transfer);
  return code;
}

// One blocking transfer in slices, until something moved, the time is over or the start cancelled.
int UsbConnection::move(const UsbEndpoint& endpoint, std::span<std::uint8_t> bytes,
                        std::size_t& moved, unsigned timeout_ms) noexcept {
  moved = 0;
  if (handle_ == nullptr) return LIBUSB_ERROR_NO_DEVICE;
  if (endpoint.address == 0) return LIBUSB_ERROR_NOT_FOUND;
  unsigned left_ms = std::max(timeout_ms, 1u);
  int code = LIBUSB_ERROR_TIMEOUT;
  while (left_ms > 0 && code == LIBUSB_ERROR_TIMEOUT && moved == 0 && !cancelled()) {
    const unsigned slice_ms = std::min(left_ms, kSlice_ms);
    left_ms -= slice_ms;
    int done = 0;
    const auto transfer = endpoint.bulk ? libusb_bulk_transfer : libusb_interrupt_transfer;
    code = transfer(handle_, endpoint.address, bytes.data(), static_cast<int>(bytes.size()), &done,
                    slice_ms);
    if (done > 0) moved = static_cast<std::size_t>(done);
  }
  std::size_t none = 0;
  if (code == LIBUSB_ERROR_PIPE)
    (void)request({LIBUSB_RECIPIENT_ENDPOINT, LIBUSB_REQUEST_CLEAR_FEATURE, 0, endpoint.address},
                  {}, none, kSlice_ms);
  return code == LIBUSB_ERROR_TIMEOUT && moved > 0 ? 0 : code;
}

HalStatus UsbConnection::write(std::span<const std::uint8_t> bytes, unsigned timeout_ms) noexcept {
  unsigned char room[kMaxReportBytes] = {};  // libusb takes no constant bytes
  if (bytes.size() > sizeof room) return HalStatus::kDeviceUnfit;
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const std::size_t left = bytes.size() - sent;
    std::copy(bytes.begin() + static_cast<std::ptrdiff_t>(sent), bytes.end(), room);
    std::size_t moved = 0;
    const int code = move(out_, {room, left}, moved, timeout_ms);
    if (code < 0) return status_of_libusb(code, UsbAction::kStart);
    if (moved == 0) return HalStatus::kTransferFailed;
    sent += moved;
  }
  return HalStatus::kOk;
}

HalStatus UsbConnection::read(std::span<std::uint8_t> bytes, std::size_t& moved,
                              unsigned timeout_ms) noexcept {
  if (bytes.size() >= in_.packet_bytes)
    return status_of_libusb(move(in_, bytes, moved, timeout_ms), UsbAction::kStart);
  // A shorter buffer than a packet may get would end as an overflow with anything that the device
  // sends.
  std::uint8_t packet[kMostPacketBytes];
  int code = move(in_, {packet, in_.packet_bytes}, moved, timeout_ms);
  if (moved > bytes.size()) code = LIBUSB_ERROR_OVERFLOW;
  if (code < 0) moved = 0;
  std::copy_n(packet, moved, bytes.begin());
  return status_of_libusb(code, UsbAction::kStart);
}

}  // namespace haptic::hal
