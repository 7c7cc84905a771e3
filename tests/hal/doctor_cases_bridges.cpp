// SPDX-License-Identifier: Apache-2.0
#include <cerrno>

#include "tests/hal/doctor_cases.hpp"

namespace haptic::test {
namespace {

const std::string kPlugged = "/sys/bus/usb/devices/";
const std::string kPrint = "run_device doctor --print 60-haptic.rules | sudo tee";

/// The Haply service with one more thing to do, or none.
void haply_needs(FakeMachine& m, const char* needs) { m.probes.bridges["haply"].needs = needs; }
void haply_says(FakeMachine& m, const char* why) {
  m.probes.bridges["haply"] = {true, false, "", "", why};
}
constexpr const char* kHaplySilent =
    "Haply's Inverse service does not answer at 127.0.0.1:10000 or 10001 (Connection refused); "
    "start it";

const DoctorCase kBridgeCases[] = {
    {"a reference board that may not be opened",
     "device rights",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kPlugged + "1-2/speed", "12\n");
       m.probes.refused_nodes.insert("/dev/bus/usb/001/004");
     },
     {"1209:0001 at 1-2 for driver reference, full speed", "EACCES"},
     {kPrint, "udevadm control --reload"}},
    {"no device of a driver",
     "device rights",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove(kPlugged + "1-2"); },
     {"no device of a driver for USB"},
     {"lsusb"}},
    {"the daemon's socket may not be opened",
     "spacenavd",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.sockets["/run/spnav.sock"] = EACCES; },
     {"listens at /run/spnav.sock, which this user may not open"},
     {"sudo systemctl restart spacenavd", "sudo chmod 0666 /run/spnav.sock"}},
    {"the daemon runs, and nobody listens",
     "spacenavd",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.sockets["/run/spnav.sock"] = ECONNREFUSED; },
     {"it runs and listens at none of", "ECONNREFUSED"},
     {"sudo systemctl restart spacenavd"}},
    {"a device, and no daemon",
     "spacenavd",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.probes.sockets.clear();
       m.remove("/proc/55");
     },
     {"256f:c635 at 1-3 is plugged in, and no spacenavd runs"},
     {"sudo apt-get install spacenavd", "sudo systemctl start spacenavd", "\"spacemouse\""}},
    {"neither of them",
     "spacenavd",
     kSkipped,
     false,
     [](FakeMachine& m) {
       m.probes.sockets.clear();
       m.remove("/proc/55");
       m.remove(kPlugged + "1-3");
     },
     {"it does not run"},
     {"apt-get install"}},
    {"neither of them, and it was asked for",
     "spacenavd",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.questions.bridge = "spacenav";
       m.probes.sockets.clear();
       m.remove("/proc/55");
       m.remove(kPlugged + "1-3");
     },
     {"it does not run"},
     {"apt-get install"}},
    {"the socket of /etc/spnavrc, and the device that the other driver would want",
     "spacenavd",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/etc/spnavrc", "socket = /run/other.sock\n");
       m.probes.sockets = {{"/run/other.sock", EAGAIN}};
     },
     {"listens at /run/other.sock", "it holds 256f:c635 at 1-3",
      "driver = \"spacemouse\" is refused"},
     {}},
    {"the variable stands before it",
     "spacenavd",
     kPass,
     false,
     [](FakeMachine& m) {
       m.probes.variables["SPNAV_SOCKET"] = "/tmp/mine.sock";
       m.probes.sockets["/tmp/mine.sock"] = 0;
       m.remove(kPlugged + "1-3");
     },
     {"listens at /tmp/mine.sock", "no device of 3Dconnexion is on USB"},
     {}},
    {"the browser may not open it",
     "browser's mouse",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.refused_nodes.insert("/dev/hidraw0"); },
     {"/dev/hidraw0: EACCES"},
     {kPrint}},
    {"not calibrated, and another program has it",
     "Haply service",
     kWarning,
     false,
     [](FakeMachine& m) {
       haply_needs(m,
                   "not calibrated yet: put the handle to the calibration point; another program "
                   "commands this device now: end it");
     },
     {"Inverse3, serial 049D, service 3.5.0.0"},
     {"put the handle to the calibration point", "another program commands this device"}},
    {"a service of another version",
     "Haply service",
     kWarning,
     false,
     [](FakeMachine& m) {
       haply_says(m, "Inverse service 3.0.7 speaks the format 3.0; install 3.1 or 3.5");
     },
     {"3.0.7"},
     {"install 3.1 or 3.5"}},
    {"a service that does not run",
     "Haply service",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write("/lib/systemd/system/haply-inverse-service.service", "[Unit]\n");
       haply_says(m, kHaplySilent);
     },
     {"it is installed", "Connection refused"},
     {"    sudo systemctl start haply-inverse-service"}},
    {"no service",
     "Haply service",
     kSkipped,
     false,
     [](FakeMachine& m) { haply_says(m, kHaplySilent); },
     {"Connection refused"},
     {"install it"}},
    {"no service, and it was asked for",
     "Haply service",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.questions.bridge = "haply";
       haply_says(m, kHaplySilent);
     },
     {"Connection refused"},
     {"install it", "    sudo systemctl start haply-inverse-service"}},
    {"a program without bridges",
     "Haply service",
     kSkipped,
     false,
     [](FakeMachine& m) { m.probes.bridges.clear(); },
     {"not asked"},
     {"run_device doctor"}},
    {"a Touch, and no library",
     "OpenHaptics",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.probes.bridges["openhaptics"] = {
           true, false, "", "", "the vendor's library is not there (libHD.so): install it"};
     },
     {"it is plugged in", "library is not there"},
     {"OpenHaptics 3.x", "library = \"/PATH/libHD.so\""}},
    {"a Touch that is not calibrated",
     "OpenHaptics",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.probes.bridges["openhaptics"].needs = "it is not calibrated: put the stylus in";
     },
     {"Touch, serial 1, HDAPI 3.4.0"},
     {"put the stylus in"}},
    {"no Touch and no library",
     "OpenHaptics",
     kSkipped,
     false,
     [](FakeMachine& m) {
       m.remove(kPlugged + "1-5");
       m.probes.bridges["openhaptics"] = {
           true, false, "", "", "the vendor's library is not there (libHD.so): install it"};
     },
     {"library is not there"},
     {"libHD.so"}},
    {"the Touch's port may not be opened",
     "Touch port",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.refused_nodes.insert("/dev/ttyACM0"); },
     {"/dev/ttyACM0: EACCES"},
     {kPrint}},
    {"GTDD_HOME is not set",
     "GTDD_HOME",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.variables.clear(); },
     {"not set"},
     {"    export GTDD_HOME=", "    Touch_Setup"}},
    {"GTDD_HOME without a pairing",
     "GTDD_HOME",
     kWarning,
     false,
     [](FakeMachine& m) { m.remove("/home/anna/.3dsystems/config/Default Device.config"); },
     {"no device is paired in /home/anna/.3dsystems/config"},
     {"    Touch_Setup"}},
    {"an omega that another program has",
     "Force Dimension",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.probes.bridges["forcedimension"] = {
           true, false, "", "", "no Force Dimension device (libdhd.so.3, SDK 3.17.6, sees 0); x"};
     },
     {"it is plugged in", "SDK 3.17.6"},
     {"x"}},
    {"no SDK, and it was asked for",
     "Force Dimension",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.questions.bridge = "forcedimension";
       m.remove(kPlugged + "1-4");
       m.probes.bridges["forcedimension"] = {true, false, "", "",
                                             "the library cannot be loaded: no such file"};
     },
     {"cannot be loaded"},
     {"Force Dimension SDK 3.x"}},
    {"an omega that may not be opened",
     "Force Dimension USB",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.refused_nodes.insert("/dev/bus/usb/001/006"); },
     {"/dev/bus/usb/001/006: EACCES"},
     {kPrint}},
    {"a known adapter that may not be opened",
     "servo ports",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.refused_nodes.insert("/dev/ttyUSB0"); },
     {"/dev/ttyUSB0, ROBOTIS U2D2, driver dynamixel: EACCES"},
     {kPrint}},
    {"an unknown one",
     "servo ports",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kPlugged + "1-6/idProduct", "6001\n");
       m.probes.refused_nodes.insert("/dev/ttyUSB0");
     },
     {"/dev/ttyUSB0: EACCES"},
     {"    sudo usermod -aG dialout $USER"}},
    {"the path of an adapter",
     "servo ports",
     kPass,
     false,
     [](FakeMachine&) {},
     {"port = /dev/serial/by-id/usb-FTDI_Serial_FT1-if00-port0"},
     {}},
    {"no adapter, and an arm was asked for",
     "servo ports",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.questions.bridge = "feetech";
       m.remove(kPlugged + "1-6");
     },
     {"no serial port is on USB"},
     {"lsusb"}},
    {"an FTDI adapter at its 16 ms",
     "servo latency",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n"); },
     {"ttyUSB0: 16 ms"},
     {"    echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer"}},
    {"ModemManager runs",
     "ModemManager",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/66/comm", "ModemManager\n"); },
     {"it writes to ttyACM0, ttyUSB0"},
     {kPrint, "    sudo systemctl disable --now ModemManager"}},
    {"ModemManager runs, and a rule holds it off",
     "ModemManager",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/run/systemd/units/invocation:ModemManager.service", "1\n");
       // Numbers of the nodes 001/007 and 001/008.
       m.write("/run/udev/data/c189:6", "E:ID_MM_DEVICE_IGNORE=1\n");
       m.write("/run/udev/data/c189:7", "E:ID_MM_DEVICE_IGNORE=1\n");
     },
     {"leaves these ports alone"},
     {}},
};

}  // namespace

std::span<const DoctorCase> bridge_cases() { return kBridgeCases; }

}  // namespace haptic::test
