// SPDX-License-Identifier: Apache-2.0
// Hands on a daemon, on Haply's service, and on the vendors' libraries.
#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <new>
#include <stdexcept>

#include "hal/clock/servo_clock.hpp"
#include "tests/bridges/haply/inverse_service.hpp"
#include "tests/bridges/sessions/emulated_hand.hpp"
#include "tests/bridges/spacenav/spacenav_emulator.hpp"
#include "tests/bridges/vendor/fake_trace.hpp"
#include "tests/support/program_run.hpp"

namespace haptic::test {
namespace {

class SpacenavHand final : public EmulatedHand {
 public:
  SpacenavHand() {
    if (!daemon_.start()) throw std::runtime_error("the emulated spacenavd cannot listen");
    daemon_.plug(EmulatedDevice{});
  }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> environment() const override {
    return {{"SPNAV_SOCKET", folder_.file("spnav.sock")}};
  }
  void press(bool pressed) override { daemon_.press(0, pressed); }
  /// A cap has a speed and no place: full push is 0.10 m/s beyond a dead zone of 5 %. Its own axes
  /// are x right, y towards the operator, z down.
  void move(const Vec3& way_d) override {
    const std::int64_t now_ns = hal::monotonic_ns();
    if (now_ns - told_ns_ < kEvery_ns) return;
    const double seconds = 1e-9 * static_cast<double>(now_ns - told_ns_);
    std::array<std::int16_t, 6> raw{};
    for (int k = 0; k < 3; ++k) {
      const double share = static_cast<double>(way_d[k] - way_[k]) / seconds / 0.10;
      const double pushed = share == 0 ? 0 : std::copysign(0.05 + 0.95 * std::abs(share), share);
      const double counts = std::clamp(500 * pushed, -500.0, 500.0) * (k == 0 ? 1 : -1);
      raw[static_cast<std::size_t>(k)] = static_cast<std::int16_t>(std::lround(counts));
    }
    daemon_.report(raw);
    way_ = way_d;
    told_ns_ = now_ns;
  }

 private:
  static constexpr std::int64_t kEvery_ns = 8'000'000;
  const sim::test::ScratchFolder folder_{"spacenav_hand"};
  SpacenavEmulator daemon_{folder_.file("spnav.sock")};
  Vec3 way_ = Vec3::Zero();
  std::int64_t told_ns_ = 0;
};

/// The service has fixed ports, which another one on this machine may have: a network of this
/// process's own where Linux grants one, else the machine's.
void take_own_network() {
  static const bool is_own = [] {
    if (unshare(CLONE_NEWNET) != 0) return false;
    const int any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq loopback{};
    std::strcpy(loopback.ifr_name, "lo");
    loopback.ifr_flags = IFF_UP;
    const bool is_up = ioctl(any, SIOCSIFFLAGS, &loopback) == 0;
    close(any);
    return is_up;
  }();
  static_cast<void>(is_own);
}

class HaplyHand final : public EmulatedHand {
 public:
  explicit HaplyHand(const std::string& version) {
    take_own_network();
    const InverseKind kind = version.starts_with("3.0")   ? InverseKind::k30
                             : version.starts_with("3.1") ? InverseKind::k31
                                                          : InverseKind::k35;
    try {
      service_ = std::make_unique<InverseService>(kind, version, 10000, 10001);
    } catch (const std::runtime_error& error) {
      absence_ = error.what();
    }
  }
  [[nodiscard]] std::string absence() const override { return absence_; }
  void press(bool pressed) override {
    device_.a = pressed;
    service_->set(device_);
  }
  void move(const Vec3& way_d) override {
    const TableDevice rest;
    for (int k = 0; k < 3; ++k)
      device_.position_m[static_cast<std::size_t>(k)] =
          rest.position_m[static_cast<std::size_t>(k)] + static_cast<double>(way_d[k]);
    service_->set(device_);
  }
  [[nodiscard]] std::vector<WireForce> wire() const override {
    std::vector<WireForce> forces;
    for (const Exerted& e : service_->log())
      forces.push_back(
          {e.at_ns, Vec3(static_cast<Real>(e.force_n[0]), static_cast<Real>(e.force_n[1]),
                         static_cast<Real>(e.force_n[2]))});
    return forces;
  }
  [[nodiscard]] bool is_limp() const override {
    const std::vector<WireForce> forces = wire();
    return forces.empty() || forces.back().force_d.isZero(0);
  }

