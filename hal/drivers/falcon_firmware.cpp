// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/falcon_firmware.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <new>
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

/// The image, whole: what was checked is what is sent, no matter what happens to the file.
class ImageFile {
 public:
  explicit ImageFile(const char* path) noexcept {
    if (path == nullptr || path[0] == '\0') return;
    // Not blocking: a pipe in the image's place must not hold the thread; it is refused below.
    const int file = ::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return;
    struct stat about {};
    const bool regular = ::fstat(file, &about) == 0 && S_ISREG(about.st_mode);
    const auto size = regular ? static_cast<std::size_t>(about.st_size) : 0;
    if (size >= kFalconLeastImageBytes && size <= kFalconMostImageBytes) {
      bytes_.reset(new (std::nothrow) std::uint8_t[size]);
      if (bytes_ != nullptr && read(file, size)) size_ = size;
    }
    ::close(file);
  }

  /// Empty: there is none.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return {bytes_.get(), size_};
  }

 private:
  [[nodiscard]] bool read(int file, std::size_t size) noexcept {
    std::size_t filled = 0;
    for (int tries = 0; tries < 100 && filled < size; ++tries) {
      const ssize_t n =
          ::pread(file, bytes_.get() + filled, size - filled, static_cast<off_t>(filled));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      filled += static_cast<std::size_t>(n);
    }
    return filled == size;
  }

  std::unique_ptr<std::uint8_t[]> bytes_;
  std::size_t size_ = 0;
};

bool is_known(std::span<const std::uint8_t> bytes, const FalconImage& image) noexcept {
  Sha256 hash;
  hash.add(bytes);
  const Sha256Digest digest = hash.finish();
  return image.accept_unknown ||
         std::find(image.known.begin(), image.known.end(), digest) != image.known.end();
}

HalStatus send_image(UsbPort& port, std::span<const std::uint8_t> image, bool& loaded) noexcept {
  loaded = false;
  while (!image.empty()) {
    const auto block = image.first(std::min(kFalconBlockBytes, image.size()));
    bool echoed = false;
    const HalStatus s = send_and_expect(port, block, block, false, kReadsPerBlock, echoed);
    if (s != HalStatus::kOk || !echoed) return s;
    image = image.subspan(block.size());
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

HalStatus load_falcon_firmware(UsbPort& port, const FalconImage& image, int attempts) noexcept {
  const ImageFile file(image.path);
  if (file.bytes().empty()) return HalStatus::kBadFirmwareFile;
  if (!is_known(file.bytes(), image)) return HalStatus::kUnknownFirmwareFile;
  for (int attempt = 0; attempt < std::clamp(attempts, 1, 10); ++attempt) {
    bool good = false;
    if (const HalStatus s = greet_loader(port, good); s != HalStatus::kOk) return s;
    if (!good) continue;
    if (const HalStatus s = send_image(port, file.bytes(), good); s != HalStatus::kOk) return s;
    if (good) return set_falcon_run_mode(port);
  }
  return HalStatus::kStartFailed;
}

}  // namespace haptic::hal
