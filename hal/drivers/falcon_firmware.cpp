// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/falcon_firmware.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <span>

#include "hal/drivers/falcon_codec.hpp"

namespace haptic::hal {
namespace {

constexpr unsigned kControl_ms = 1000, kWrite_ms = 1000, kRead_ms = 50;
constexpr int kGreetings = 100;     // as often as libnifalcon sends its first message
constexpr int kReadsPerAnswer = 8;  // packets without bytes come every 16 ms while nothing is there
constexpr int kReadsPerBlock = 100;  // 62 bytes take 4.5 ms at 140 kbaud
constexpr int kProbes = 5;

/// A read that found nothing is an ordinary event of the line, not a failure of the port.
bool is_fatal(HalStatus status) noexcept {
  return status != HalStatus::kOk && status != HalStatus::kTimeout;
}

HalStatus request(UsbPort& port, FtdiRequest what, std::uint16_t value) noexcept {
  if (port.cancelled()) return HalStatus::kTimeout;
  std::size_t moved = 0;
  return port.control({0x40, what, value, 0}, {}, moved, kControl_ms);
}

struct LineStep {
  FtdiRequest what;
  std::uint16_t value;
};

HalStatus set_line(UsbPort& port, std::span<const LineStep> steps) noexcept {
  for (const LineStep& step : steps) {
    if (const HalStatus s = request(port, step.what, step.value); s != HalStatus::kOk) return s;
  }
  return HalStatus::kOk;
}

/// Reads until `expected` has come back, byte for byte. `matches` becomes false on the first wrong
/// byte, on too many bytes, or after `reads` packets.
HalStatus expect(UsbPort& port, std::span<const std::uint8_t> expected, bool leading_zeros,
                 int reads, bool& matches) noexcept {
  std::array<std::uint8_t, kFtdiPacketBytes> packet{};
  std::size_t seen = 0;
  matches = false;
  for (int i = 0; i < reads && seen < expected.size(); ++i) {
    if (port.cancelled()) return HalStatus::kTimeout;
    std::size_t moved = 0;
    if (const HalStatus s = port.read(packet, moved, kRead_ms); is_fatal(s)) return s;
    for (std::size_t k = kFtdiStatusBytes; k < std::min(moved, packet.size()); ++k) {
      if (leading_zeros && seen == 0 && packet[k] == 0) continue;
      if (seen == expected.size() || packet[k] != expected[seen]) return HalStatus::kOk;
      ++seen;
    }
  }
  matches = seen == expected.size();
  return HalStatus::kOk;
}

HalStatus send_and_expect(UsbPort& port, std::span<const std::uint8_t> sent,
                          std::span<const std::uint8_t> expected, bool leading_zeros, int reads,
                          bool& matches) noexcept {
  matches = false;
  const HalStatus written = port.write(sent, kWrite_ms);
  if (written == HalStatus::kTimeout) return HalStatus::kOk;  // not taken: no answer either
  if (written != HalStatus::kOk) return written;
  return expect(port, expected, leading_zeros, reads, matches);
}

HalStatus greet_loader(UsbPort& port, bool& answered) noexcept {
  static constexpr LineStep kGreetLine[] = {{kFtdiReset, 1},           {kFtdiReset, 2},
                                            {kFtdiLatency, 16},        {kFtdiBaud, kFtdiBaud9600},
                                            {kFtdiFormat, 8},          {kFtdiFlow, 0},
                                            {kFtdiModem, kFtdiRtsLow}, {kFtdiModem, kFtdiDtrLow},
                                            {kFtdiModem, kFtdiDtrHigh}};
  static constexpr LineStep kLoadLine[] = {{kFtdiModem, kFtdiDtrLow}, {kFtdiBaud, kFtdiBaudLoad}};
  static constexpr std::uint8_t kHello[] = {0x0a, 0x43, 0x0d};
  static constexpr std::uint8_t kReply[] = {0x0a, 0x44, 0x2c, 0x0d};
  static constexpr std::uint8_t kLetter[] = {0x41};
  answered = false;
  if (const HalStatus s = set_line(port, kGreetLine); s != HalStatus::kOk) return s;
  for (int i = 0; i < kGreetings && !answered; ++i) {
    // Some hosts see a zero before the reply.
    const HalStatus s = send_and_expect(port, kHello, kReply, true, kReadsPerAnswer, answered);
    if (s != HalStatus::kOk) return s;
  }
  if (!answered) return HalStatus::kOk;
  if (const HalStatus s = set_line(port, kLoadLine); s != HalStatus::kOk) return s;
  return send_and_expect(port, kLetter, kLetter, false, kReadsPerAnswer, answered);
}

/// The open image; closed when it goes.
class ImageFile {
 public:
  explicit ImageFile(const char* path) noexcept {
    if (path == nullptr || path[0] == '\0') return;
    // Not blocking: a pipe in the image's place must not hold the thread; it is refused below.
    file_ = ::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat about {};
    if (file_ < 0 || ::fstat(file_, &about) != 0 || !S_ISREG(about.st_mode)) return;
    const auto least = static_cast<off_t>(kFalconLeastImageBytes);
    const auto most = static_cast<off_t>(kFalconMostImageBytes);
    if (about.st_size >= least && about.st_size <= most) {
      bytes_ = static_cast<std::size_t>(about.st_size);
    }
  }
  ~ImageFile() {
    if (file_ >= 0) ::close(file_);
  }
  ImageFile(const ImageFile&) = delete;
  ImageFile& operator=(const ImageFile&) = delete;

  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  /// Fills `block` from `offset`; false where the file has become shorter or cannot be read.
  [[nodiscard]] bool read(std::size_t offset, std::span<std::uint8_t> block) const noexcept {
    std::size_t filled = 0;
    for (int tries = 0; tries < 100 && filled < block.size(); ++tries) {
      const ssize_t n = ::pread(file_, block.data() + filled, block.size() - filled,
                                static_cast<off_t>(offset + filled));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      filled += static_cast<std::size_t>(n);
    }
    return filled == block.size();
  }

