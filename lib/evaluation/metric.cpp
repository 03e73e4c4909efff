// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/metric.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vlp {
namespace {

constexpr double kMaxLimit = 1e6;
constexpr const char* kFixesCause = "the errors of the fixes exceed the limit";

using enum MetricSource;
using enum Direction;

constexpr auto kMetricKinds = std::to_array<MetricKind>({
    {"board_white", "", station,
     "level that 1 % of the pixels of a board image exceed, as a fraction of full scale, median",
     "the boards are dark: exposure or gain of the camera, or light on the board", at_least, 1,
     false},
    {"lamp_white", "", station,
     "level that 0.1 % of the pixels of a lamp image exceed, as a fraction of full scale, median",
     "the lamps are dark: exposure or gain of the camera, or current of the lamps", at_least, 1,
     false},
    {"dark_level", "", station,
     "median level of the lamp images, as a fraction of full scale: black level and ambient light",
     "the dark is not black: black level of the camera, or ambient light", at_most, 1, false},
    {"defective_pixels", "", station,
     "number of pixels that are bright in all lamp images, or dark in all board images",
     "the sensor has defective pixels"},
    {"lamp_blur_px", "px", station,
     "blur of the lamp edges: sigma, median over the lamps of the rotation",
     "the lamps are blurred: vibration or motion during the exposure, or a lens out of focus",
     at_most, kMaxLimit, false},
    {"blur_px", "px", station, "blur of the board edges: sigma, median over the views",
     "the lens is blurred: out of focus, or dirty"},
    {"focal_percent", "%", station, "difference between focal length and nominal focal length",
     "wrong lens: the focal length is not that of the type"},
    {"principal_point_px", "px", station,
     "distance of the principal point from its nominal position", "the lens is decentered"},
    {"nominal_difference_px", "px", station,
     "maximum difference between projection and nominal projection, without a common rotation",
     "the lens is of another type"},
    {"board_warp_mm", "mm", station, "deviation of the board center from a plane",
     "the board is warped", at_most, kMaxLimit, false},
    {"mtf50_asymmetry", "", lens,
     "difference of the MTF50 between directions from the image center, divided by the mean; needs "
     "AprilTags without corner squares",
     "the focal plane is tilted: the lens is tilted or decentered"},
    {"mtf50", "cycles/px", lens,
     "spatial frequency at which lens and pixel transfer half of the contrast, mean over the "
     "image; needs AprilTags without corner squares",
     "the lens is not sharp: out of focus", at_least},
    {"local_loss", "", lens,
     "largest relative loss of MTF50 or contrast in a part of the image, compared with the parts "
     "around it; needs AprilTags without corner squares",
     "the lens is smeared", at_most, 1},
    {"local_shadow", "", lens,
     "largest relative loss of light in a part of the image, compared with the parts around it; "
     "needs AprilTags without corner squares",
     "dust or shade on the lens or the sensor", at_most, 1},
    {"mtf50_worst_ratio", "", lens,
     "smallest MTF50 of a part of the image, divided by the mean; needs AprilTags without corner "
     "squares",
     "the lens is not sharp in a part of the image", at_least, 1},
    {"black_ratio", "", lens,
     "ratio of black to white light at tag edges, median over the image; needs AprilTags without "
     "corner squares",
     "veiling glare: the lens is dirty, stray light enters it, or the black of the board is not "
     "dark",
     at_most, 1},
    {"rms_px", "px", lens, "RMS residual of the corners, per axis",
     "the corners of the board do not fit the lens model"},
    {"board_print_px", "px", lens,
     "effect of one standard deviation of the board print (print_sd of board.yaml) on projections, "
     "RMS over the image",
     "the board is not printed accurately enough"},
    {"expected_max_error_px", "px", lens,
     "expected maximum error of a projection in the valid region, from corner noise and from the "
     "board print (board_print_px)",
     "the lens is too uncertain: add board views, or use a more accurate board", at_most, kMaxLimit,
     false},
    {"split_half_px", "px", lens,
     "RMS difference between the lenses of two halves of the views, per axis",
     "two halves of the board views result in different lenses"},
    {"coverage", "", lens, "fraction of the image that contains corners",
     "the board views do not cover the image", at_least, 1, false},
    {"views", "", lens, "number of distinct views of the board",
     "too few different views of the board", at_least, 1e6, false},
    {"board_tilt_deg", "deg", lens, "largest angle between two views of the board",
     "the board was barely tilted", at_least, 180, false},
    {"rotation_px", "px", rotation, "RMS residual of the rotation in place",
     "the lamps do not rotate about one axis"},
    {"rotation_spread_px", "px", rotation,
     "spread of the circle centers of the lamps, for the level camera",
     "the circles of the rotation have no common center"},
    {"rotation_sd_px", "px", rotation, "standard deviation of the rotation center",
     "the rotation center is too uncertain", at_most, kMaxLimit, false},
    {"tilt_deg", "deg", rotation, "angle between the camera and the axis of rotation",
     "the camera is tilted on its mount", at_most, 90},
    {"lever_arm_mm", "mm", rotation, "distance of the camera from the axis of rotation",
     "the camera is off its axis of rotation"},
    {"row_time_us", "us", rotation, "row time, from the lamp stripes",
     "the row time is not that of this camera", at_most, kMaxLimit, false},
    {"row_time_sd_us", "us", rotation, "standard deviation of the row time",
     "the row time is too uncertain", at_most, kMaxLimit, false},
    {"row_time_error_percent", "%", rotation,
     "difference between the given row time and that of the lamp stripes, less three standard "
     "deviations; needs a given row time and three lamps",
     "the given row time is wrong", at_most, kMaxLimit, false},
    {"dispersion_mm", "mm", dispersion,
     "radius of the dispersion circle, before correction of its offset",
     "the fixes at the reference point scatter too much"},
    {"dispersion_offset_px", "px", dispersion, "length of the dispersion offset",
     "the error of the fixes at the reference point rotates with the camera"},
    {"world_offset_mm", "mm", dispersion, "offset of the fixes that is constant in the world",
     "the reference point or the lamp map is wrong", at_most, kMaxLimit, false},
    {"check_fix_fraction", "", station, "fraction of the check captures with a fix",
     "check captures have no fix", at_least, 1},
    {"check_lamp_inlier_fraction", "", station,
     "fraction of the lamps in the check captures that are inliers of the fixes",
     "lamps contradict their map", at_least, 1},
    {"check_lamps_seen", "", station,
     "fraction of the lamps in the map that are visible in the check captures",
     "a lamp is not visible", at_least, 1, false},
    {"check_mean_mm", "mm", station, "mean horizontal error at the known points",
     "the fixes at the known points are wrong"},
    {"check_worst_mm", "mm", station, "largest horizontal error at the known points",
     "a fix at a known point is wrong"},
    {"check_offset_mm", "mm", station, "length of the mean horizontal error",
     "the known points or the lamps have moved", at_most, kMaxLimit, false},
    {"check_height_mm", "mm", station, "RMS height error at the known points",
     "the heights at the known points are wrong"},
    {"check_residual_px", "px", station, "median residual of the fixes at the known points",
     "the lamps do not fit their map"},
    {"mean_mm", "mm", evaluation, "mean horizontal error", kFixesCause},
    {"median_mm", "mm", evaluation, "median horizontal error", kFixesCause},
    {"p90_mm", "mm", evaluation, "90th percentile of the horizontal errors", kFixesCause},
    {"max_mm", "mm", evaluation, "largest horizontal error", kFixesCause},
    {"rms_mm", "mm", evaluation, "RMS horizontal error", kFixesCause},
    {"bias_mm", "mm", evaluation,
     "RMS bias of the fixes at reference points; needs ground truth and two or more fixes per "
     "reference point",
     kFixesCause},
    {"repeatability_mm", "mm", evaluation,
     "standard deviation of the fixes at a reference point; needs ground truth and two or more "
     "fixes per reference point",
     kFixesCause},
    {"height_rms_mm", "mm", evaluation,
     "RMS height error; needs z_m in the ground truth or the path",
     "the height errors exceed the limit: wrong focal length or lamp heights?"},
    {"yaw_rms_deg", "deg", evaluation, "RMS yaw error; needs yaw_rad in the ground truth",
     "the yaw errors exceed the limit", at_most, 180},
    {"missing_fraction", "", evaluation, "fraction of the captures without a fix, from 0 to 1",
     "captures have no fix", at_most, 1},
    {"normalized_error_rms", "", evaluation,
     "RMS of horizontal errors / reported sd; needs ground truth and sd columns; gate on the lower "
     "limit of its 95 % interval, since errors of one unit are correlated",
     "the errors are larger than the fixes report: a wrong table, lens or map?"},
    {"normalized_height_error_rms", "", evaluation, "the same for the height",
     "the heights are wrong: the lens, or its boards, of another camera?"},
    {"normalized_yaw_error_rms", "", evaluation, "the same for the yaw",
     "the yaw angles are wrong: is the ground truth of these captures?"},
    {"warnings", "", evaluation, "number of warnings; 0: each warning fails (--strict)",
     "there are warnings", at_most, kMaxLimit, false},
    {"crlb_ratio", "", reference,
     "RMS of horizontal errors / theoretical limit (CRLB); needs --lamps, --calibration, "
     "--noise-px",
     kFixesCause},
    {"fitted_mean_mm", "mm", reference,
     "mean distance of the fitted line from the commanded line; needs --line", kFixesCause},
    {"fitted_p90_mm", "mm", reference, "90th percentile of these distances; needs --line",
     kFixesCause},
    {"fitted_max_mm", "mm", reference, "maximum of these distances; needs --line", kFixesCause},
    {"worse_mm", "mm", reference,
     "lower bound of the increase in mean error compared with --compare (95 % interval; 0 up to 1 "
     "um or 1 % of their mean error): 0 fails on the verdict 'worse'; always 0 for fewer than 20 "
     "reference points or captures",
     "the fixes are worse than those of --compare"},
    {"worse_height_mm", "mm", reference, "the same for the height error",
     "the heights are worse than those of --compare"},
    {"worse_yaw_deg", "deg", reference, "the same for the yaw error",
     "the yaw angles are worse than those of --compare", at_most, 180},
    {"worse_sd_mm", "mm", reference, "the same for the reported horizontal sd",
     "the reported standard deviations are larger than those of --compare"},
    {"worse_normalized_error", "", reference,
     "the same for the RMS of error / reported sd over x, y, z and yaw; 0 up to 1, its correct "
     "mean",
     "the reported standard deviations are too small, compared with --compare"},
    {"unpaired_fraction", "", reference,
     "fraction of the captures that are not compared: a fix is only in --compare, its sd only in "
     "one of both, or --compare has no row",
     "fixes were lost, or --compare lacks captures or columns", at_most, 1},
});

}  // namespace

std::string describe_direction(Direction required) {
  return required == Direction::at_least ? "at least" : "at most";
}

std::vector<MetricKind> list_metric_kinds(std::initializer_list<MetricSource> sources) {
  std::vector<MetricKind> kinds;
  for (const MetricKind& kind : kMetricKinds) {
    const bool required = std::find(sources.begin(), sources.end(), kind.source) != sources.end();
    if (required) kinds.push_back(kind);
  }
  return kinds;
}

std::optional<MetricKind> find_metric_kind(const std::string& name) {
  const auto kind = std::find_if(kMetricKinds.begin(), kMetricKinds.end(),
                                 [&](const MetricKind& each) { return each.name == name; });
  return kind == kMetricKinds.end() ? std::nullopt : std::optional(*kind);
}

std::optional<double> find_metric_value(const std::vector<Metric>& metrics,
                                        const std::string& name) {
  for (const Metric& metric : metrics) {
    if (metric.name == name && std::isfinite(metric.value)) return metric.value;
  }
  return std::nullopt;
}

}  // namespace vlp
