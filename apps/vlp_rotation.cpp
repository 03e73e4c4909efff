// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-rotation: captures of a turn on the spot -> the rotation centre and the camera's tilt.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <map>
#include <string>

#include "app.h"
#include "calibration/rotation/circle_center.h"
#include "calibration/rotation/joint_center.h"
#include "calibration/rotation/turning_axis.h"
#include "detect_folder.h"
#include "evaluation/rotation_plot.h"
#include "geometry/angles.h"
#include "history.h"
#include "print_rotation.h"
#include "rig/input_error.h"
#include "rig/stage.h"
#include "rotation_by_lamps.h"

namespace vlp {
namespace {

struct Options {
  DetectOptions detect;
  std::string plot, refined_map;
  std::string method = "axis";
};

using Method = RotationFit (*)(const SpotCaptures&, const Camera&);
const std::map<std::string, Method> kMethods{
    {"axis", fit_turning_axis},
    {"joint", fit_joint_center},
    {"circle", [](const SpotCaptures& spot, const Camera& camera) {
       return fit_circle_centers(spot, camera).mean;
     }}};

SpotCaptures captures_of(const Options& options, const LampMap& lamps,
                         const Calibration& calibration) {
  const auto frames = frames_of(options.detect, lamps, calibration);
  SpotCaptures spot = spot_captures(frames, lamps, calibration.camera);
  for (const auto& [image, reason] : spot.left_out) {
    spdlog::warn("{}: left out: {}", image, reason);
  }
  if (spot.status == SpotStatus::ok) return spot;
  const std::string why(explanation_of(spot.status));
  if (spot.status == SpotStatus::other_map) throw InputError(options.detect.lamps, why);
  throw Undetermined(why);
}

/// A height in metres, without a sign where it rounds to zero.
std::string metres(double z_m) {
  const std::string text = fmt::format("{:.3f}", z_m);
  return text == "-0.000" ? "0.000" : text;
}

void print_lever_arm(const RotationCenter& center, const SpotCaptures& spot) {
  if (const auto& arm_m = center.lever_arm_m) {
    fmt::print("lever arm   {:.3f} {:.3f} mm{}\n", 1e3 * arm_m->x(), 1e3 * arm_m->y(),
               sd_of(center.lever_arm_covariance, 1e3, "mm"));
  } else if (spot.heights.size() == 1) {
    fmt::print("lever arm   taken as zero\n");
    spdlog::warn(
        "at one height a lever arm cannot be told from a tilt; it is taken as zero, and fixes at "
        "z = {} m will be of the axis of rotation: add captures at a second height",
        metres(spot.heights.front().z_m));
  } else {
    fmt::print("lever arm   taken as zero\n");
    spdlog::warn(
        "this method takes the lever arm as zero, and the centre is a mean over {} heights: axis "
        "estimates both",
        spot.heights.size());
  }
}

void print_summary(const RotationFit& fit, const SpotCaptures& spot, const CircleCenters& circles,
                   const Camera& camera) {
  fmt::print("captures    {} of {}\n", spot.captures.size(),
             spot.captures.size() + spot.left_out.size());
  for (const SpotHeight& height : spot.heights) {
    fmt::print("  height    {} m: {} captures over {:.0f} deg\n", metres(height.z_m),
               height.captures, deg_from_rad(height.arc_rad));
  }
  fmt::print("lamps       {}\n", spot.lamps.size());
  print_center(fit.center, camera);
  print_lever_arm(fit.center, spot);
  fmt::print("circles     {}, their centres spread by {:.3f} px\n", circles.circles.size(),
             circles.spread_px);
  fmt::print("residual    {:.4f} px (rms of {})\n", fit.residual_px,
             spot.sightings.size() - fit.outliers.size());
  fmt::print("outliers    {}\n", fit.outliers.size());
  for (const auto& [index, distance_px] : fit.outliers) {
    const SpotSighting& sighting = spot.sightings[index];
    fmt::print("  outlier   {} lamp {}: {:.2f} px off\n", spot.captures[sighting.capture].image,
               spot.lamps[sighting.lamp].id, distance_px);
  }
  fmt::print("\n{:>10} {:>10}  image\n", "z (m)", "yaw (deg)");
  for (std::size_t i = 0; i < spot.captures.size(); ++i) {
    const SpotCapture& capture = spot.captures[i];
    fmt::print("{:>10} {:10.3f}  {}\n", metres(spot.heights[capture.height].z_m),
               deg_from_rad(wrapped_rad(fit.yaws_rad[i])), capture.image);
  }
}

void report_noise(const RotationFit& fit, const SpotCaptures& spot) {
  constexpr double too_noisy = 5;
  if (!spot.stated_px || fit.residual_px <= too_noisy * *spot.stated_px) return;
  spdlog::warn(
      "the residuals show {:.2g} px of noise, {:.2g} px are stated: is the lens calibrated, the "
      "camera beside its axis, the method exact?",
      fit.residual_px, *spot.stated_px);
}

void draw_plot(const Options& options, const SpotCaptures& spot, const CircleCenters& circles,
               const RotationFit& fit, const Camera& camera) {
  RotationPlot plot{fmt::format("{}, method {}", camera.id, options.method),
                    {},
                    fit.center.center_px,
                    undistorted_pixel(camera, Eigen::Vector2d::Zero())};
  for (const auto& [lamp, height, circle] : circles.circles) {
    const Eigen::Vector2d radii_px(camera.intrinsics[0], camera.intrinsics[1]);
    plot.traces.push_back({spot.lamps[lamp].id,
                           {},
                           undistorted_pixel(camera, circle.circle.center),
                           circle.circle.radius * radii_px});
    for (const SpotSighting& sighting : spot.sightings) {
      if (sighting.lamp != lamp || spot.captures[sighting.capture].height != height) continue;
      plot.traces.back().places_px.push_back(undistorted_pixel(camera, sighting.ray.hnormalized()));
    }
  }
  draw_rotation_plot(options.plot, plot);
}

void run(const CLI::App& app, const Options& options) {
  if (options.method == "lamps") {
    if (!options.plot.empty()) throw std::invalid_argument("--plot is of a turn on the spot");
    return rotate_by_lamps(app, options.detect, options.refined_map);
  }
  if (!options.refined_map.empty()) {
    throw std::invalid_argument("--refine-map needs --method lamps");
  }
  const std::vector<std::string> inputs = inputs_of(options.detect);
  check_output(options.detect.output, inputs);
  check_plot(options.plot, options.detect.output, inputs);
  const LampMap lamps = read_lamp_map(options.detect.lamps);
  const Calibration calibration = read_calibration(options.detect.calibration);
  const Camera& camera = calibration.camera;
  const SpotCaptures spot = captures_of(options, lamps, calibration);
  const RotationFit fit = kMethods.at(options.method)(spot, camera);
  if (!fit.converged) {
    throw Undetermined(
        "no rotation centre fits the captures: take them on one spot at each height, over more of "
        "the turn, with more of the lamps in view, and see that lens and lamp map are right");
  }
  const CircleCenters circles = fit_circle_centers(spot, camera);
  HistoryEntry entry = history_entry(app, inputs);
  if (!options.plot.empty()) draw_plot(options, spot, circles, fit, camera);
  write_calibration(options.detect.output,
                    with_rotation_center(calibration, fit.center, std::move(entry)));
  print_summary(fit, spot, circles, camera);
  report_noise(fit, spot);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "Finds the rotation centre of a camera, and so its tilt, from captures while it turns on "
      "the\n"
      "spot about a vertical axis: at least three over 90 degrees, better twelve over a full "
      "turn,\n"
      "by angles that need not be known. At one height a camera that sits beside the axis cannot "
      "be\n"
      "told from one that leans; captures at two heights or more tell both, in the same folder.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-rotation datasets/example/turning.csv --lamps datasets/example/lamps.yaml "
      "\\\n"
      "    --calibration datasets/example/calibration.yaml -o rotated.yaml --plot rotation.png\n",
      "vlp-rotation");
  vlp::Options options;
  app.add_option("captures", options.detect.folder,
                 "detections.csv: image, lamp, u_px, v_px [, sigma_px]; or a folder of images")
      ->required();
  app.add_option("--lamps", options.detect.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.detect.calibration,
                 "Calibration of the camera; a rotation centre in it is replaced")
      ->required();
  app.add_option("-o,--output", options.detect.output,
                 "Where to write the calibration with its rotation centre")
      ->required();
  app.add_option(
         "--method", options.method,
         "axis (default): the direction about which all lamp rays turn, exact with tilt and "
         "lens; joint: one centre in the undistorted image for all lamps; circle: the mean "
         "of a circle per lamp; lamps: level the camera from captures taken anywhere, while "
         "driving, that see three lamps or more")
      ->check(CLI::IsMember({"axis", "joint", "circle", "lamps"}))
      ->option_text("axis|joint|circle|lamps");
  app.add_option(
         "--refine-map", options.refined_map,
         "With --method lamps: correct the lamp map, too, and write it to this file; place, "
         "turn about the vertical and size of the map as a whole stay")
      ->option_text("FILE");
  app.add_option("--plot", options.plot,
                 "Where to draw lamps, circles, rotation centre and principal point, .png or .svg");
  vlp::add_detect_options(app, options.detect);
  return vlp::run_app(app, argc, argv, [&] { vlp::run(app, options); });
}
