// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/renamed.h"

#include <algorithm>
#include <array>

namespace vlp {
namespace {

struct Renaming {
  NameKind kind;
  std::string_view former, present;
};

/// All renamed names that programs read. A former name is unique in its kind, and so is a present
/// one.
constexpr std::array kRenamings{
    // scene.yaml
    Renaming{NameKind::key, "radiance_e_per_s", "electron_rate_e_per_s"},
    Renaming{NameKind::key, "edge_share", "rim_to_center_ratio"},
    Renaming{NameKind::key, "reflector_share", "reflector_ratio"},
    Renaming{NameKind::key, "share", "fraction"},
    Renaming{NameKind::key, "focal_share", "focal_fraction"},
    Renaming{NameKind::key, "distortion_share", "distortion_fraction"},
    Renaming{NameKind::key, "fault_share", "fault_fraction"},
    Renaming{NameKind::key, "damage_share", "damage_fraction"},
    Renaming{NameKind::key, "red_share", "red_to_green_ratio"},
    Renaming{NameKind::key, "blue_share", "blue_to_green_ratio"},
    Renaming{NameKind::key, "picture", "processing"},
    Renaming{NameKind::key, "print", "pattern"},
    Renaming{NameKind::key, "lean", "roll_pitch"},
    Renaming{NameKind::key, "spread", "field_coverage"},
    Renaming{NameKind::key, "spots_m", "pivots_m"},
    // station.yaml
    Renaming{NameKind::key, "enough", "completion"},
    Renaming{NameKind::key, "refuse", "rejection"},
    Renaming{NameKind::key, "keep", "retention"},
    Renaming{NameKind::key, "in_a_row", "max_consecutive_rejections"},
    Renaming{NameKind::key, "dark_share", "dark_fraction"},
    Renaming{NameKind::key, "white_share", "white_fraction"},
    Renaming{NameKind::key, "same_pose_share", "same_pose_fraction"},
    Renaming{NameKind::key, "dispersion_station_m", "dispersion_position_m"},
    // calibration.yaml
    Renaming{NameKind::key, "uncertainty_px", "expected_max_error_px"},
    Renaming{NameKind::key, "region_px", "valid_region_px"},
    // captures.csv
    Renaming{NameKind::column, "spot", "pivot"},
    Renaming{NameKind::column, "place", "reference_point"},
    Renaming{NameKind::column, "place_sd_m", "position_sd_m"},
    // corners
    Renaming{NameKind::column, "bow_square_px", "edge_quadratic_px"},
    Renaming{NameKind::column, "bow_cube_px", "edge_cubic_px"},
    Renaming{NameKind::column, "bow_reach", "edge_half_extent"},
    // fixes.csv
    Renaming{NameKind::column, "sd_x_m", "x_sd_m"},
    Renaming{NameKind::column, "sd_y_m", "y_sd_m"},
    Renaming{NameKind::column, "sd_z_m", "z_sd_m"},
    Renaming{NameKind::column, "sd_yaw_rad", "yaw_sd_rad"},
    Renaming{NameKind::column, "noise_sd_x_m", "x_noise_sd_m"},
    Renaming{NameKind::column, "noise_sd_y_m", "y_noise_sd_m"},
    Renaming{NameKind::column, "noise_sd_z_m", "z_noise_sd_m"},
    Renaming{NameKind::column, "noise_sd_yaw_rad", "yaw_noise_sd_rad"},
    // metrics and their gates
    Renaming{NameKind::metric, "center_px", "principal_point_px"},
    Renaming{NameKind::metric, "nominal_px", "nominal_difference_px"},
    Renaming{NameKind::metric, "board_bend_mm", "board_warp_mm"},
    Renaming{NameKind::metric, "uncertainty_px", "expected_max_error_px"},
    Renaming{NameKind::metric, "halves_px", "split_half_px"},
    Renaming{NameKind::metric, "world_mm", "world_offset_mm"},
    Renaming{NameKind::metric, "check_fixes", "check_fix_fraction"},
    Renaming{NameKind::metric, "check_lamps", "check_lamp_inlier_fraction"},
    Renaming{NameKind::metric, "scatter_mm", "repeatability_mm"},
    Renaming{NameKind::metric, "missing", "missing_fraction"},
    Renaming{NameKind::metric, "stated_ratio", "normalized_error_rms"},
    Renaming{NameKind::metric, "limit_ratio", "crlb_ratio"},
    // options and their values
    Renaming{NameKind::option, "--lean-sd-deg", "--roll-pitch-sd-deg"},
    Renaming{NameKind::option, "--frames", "--window"},
    Renaming{NameKind::option, "--noted", "--expected-digest"},
    Renaming{NameKind::option, "--stated", "--from-calibration"},
    Renaming{NameKind::option, "--of", "--position-of"},
    Renaming{NameKind::option, "--each", "--batch-stdin"},
    Renaming{NameKind::option, "--center-px", "--principal-point-px"},
    Renaming{NameKind::option, "--station", "--reference-point"},
    Renaming{NameKind::option, "--place-sd-m", "--position-sd-m"},
    Renaming{NameKind::option, "--station-mm", "--same-point-mm"},
    Renaming{NameKind::option, "--marker-share", "--marker-to-square-ratio"},
    Renaming{NameKind::value, "paper", "chen-guan"},
};

}  // namespace

std::string_view find_current_name_for_former(NameKind kind, std::string_view former) {
  const auto found = std::ranges::find_if(
      kRenamings, [&](const Renaming& each) { return each.kind == kind && each.former == former; });
  return found == kRenamings.end() ? std::string_view() : found->present;
}

std::string_view find_former_name_for_current(NameKind kind, std::string_view present) {
  const auto found = std::ranges::find_if(kRenamings, [&](const Renaming& each) {
    return each.kind == kind && each.present == present;
  });
  return found == kRenamings.end() ? std::string_view() : found->former;
}

std::string describe_renaming(std::string_view former, std::string_view present) {
  return "'" + std::string(former) + "' is now called '" + std::string(present) + "'";
}

}  // namespace vlp
