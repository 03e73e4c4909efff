// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/station_faults.h"

#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/map/map_errors.h"
#include "geometry/median.h"
#include "positioning/positioner.h"
#include "rig/calibration_error.h"
#include "session/check_outliers.h"

namespace vlp {
namespace {

/// Fewer captures determine no fault.
constexpr std::size_t kMinFrames = 3;
/// Fix of a frame from three lamps or more.
struct FrameFix {
  /// Index of the frame.
  std::size_t frame;
  Fix fix;
};

std::vector<FrameFix> locate_by_three(std::span<const Frame> frames, const LampMap& map,
                                      const Calibration& calibration) {
  const Positioner positioner(map, calibration);
  std::vector<FrameFix> located;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Fix fix = positioner.compute_position_fix(frames[i].detections);
    if (fix.has_succeeded() && fix.lamps >= 3) located.push_back({i, std::move(fix)});
  }
  return located;
}

constexpr Eigen::Index kFocalAndCenter = 4;

/// Returns the calibration with additional variance for focal lengths and center, 5 % of the focal
/// length. Distortion is common to the type of camera and is not freed.
Calibration free_focal_length(Calibration calibration) {
  constexpr double relative_sd = 0.05;
  const double sd_px =
      relative_sd * (calibration.camera.intrinsics[0] + calibration.camera.intrinsics[1]) / 2;
  auto& report = calibration.intrinsics_report;
  if (!report) report.emplace();
  auto& covariance = report->covariance;
  if (!covariance) {
    const Eigen::Index n = count_intrinsics(calibration.camera);
    covariance = Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, n));
  }
  for (Eigen::Index i = 0; i < kFocalAndCenter; ++i) (*covariance)(i, i) += sd_px * sd_px;
  return calibration;
}

AdjustmentResult adjust_frames(std::span<const Frame> frames, const LampMap& map,
                               Calibration calibration) {
  AdjustmentInput input{{}, map, std::move(calibration)};
  for (Lamp& lamp : input.lamps.lamps) lamp.sd_m = 0;
  for (const Frame& frame : frames) input.captures.push_back({frame.image, frame.detections});
  return adjust_bundle(input);
}

/// Errors of the heights of fixes at known points.
struct HeightErrors {
  double median_m;
  /// Median of the reported standard deviations of one height.
  double sd_m;
};

/// Returns the errors of fixes of three lamps or more; std::nullopt for fewer than five.
std::optional<HeightErrors> compute_height_errors(const CapturesWithPositions& captures,
                                                  const LampMap& map,
                                                  const Calibration& calibration) {
  constexpr std::size_t min_heights = 5;  // fewer make the median unreliable
  std::vector<double> errors_m, sds_m;
  for (const auto& [i, fix] : locate_by_three(captures.frames, map, calibration)) {
    const auto place = captures.positions.find(captures.frames[i].image);
    if (place == captures.positions.end() || !place->second.z_m) continue;
    errors_m.push_back(fix.state.pose.position_m.z() - *place->second.z_m);
    sds_m.push_back(std::sqrt(fix.pose_covariance()(2, 2)));
  }
  if (errors_m.size() < min_heights) return std::nullopt;
  return HeightErrors{upper_median(errors_m), upper_median(sds_m)};
}

/// Returns the largest displacement of an image corner between two lenses.
double max_corner_shift_px(const Camera& a, const Camera& b) {
  double worst_px = 0;
  for (const double u : {0., double(a.imager_px[0])}) {
    for (const double v : {0., double(a.imager_px[1])}) {
      // Ray of the corner; the distortion is the same in both lenses.
      const Eigen::Vector2d corner(u, v);
      const Eigen::Vector2d ray = (corner - a.principal_point_px()).cwiseQuotient(a.focal_px());
      worst_px = std::max(
          worst_px, (b.focal_px().cwiseProduct(ray) + b.principal_point_px() - corner).norm());
    }
  }
  return worst_px;
}

}  // namespace

