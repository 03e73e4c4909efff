// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/guidance.h"

#include <fmt/core.h>

#include <array>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/view_pose.h"
#include "station/unit/guidance_maps.h"

namespace vlp {
namespace {

/// Computes the coverage of the views as in vlp-intrinsics, with poses from the nominal lens.
ViewCoverage compute_coverage(const Unit& unit) {
  const StationConfig& config = unit.config();
  const Lens nominal(config.type.lens_model, config.type.intrinsics);
  IntrinsicsInput input{
      BoardLattice(config.board), {}, config.type.imager_px, config.type.lens_model};
  IntrinsicsSolution poses{};
  for (const UnitImage* image : used_images(unit.step(StationStep::boards))) {
    poses.views.push_back(input.views.size());
    input.views.push_back(input.lattice.corners(image->seen.board->seen));
    const auto pose = estimate_view_pose(input.views.back(), nominal);
    if (pose) poses.problem.poses.push_back(pose->camera_from_board);
  }
  return compute_view_coverage(poses, input);
}

}  // namespace

std::string format_count(const Unit& unit, StationStep step) {
  const CompletionCriteria& sufficient = unit.config().sufficient;
  const std::array wanted{sufficient.board_views,
                          sufficient.turn_captures * sufficient.turn_heights,
                          sufficient.dispersion_captures, sufficient.check_captures};
  return fmt::format("{}/{}", unit.step(step).used(), wanted[static_cast<std::size_t>(step)]);
}

std::vector<std::string> describe_progress(const Unit& unit, StationStep step) {
  if (step == StationStep::boards) return draw_board_map(unit);
  std::vector<std::string> lines;
  if (step == StationStep::rotation) lines = describe_turn(unit);
  lines.push_back(describe_lamps(unit, unit.step(step)));
  return lines;
}

std::string describe_next_action(const Unit& unit, StationStep step) {
  const UnitStep& state = unit.step(step);
  if (state.result && !state.result->ok()) {
    return state.result->why + "; add images, or empty the step's folder and take them anew";
  }
  switch (step) {
    case StationStep::boards:
      return "show " + recommend_next_view(compute_coverage(unit));
    case StationStep::rotation: {
      const TurnMap turn = compute_unit_turn_map(unit);
      for (const TurnMap::Height& height : turn.heights) {
        const bool is_complete = height.captures >= unit.config().sufficient.turn_captures &&
                                 height.arc_rad >= unit.config().sufficient.turn_arc_rad;
        if (!is_complete) return "turn the camera on its spot to the next missing angle";
      }
      return turn.heights.empty() ? "take captures on one spot, turning the camera once around"
                                  : "move the camera to the next height and turn it once around";
    }
    case StationStep::dispersion:
      return "take captures at the station, turning the camera all around";
    case StationStep::check:
      return "take captures at the known points";
  }
  return "";
}

}  // namespace vlp
