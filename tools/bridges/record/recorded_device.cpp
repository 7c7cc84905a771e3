// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/record/recorded_device.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "tools/bridges/record/sample_bytes.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kMostWords = 4096;

}  // namespace

using hal::TapKind;

RecordedDevice::RecordedDevice(std::unique_ptr<hal::BridgedDevice> device,
                               std::shared_ptr<hal::DeviceTap> recorder)
    : device_(std::move(device)) {
  device_->set_tap(recorder);
  set_tap(std::move(recorder));
}

bool RecordedDevice::open(std::string& why) {
  tap()->note(TapKind::kOpen, 0, {}, {});
  is_open_ = device_->open(why);
  const std::string words = is_open_ ? device_->facts().name + "\n" + device_->facts().words : why;
  const std::span<const char> kept(words.data(), std::min(words.size(), kMostWords));
  tap()->note(TapKind::kOpened, is_open_ ? 1 : 0, {}, std::as_bytes(kept));
  return is_open_;
}

hal::BridgeRead RecordedDevice::read(std::int64_t now_ns, hal::BridgeSample& sample) {
  tap()->note(TapKind::kRead, now_ns, {}, {});
  const hal::BridgeRead read = device_->read(now_ns, sample);
  const SampleBytes bytes = bytes_of(sample);
  tap()->note(TapKind::kLooked, static_cast<std::int64_t>(read), {},
              std::span(bytes).first(read == hal::BridgeRead::kNew ? bytes.size() : 0));
  return read;
}

bool RecordedDevice::write(std::int64_t now_ns, const Wrench& wrench_d) {
  tap()->note(TapKind::kWrite, now_ns, bytes_of(wrench_d), {});
  return device_->write(now_ns, wrench_d);
}

bool RecordedDevice::release(std::int64_t now_ns) {
  tap()->note(TapKind::kRelease, now_ns, {}, {});
  return device_->release(now_ns);
}

void RecordedDevice::close() noexcept {
  if (is_open_) tap()->note(TapKind::kClose, 0, {}, {});
  device_->close();
  is_open_ = false;
}

}  // namespace haptic::tools
