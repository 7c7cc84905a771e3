# SPDX-License-Identifier: Apache-2.0
# The studies of the laboratory: comparisons, tables and figures that answer a question once. HAPTIC_BUILD_STUDIES builds them
# into host_lab; without it files whose names end in _absent stand in, and say how to get them.
set(haptic_study_commands)
if(HAPTIC_BUILD_STUDIES)
  target_sources(haptic_host_lab
    PRIVATE
      lab/optional/studies_built.cpp
      lab/stability/part_continuity.cpp
      lab/studies/pareto/pair_plot.cpp
      lab/studies/pareto/pair_sweep.cpp
      lab/studies/pareto/pair_table.cpp
      lab/studies/pegs/peg_table.cpp
      lab/studies/planning/guide_limits.cpp
      lab/studies/planning/guide_study.cpp
      lab/studies/planning/guide_study_report.cpp
      lab/studies/planning/insertion_hand.cpp
      lab/studies/planning/planning_table.cpp
      lab/studies/realtime/loop_rates.cpp
      lab/studies/realtime/rate_error.cpp
      lab/studies/reproduction/drawing.cpp
      lab/studies/reproduction/figure_contacts.cpp
      lab/studies/reproduction/figure_forces.cpp
      lab/studies/reproduction/figure_guidance.cpp
      lab/studies/reproduction/figure_insertion.cpp
      lab/studies/reproduction/figure_motion.cpp
      lab/studies/reproduction/figure_neighbors.cpp
      lab/studies/reproduction/graph_report.cpp
      lab/studies/reproduction/graph_table.cpp
      lab/studies/reproduction/literal_table.cpp
      lab/studies/reproduction/reproduction.cpp
      lab/studies/reproduction/solid_union.cpp
      lab/studies/reproduction/timing_table.cpp
      lab/studies/stability/part_clearance.cpp
      lab/studies/stability/part_divisions.cpp
      lab/studies/stability/part_energy.cpp
      lab/studies/stability/part_z_width.cpp
      lab/studies/stability/study_parts.cpp
    PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES
      lab/studies/pareto/pair_plot.hpp
      lab/studies/pegs/peg_table.hpp
      lab/studies/planning/guide_limits.hpp
      lab/studies/planning/guide_study.hpp
      lab/studies/planning/insertion_hand.hpp
      lab/studies/planning/planning_table.hpp
      lab/studies/realtime/loop_rates.hpp
      lab/studies/realtime/rate_error.hpp
      lab/studies/reproduction/drawing.hpp
      lab/studies/reproduction/figures.hpp
      lab/studies/reproduction/graph_table.hpp
      lab/studies/reproduction/literal_table.hpp
      lab/studies/reproduction/reproduction.hpp
      lab/studies/reproduction/solid_union.hpp
      lab/studies/reproduction/timing_table.hpp)
  set(haptic_study_commands
    lab/studies/commands/guide_limits_command.cpp
    lab/studies/commands/guide_study_command.cpp
    lab/studies/commands/pegs_command.cpp
    lab/studies/commands/planners_command.cpp
    lab/studies/commands/rates_command.cpp
    lab/studies/commands/reproduce_paper_command.cpp
    lab/studies/commands/study_commands.cpp)
else()
  target_sources(haptic_host_lab PRIVATE lab/optional/studies_absent.cpp lab/pareto/pairs_absent.cpp
    lab/stability/study_parts_absent.cpp)
  set(haptic_study_commands lab/commands/study_commands_absent.cpp)
endif()

# haptic_study_unity(): the objects of the studies, after haptic_unity(haptic_host_lab).
function(haptic_study_unity)
  if(HAPTIC_BUILD_STUDIES)
    haptic_unity_together(haptic_host_lab lab/studies/pareto lab/studies/pegs lab/studies/planning lab/studies/realtime)
    haptic_unity_together(haptic_host_lab lab/studies/reproduction lab/studies/stability)
  endif()
endfunction()
