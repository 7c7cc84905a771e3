// SPDX-License-Identifier: Apache-2.0
// What nearly every test includes, compiled once for all test programs. A test still includes what
// it uses.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>
