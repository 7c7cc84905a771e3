// SPDX-License-Identifier: Apache-2.0
/// Any bytes as the host's side of a USB/IP connection: header by header through the codec, then
/// all of them to a device, whose answers must be whole messages of the device side.
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <span>
#include <thread>

#include "host_sim/device/reference_usb.hpp"
#include "host_sim/device/usbip_carrier.hpp"
#include "host_sim/device/usbip_codec.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace {

using namespace haptic::sim;
using haptic::fuzz::require;

using Header = std::array<std::uint8_t, kUsbipHeaderBytes>;

void check_header(const Header& header) {
  const UsbipMessage before = UsbipUnlink{1, 2, 3};
  UsbipMessage message = before;
  if (decode(header, message) != UsbipVerdict::kOk) {
    require(message == before, "a refused header leaves the message as it was");
    return;
  }
  if (const auto* submit = std::get_if<UsbipSubmit>(&message)) {
    require(submit->endpoint <= 15 && submit->byte_count <= kUsbipMostBytes, "ranges hold");
    require((submit->address() & 0x70u) == 0, "an address has a number and a direction");
  }
  Header again{};
  encode(message, again);
  UsbipMessage twice;
  require(decode(again, twice) == UsbipVerdict::kOk && twice == message,
          "a message decodes to itself");
}

/// Answers what it is asked for, never more than there is room for.
class AnsweringFunction final : public UsbFunction {
 public:
  [[nodiscard]] std::vector<std::uint8_t> descriptors() const override {
    return reference_descriptors();
  }
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t /*value*/,
              std::uint16_t /*index*/, std::span<std::uint8_t> bytes) override {
    if ((request_type & 0x80u) == 0) return request == 9 ? 0 : -EPIPE;
    std::fill(bytes.begin(), bytes.end(), request);
    return static_cast<int>(bytes.size()) + request % 3;  // says more than it may
  }
  int out(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> bytes) override {
    if (carrier != nullptr)
      carrier->push(0x81, bytes.first(std::min<std::size_t>(bytes.size(), 96)));
    return static_cast<int>(bytes.size());
  }
  UsbipCarrier* carrier = nullptr;
};

/// False at the end of the connection.
bool receive(int socket, std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::recv(socket, bytes.data(), bytes.size(), 0);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

/// Submits of the host by their sequence numbers. Empty where a number comes twice: an answer does
/// not say then which it belongs to.
std::map<std::uint32_t, UsbipSubmit> submits_of(std::span<const std::uint8_t> sent) {
  std::map<std::uint32_t, UsbipSubmit> submits;
  for (std::size_t at = 0; at + kUsbipHeaderBytes <= sent.size();) {
    UsbipMessage message;
    const auto header = sent.subspan(at).first<kUsbipHeaderBytes>();
    if (decode(header, message) != UsbipVerdict::kOk) break;
    at += kUsbipHeaderBytes;
    const auto* submit = std::get_if<UsbipSubmit>(&message);
    if (submit == nullptr) continue;
    if (!submits.emplace(submit->sequence, *submit).second) return {};
    if (!submit->to_host) at += submit->byte_count;
  }
  return submits;
}

void check_answers(int host, const std::map<std::uint32_t, UsbipSubmit>& submits) {
  Header header{};
  std::vector<std::uint8_t> bytes;
  while (receive(host, header)) {
    UsbipMessage message;
    require(decode(header, message) == UsbipVerdict::kOk, "an answer is a message");
    const auto* end = std::get_if<UsbipSubmitEnd>(&message);
    require(end != nullptr || std::holds_alternative<UsbipUnlinkEnd>(message),
            "an answer is of the device side");
    if (end == nullptr) continue;
    const auto submit = submits.find(end->sequence);
    require(submit != submits.end(), "an answer is to a submit");
    require(end->byte_count <= submit->second.byte_count, "no more moves than there is room for");
    require(end->status <= 0, "a status is an errno");
    bytes.resize(submit->second.to_host ? end->byte_count : 0);
    if (!receive(host, bytes)) return;
  }
}

/// Reads on until the connection ends.
void drain(int host) {
  std::array<std::uint8_t, 4096> bytes{};
  while (receive(host, std::span(bytes).first(1))) {
    (void)::recv(host, bytes.data(), bytes.size(), MSG_DONTWAIT);
  }
}

void converse(std::span<const std::uint8_t> sent) {
  AnsweringFunction function;
  UsbipCarrier carrier(function, 4);
  function.carrier = &carrier;
  const int host = carrier.descriptor();
  std::thread sender([&] {
    std::span<const std::uint8_t> rest = sent;
    while (!rest.empty()) {
      const ssize_t count = ::send(host, rest.data(), rest.size(), MSG_NOSIGNAL);
      if (count <= 0) break;
      rest = rest.subspan(static_cast<std::size_t>(count));
    }
    ::shutdown(host, SHUT_WR);
  });
  try {
    const auto submits = submits_of(sent);
    if (!submits.empty()) check_answers(host, submits);
    drain(host);
  } catch (...) {
    carrier.unplug();
    sender.join();
    throw;
  }
  sender.join();
  require(!carrier.plugged(), "a connection that has ended is unplugged");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> input(data, size);
  for (std::size_t at = 0; at < size; at += kUsbipHeaderBytes) {
    Header header{};
    const auto piece = input.subspan(at, std::min(kUsbipHeaderBytes, size - at));
    std::copy(piece.begin(), piece.end(), header.begin());
    check_header(header);
  }
  converse(input);
  return 0;
}
