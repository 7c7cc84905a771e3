// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>
#include <vector>

#include "hal/drivers/spacemouse_driver.hpp"
#include "hal/drivers/spacenav_socket.hpp"
#include "tests/support/listening_socket.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic::hal;
using haptic::test::has;
using haptic::test::ListeningSocket;

TEST_SUITE("hal.spacenav_socket") {
  TEST_CASE("spacenav_path_of: the first socket of spnavrc that has a value") {
    CHECK(spacenav_path_of("") == "");
    CHECK(spacenav_path_of("socket = /tmp/a b.sock \r\n") == "/tmp/a b.sock");
    CHECK(spacenav_path_of("#socket = /no\n  socket=/yes\nsocket = /late") == "/yes");
    CHECK(spacenav_path_of("sensitivity = 2\nsocket =\nsocket = /second") == "/second");
    CHECK(spacenav_path_of("sockets = /no\nsocket /no\n= /no\n=\n\n") == "");
    CHECK(spacenav_path_of(std::string("socket=/a\0b", 11)) == std::string("/a\0b", 4));
  }

  TEST_CASE("spacenav_paths: the environment first, the usual ones last") {
    unsetenv("SPNAV_SOCKET");
    const std::vector<std::string> usual = spacenav_paths();
    REQUIRE(usual.size() >= 2u);
    CHECK(usual[usual.size() - 2] == "/var/run/spnav.sock");
    CHECK(usual.back() == "/run/spnav.sock");
    setenv("SPNAV_SOCKET", "/tmp/mine", 1);
    CHECK(spacenav_paths().front() == "/tmp/mine");
    CHECK(spacenav_paths().size() == usual.size() + 1);
    setenv("SPNAV_SOCKET", "", 1);
    CHECK(spacenav_paths() == usual);
    unsetenv("SPNAV_SOCKET");
  }

  TEST_CASE("connect_spacenav: a descriptor, or why there is none") {
    ListeningSocket daemon;
    const int fd = connect_spacenav(daemon.path());
    REQUIRE(fd >= 0);
    CHECK((fcntl(fd, F_GETFL) & O_NONBLOCK) != 0);
    CHECK((fcntl(fd, F_GETFD) & FD_CLOEXEC) != 0);
    close(fd);
    CHECK(connect_spacenav("") == -ENOENT);
    CHECK(connect_spacenav(daemon.path() + ".not") == -ENOENT);
    CHECK(connect_spacenav(std::string(108, 'x')) == -ENAMETOOLONG);
    CHECK(connect_spacenav("/tmp") == -ECONNREFUSED);
    daemon.stop();
    CHECK(connect_spacenav(daemon.path()) == -ECONNREFUSED);  // the file is there still
  }

  TEST_CASE("spacenav_holder: while somebody listens, and in the profile of driver spacemouse") {
    unsetenv("SPNAV_SOCKET");
    const bool asks = SpaceMouseDriver().profile().holder != nullptr;
    REQUIRE(asks);
    if (!spacenav_holder().empty()) {
      MESSAGE("skipped: a spacenavd runs on this machine");
      return;
    }
    ListeningSocket daemon;
    setenv("SPNAV_SOCKET", daemon.path().c_str(), 1);
    const std::string text = SpaceMouseDriver().profile().holder();
    CHECK(has(text, "spacenavd holds the devices of 3Dconnexion (it listens at " + daemon.path()));
    CHECK(has(text, "Give driver = \"spacenav\""));
    CHECK(has(text, "sudo systemctl stop spacenavd"));
    for (int k = 0; k < 64; ++k) (void)spacenav_holder();  // none of which it accepts
    CHECK(spacenav_holder() == text);
    daemon.stop();
    CHECK(spacenav_holder().empty());
    unsetenv("SPNAV_SOCKET");
  }
}