 private:
  std::unique_ptr<InverseService> service_;
  std::string absence_;
  TableDevice device_;
};

/// The library is found as an installed one is, by its usual name; the trace is shared with the
/// bridge that has loaded it.
class VendorHand final : public EmulatedHand {
 public:
  /// @param r_dv  the library's axes in D
  VendorHand(const char* library, const char* usual_name, const Mat3& r_dv) : r_dv_(r_dv) {
    std::filesystem::create_symlink(library, folder_.file(usual_name));
    const int file = open(folder_.file("trace").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0 || ftruncate(file, sizeof(fake::Trace)) != 0)
      throw std::runtime_error("no file for the trace of a library");
    void* const at =
        mmap(nullptr, sizeof(fake::Trace), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (at == MAP_FAILED) throw std::runtime_error("no memory for the trace of a library");
    trace_ = new (at) fake::Trace;
    trace_->is_fixed.store(1);
  }
  ~VendorHand() override { munmap(static_cast<void*>(trace_), sizeof(fake::Trace)); }
  VendorHand(const VendorHand&) = delete;
  VendorHand& operator=(const VendorHand&) = delete;

  [[nodiscard]] std::vector<std::pair<std::string, std::string>> environment() const override {
    return {{"LD_LIBRARY_PATH", std::filesystem::path(folder_.file("trace")).parent_path()},
            {"HAPTIC_FAKE_TRACE", folder_.file("trace")}};
  }
  void press(bool pressed) override { trace_->buttons.store(pressed ? 1 : 0); }
  void move(const Vec3& way_d) override {
    const Vec3 way_v = r_dv_.transpose() * way_d;
    for (int k = 0; k < 3; ++k) trace_->position_m[k].store(static_cast<double>(way_v[k]));
  }
  [[nodiscard]] std::vector<WireForce> wire() const override {
    std::vector<WireForce> forces;
    const std::uint64_t count = trace_->wrenches.load();
    if (count > fake::kHistory) throw std::runtime_error("the trace of a library is too short");
    for (std::uint64_t k = 0; k < count; ++k) {
      const auto& f = trace_->history_xyz_n[k];
      forces.push_back({trace_->history_us[k].load() * 1000,
                        r_dv_ * Vec3(static_cast<Real>(f[0].load()), static_cast<Real>(f[1].load()),
                                     static_cast<Real>(f[2].load()))});
    }
    return forces;
  }
  [[nodiscard]] bool is_limp() const override {
    return trace_->force_on.load() == 0 ||
           (trace_->force[0].load() == 0 && trace_->force[1].load() == 0 &&
            trace_->force[2].load() == 0);
  }

 private:
  const sim::test::ScratchFolder folder_{"vendor_hand"};
  const Mat3 r_dv_;
  fake::Trace* trace_ = nullptr;
};

}  // namespace

std::unique_ptr<EmulatedHand> make_spacenav_hand() { return std::make_unique<SpacenavHand>(); }
std::unique_ptr<EmulatedHand> make_haply_hand(const std::string& version) {
  return std::make_unique<HaplyHand>(version);
}
std::unique_ptr<EmulatedHand> make_touch_hand() {
  // x right, y up, z towards the operator
  const Mat3 r_dv = (Mat3() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
  return std::make_unique<VendorHand>(HAPTIC_HD_FAKE, "libHD.so.3.4", r_dv);
}
std::unique_ptr<EmulatedHand> make_force_dimension_hand() {
  // x towards the operator, y right, z up
  const Mat3 r_dv = (Mat3() << 0, 1, 0, -1, 0, 0, 0, 0, 1).finished();
  return std::make_unique<VendorHand>(HAPTIC_DHD_FAKE, "libdhd.so.3", r_dv);
}

}  // namespace haptic::test
