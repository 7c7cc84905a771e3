// SPDX-License-Identifier: Apache-2.0
// host_sim compare-laws --scene S.rtscene --motion M.csv --out DIR [--towards X,Y,Z]
// [--k-r K]
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/laws/law_comparison.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "host_sim/session/tick_csv.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct CompareLawsArguments {
  std::string scene, motion, out;
  std::vector<double> towards{0, 0, -1};
  double k_r_nm_per_rad = 0;
};

int do_compare_laws(const CompareLawsArguments& o) {
  if (o.towards.size() != 3) throw tools::UsageError("--towards needs three numbers");
  double towards[3] = {o.towards[0], o.towards[1], o.towards[2]};
  const double norm = length_of(towards);
  if (!(norm > 0))
    throw tools::UsageError("--towards: 0,0,0 has no direction; give three numbers such as 0,0,-1");
  for (double& x : towards) x /= norm;
  tools::claim_folder(o.out, "--out",
                      {"compare_laws.csv", "compare_laws.json", "compare_laws.svg", "README.md"});
  const CoreSession session(o.scene);
  require_one_moving_part(session, o.scene, "compare-laws",
                          "only law proxy moves several parts; give a scene of one");
  const std::vector<MotionSample> motion = read_played_motion(o.motion);
  std::vector<LawRun> runs;
  for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
    runs.push_back(
        run_law(scene_with_law(session.view(), law, o.k_r_nm_per_rad), law, motion, towards));
  }
  const SceneParameters& p = session.view().parameters();
  const std::string title(session.view().text(p.name_offset, p.name_bytes));
  write_whole_file(o.out + "/compare_laws.csv", comparison_csv(runs));
  write_whole_file(o.out + "/compare_laws.json", comparison_json(runs));
  write_whole_file(o.out + "/compare_laws.svg", comparison_picture(runs, title));
  write_whole_file(o.out + "/README.md", comparison_page(runs, title));
  for (const LawRun& law : runs) {
    std::printf(
        "%-6s largest change of force %.4g N, of torque %.4g mN m; way in %.6g of %.6g mm\n",
        law_name(law.law), law.force_steps[0].force_n, 1e3 * law.torque_steps[0].torque_nm,
        1e3 * law.farthest_proxy_m, 1e3 * law.farthest_goal_m);
  }
  return tools::kExitDone;
}

}  // namespace

Command add_compare_laws_command(CLI::App& program) {
  const auto o = std::make_shared<CompareLawsArguments>();
  CLI::App* app = program.add_subcommand(
      "compare-laws", "Runs a motion under the paper's law and the proxy law, side by side.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--motion", o->motion, "motion: t,x,y,z,qw,qx,qy,qz of A's mesh frame in W")
      ->required();
  app->add_option("-o,--out", o->out, "folder for the tables (CSV, JSON, Markdown) and the picture")
      ->required();
  app->add_option("--towards", o->towards, "direction of the insertion, W axes; default 0,0,-1")
      ->delimiter(',')
      ->expected(3);
  app->add_option("--k-r", o->k_r_nm_per_rad,
                  "rotational stiffness of the coupling in N m/rad instead of the scene's")
      ->check(tools::positive_number());
  return {app, [o] { return do_compare_laws(*o); },
          "host_sim compare-laws --scene peg.rtscene --motion motion.csv --out laws"};
}

}  // namespace haptic::sim
