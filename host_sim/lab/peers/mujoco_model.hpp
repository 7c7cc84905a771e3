// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Shared by the adapters of MuJoCo: a model from text, and differences of rotations.

#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>

#include "host_sim/lab/peers/peer_query.hpp"

namespace haptic::sim {

inline std::string mujoco_text(const PeerVector& v) {
  char text[100];
  std::snprintf(text, sizeof text, "%.17g %.17g %.17g", v[0], v[1], v[2]);
  return text;
}

/// To be deleted by mj_deleteModel. @throws std::runtime_error with MuJoCo's message.
inline mjModel* loaded_mujoco(const std::string& xml) {
  constexpr const char* kName = "model.xml";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(xml.size()) + 1);
  std::memcpy(files->filedata[0], xml.c_str(), xml.size() + 1);
  char error[500] = "";
  mjModel* const model = mj_loadXML(kName, files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("MuJoCo: ") + error);
  return model;
}

/// The turn from one orientation to another, W axes.
inline void mujoco_turn(const mjtNum* from, const mjtNum* to, mjtNum* vector) {
  mjtNum back[4], turn[4];
  mju_negQuat(back, from);
  mju_mulQuat(turn, to, back);
  mju_quat2Vel(vector, turn, 1);
}

/// @throws std::runtime_error where a step has gone wrong.
inline void check_mujoco(const mjData& data) {
  if (data.warning[mjWARN_CONTACTFULL].number + data.warning[mjWARN_CNSTRFULL].number +
          data.warning[mjWARN_BADQACC].number + data.warning[mjWARN_BADQPOS].number +
          data.warning[mjWARN_BADQVEL].number >
      0) {
    throw std::runtime_error("MuJoCo: no room for the contacts, or a step that diverged");
  }
}

}  // namespace haptic::sim
