// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-locate: identified lamps in images -> positions.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <stdexcept>

#include "app.h"
#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "captures/fixes_table.h"
#include "detect_folder.h"
#include "evaluation/fix_summary.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "positioning/residual_noise.h"

namespace vlp {
namespace {

const std::map<std::string, Correction> kCorrections{{"none", Correction::none},
                                                     {"rotation", Correction::rotation},
                                                     {"dispersion", Correction::dispersion},
                                                     {"all", Correction::all}};

struct Options {
  DetectOptions detect;
  std::string captures;
  std::string correction = "all";
  std::optional<double> sigma_px;
  std::optional<double> inclination_sigma_deg;
  std::optional<std::array<double, 4>> camera_on_robot;
  bool one_lamp = false;
};

Sensors sensors_of(const std::string& image, const CapturesTable& captures,
                   const Options& options) {
  Sensors sensors;
  const auto entry = captures.find(image);
  if (entry == captures.end()) return sensors;
  const Capture& capture = entry->second;
  sensors.inclination = capture.inclination;
  sensors.inclination_sigma_rad = rad_from_deg(options.inclination_sigma_deg.value_or(0));
  if (options.one_lamp && capture.z_m && capture.yaw_rad) {
    sensors.height_and_yaw = HeightAndYaw{*capture.z_m, *capture.yaw_rad};
  }
  return sensors;
}

std::vector<Fix> locate_all(const Positioner& positioner, const std::vector<Frame>& frames,
                            const CapturesTable& captures, const Options& options) {
  std::vector<Fix> fixes;
  fixes.reserve(frames.size());
  for (const Frame& frame : frames) {
    fixes.push_back(
        positioner.locate(frame.detections, sensors_of(frame.image, captures, options)));
  }
  return fixes;
}

void set_sigma(std::vector<Frame>& frames, double sigma_px) {
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) detection.sigma_px = sigma_px;
  }
}

bool states_sigma(const Frame& frame) {
  return std::all_of(frame.detections.begin(), frame.detections.end(),
                     [](const Detection& detection) { return detection.sigma_px.has_value(); });
}

FixRow row_of(const Frame& frame, const Fix& fix, bool noise_known) {
  FixRow row{frame.image, std::string(name_of(fix.status)), {}, fix.lamps};
  if (!fix.ok()) return row;
  row.fix = {fix.estimate.pose, {}, fix.residual_px};
  if (noise_known) row.fix->sd = fix.estimate.covariance.diagonal().cwiseSqrt();
  return row;
}

void report_captures(const std::vector<Frame>& frames, const CapturesTable& captures) {
  const auto without = std::count_if(frames.begin(), frames.end(), [&](const Frame& frame) {
    return captures.find(frame.image) == captures.end();
  });
  if (captures.empty() || without == 0) return;
  spdlog::warn(
      "{} of {} images are not in captures.csv: image names have to be equal (here '{}', "
      "there '{}')",
      without, frames.size(), frames.front().image, captures.begin()->first);
}

void report_lamps(const std::vector<Frame>& frames, const std::vector<Fix>& fixes) {
  int unknown = 0, rejected = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    unknown += fixes[i].unknown_lamps;
    rejected += fixes[i].rejected_lamps;
    if (fixes[i].rejected_lamps > 0) {
      spdlog::debug("{}: lamp {} contradicts the others and is left out", frames[i].image,
                    fixes[i].rejected_lamp_id);
    }
  }
  if (unknown > 0)
    spdlog::warn("{} detections of lamps that are not in the map, left out", unknown);
  if (rejected > 0) spdlog::warn("{} detections that contradict the others, left out", rejected);
}

void print_summary(const FixSummary& summary) {
  fmt::print("frames      {}\nfixes       {}\n", summary.frames, summary.fixes);
  for (const auto& [status, count] : summary.refused) {
    fmt::print("  no fix    {} {}\n", count, status);
  }
  if (const auto& typical = summary.typical) {
    fmt::print("lamps       {:.1f} a fix ({} to {})\n", typical->mean_lamps, typical->fewest_lamps,
               typical->most_lamps);
    if (const auto& residual_px = typical->median_residual_px) {
      fmt::print("residual    {:.3f} px (median)\n", *residual_px);
    }
  }
  if (const auto& sd = summary.median_sd) {
    fmt::print("sd          {:.2f} mm horizontal, {:.2f} mm height, {:.3f} deg yaw (median)\n",
               1e3 * sd->horizontal_m, 1e3 * sd->height_m, deg_from_rad(sd->yaw_rad));
  }
}

void report_noise(const std::vector<Frame>& frames, const std::vector<Fix>& fixes) {
  double stated_px = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      stated_px = std::max(stated_px, detection.sigma_px.value_or(0));
    }
  }
  constexpr double too_noisy = 3;
  const auto shown_px = residual_noise_px(fixes);
  if (shown_px && *shown_px > too_noisy * stated_px) {
    spdlog::warn(
        "the residuals show {:.2g} px of noise, {:.2g} px are stated: sd is too small; are "
        "calibration and lamp map right and complete?",
        *shown_px, stated_px);
  }
}

