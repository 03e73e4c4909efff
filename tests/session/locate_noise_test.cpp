// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Standard deviations of fixes whose detections state no noise, or too little of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "session/locate_step.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr double kNoise_px = 0.3;

enum class Noise { stated, not_stated, too_small, mixed };

struct Case {
  const char* name;
  double map_sd_m;
  Noise noise;
};

/// Prints a case as its name, in place of its bytes.
void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class LocateFromNoisyDetections : public testing::TestWithParam<Case> {
 protected:
  /// Draws three captures, under lamps at drawn distances from the map.
  LocateInput draw_captures() {
    SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
    LocateInput input{{}, rig.map, rig.calibration};
    for (std::size_t i = 0; i < rig.map.lamps.size(); ++i) {
      input.lamps.lamps[i].sd_m = GetParam().map_sd_m;
      for (double& coordinate : rig.map.lamps[i].position_m) {
        coordinate += GetParam().map_sd_m * random.normal();
      }
    }
    truth.clear();
    for (int k = 0; k < 3; ++k) {
      rig.camera = {{random.uniform(-0.3, 0.3), random.uniform(-0.2, 0.2), 0},
                    random.uniform(-3, 3)};
      truth.push_back(rig.camera);
      std::vector<Detection> seen = with_noise(seen_from(rig, kNoise_px), random);
      std::erase_if(seen, [](const Detection& one) {
        return one.pixel.minCoeff() < 0 || one.pixel.x() > 800 || one.pixel.y() > 600;
      });
      for (Detection& detection : seen) {
        const bool is_unstated =
            GetParam().noise == Noise::not_stated || (GetParam().noise == Noise::mixed && k == 0);
        if (is_unstated) detection.sigma_px.reset();
        if (GetParam().noise == Noise::too_small) detection.sigma_px = kNoise_px / 1.4;
      }
      input.frames.push_back({std::to_string(k), seen});
    }
    return input;
  }

  Random random{17};
  std::vector<Pose> truth;
};

TEST_P(LocateFromNoisyDetections, ReportedSdsMatchErrorsOfFixes) {
  constexpr int draws = 500;
  Eigen::Vector4d squares = Eigen::Vector4d::Zero();
  int fixes = 0, within = 0;
  for (int i = 0; i < draws; ++i) {
    const LocateResult found = locate_from_detections(draw_captures());
    ASSERT_TRUE(found.has_succeeded());
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const auto& fix = found.rows[k].fix;
      if (!fix) continue;
      ASSERT_TRUE(fix->sd);
      Eigen::Vector4d error;
      error << fix->pose.position_m - truth[k].position_m,
          std::remainder(fix->pose.yaw_rad - truth[k].yaw_rad, 2 * M_PI);
      const Eigen::Array4d normalized = error.array() / fix->sd->array();
      squares += normalized.square().matrix();
      within += static_cast<int>((normalized.abs() <= 1.96).count());
      ++fixes;
    }
  }
  ASSERT_GT(fixes, 0.95 * 3 * draws);
  const Eigen::Vector4d ratio = (squares / fixes).cwiseSqrt();
  const double coverage = within / (4.0 * fixes);
  EXPECT_GT(ratio.minCoeff(), 0.85) << ratio.transpose();
  EXPECT_LT(ratio.maxCoeff(), 1.2) << ratio.transpose();
  EXPECT_GT(coverage, 0.93);
  EXPECT_LT(coverage, 0.97);
}

/// The noise part of the sd is that of the true noise, whatever is stated, beside errors of the map
/// that are several times as large.
TEST(LocateFromDetections, NoiseSdExcludesErrorsOfMap) {
  constexpr double map_sd_m = 0.002;
  for (const double stated_to_true : {0.0, 1 / 1.4, 1.0}) {
    Random random(31);
    double sum = 0;
    constexpr int draws = 100, captures = 12;
    for (int i = 0; i < draws; ++i) {
      SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
      LocateInput input{{}, rig.map, rig.calibration};
      for (std::size_t k = 0; k < rig.map.lamps.size(); ++k) {
        input.lamps.lamps[k].sd_m = map_sd_m;
        for (double& coordinate : rig.map.lamps[k].position_m)
          coordinate += map_sd_m * random.normal();
      }
      for (int k = 0; k < captures; ++k) {
        rig.camera = {{random.uniform(-0.3, 0.3), random.uniform(-0.2, 0.2), 0},
                      random.uniform(-3, 3)};
        std::vector<Detection> seen = with_noise(seen_from(rig, 0.05), random);
        for (Detection& detection : seen) {
          detection.sigma_px =
              stated_to_true > 0 ? std::optional(0.05 * stated_to_true) : std::nullopt;
        }
        input.frames.push_back({std::to_string(k), seen});
      }
      const LocateResult found = locate_from_detections(input);
      ASSERT_TRUE(found.has_succeeded());
      double ratio = 0;
      for (int k = 0; k < captures; ++k) {
        const auto index = static_cast<std::size_t>(k);
        for (Detection& detection : input.frames[index].detections) detection.sigma_px = 0.05;
        const Fix exact = Positioner(input.lamps, input.calibration)
                              .compute_position_fix(input.frames[index].detections);
        ASSERT_TRUE(exact.has_succeeded() && found.fixes[index].has_succeeded());
        ratio +=
            std::sqrt(exact.noise_covariance(0, 0) / found.fixes[index].noise_covariance(0, 0)) /
            captures;
      }
      sum += ratio;
    }
    EXPECT_NEAR(sum / draws, 1, 0.1) << stated_to_true;
  }
}

INSTANTIATE_TEST_SUITE_P(Rooms, LocateFromNoisyDetections,
                         testing::Values(Case{"Stated", 0, Noise::stated},
                                         Case{"NotStated", 0, Noise::not_stated},
                                         Case{"TooSmall", 0, Noise::too_small},
                                         Case{"Mixed", 0, Noise::mixed},
                                         Case{"MapErrors", 0.002, Noise::stated},
                                         Case{"MapErrorsNotStated", 0.002, Noise::not_stated}),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace vlp
