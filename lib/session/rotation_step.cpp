// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/rotation_step.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>

#include "calibration/levelling/map_doubt.h"
#include "calibration/passed_on.h"
#include "calibration/rotation/joint_center.h"
#include "calibration/rotation/turning_axis.h"
#include "geometry/angles.h"
#include "report/plots/calibration_plots.h"
#include "rig/calibration_error.h"
#include "rig/stage.h"
#include "session/lamp_images.h"

namespace vlp {
namespace {

std::string name_of(RotationMethod method) {
  switch (method) {
    case RotationMethod::axis:
      return "axis";
    case RotationMethod::joint:
      return "joint";
    case RotationMethod::circle:
      return "circle";
  }
  return "";
}

RotationFit fit_of(const SpotCaptures& spot, const Camera& camera, RotationMethod method) {
  switch (method) {
    case RotationMethod::axis:
      return fit_turning_axis(spot, camera);
    case RotationMethod::joint:
      return fit_joint_center(spot, camera);
    case RotationMethod::circle:
      break;
  }
  return fit_circle_centers(spot, camera).mean;
}

/// How the zenith moves with the lens, where that says how well it is known. What was estimated
/// stays what is.
void pass_on_lens(RotationResult& result, const LampCaptures& input, RotationMethod method) {
  const auto& report = input.calibration.intrinsics_report;
  if (!report || !report->covariance) return;
  RotationCenter& center = result.fit.center;
  const auto zenith_with = [&](const Eigen::VectorXd& error) -> std::optional<Eigen::Vector2d> {
    const Camera camera = with_lens_error(camera_alone(input.calibration), error).camera;
    const SpotCaptures spot = spot_captures(input.frames, input.lamps, camera);
    if (spot.status != SpotStatus::ok || spot.heights.size() != result.spot.heights.size() ||
        spot.left_out.size() != result.spot.left_out.size()) {
      return {};
    }
    const RotationFit fit = fit_of(spot, camera, method);
    if (!fit.converged || fit.center.lever_arm_m.has_value() != center.lever_arm_m.has_value()) {
      return {};
    }
    return zenith_point(fit.center);
  };
  center.by_intrinsics = jacobian_of(zenith_with, zenith_point(center), *report->covariance);
  if (center.by_intrinsics) return;
  result.warnings.emplace_back(
      "how the lens' errors move the zenith cannot be told, and sd of fixes will lack them: "
      "vlp-adjust states them");
}

/// A height in metres, without a sign where it rounds to zero.
std::string metres(double z_m) {
  const std::string text = fmt::format("{:.3f}", z_m);
  return text == "-0.000" ? "0.000" : text;
}

void add_warnings(RotationResult& result) {
  const auto& heights = result.spot.heights;
  if (!result.fit.center.lever_arm_m && heights.size() == 1) {
    result.warnings.push_back(fmt::format(
        "at one height, under lamps that hang much alike, a lever arm cannot be told from a tilt; "
        "it is taken as zero, and fixes at z = {} m will be of the axis of rotation: add captures "
        "at a second height",
        metres(heights.front().z_m)));
  } else if (!result.fit.center.lever_arm_m) {
    result.warnings.push_back(fmt::format(
        "this method takes the lever arm as zero, and the centre is a mean over {} heights: axis "
        "estimates both",
        heights.size()));
  }
  constexpr double too_noisy = 3;
  const auto& stated_px = result.spot.stated_px;
  if (stated_px && result.fit.residual_px > too_noisy * *stated_px) {
    result.warnings.push_back(fmt::format(
        "the residuals show {:.2g} px of noise, {:.2g} px are stated: is the lens calibrated, the "
        "camera beside its axis, the method exact?",
        result.fit.residual_px, *stated_px));
  }
}

void add_metrics(RotationResult& result) {
  const RotationCenter& center = result.fit.center;
  result.metrics = {{"rotation_px", result.fit.residual_px},
                    {"rotation_spread_px", result.circles.spread_px},
                    {"tilt_deg", deg_from_rad(tilt_of(center).angle_rad)}};
  if (const auto& covariance = center.covariance) {
    result.metrics.push_back({"rotation_sd_px", std::sqrt(covariance->trace())});
  }
  if (const auto& arm_m = center.lever_arm_m) {
    result.metrics.push_back({"lever_arm_mm", 1e3 * arm_m->norm()});
  }
}

}  // namespace

Calibration camera_alone(const Calibration& calibration) {
  Calibration alone;
  alone.camera = calibration.camera;
  return alone;
}

bool doubts_map(const LampCaptures& input, const Calibration& calibration, StepResult& result) {
  const std::string doubt = doubt_of_map(input.frames, input.lamps, calibration);
  if (!doubt.empty()) result.fail(StepFailure::wrong_map, doubt, input.lamps_file);
  return !doubt.empty();
}

void blame_map(const LampCaptures& input, const Calibration& calibration, StepResult& result) {
  if (doubts_map(input, calibration, result)) return;
  if (!contradicts_map(input.frames, input.lamps, calibration)) return;
  result.fail(StepFailure::wrong_map,
              "most captures contradict it: is it the map of this room, and the calibration this "
              "camera's?",
              input.lamps_file);
}

RotationResult solve_rotation(const LampCaptures& input, RotationMethod method,
                              HistoryEntry entry) {
  RotationResult result;
  if (doubts_map(input, camera_alone(input.calibration), result)) return result;
  const Camera& camera = input.calibration.camera;
  result.spot = spot_captures(input.frames, input.lamps, camera);
  for (const auto& [image, reason] : result.spot.left_out) {
    result.warnings.push_back(fmt::format("{}: left out: {}", image, reason));
  }
  if (result.spot.status != SpotStatus::ok) {
    const bool map = result.spot.status == SpotStatus::other_map;
    result.fail(map ? StepFailure::wrong_map : StepFailure::undetermined,
                std::string(explanation_of(result.spot.status)),
                map ? input.lamps_file : std::filesystem::path());
    return result;
  }
  result.circles = fit_circle_centers(result.spot, camera);
  result.fit = fit_of(result.spot, camera, method);
  if (!result.fit.converged) {
    result.fail(StepFailure::undetermined,
                "no rotation centre fits the captures: take them on one spot at each height, over "
                "more of the turn, with more of the lamps in view, and see that lens and lamp map "
                "are right");
    return result;
  }
  pass_on_lens(result, input, method);
  add_metrics(result);
  add_warnings(result);
  result.calibration = with_rotation_center(input.calibration, result.fit.center, std::move(entry));
  const std::string title = fmt::format("{}, method {}", camera.id, name_of(method));
  result.drawing = [title, spot = result.spot, circles = result.circles, fit = result.fit, camera] {
    return drawing_of(plot_of(title, spot, circles, fit, camera));
  };
  return result;
}

}  // namespace vlp
