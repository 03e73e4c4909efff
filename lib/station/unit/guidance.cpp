// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/guidance.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/lens_sharpness.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

/// Computes the coverage of the views as in vlp-intrinsics, with poses from the nominal lens.
ViewCoverage compute_coverage(const Unit& unit) {
  const StationConfig& config = unit.station_config();
  const Lens nominal(config.nominal_camera.lens_model, config.nominal_camera.intrinsics);
  IntrinsicsInput input{BoardLattice(config.board),
                        {},
                        config.nominal_camera.imager_px,
                        config.nominal_camera.lens_model};
  IntrinsicsSolution poses{};
  for (const UnitImage* image : list_used_images(unit.step_state(StationStep::boards))) {
    poses.views.push_back(input.views.size());
    input.views.push_back(input.lattice.list_corners(image->observation.board->detection));
    const auto pose = estimate_view_pose(input.views.back(), nominal);
    if (pose) poses.problem.poses.push_back(pose->camera_from_board);
  }
  return measure_view_coverage(poses, input);
}

std::string describe_angles(const YawCoverage::Height& height) {
  std::string angles;
  for (std::size_t part = 0; part < height.covered_sectors.size(); ++part) {
    if (height.covered_sectors[part]) continue;
    angles += fmt::format(" {:.0f}", 360.0 * double(part) / double(height.covered_sectors.size()));
  }
  return angles;
}

/// Returns a map of the corners over the image: '#' many, '+' some, '.' none.
std::vector<std::string> draw_board_map(const Unit& unit) {
  const ImageCoverage coverage = compute_board_coverage(
      unit.step_state(StationStep::boards), unit.station_config().nominal_camera.imager_px);
  constexpr int many = 20;
  std::vector<std::string> lines;
  const std::string edge = "  +-----------------+";
  lines.push_back(edge);
  for (int row = 0; row < ImageCoverage::kRows; ++row) {
    std::string line = "  |";
    for (int col = 0; col < ImageCoverage::kCols; ++col) {
      const int corners = coverage.count_in_cell(col, row);
      line += corners == 0 ? " ." : corners < many ? " +" : " #";
    }
    lines.push_back(line + " |");
  }
  lines.push_back(edge);
  lines[1] += fmt::format("   {:.0f} % of the image have corners, {:.0f} % wanted",
                          100 * coverage.covered_fraction(),
                          100 * unit.station_config().completion.board_coverage);
  lines[3] += "   # many corners   + some   . none";
  const UnitStep& boards = unit.step_state(StationStep::boards);
  const auto last = boards.images.find(boards.last_image);
  if (last == boards.images.end() || !last->second.observation.board) return lines;
  if (const auto mtf50 = compute_median_edge_mtf50(last->second.observation.board->detection)) {
    lines[5] += fmt::format("   sharpness of the last image: MTF50 {:.3f} cycles/px", *mtf50);
  }
  return lines;
}

/// Returns the covered angles of the rotation in place; empty before the lens is known.
YawCoverage compute_unit_coverage(const Unit& unit) {
  const auto& lens = unit.step_state(StationStep::boards).result;
  if (!lens || !lens->has_succeeded()) return {};
  return compute_yaw_coverage(list_used_detections(unit.step_state(StationStep::rotation)),
                              unit.station_config(), lens->calibration);
}

/// Returns the heights of the rotation with covered and missing angles, as lines.
std::vector<std::string> describe_rotation(const Unit& unit) {
  std::vector<std::string> lines;
  for (const YawCoverage::Height& height : compute_unit_coverage(unit).heights) {
    std::string parts;
    for (const bool there : height.covered_sectors) parts += there ? '#' : '.';
    const double z_m = std::round(100 * height.z_m) / 100 + 0.0;  // without negative zero
    lines.push_back(fmt::format("  height {:5.2f} m  [{}]  {} captures over {:.0f} degrees", z_m,
                                parts, height.captures, deg_from_rad(height.arc_rad)));
    const std::string missing = describe_angles(height);
    if (!missing.empty()) lines.push_back("    missing, degrees from the first:" + missing);
  }
  return lines;
}

/// Returns a line with the lamps that the captures of a step contain, and the missing ones.
std::string describe_lamps(const Unit& unit, const UnitStep& step) {
  std::map<int, int> seen;
  for (const UnitImage* image : list_used_images(step)) {
    for (const Detection& lamp : list_identified_lamps(image->observation)) ++seen[lamp.lamp];
  }
  std::string there, missing;
  for (const Lamp& lamp : unit.station_config().lamps.lamps) {
    (seen.contains(lamp.id) ? there : missing) += fmt::format(" {}", lamp.id);
  }
  return "  lamps seen:" + (there.empty() ? " none" : there) +
         (missing.empty() ? "" : "   not yet:" + missing);
}

}  // namespace

std::string format_image_count(const Unit& unit, StationStep step) {
  const CompletionCriteria& completion = unit.station_config().completion;
  const std::array wanted{completion.board_views,
                          completion.rotation_captures * completion.rotation_heights,
                          completion.dispersion_captures, completion.check_captures};
  return fmt::format("{}/{}", unit.step_state(step).count_used_images(),
                     wanted[static_cast<std::size_t>(step)]);
}

std::vector<std::string> describe_progress(const Unit& unit, StationStep step) {
  if (step == StationStep::boards) return draw_board_map(unit);
  std::vector<std::string> lines;
  if (step == StationStep::rotation) lines = describe_rotation(unit);
  lines.push_back(describe_lamps(unit, unit.step_state(step)));
  return lines;
}

std::string describe_next_action(const Unit& unit, StationStep step) {
  const UnitStep& state = unit.step_state(step);
  if (state.result && !state.result->has_succeeded()) {
    return state.result->message + "; add images, or empty the folder of the step and repeat it";
  }
  switch (step) {
    case StationStep::boards:
      return "show " + recommend_next_view(compute_coverage(unit));
    case StationStep::rotation: {
      const YawCoverage turn = compute_unit_coverage(unit);
      if (!std::ranges::all_of(turn.heights, &YawCoverage::Height::is_complete)) {
        return "turn the camera in place to the next missing angle";
      }
      return turn.heights.empty() ? "take captures at one position, turning the camera once around"
                                  : "move the camera to the next height and turn it once around";
    }
    case StationStep::dispersion:
      return "take captures at the reference point, turning the camera all around";
    case StationStep::check:
      return "take captures at the known points";
  }
  return "";
}

}  // namespace vlp
