// SPDX-License-Identifier: Apache-2.0
// For 11_mujoco_robot.py: a MuJoCo model of which one body is followed and pushed. Made for MuJoCo
// 2.2.2 (Debian's libmujoco-dev).
#include <mujoco/mujoco.h>
#include <stdlib.h>

typedef struct robot {
  mjModel* m;
  mjData* d;
  int body;
} robot;

void robot_close(robot* r) {
  if (r->d) mj_deleteData(r->d);
  if (r->m) mj_deleteModel(r->m);
  free(r);
}

// Null, with a text in `error`, if the model cannot be loaded.
robot* robot_open(const char* xml_file, const char* body, char* error, int error_bytes) {
  robot* r = calloc(1, sizeof(robot));
  r->m = mj_loadXML(xml_file, NULL, error, error_bytes);
  if (r->m == NULL) {
    robot_close(r);
    return NULL;
  }
  r->d = mj_makeData(r->m);
  r->body = mj_name2id(r->m, mjOBJ_BODY, body);
  return r;
}

// Joint angles, and the set points of the actuators at them.
void robot_place(robot* r, const double* angles) {
  mju_copy(r->d->qpos, angles, r->m->nq);
  mju_copy(r->d->ctrl, angles, r->m->nu);
  mj_forward(r->m, r->d);
}

void robot_step(robot* r, int steps, const double* set_points) {
  mju_copy(r->d->ctrl, set_points, r->m->nu);
  while (steps-- > 0) mj_step(r->m, r->d);
  mj_kinematics(r->m, r->d);  // mj_step leaves the poses one step behind the angles
}

// Of the body's frame: x y z, quaternion x y z w.
void robot_pose(const robot* r, double* pose) {
  const double* q = r->d->xquat + 4 * r->body;
  mju_copy(pose, r->d->xpos + 3 * r->body, 3);
  mju_copy(pose + 3, q + 1, 3);
  pose[6] = q[0];
}

// A force, and a torque about the origin of the body's frame, both in the axes of the world, until
// the next call. MuJoCo takes the torque about the centre of mass.
void robot_push(robot* r, const double* force, const double* torque) {
  double* applied = r->d->xfrc_applied + 6 * r->body;
  double arm[3], moment[3];
  mju_sub3(arm, r->d->xpos + 3 * r->body, r->d->xipos + 3 * r->body);
  mju_cross(moment, arm, force);
  mju_copy(applied, force, 3);
  mju_add3(applied + 3, torque, moment);
}

const char* robot_version(void) { return mj_versionString(); }
