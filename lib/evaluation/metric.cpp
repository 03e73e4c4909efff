// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/metric.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rig/renamed.h"

namespace vlp {
namespace {

constexpr double kMaxLimit = 1e6;
constexpr const char* kFixesCause = "the fixes are worse than was asked for";

using enum MetricSource;
using enum Direction;

constexpr auto kMetricKinds = std::to_array<MetricKind>({
    {"blur_px", "px", station, "blur of the board's edges, the median view's sigma",
     "the lens is blurred: out of focus, or dirty"},
    {"focal_percent", "%", station, "difference of the focal length from the nominal one",
     "wrong lens: another focal length than the type's"},
    {"principal_point_px", "px", station, "distance of the image center from the nominal one",
     "the lens is decentered"},
    {"nominal_difference_px", "px", station,
     "worst difference of the projection from the nominal one, but for a turn",
     "the lens is not of the type"},
    {"board_warp_mm", "mm", station, "how far the middle of the board is from flat",
     "the board is bent", at_most, kMaxLimit, false},
    {"mtf50_asymmetry", "", lens,
     "difference of the MTF50 between directions from the image's middle, over the mean; "
     "needs AprilTags without corner squares",
     "the focal plane is tilted: the lens is tilted or decentered"},
    {"mtf50", "cycles/px", lens,
     "mean over the image of the spatial frequency at which lens and pixel pass half of "
     "the contrast; needs AprilTags without corner squares",
     "the lens is not sharp: out of focus", at_least},
    {"local_loss", "", lens,
     "largest fraction by which a part of the image has less MTF50 or contrast than the "
     "parts around it; needs AprilTags without corner squares",
     "a smear is on the lens", at_most, 1},
    {"local_shadow", "", lens,
     "largest fraction by which a part of the image has less light than the parts around "
     "it; needs AprilTags without corner squares",
     "dust is on the lens or the sensor", at_most, 1},
    {"mtf50_worst_ratio", "", lens,
     "least MTF50 of a part of the image over the mean; needs AprilTags without corner "
     "squares",
     "the lens is not sharp in a part of the image", at_least, 1},
    {"black_ratio", "", lens,
     "light of black over light of white at the edges of tags, the median over the image; "
     "needs AprilTags without corner squares",
     "a veil lies over the image: the lens is dirty, stray light falls into it, or the "
     "board's black is not dark",
     at_most, 1},
    {"rms_px", "px", lens, "residuals of the corners, rms per axis",
     "the board's corners do not fit the lens model"},
    {"board_print_px", "px", lens,
     "change of projections by one standard deviation of the board's print (print_sd of "
     "board.yaml), rms over the image",
     "the board is not printed accurately enough"},
    {"expected_max_error_px", "px", lens,
     "expected largest error of a projection over the region where the lens is known, from "
     "the noise of the corners and from the board's print (board_print_px)",
     "the lens is not known well enough: other board views, or a more accurate board", at_most,
     kMaxLimit, false},
    {"split_half_px", "px", lens, "difference of the lenses of every other view, rms per axis",
     "two halves of the board views give two lenses"},
    {"coverage", "", lens, "share of the image in which there are corners",
     "the board was not shown all over the image", at_least, 1, false},
    {"views", "", lens, "views of the board that differ", "too few different views of the board",
     at_least, 1e6, false},
    {"board_tilt_deg", "deg", lens, "largest angle between two views of the board",
     "the board was hardly tilted", at_least, 180, false},
    {"rotation_px", "px", rotation, "residuals of the turn on the spot, rms",
     "the lamps do not turn about one axis"},
    {"rotation_spread_px", "px", rotation,
     "spread of the centers of the lamps' circles, of the level camera",
     "the circles of the turn have no common center"},
    {"rotation_sd_px", "px", rotation, "standard deviation of the rotation center",
     "the rotation center is not known well enough", at_most, kMaxLimit, false},
    {"tilt_deg", "deg", rotation, "angle between the camera and the axis of rotation",
     "the camera leans on its mount", at_most, 90},
    {"lever_arm_mm", "mm", rotation, "distance of the camera from the axis of rotation",
     "the camera sits beside its axis of rotation"},
    {"row_time_us", "us", rotation, "row time, from the stripes of the lamps",
     "the row time is not that of the camera", at_most, kMaxLimit, false},
    {"row_time_sd_us", "us", rotation, "standard deviation of the row time",
     "the row time is not known well enough", at_most, kMaxLimit, false},
    {"dispersion_mm", "mm", dispersion,
     "radius of the dispersion circle, before its offset is taken off",
     "the fixes at the station scatter too widely"},
    {"dispersion_offset_px", "px", dispersion, "length of the dispersion's offset",
     "the fixes at the station turn with the camera"},
    {"world_offset_mm", "mm", dispersion, "offset of the fixes that does not turn with the camera",
     "the station or its lamp map is off", at_most, kMaxLimit, false},
    {"check_fix_fraction", "", station, "share of the check captures that have a fix",
     "captures of the check have no fix", at_least, 1},
    {"check_lamp_inlier_fraction", "", station,
     "share of the lamps seen in the check captures that the fixes rest on",
     "lamps contradict their map", at_least, 1},
    {"check_lamps_seen", "", station, "share of the map's lamps that the check captures show",
     "a lamp is not seen", at_least, 1, false},
    {"check_mean_mm", "mm", station, "mean horizontal error at the known points",
     "the fixes at the known points are off"},
    {"check_worst_mm", "mm", station, "largest horizontal error at the known points",
     "a fix at a known point is off"},
    {"check_offset_mm", "mm", station, "length of the mean horizontal error",
     "the known points or the lamps have moved", at_most, kMaxLimit, false},
    {"check_height_mm", "mm", station, "rms error of the height at the known points",
     "the heights at the known points are off"},
    {"check_residual_px", "px", station, "median residual of the fixes at the known points",
     "the lamps do not fit their map"},
    {"mean_mm", "mm", evaluation, "mean horizontal error", kFixesCause},
    {"median_mm", "mm", evaluation, "median horizontal error", kFixesCause},
    {"p90_mm", "mm", evaluation, "what 90 % of the horizontal errors do not exceed", kFixesCause},
    {"max_mm", "mm", evaluation, "largest horizontal error", kFixesCause},
    {"rms_mm", "mm", evaluation, "root mean square of the horizontal errors", kFixesCause},
    {"bias_mm", "mm", evaluation,
     "what the fixes of a station share; needs a truth and stations with two fixes or more",
     kFixesCause},
    {"repeatability_mm", "mm", evaluation,
     "scatter of the fixes within stations; needs a truth and stations with two fixes or more",
     kFixesCause},
    {"height_rms_mm", "mm", evaluation,
     "root mean square of the height errors; needs z_m in the truth or the path",
     "the heights are worse than was asked for, as with a wrong focal length or lamp heights"},
    {"yaw_rms_deg", "deg", evaluation,
     "root mean square of the yaw errors; needs yaw_rad in the truth",
     "the yaws are worse than was asked for", at_most, 180},
    {"missing_fraction", "", evaluation, "share of the captures without a fix, from 0 to 1",
     "captures have no fix", at_most, 1},
    {"normalized_error_rms", "", evaluation,
     "horizontal errors / stated sd, rms; needs a truth and sd columns",
     "the fixes claim to be better than they are"},
    {"crlb_ratio", "", reference,
     "horizontal errors / theoretical limit (CRLB), rms; needs --lamps, --calibration, "
     "--noise-px",
     kFixesCause},
    {"fitted_mean_mm", "mm", reference, "mean distance of the fitted line; needs --line",
     kFixesCause},
    {"fitted_p90_mm", "mm", reference, "what 90 % of those distances do not exceed; needs --line",
     kFixesCause},
    {"fitted_max_mm", "mm", reference, "the largest of those distances; needs --line", kFixesCause},
    {"worse_mm", "mm", reference,
     "by how much the mean error is certainly larger than that of --compare (lower end of "
     "the difference's interval; 0 where that is no more than 1 um or 1 % of theirs): 0 fails "
     "on the verdict 'worse'; of fewer than 20 stations or captures nothing is certain",
     "the fixes are worse than those they are compared with"},
});

}  // namespace

std::string describe(Direction required) {
  return required == Direction::at_least ? "at least" : "at most";
}

std::vector<MetricKind> metric_kinds(std::initializer_list<MetricSource> sources) {
  std::vector<MetricKind> kinds;
  for (const MetricKind& kind : kMetricKinds) {
    const bool required = std::find(sources.begin(), sources.end(), kind.source) != sources.end();
    if (required) kinds.push_back(kind);
  }
  return kinds;
}

std::optional<MetricKind> metric_kind(const std::string& name) {
  const auto kind = std::find_if(kMetricKinds.begin(), kMetricKinds.end(),
                                 [&](const MetricKind& each) { return each.name == name; });
  return kind == kMetricKinds.end() ? std::nullopt : std::optional(*kind);
}

std::string present_metric_name(const std::string& name) {
  const std::string_view present = find_present_name(NameKind::metric, name);
  return present.empty() ? name : std::string(present);
}

std::optional<double> find_metric_value(const std::vector<Metric>& metrics,
                                        const std::string& name) {
  for (const Metric& metric : metrics) {
    if (metric.name == name && std::isfinite(metric.value)) return metric.value;
  }
  return std::nullopt;
}

}  // namespace vlp
