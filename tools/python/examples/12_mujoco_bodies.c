// SPDX-License-Identifier: Apache-2.0
// For 12_mujoco_bodies.py: as 06_mujoco_peg.c, and a second body that is given poses too: a mocap
// body, one that is welded to a mocap body, or a free one that a spring draws. Made for
// MuJoCo 2.2.2 (Debian's libmujoco-dev).
#include <mujoco/mujoco.h>

// The dampers act on the speed beyond the goal's. `most`: of the spring's force, 0: no limit.
typedef struct spring {
  double stiffness, turn_stiffness, damping, turn_damping, most;
} spring;

// The goal of a tick moves from one pose (x y z, quaternion x y z w) to another.
typedef struct goal {
  const double *from, *to;
  double time;  // between them
} goal;

// After a share of the tick: place, and quaternion w first.
static void goal_at(const goal* g, double share, double* p, double* q) {
  int i;
  for (i = 0; i < 3; ++i) p[i] = g->from[i] + share * (g->to[i] - g->from[i]);
  for (i = 0; i < 4; ++i)
    q[i] = g->from[3 + (i + 3) % 4] * (1 - share) + g->to[3 + (i + 3) % 4] * share;
  mju_normalize4(q);
}

// From `from` to `to`, a rotation vector in the world: w first.
static void rotation_vector(const double* from, const double* to, double* v) {
  double back[4], turn[4];
  mju_negQuat(back, from);
  mju_mulQuat(turn, to, back);
  mju_quat2Vel(v, turn, 1.0);
}

// Applies the spring to a body with a free joint, and tells its pull.
static void draw(const mjModel* m, mjData* d, int body, const spring* s, const goal* g,
                 double share, double* pull) {
  const double* at = d->qpos + m->jnt_qposadr[m->body_jntadr[body]];
  const double* speed = d->qvel + m->jnt_dofadr[m->body_jntadr[body]];
  double* applied = d->xfrc_applied + 6 * body;
  double p[3], q[4], q_from[4], q_to[4], turn[3], goal_turn[3], own_turn[3], length;
  int i;
  goal_at(g, 0, p, q_from);
  goal_at(g, 1, p, q_to);
  rotation_vector(q_from, q_to, goal_turn);
  goal_at(g, share, p, q);
  rotation_vector(at + 3, q, turn);
  for (i = 0; i < 3; ++i) {
    pull[i] = s->stiffness * (p[i] - at[i]);
    pull[3 + i] = s->turn_stiffness * turn[i];
  }
  length = mju_norm3(pull);
  if (s->most > 0 && length > s->most) mju_scl3(pull, pull, s->most / length);
  // The angular velocity of a free joint is in the body's own axes.
  mju_rotVecQuat(own_turn, speed + 3, at + 3);
  for (i = 0; i < 3; ++i) {
    applied[i] = pull[i] + s->damping * ((g->to[i] - g->from[i]) / g->time - speed[i]);
    applied[3 + i] = pull[3 + i] + s->turn_damping * (goal_turn[i] / g->time - own_turn[i]);
  }
}

static void pose_of_body(const mjData* d, int body, double* pose) {
  mju_copy(pose, d->xpos + 3 * body, 3);
  mju_copy(pose + 3, d->xquat + 4 * body + 1, 3);
  pose[6] = d->xquat[4 * body];
}

// Body "part", the first with a free joint, is drawn to `goals`; mocap body 0, or body "driver" by
// its spring, to `drives`. Both have 7 numbers a tick, as `felt` and `driven`, where part and
// driver are then; `wrenches`, on the hand, 6. `parts`: steps of MuJoCo in a tick. Returns 0, or 1
// with a text in `error`.
int mujoco_bodies(const char* xml_file, int ticks, int parts, const double* goals,
                  const double* drives, const spring* hand, const spring* guide, double* wrenches,
                  double* felt, double* driven, char* error, int error_bytes) {
  mjModel* m = mj_loadXML(xml_file, NULL, error, error_bytes);
  mjData* d;
  int k, i, step, part, driver;
  if (m == NULL) return 1;
  d = mj_makeData(m);
  part = mj_name2id(m, mjOBJ_BODY, "part");
  driver = mj_name2id(m, mjOBJ_BODY, "driver");
  for (k = 0; k < ticks; ++k) {
    const int last = k > 0 ? k - 1 : 0;
    const double time = parts * m->opt.timestep;
    const goal wanted = {goals + 7 * last, goals + 7 * k, time};
    const goal drive = {drives + 7 * last, drives + 7 * k, time};
    double pull[6], guided[6];
    for (step = 0; step <= parts; ++step) {
      const double share = (double)step / parts;
      if (m->nmocap > 0)
        goal_at(&drive, share, d->mocap_pos, d->mocap_quat);
      else
        draw(m, d, driver, guide, &drive, share, guided);
      draw(m, d, part, hand, &wanted, share, pull);
      if (step < parts) mj_step(m, d);
    }
    for (i = 0; i < 6; ++i) wrenches[6 * k + i] = -pull[i];
    mj_kinematics(m, d);  // mj_step leaves the poses one step behind
    pose_of_body(d, part, felt + 7 * k);
    pose_of_body(d, driver, driven + 7 * k);
  }
  mj_deleteData(d);
  mj_deleteModel(m);
  return 0;
}

const char* mujoco_version(void) { return mj_versionString(); }
