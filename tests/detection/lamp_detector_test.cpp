// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The detector on rendered captures, whose truth is known.
#include "detection/lamp_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "simulation/exposure.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

struct Score {
  int lamps = 0, missed = 0, wrong = 0;
  double squares = 0, worst_px = 0, chi_square = 0;

  double rms_px() const { return std::sqrt(squares / lamps); }
};

/// Every so many captures of a folder of a scene.
class Captures {
 public:
  explicit Captures(const std::string& scene, const std::string& folder)
      : scene_(read_scene(VLP_SOURCE_DIR "/datasets/" + scene + "/scene.yaml")),
        renderer_(scene_),
        set_(*std::find_if(scene_.sets.begin(), scene_.sets.end(),
                           [&](const CaptureSet& set) { return set.folder == folder; })) {}

  LampShot shot(std::size_t index) const { return lamp_shot(scene_, set_, index); }
  cv::Mat image(const LampShot& shot) const {
    const cv::Mat lines = expose(scene_.sensor, renderer_.lamp_electrons(shot), shot.noise_seed);
    return scene_.camera.readout == Readout::rows ? lines : cv::Mat(lines.t());
  }
  std::vector<TrueLamp> truth(const LampShot& shot) const {
    return true_lamps(scene_, renderer_, shot);
  }
  LampDetector detector() const {
    return {lamp_map_of(scene_, false), detector_camera(true_calibration(scene_))};
  }

  Score score(std::size_t step) const {
    const LampDetector lamp_detector = detector();
    Score score;
    for (std::size_t i = 0; i < shots_in(set_); i += step) {
      const LampShot shot = this->shot(i);
      std::map<int, Light> found;
      for (Light& light : lamp_detector.detect(image(shot))) {
        if (light.kind != LightKind::lamp) continue;
        EXPECT_FALSE(found.contains(*light.lamp)) << "one lamp twice in image " << i;
        found[*light.lamp] = light;
      }
      add(truth(shot), found, score);
    }
    return score;
  }

 private:
  void add(const std::vector<TrueLamp>& truth, std::map<int, Light>& found, Score& score) const {
    const Eigen::Vector2d size(scene_.camera.imager_px[0] - 1, scene_.camera.imager_px[1] - 1);
    for (const auto& [id, pixel, in_view] : truth) {
      const auto light = found.find(id);
      constexpr double radius_px = 40;  // no lamp here is larger
      const bool inside =
          in_view == 1 && pixel.minCoeff() > radius_px && (size - pixel).minCoeff() > radius_px;
      if (light == found.end()) {
        score.missed += inside;
        continue;
      }
      const double error_px = (light->second.pixel - pixel).norm();
      const double sigma_px = light->second.sigma_px;
      found.erase(light);
      if (error_px > 5) ++score.wrong;
      if (in_view < 1 || error_px > 5) continue;
      ++score.lamps;
      score.squares += error_px * error_px;
      score.worst_px = std::max(score.worst_px, error_px);
      score.chi_square += error_px * error_px / 2 / std::pow(sigma_px, 2);
    }
    score.wrong += static_cast<int>(found.size());
  }

  Scene scene_;
  FrameRenderer renderer_;
  CaptureSet set_;
};

TEST(LampDetector, FindsAndIdentifiesEveryLampOfThePaperRig) {
  const Score score = Captures("paper-rig", "check").score(12);
  EXPECT_GT(score.lamps, 180);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.02);
  EXPECT_LT(score.worst_px, 0.08);
}

TEST(LampDetector, StatesTheScatterOfItsCentres) {
  const Score score = Captures("paper-rig", "check").score(12);
  EXPECT_GT(score.chi_square / score.lamps, 0.7);
  EXPECT_LT(score.chi_square / score.lamps, 2);
}

TEST(LampDetector, CopesWithTiltAndADecentredLens) {
  const Score score = Captures("paper-rig-faulty", "check").score(24);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.02);
}

TEST(LampDetector, CopesWithAWideLensAndAReadOutAlongColumns) {
  const Score score = Captures("wide", "check").score(8);
  EXPECT_GT(score.lamps, 150);
  EXPECT_LE(score.missed, 4);  // too few stripes to tell
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.03);
}

TEST(LampDetector, LeavesOutSteadyLightsAndReflections) {
  const Captures captures("clutter", "sample");
  const LampShot shot = captures.shot(0);
  std::map<LightKind, int> kinds;
  for (const Light& light : captures.detector().detect(captures.image(shot))) ++kinds[light.kind];
  EXPECT_GE(kinds[LightKind::lamp], 3);
  EXPECT_LE(kinds[LightKind::lamp], 6) << "and three of them partly hidden";
  EXPECT_GE(kinds[LightKind::unknown], 1) << "the reflection of lamp 5";
  EXPECT_EQ(kinds[LightKind::steady], 2) << "the steady lamp and the window";
}

TEST(LampDetector, MarksALampThatTheImagesEdgeCuts) {
  const Captures captures("paper-rig", "check");
  int cut = 0;
  for (std::size_t i = 0; i < 432; i += 8) {
    const LampShot shot = captures.shot(i);
    const auto lights = captures.detector().detect(captures.image(shot));
    for (const auto& [id, pixel, in_view] : captures.truth(shot)) {
      if (in_view > 0.9) continue;
      for (const Light& light : lights) {
        if (light.lamp != id) continue;
        EXPECT_EQ(light.kind, LightKind::cut) << id << " in image " << i;
        ++cut;
      }
    }
  }
  EXPECT_GT(cut, 5);
}

TEST(LampDetector, CallsALampUnknownThatTheMapDoesNotHave) {
  const Captures captures("paper-rig", "sample");
  const LampDetector detector(LampMap{{Lamp{7, {0, 0, 1.6}, {}, 6000, 0.5}}},
                              {Readout::rows, 3e-5, {}});
  for (const Light& light : detector.detect(captures.image(captures.shot(0)))) {
    EXPECT_EQ(light.kind, LightKind::unknown);
    EXPECT_FALSE(light.lamp);
  }
}

TEST(LampDetector, DoesNotChooseBetweenLampsOfNearlyOneFrequency) {
  const Captures captures("paper-rig", "sample");
  LampMap map{{Lamp{3, {0, 0, 1.6}, {}, 2500, 0.5}, Lamp{7, {1, 0, 1.6}, {}, 2520, 0.5}}};
  const auto identified = [&] {
    const LampDetector detector(map, {Readout::rows, 3e-5, {}});
    const auto lights = detector.detect(captures.image(captures.shot(0)));
    return std::count_if(lights.begin(), lights.end(),
                         [](const Light& light) { return light.lamp.has_value(); });
  };
  EXPECT_EQ(identified(), 0);
  map.lamps.pop_back();
  EXPECT_EQ(identified(), 1);
}

TEST(LampDetector, FindsNothingInImagesWithoutLamps) {
  const LampDetector detector = Captures("paper-rig", "sample").detector();
  for (const int type : {CV_8U, CV_16U}) {
    for (const double level : {0.0, 100.0, 255.0, 65535.0}) {
      EXPECT_TRUE(detector.detect(cv::Mat(600, 800, type, cv::Scalar(level))).empty());
    }
    EXPECT_TRUE(detector.detect(cv::Mat(1, 1, type, cv::Scalar(9))).empty());
  }
}

}  // namespace
}  // namespace vlp
