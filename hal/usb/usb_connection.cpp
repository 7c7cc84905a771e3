// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_connection.hpp"

#include <libusb.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "hal/usb/usb_link.hpp"

namespace haptic::hal {
namespace {

// Longest part of a blocking transfer: how soon a cancelled start notices.
constexpr unsigned kSlice_ms = 50;

constexpr unsigned kPacketBits = 0x7ff;  // of wMaxPacketSize; above them: transactions per frame
constexpr std::size_t kMostPacketBytes = kPacketBits + 1;

bool is_in(std::uint8_t address) { return (address & LIBUSB_ENDPOINT_IN) != 0; }

UsbEndpoint described(const libusb_endpoint_descriptor& e) {
  return {e.bEndpointAddress,
          (e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == LIBUSB_TRANSFER_TYPE_BULK,
          static_cast<std::uint16_t>(e.wMaxPacketSize & kPacketBits)};
}

// The endpoint of this address, or else the first of its kind and direction: gadgets built on a
// kernel's framework get other numbers than they asked for.
UsbEndpoint choose(const libusb_interface_descriptor& interface, std::uint8_t address, bool bulk) {
  UsbEndpoint chosen;
  for (int i = 0; i < interface.bNumEndpoints; ++i) {
    const libusb_endpoint_descriptor& e = interface.endpoint[i];
    const unsigned type = e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK;
    const unsigned wanted = bulk ? LIBUSB_TRANSFER_TYPE_BULK : LIBUSB_TRANSFER_TYPE_INTERRUPT;
    if (type != wanted || is_in(e.bEndpointAddress) != is_in(address)) continue;
    if (e.bEndpointAddress == address) return described(e);
    if (chosen.address == 0) chosen = described(e);
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

}  // namespace

HalStatus UsbConnection::open(const UsbProfile& profile, const UsbAddress& address, int wrapped_fd,
                              std::string& trouble) {
  close();
  name_.name = profile.name;
  name_.vendor_id = address.vendor_id != 0 ? address.vendor_id : profile.vendor_id;
  name_.product_id = address.product_id != 0 ? address.product_id : profile.product_id;
  UsbAction action = UsbAction::kInitialise;
  int code = context_.open(wrapped_fd < 0);
  if (code >= 0 && wrapped_fd >= 0) {
    action = UsbAction::kWrap;
    code = libusb_wrap_sys_device(context_.get(), wrapped_fd, &handle_);
  } else if (code >= 0) {
    code = find(address.serial);
    // Found and not to be opened is another trouble than not found.
    action = code == LIBUSB_ERROR_NOT_FOUND ? UsbAction::kFind : UsbAction::kOpen;
  }
  if (code >= 0) code = claim(profile, action);
  if (code >= 0) descriptor_ = wrapped_fd >= 0 ? wrapped_fd : usbfs_descriptor(handle_);
  if (code >= 0) return HalStatus::kOk;
  const HalStatus status = status_of_libusb(code, action);
  trouble = usb_trouble(name_, action, code, status);
  close();
  return status;
}

// Opens the first device of the identity that can be opened and has the serial number.
int UsbConnection::find(const std::string& serial) noexcept {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context_.get(), &list);
  if (count < 0) return static_cast<int>(count);
  int code = LIBUSB_ERROR_NOT_FOUND;
  for (ssize_t i = 0; i < count && handle_ == nullptr; ++i) {
    libusb_device_descriptor device{};
    if (libusb_get_device_descriptor(list[i], &device) < 0 || device.idVendor != name_.vendor_id ||
        device.idProduct != name_.product_id)
      continue;
    const int opened = libusb_open(list[i], &handle_);
    if (opened < 0) {
      handle_ = nullptr;
      code = opened;
    } else if (!serial.empty() && !has_serial(list[i], serial)) {
      libusb_close(handle_);
      handle_ = nullptr;
    }
  }
  libusb_free_device_list(list, 1);
  return handle_ != nullptr ? 0 : code;
}

bool UsbConnection::has_serial(libusb_device* device, const std::string& serial) noexcept {
  libusb_device_descriptor descriptor{};
  unsigned char text[256] = {};
  if (libusb_get_device_descriptor(device, &descriptor) < 0 || descriptor.iSerialNumber == 0)
    return false;
  const int length = libusb_get_string_descriptor_ascii(handle_, descriptor.iSerialNumber, text,
                                                        static_cast<int>(sizeof text));
  return length >= 0 && serial.size() == static_cast<std::size_t>(length) &&
         std::equal(serial.begin(), serial.end(), text,
                    [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; });
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
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    const libusb_interface& each = config->interface[i];
    if (each.num_altsetting == 0 || each.altsetting[0].bInterfaceNumber != profile.interface_number)
      continue;
    in_ = choose(each.altsetting[0], profile.in_endpoint, profile.bulk);
    if (profile.out_endpoint != 0)
      out_ = choose(each.altsetting[0], profile.out_endpoint, profile.bulk);
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
  libusb_close(handle_);
  handle_ = nullptr;
  descriptor_ = -1;
}

HalStatus UsbConnection::control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                                 std::size_t& moved, unsigned timeout_ms) noexcept {
  moved = 0;
  if (handle_ == nullptr) return HalStatus::kDeviceGone;
  if (cancelled()) return HalStatus::kTimeout;
  // Not cut into slices: a request sent twice may mean something else than once.
  const int code = libusb_control_transfer(
      handle_, request.request_type, request.request, request.value, request.index, bytes.data(),
      static_cast<std::uint16_t>(std::min<std::size_t>(bytes.size(), 0xffff)),
      std::max(timeout_ms, 1u));
  if (code >= 0) moved = static_cast<std::size_t>(code);
  return status_of_libusb(code, UsbAction::kStart);
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
  if (code == LIBUSB_ERROR_PIPE) (void)libusb_clear_halt(handle_, endpoint.address);
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
