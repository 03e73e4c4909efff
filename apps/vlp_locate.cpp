// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-locate: identified lamps in images -> positions.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "app.h"
#include "capture_options.h"
#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "captures/fixes_table.h"
#include "evaluation/fix_summary.h"
#include "geometry/angles.h"
#include "locate_options.h"
#include "locate_warnings.h"
#include "positioning/positioner.h"
#include "positioning/residual_noise.h"

namespace vlp {
namespace {

const std::map<std::string, Correction> kCorrections{{"none", Correction::none},
                                                     {"rotation", Correction::rotation},
                                                     {"dispersion", Correction::dispersion},
                                                     {"all", Correction::all}};

Sensors sensors_of(const std::string& image, const CapturesTable& captures,
                   const LocateOptions& options) {
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
                            const CapturesTable& captures, const LocateOptions& options) {
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

void run(const LocateOptions& options) {
  check_output(options.detect.output,
               {options.detect.folder, options.detect.lamps, options.detect.calibration,
                options.detect.classifier, options.captures});
  const CapturesTable captures =
      options.captures.empty() ? CapturesTable{} : read_captures(options.captures);
  auto [lamps, calibration, frames] = read_captures_of(options.detect);
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
  if (stated) warn_of_noise(frames, fixes);
  std::vector<FixRow> rows;
  rows.reserve(fixes.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    rows.push_back(row_of(frames[i], fixes[i], noise_known));
  }
  write_fixes(options.detect.output, rows);
  warn_of_image(frames, calibration.camera);
  warn_of_captures(frames, captures);
  warn_of_lamps_left_out(frames, fixes);
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
  vlp::LocateOptions options;
  vlp::add_locate_options(app, options);
  return vlp::run_app(app, argc, argv, [&] { vlp::run(options); });
}
