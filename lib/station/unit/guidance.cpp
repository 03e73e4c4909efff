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
ViewCoverage coverage_so_far(const Unit& unit) {
  const StationConfig& config = unit.config();
  const Lens nominal(config.type.lens_model, config.type.intrinsics);
  IntrinsicsInput input{
      BoardLattice(config.board), {}, config.type.imager_px, config.type.lens_model};
  IntrinsicsSolution poses{};
  for (const UnitImage* image : used_images(unit.step(StationStep::boards))) {
    poses.views.push_back(input.views.size());
    input.views.push_back(input.lattice.corners(image->seen.board->seen));
    const auto pose = view_pose(input.views.back(), nominal);
    if (pose) poses.problem.poses.push_back(pose->camera_from_board);
  }
  return coverage_of(poses, input);
}

}  // namespace

std::string count_of(const Unit& unit, StationStep step) {
  const StationEnough& enough = unit.config().enough;
  const std::array wanted{enough.board_views, enough.turn_captures * enough.turn_heights,
                          enough.dispersion_captures, enough.check_captures};
  return fmt::format("{}/{}", unit.step(step).used(), wanted[static_cast<std::size_t>(step)]);
}

std::vector<std::string> progress_of(const Unit& unit, StationStep step) {
  if (step == StationStep::boards) return board_map(unit);
  std::vector<std::string> lines;
  if (step == StationStep::rotation) lines = turn_lines(unit);
  lines.push_back(lamps_line(unit, unit.step(step)));
  return lines;
}

std::string next_of(const Unit& unit, StationStep step) {
  const UnitStep& state = unit.step(step);
  if (state.result && !state.result->ok()) {
    return state.result->why + "; add images, or empty the step's folder and take them anew";
  }
  switch (step) {
    case StationStep::boards:
      return "show " + next_view(coverage_so_far(unit));
    case StationStep::rotation: {
      const TurnMap turn = turn_of(unit);
      for (const TurnMap::Height& height : turn.heights) {
        const bool whole = height.captures >= unit.config().enough.turn_captures &&
                           height.arc_rad >= unit.config().enough.turn_arc_rad;
        if (!whole) return "turn the camera on its spot to the next missing angle";
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
