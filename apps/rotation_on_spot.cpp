// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rotation_on_spot.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <map>
#include <utility>

#include "app.h"
#include "calibration/plots/calibration_plots.h"
#include "calibration/rotation/circle_center.h"
#include "calibration/rotation/joint_center.h"
#include "calibration/rotation/turning_axis.h"
#include "capture_options.h"
#include "check_map.h"
#include "history.h"
#include "print_rotation.h"
#include "rig/input_error.h"
#include "rig/stage.h"

namespace vlp {
namespace {

using Method = RotationFit (*)(const SpotCaptures&, const Camera&);
const std::map<std::string, Method> kMethods{
    {"axis", fit_turning_axis},
    {"joint", fit_joint_center},
    {"circle", [](const SpotCaptures& spot, const Camera& camera) {
       return fit_circle_centers(spot, camera).mean;
     }}};

SpotCaptures captures_of(const CaptureInput& input, const DetectOptions& detect) {
  check_map(input, camera_alone(input.calibration), detect);
  SpotCaptures spot = spot_captures(input.frames, input.lamps, input.calibration.camera);
  for (const auto& [image, reason] : spot.left_out) {
    spdlog::warn("{}: left out: {}", image, reason);
  }
  if (spot.status == SpotStatus::ok) return spot;
  const std::string why(explanation_of(spot.status));
  if (spot.status == SpotStatus::other_map) throw InputError(detect.lamps, why);
  throw Undetermined(why);
}

void report_noise(const RotationFit& fit, const SpotCaptures& spot) {
  constexpr double too_noisy = 3;
  if (!spot.stated_px || fit.residual_px <= too_noisy * *spot.stated_px) return;
  spdlog::warn(
      "the residuals show {:.2g} px of noise, {:.2g} px are stated: is the lens calibrated, the "
      "camera beside its axis, the method exact?",
      fit.residual_px, *spot.stated_px);
}

}  // namespace

void rotate_on_spot(const CLI::App& app, const DetectOptions& detect, const std::string& method,
                    const std::string& plot) {
  const std::vector<std::string> inputs = inputs_of(detect);
  check_output(detect.output, inputs);
  check_plot(plot, detect.output, inputs);
  const CaptureInput input = read_captures_of(detect);
  const Camera& camera = input.calibration.camera;
  const SpotCaptures spot = captures_of(input, detect);
  const RotationFit fit = kMethods.at(method)(spot, camera);
  if (!fit.converged) {
    throw Undetermined(
        "no rotation centre fits the captures: take them on one spot at each height, over more "
        "of "
        "the turn, with more of the lamps in view, and see that lens and lamp map are right");
  }
  const CircleCenters circles = fit_circle_centers(spot, camera);
  HistoryEntry entry = history_entry(app, inputs);
  if (!plot.empty()) {
    const std::string title = fmt::format("{}, method {}", camera.id, method);
    draw_rotation_plot(plot, plot_of(title, spot, circles, fit, camera));
  }
  write_calibration(detect.output,
                    with_rotation_center(input.calibration, fit.center, std::move(entry)));
  print_summary(fit, spot, circles, camera);
  report_noise(fit, spot);
}

}  // namespace vlp
