// SPDX-License-Identifier: Apache-2.0
// For 06_mujoco_side_by_side.py: MuJoCo drives a free body by a spring and damper that draw it to
// the pose of the hand; what the hand feels is the spring's pull. Made for MuJoCo 2.2.2 (Debian's
// libmujoco-dev).
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>

// From `q` to the nearest rotation vector in the world: w first.
static void rotation_vector(const double* q_from, const double* q_to, double* v) {
  double back[4], turn[4];
  mju_negQuat(back, q_from);
  mju_mulQuat(turn, q_to, back);
  mju_quat2Vel(v, turn, 1.0);
}

// `poses`: 7 numbers a step (x y z, quaternion x y z w) of body 1's frame. `wrenches`: 6 numbers a
// step, force and torque on the hand. Returns 0, or 1 with a text in `error`. `parts`: steps of
// MuJoCo for each of these.
int mujoco_replay(const char* xml_file, int steps, int parts, const double* poses, double stiffness,
                  double turn_stiffness, double damping, double turn_damping, double* wrenches,
                  double* felt, char* error, int error_bytes) {
  mjModel* m = mj_loadXML(xml_file, NULL, error, error_bytes);
  mjData* d;
  int k, i, part;
  if (m == NULL) return 1;
  d = mj_makeData(m);
  for (k = 0; k < steps; ++k) {
    const double* goal = poses + 7 * k;
    const double q_goal[4] = {goal[6], goal[3], goal[4], goal[5]};
    double pull[6], turn[3];
    if (k == 0) {
      mju_copy(d->qpos, goal, 3);
      mju_copy(d->qpos + 3, q_goal, 4);
      mj_forward(m, d);
    }
    for (part = 0; part < parts; ++part) {
      rotation_vector(d->qpos + 3, q_goal, turn);
      for (i = 0; i < 3; ++i) {
        pull[i] = stiffness * (goal[i] - d->qpos[i]);
        pull[3 + i] = turn_stiffness * turn[i];
      }
      for (i = 0; i < 3; ++i) d->xfrc_applied[6 + i] = pull[i] - damping * d->qvel[i];
      // The angular velocity of a free joint is in the body's own axes.
      mju_rotVecQuat(turn, d->qvel + 3, d->qpos + 3);
      for (i = 0; i < 3; ++i) d->xfrc_applied[9 + i] = pull[3 + i] - turn_damping * turn[i];
      mj_step(m, d);
    }
    for (i = 0; i < 6; ++i) wrenches[6 * k + i] = -pull[i];
    mju_copy(felt + 7 * k, d->qpos, 3);
    for (i = 0; i < 3; ++i) felt[7 * k + 3 + i] = d->qpos[4 + i];
    felt[7 * k + 6] = d->qpos[3];
  }
  mj_deleteData(d);
  mj_deleteModel(m);
  return 0;
}