 private:
  int file_ = -1;
  std::size_t bytes_ = 0;
};

HalStatus send_image(UsbPort& port, const ImageFile& image, bool& loaded) noexcept {
  std::array<std::uint8_t, kFalconBlockBytes> buffer{};
  loaded = false;
  for (std::size_t at = 0; at < image.bytes(); at += buffer.size()) {
    const std::span<std::uint8_t> block(buffer.data(), std::min(buffer.size(), image.bytes() - at));
    if (!image.read(at, block)) return HalStatus::kBadFirmwareFile;
    bool echoed = false;
    const HalStatus s = send_and_expect(port, block, block, false, kReadsPerBlock, echoed);
    if (s != HalStatus::kOk || !echoed) return s;
  }
  loaded = true;
  return HalStatus::kOk;
}

}  // namespace

HalStatus set_falcon_run_mode(UsbPort& port) noexcept {
  static constexpr LineStep kRunLine[] = {
      {kFtdiLatency, 1}, {kFtdiBaud, kFtdiBaudRun}, {kFtdiReset, 1}, {kFtdiReset, 2}};
  return set_line(port, kRunLine);
}

HalStatus probe_falcon(UsbPort& port, bool& runs) noexcept {
  FalconCommand command;
  command.homing = true;
  const FalconPacket packet = encode(command);
  FalconStream stream;
  std::array<std::uint8_t, kFtdiPacketBytes> bytes{};
  runs = false;
  for (int probe = 0; probe < kProbes; ++probe) {
    const HalStatus written = port.write(packet, kWrite_ms);
    if (is_fatal(written)) return written;
    for (int i = 0; i < kReadsPerAnswer; ++i) {
      if (port.cancelled()) return HalStatus::kTimeout;
      std::size_t moved = 0;
      if (const HalStatus s = port.read(bytes, moved, kRead_ms); is_fatal(s)) return s;
      for (std::size_t k = kFtdiStatusBytes; k < std::min(moved, bytes.size()); ++k) {
        FalconReport report;
        runs = runs || (stream.push(bytes[k]) == FalconStream::Step::kPacket &&
                        decode(stream.packet(), report));
      }
      if (runs) return HalStatus::kOk;
    }
  }
  return HalStatus::kOk;
}

HalStatus load_falcon_firmware(UsbPort& port, const char* path, int attempts) noexcept {
  const ImageFile image(path);
  if (image.bytes() == 0) return HalStatus::kBadFirmwareFile;
  for (int attempt = 0; attempt < std::clamp(attempts, 1, 10); ++attempt) {
    bool good = false;
    if (const HalStatus s = greet_loader(port, good); s != HalStatus::kOk) return s;
    if (!good) continue;
    if (const HalStatus s = send_image(port, image, good); s != HalStatus::kOk) return s;
    if (good) return set_falcon_run_mode(port);
  }
  return HalStatus::kStartFailed;
}

}  // namespace haptic::hal