/// A lamp that the image's edge cuts may have its centre a little outside.
void report_image(const std::vector<Frame>& frames, const Camera& camera) {
  const Eigen::Array2d size(camera.imager_px[0], camera.imager_px[1]);
  std::size_t outside = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      const Eigen::Array2d pixel = detection.pixel.array();
      const bool near = (pixel >= -0.1 * size).all() && (pixel <= 1.1 * size).all();
      outside += near ? 0 : 1;
    }
  }
  if (outside > 0) {
    spdlog::warn(
        "{} detections far outside the camera's {} x {} px: is the calibration this camera's?",
        outside, camera.imager_px[0], camera.imager_px[1]);
  }
}

void run(const Options& options) {
  check_output(options.detect.output,
               {options.detect.folder, options.detect.lamps, options.detect.calibration,
                options.detect.classifier, options.captures});
  const LampMap lamps = read_lamp_map(options.detect.lamps);
  const Calibration calibration = read_calibration(options.detect.calibration);
  const CapturesTable captures =
      options.captures.empty() ? CapturesTable{} : read_captures(options.captures);
  std::vector<Frame> frames = frames_of(options.detect, lamps, calibration);
  if (options.sigma_px) set_sigma(frames, *options.sigma_px);
  PositionerOptions how;
  how.correction = kCorrections.at(options.correction);
  if (const auto& mount = options.camera_on_robot) {
    how.mount = CameraMount{{(*mount)[0], (*mount)[1], (*mount)[2]}, rad_from_deg((*mount)[3])};
  }

  std::vector<Fix> fixes = locate_all({lamps, calibration, how}, frames, captures, options);
  const bool stated = std::all_of(frames.begin(), frames.end(), states_sigma);
  bool noise_known = stated;
  if (!noise_known) {
    if (const auto noise_px = residual_noise_px(fixes)) {
      spdlog::info("sigma_px is not stated: {:.3g} px taken from the residuals", *noise_px);
      how.unstated_sigma_px = *noise_px;
      noise_known = true;
      fixes = locate_all({lamps, calibration, how}, frames, captures, options);
    } else {
      spdlog::warn("sigma_px is not stated and no residuals show it: sd columns are empty");
    }
  }
  if (stated) report_noise(frames, fixes);
  std::vector<FixRow> rows;
  rows.reserve(fixes.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    rows.push_back(row_of(frames[i], fixes[i], noise_known));
  }
  write_fixes(options.detect.output, rows);
  report_image(frames, calibration.camera);
  report_captures(frames, captures);
  report_lamps(frames, fixes);
  const FixSummary summary = summarize(rows);
  print_summary(summary);
  if (summary.fixes == 0) {
    throw Undetermined(
        fmt::format("no frame has a fix; the first: {}", explanation_of(fixes.front().status)));
  }
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "Positions from the lamps seen in images: fixes.csv from detections.csv, or from a folder "
      "of\n"
      "images.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-locate datasets/example/detections.csv --lamps datasets/example/lamps.yaml "
      "\\\n"
      "    --calibration datasets/example/calibration.yaml -o fixes.csv\n",
      "vlp-locate");
  vlp::Options options;
  app.add_option("detections", options.detect.folder,
                 "detections.csv: image, lamp, u_px, v_px [, sigma_px]; or a folder of images")
      ->required();
  app.add_option("--lamps", options.detect.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.detect.calibration, "Calibration of the camera")
      ->required();
  app.add_option("-o,--output", options.detect.output, "Where to write fixes.csv")->required();
  vlp::add_detect_options(app, options.detect);
  app.add_option("--correction", options.correction,
                 "Parts of the calibration to apply (default: all that it has)")
      ->check(CLI::IsMember({"none", "rotation", "dispersion", "all"}))
      ->option_text("none|rotation|dispersion|all");
  app.add_option(
         "--sigma-px", options.sigma_px,
         "Standard deviation of the lamps' pixels; taken from the residuals when neither it "
         "nor a column says it")
      ->check(CLI::Range(vlp::kMinSigma_px, vlp::kMaxSigma_px));
  auto* captures_option =
      app.add_option("--captures", options.captures,
                     "captures.csv: image, roll_rad, pitch_rad (inclination of the robot, or of "
                     "the camera when there is no --camera-on-robot), z_m, yaw_rad");
  app.add_option("--inclination-sigma-deg", options.inclination_sigma_deg,
                 "Standard deviation of the inclination sensor's angles (default: left out of sd)")
      ->check(vlp::finite_not_negative())
      ->needs(captures_option);
  app.add_option(
         "--camera-on-robot", options.camera_on_robot,
         "The camera's place and yaw on the robot: the fixes are then of the robot's centre")
      ->check(vlp::finite())
      ->option_text("X_M Y_M Z_M YAW_DEG");
  app.add_flag("--one-lamp", options.one_lamp,
               "Where one lamp is seen, take z_m and yaw_rad from captures.csv")
      ->needs(captures_option);
  return vlp::run_app(app, argc, argv, [&] { vlp::run(options); });
}
