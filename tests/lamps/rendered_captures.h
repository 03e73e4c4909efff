// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "frontend/mat_view.h"
#include "lamps/light_detector.h"
#include "simulation/exposure.h"
#include "simulation/truth.h"

namespace vlp {

struct Score {
  /// Number of evaluated and missed lamps. `wrong` is the number of identified lamps with an error
  /// above Captures::max_error_px, or outside the image.
  int lamps = 0, missed = 0, wrong = 0;
  double squares = 0, worst_px = 0, chi_square = 0;
  /// Maximum ratio of an error to the reported sigma_px.
  double worst_ratio = 0;
  /// Number of partly hidden lamps, and their sum of normalized squared errors.
  int hidden = 0;
  double hidden_chi_square = 0;

  double rms_px() const { return std::sqrt(squares / lamps); }
};

/// Captures of a folder of a scene, rendered on demand.
class Captures {
 public:
  explicit Captures(const std::string& scene, const std::string& folder)
      : Captures(read_scene_file(VLP_SOURCE_DIR "/datasets/" + scene + "/scene.yaml"), folder) {}
  Captures(Scene scene, const std::string& folder)
      : scene_(std::move(scene)),
        renderer_(scene_),
        set_(*std::find_if(scene_.sets.begin(), scene_.sets.end(),
                           [&](const CaptureSet& set) { return set.folder == folder; })) {}

  /// Error of a center above which, and above its sigma, a lamp counts as wrong.
  double max_error_px = 5;

  LampShot shot(std::size_t index) const { return make_lamp_shot(scene_, set_, index); }
  cv::Mat image(const LampShot& shot) const {
    const cv::Mat lines = simulate_sensor_image(scene_.sensor, renderer_.render_lamps(shot),
                                                shot.noise_seed, scene_.processing);
    const cv::Mat image = scene_.camera.readout == Readout::rows ? lines : cv::Mat(lines.t());
    return cv::imdecode(encode_image(image, scene_.processing),
                        cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  }
  std::vector<TrueLamp> truth(const LampShot& shot) const {
    return list_true_lamps(scene_, renderer_, shot);
  }
  LampMap lamps() const { return make_lamp_map(scene_, false); }
  Calibration calibration() const { return make_true_calibration(scene_); }
  LightDetector detector() const { return {lamps(), make_detector_camera(calibration())}; }
  std::size_t size() const { return count_shots(set_); }

  /// Evaluates every `step`-th capture for the lamps selected by `counts`; wrong identifications
  /// count for all lamps.
  Score score(
      std::size_t step, const std::function<bool(int)>& counts = [](int) { return true; }) const {
    return score(step, detector(), counts);
  }
  Score score(
      std::size_t step, const LightDetector& lamp_detector,
      const std::function<bool(int)>& counts = [](int) { return true; }) const {
    Score score;
    for (std::size_t i = 0; i < count_shots(set_); i += step) {
      const LampShot shot = this->shot(i);
      std::map<int, Light> found;
      for (Light& light : lamp_detector.detect_lights(to_image_view(image(shot)))) {
        if (light.kind != LightKind::lamp) continue;
        EXPECT_FALSE(found.contains(*light.lamp)) << "one lamp twice in image " << i;
        found[*light.lamp] = light;
      }
      add(truth(shot), found, counts, score);
    }
    return score;
  }

 private:
  void add(const std::vector<TrueLamp>& truth, std::map<int, Light>& found,
           const std::function<bool(int)>& counts, Score& score) const {
    for (const auto& [id, pixel, in_view] : truth) {
      const auto light = found.find(id);
      if (light == found.end()) {
        score.missed += in_view == 1 && counts(id);
        continue;
      }
      const double error_px = (light->second.pixel - pixel).norm();
      const double sigma_px = light->second.sigma_px;
      found.erase(light);
      const bool is_wrong = error_px > std::max(max_error_px, sigma_px);
      if (is_wrong) ++score.wrong;
      if (is_wrong || !counts(id)) continue;
      const double chi_square = error_px * error_px / 2 / std::pow(sigma_px, 2);
      if (in_view < 1) {
        ++score.hidden;
        score.hidden_chi_square += chi_square;
        continue;
      }
      ++score.lamps;
      score.squares += error_px * error_px;
      score.worst_px = std::max(score.worst_px, error_px);
      score.worst_ratio = std::max(score.worst_ratio, error_px / sigma_px);
      score.chi_square += chi_square;
    }
    score.wrong += static_cast<int>(found.size());
  }

  Scene scene_;
  FrameRenderer renderer_;
  CaptureSet set_;
};

}  // namespace vlp
