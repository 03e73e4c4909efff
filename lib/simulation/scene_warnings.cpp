// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene_warnings.h"

#include <algorithm>
#include <cmath>

#include "simulation/picture.h"

namespace vlp {
namespace {

/// Returns the gray level of a source that fills a pixel on the axis. Without a picture it may
/// exceed white.
double compute_level(const Scene& scene, const CaptureSet& set, double electron_rate_e_per_s) {
  const Sensor& sensor = scene.sensor;
  const double level =
      sensor.black_level_dn +
      sensor.gain_dn_per_e * std::min(electron_rate_e_per_s * set.exposure_s, sensor.full_well_e);
  return scene.picture ? apply_tone_curve(*scene.picture, sensor, level) : level;
}

std::string whole(double value) { return std::to_string(std::lround(value)); }

void add_brightness(const Scene& scene, const CaptureSet& set, const std::string& bright,
                    double bright_e_per_s, const std::string& dark, double dark_e_per_s,
                    std::vector<std::string>& warnings) {
  constexpr double too_dark = 0.03, too_bright = 0.6;
  const double white = white_dn(scene.sensor);
  const std::string fit =
      ": does sensor.gain_dn_per_e suit sensor.bits, and the light the exposure?";
  const double high = compute_level(scene, set, bright_e_per_s);
  const double low = compute_level(scene, set, dark_e_per_s);
  if (high - low < too_dark * white) {
    warnings.push_back(set.folder + ": " + bright + " is only " + whole(high - low) + " of " +
                       whole(white) + " gray levels above " + dark + fit);
  }
  if (low > too_bright * white) {
    warnings.push_back(set.folder + ": " + dark + " is at " + whole(low) + " of " + whole(white) +
                       " gray levels" + fit);
  }
}

void add_stripes(const Scene& scene, const CaptureSet& set, std::vector<std::string>& warnings) {
  constexpr double min_period_lines = 2.2;
  for (const SceneLamp& lamp : scene.lamps) {
    const std::string name = set.folder + ": lamp " + std::to_string(lamp.id);
    if (set.exposure_s * lamp.frequency_hz >= 1) {
      warnings.push_back(name + " has no clear stripes: the exposure is longer than its period");
    } else if (lamp.frequency_hz * *scene.camera.row_time_s * min_period_lines > 1) {
      warnings.push_back(name + " has stripes of less than " +
                         std::to_string(min_period_lines).substr(0, 3) + " lines");
    }
  }
}

}  // namespace

std::vector<std::string> find_warnings(const Scene& scene, const CaptureSet& set) {
  std::vector<std::string> warnings;
  if (set.board) {
    add_brightness(scene, set, "the board's white", scene.board->white_e_per_s, "its black",
                   scene.board->black_e_per_s, warnings);
    return warnings;
  }
  double brightest = 0;
  for (const SceneLamp& lamp : scene.lamps) {
    brightest = std::max(brightest, lamp.glow.electron_rate_e_per_s);
  }
  add_brightness(scene, set, "the brightest lamp", brightest + scene.ambient_e_per_s, "the ceiling",
                 scene.ambient_e_per_s, warnings);
  add_stripes(scene, set, warnings);
  return warnings;
}

}  // namespace vlp