std::vector<std::string> list_lamp_map_faults(std::span<const Frame> frames, const LampMap& map,
                                              const Calibration& calibration,
                                              double min_offset_px) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  MapErrorOptions options;
  options.min_offset_px = min_offset_px;
  for (const MapError& error : detect_map_errors(frames, map, calibration, options).errors) {
    if (!error.lamps.empty() || error.kind == MapErrorKind::mirrored) {
      faults.push_back(describe_map_error(error));
    }
  }
  return faults;
}

std::vector<std::string> list_missing_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  for (const MapError& error : list_undetected_lamps(frames, map))
    faults.push_back(describe_map_error(error));
  return faults;
}

std::string explain_lens_contradiction(std::span<const Frame> frames, const LampMap& map,
                                       const Calibration& calibration) {
  constexpr std::size_t min_captures =
      10;  // with fewer a free lens absorbs residuals of other faults
  if (frames.size() < min_captures) return "";
  const AdjustmentResult constrained = adjust_frames(frames, map, calibration);
  const AdjustmentResult unconstrained = adjust_frames(frames, map, free_focal_length(calibration));
  if (!constrained.has_succeeded() || !unconstrained.has_succeeded()) return "";
  constexpr double max_residual_ratio = 1.0 / 3, min_displacement_px = 1;
  if (unconstrained.residual_px >= max_residual_ratio * constrained.residual_px) return "";
  if (max_corner_shift_px(calibration.camera, unconstrained.camera) < min_displacement_px)
    return "";
  const auto words = [](const Camera& camera) {
    return fmt::format("a focal length of {:.1f} px and the center ({:.1f}, {:.1f})",
                       std::sqrt(camera.focal_px().prod()), camera.principal_point_px().x(),
                       camera.principal_point_px().y());
  };
  // [STATION-17] `by different lenses` | two units mixed, or lens moved between boards and lamps |
  //   take all again; if repeated: loose lens
  return fmt::format(
      "lamps and boards are imaged by different lenses: the lamps fit {}, the boards {}; are all "
      "images of this unit, or has its lens moved?",
      words(unconstrained.camera), words(calibration.camera));
}

std::string explain_focal_difference(const CapturesWithPositions& captures,
                                     const CapturesWithPositions& reference, const LampMap& map,
                                     const Calibration& calibration) {
  const auto heights = compute_height_errors(captures, map, calibration);
  const auto reference_heights = compute_height_errors(reference, map, calibration);
  if (!heights || !reference_heights) return "";
  // A unit that is loose sideways can have moved by the same amount along its axis.
  constexpr double min_difference_m = kMinOutlierError_m, sigmas = 3, mm_per_m = 1e3;
  const double difference_m = heights->median_m - reference_heights->median_m;
  const double sd_m = std::hypot(heights->sd_m, reference_heights->sd_m);
  if (std::abs(difference_m) <= std::max(min_difference_m, sigmas * sd_m)) return "";
  return fmt::format(
      "its focal length differs: the heights have an error of {:+.1f} mm, in dispersion {:+.1f} mm",
      mm_per_m * heights->median_m, mm_per_m * reference_heights->median_m);
}

std::string explain_other_lens(std::span<const Frame> frames, std::span<const Frame> reference,
                               const LampMap& map, const Calibration& calibration) {
  const AdjustmentResult result = adjust_frames(frames, map, calibration);
  const AdjustmentResult reference_result = adjust_frames(reference, map, calibration);
  if (!result.has_succeeded() || !reference_result.has_succeeded()) return "";
  // The same ratio as in explain_lens_contradiction(); 0.1 px is 0.3 mm at lamps 1.6
  // m above a lens of 520 px.
  constexpr double min_ratio = 3, min_residual_px = 0.1;
  if (result.residual_px < std::max(min_residual_px, min_ratio * reference_result.residual_px))
    return "";
  return fmt::format(
      "its lens differs, by residuals of the lamps of {:.2f} px at any tilt, in "
      "dispersion {:.2g} px",
      result.residual_px, reference_result.residual_px);
}

}  // namespace vlp
