// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo test: the reported covariance of the dispersion matches its scatter. 600 draws
/// determine a standard deviation to 2.9 %.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

#include "calibration/dispersion/station.h"
#include "positioning/positioner.h"
#include "rig/calibration_error.h"
#include "support/estimate_scatter.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns the calibration with the dispersion of a fit and its errors.
Calibration add_dispersion_with_covariance(Calibration calibration, const DispersionFit& fit) {
  calibration.dispersion = fit.dispersion;
  calibration.covariance = append_offset({}, fit, MatrixX(2, 0), calibration.camera.focal_px());
  return calibration;
}

constexpr int kStations = 600;

/// Captures at a reference point under a map with errors of its sd_m, and their given noise.
struct Captures {
  const char* name;
  DispersionMethod method;
  int count;
  double map_sd_m;
  /// Given noise divided by the true noise; std::nullopt if no noise is given.
  std::optional<double> stated_ratio;
  /// True for captures at two opposite yaws, each at a different height.
  bool has_tied_heights = false;
  /// Standard deviation of the true position about the reference point, which fixes cannot
  /// determine.
  double placement_sd_m = 0;
  /// Range of the yaws.
  double turn_rad = 2 * M_PI;
};

std::vector<ReferencePointCapture> make_captures(Station& station, const Captures& captures) {
  constexpr double noise_px = 0.3;
  if (captures.method == DispersionMethod::chen_guan) {
    return station.captures_at(0.7, captures.count, noise_px);
  }
  std::vector<ReferencePointCapture> made;
  for (int k = 0; k < captures.count; ++k) {
    const bool second = k % 2 == 1;
    const double yaw_rad =
        captures.has_tied_heights ? (second ? M_PI : 0.0) : captures.turn_rad * k / captures.count;
    station.rig.camera = {{0.05, -0.1, second ? 0.3 : 0.0}, 0.7 + yaw_rad};
    made.push_back({seen_from(station.rig, noise_px), station.rig.camera.position_m.head<2>()});
  }
  return made;
}

class EstimateDispersionUncertainty : public testing::TestWithParam<Captures> {};

/// 600 draws of two axes determine an RMS to 3 % and the fraction of 5 % to 0.6 %.
TEST_P(EstimateDispersionUncertainty, Offset95PercentIntervalCoversErrorAtNominalRate) {
  const Captures& cell = GetParam();
  Station station(0.01);
  const auto exact = make_captures(station, cell);
  const auto truth = estimate_dispersion(exact, station.rig.map, station.believed, cell.method);
  ASSERT_EQ(truth.status, DispersionStatus::ok);
  Random random(44);
  EstimateScatter offset, world;
  for (int i = 0; i < kStations; ++i) {
    LampMap surveyed = station.rig.map;
    for (Lamp& lamp : surveyed.lamps) {
      lamp.sd_m = cell.map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += cell.map_sd_m * random.normal();
    }
    auto captures = exact;
    for (auto& capture : captures) {
      capture.detections = with_noise(capture.detections, random);
      capture.reference_point_m +=
          cell.placement_sd_m * Eigen::Vector2d{random.normal(), random.normal()};
      for (auto& detection : capture.detections) {
        detection.sigma_px = cell.stated_ratio
                                 ? std::optional(*cell.stated_ratio * *detection.sigma_px)
                                 : std::nullopt;
      }
    }
    const auto fit = estimate_dispersion(captures, surveyed, station.believed, cell.method);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    const auto covariance_px2 =
        compute_offset_covariance(add_dispersion_with_covariance(station.believed, fit));
    ASSERT_TRUE(covariance_px2);
    offset.add(fit.dispersion.offset_px - truth.dispersion.offset_px, *covariance_px2);
    ASSERT_EQ(fit.world_offset_m.has_value(), cell.method == DispersionMethod::camera);
    ASSERT_EQ(truth.world_offset_m.has_value(), cell.method == DispersionMethod::camera);
    if (fit.world_offset_m)
      world.add(*fit.world_offset_m - *truth.world_offset_m, fit.world_covariance);
  }
  const double ratio = offset.normalized_rms(), fraction = offset.fraction_beyond_95();
  std::printf("%s: e/sd %.2f, beyond 95 %%: %.1f %%\n", cell.name, ratio, 100 * fraction);
  // Three captures without given noise have two degrees of freedom: t^2 has no mean.
  if (cell.count > 3 || cell.stated_ratio) {
    EXPECT_LT(ratio, 1.2);
    EXPECT_GT(ratio, 0.8);
  }
  // The world offset depends mainly on the map: its noise is far below the errors of the map.
  if (cell.method == DispersionMethod::camera && cell.map_sd_m > 0)
    EXPECT_NEAR(world.normalized_rms(), 1, 0.09);
  if (cell.count >= 10 && cell.stated_ratio) {
    EXPECT_THAT(offset.sd_ratios(), IsNear(Eigen::Vector2d(1, 1), 0.15));
    EXPECT_LT(offset.correlation_difference().cwiseAbs().maxCoeff(), 0.15);
  }
  // Three captures whose given noise is 1.4 times too small cover 93.2 % on average
  // (compute_variance_factor()). 600 draws of two axes determine this to 0.7 %.
  const bool is_understated = cell.stated_ratio.value_or(1) < 1;
  EXPECT_LT(fraction, is_understated ? 0.068 + 2 * 0.007 : 0.05 + 3 * 0.0063);
  EXPECT_GT(fraction, 0.01);
}

constexpr DispersionMethod kCamera = DispersionMethod::camera, kPaper = DispersionMethod::chen_guan;
INSTANTIATE_TEST_SUITE_P(
    Captures, EstimateDispersionUncertainty,
    testing::Values(Captures{"FullTurn", kCamera, 16, 0, 1},
                    Captures{"FullTurnNoiseNotStated", kCamera, 16, 0, {}},
                    Captures{"Over135Degrees", kCamera, 10, 0, 1, false, 0, 2.36},
                    Captures{"PaperThirty", kPaper, 30, 0, 1},
                    Captures{"PaperThreeUnderMapErrors", kPaper, 3, 2e-3, 1},
                    Captures{"PaperTwelveUnderMapErrors", kPaper, 12, 2e-3, 1},
                    Captures{"PaperThreeNoiseTooSmall", kPaper, 3, 0, 1 / 1.4},
                    Captures{"PaperThreePlacedBadly", kPaper, 3, 0, 1, false, 2e-3},
                    Captures{"PaperEightPlacedBadly", kPaper, 8, 0, 1, false, 2e-3},
                    Captures{"Three", kCamera, 3, 0, 1},
                    Captures{"ThreeNoiseNotStated", kCamera, 3, 0, {}},
                    Captures{"SixUnderMapErrors", kCamera, 6, 2e-3, 1},
                    Captures{"TiedFourUnderMapErrors", kCamera, 4, 2e-3, 1, true},
                    Captures{"TiedFourNoiseNotStated", kCamera, 4, 0, {}, true}),
    [](const auto& captures) { return captures.param.name; });

constexpr double kPixelNoise_px = 0.1, kMapSd_m = 2e-3;
/// Distance of the second group of lamps from the first, which is not visible from the reference
/// point.
constexpr double kFar_m = 3.5;

std::vector<Detection> detect_in_image(const SyntheticRig& rig) {
  std::vector<Detection> detections = seen_from(rig, kPixelNoise_px);
  std::erase_if(detections, [&](const Detection& detection) {
    const auto& [width_px, height_px] = rig.calibration.camera.imager_px;
    return detection.pixel.minCoeff() < 0 || detection.pixel.x() >= width_px ||
           detection.pixel.y() >= height_px;
  });
  return detections;
}

/// Returns a reference point under eight lamps, with eight more at kFar_m.
Station make_station_with_far_lamps() {
  Station station(0);
  LampMap& map = station.rig.map;
  const auto near = map.lamps;
  map.lamps.reserve(2 * near.size());
  for (Lamp lamp : near) {
    lamp.id += static_cast<int>(near.size());
    lamp.position_m.x() += kFar_m;
    map.lamps.push_back(lamp);
  }
  return station;
}

LampMap draw_survey(const LampMap& truth, Random& random) {
  LampMap surveyed = truth;
  for (Lamp& lamp : surveyed.lamps) {
    lamp.sd_m = kMapSd_m;
    for (double& coordinate_m : lamp.position_m) coordinate_m += kMapSd_m * random.normal();
  }
  return surveyed;
}

std::vector<ReferencePointCapture> draw_captures(SyntheticRig& rig, DispersionMethod method,
                                                 Random& random) {
  constexpr int captures = 8;
  std::vector<ReferencePointCapture> drawn;
  drawn.reserve(captures);
  for (int k = 0; k < captures; ++k) {
    const bool turns = method == DispersionMethod::camera;
    rig.camera = {{0.05, -0.1, 0}, 0.7 + (turns ? 2 * M_PI * k / captures : 0)};
    drawn.push_back({with_noise(detect_in_image(rig), random), rig.camera.position_m.head<2>()});
  }
  return drawn;
}

/// Errors of x and y at a place.
struct PlaceConsistency {
  const char* place;
  Pose camera;
  EstimateScatter errors = {};
  double variance_without_lamps = 0, variance = 0;
};

class PositionerAfterDispersion : public testing::TestWithParam<DispersionMethod> {};

/// 600 draws of two axes determine an RMS to 2.1 % to 2.9 %, as the axes are correlated.
TEST_P(PositionerAfterDispersion, FixCovarianceMatchesErrorsUnderSameAndOtherLamps) {
  constexpr int draws = 600;
  Station station = make_station_with_far_lamps();
  SyntheticRig& rig = station.rig;
  PlaceConsistency places[] = {{"at the station", {{0.05, -0.1, 0}, 0.7}},
                               {"at the station, turned", {{0.05, -0.1, 0}, 2.5}},
                               {"under other lamps", {{0.05 + kFar_m, -0.1, 0}, 0.7}}};
  Random random(45);
  for (int draw = 0; draw < draws; ++draw) {
    const LampMap surveyed = draw_survey(rig.map, random);
    const auto captures = draw_captures(rig, GetParam(), random);
    const auto fit = estimate_dispersion(captures, surveyed, station.believed, GetParam());
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    ASSERT_EQ(fit.lamp_derivatives.lamps.size(), 8U);
    Calibration calibration = add_dispersion_with_covariance(station.believed, fit);
    const Positioner positioner(surveyed, calibration);
    // Simulates independent errors of offset and map.
    for (auto& lamp : calibration.covariance->lamps) lamp.position_m.z() += 1;
    const Positioner independent(surveyed, calibration);
    for (PlaceConsistency& place : places) {
      rig.camera = place.camera;
      const auto detections = with_noise(detect_in_image(rig), random);
      const Fix fix = positioner.compute_position_fix(detections);
      ASSERT_TRUE(fix.has_succeeded());
      const Fix same = independent.compute_position_fix(detections);
      const Eigen::Matrix2d covariance = fix.pose_covariance().topLeftCorner<2, 2>();
      place.errors.add((fix.state.pose.position_m - place.camera.position_m).head<2>(), covariance);
      place.variance += covariance.trace() / (2 * draws);
      place.variance_without_lamps +=
          same.pose_covariance().topLeftCorner<2, 2>().trace() / (2 * draws);
    }
  }
  for (const PlaceConsistency& place : places) {
    std::printf("%s: e/sd %.3f; sd %.3f mm, %.3f mm if independent of the map\n", place.place,
                place.errors.normalized_rms(), 1e3 * std::sqrt(place.variance),
                1e3 * std::sqrt(place.variance_without_lamps));
    EXPECT_NEAR(place.errors.normalized_rms(), 1, 0.1) << place.place;
  }
  // The offset compensates errors of the map only under the lamps that were used for it.
  EXPECT_NEAR(places[2].variance, places[2].variance_without_lamps, 0.01 * places[2].variance);
}

INSTANTIATE_TEST_SUITE_P(Methods, PositionerAfterDispersion,
                         testing::Values(DispersionMethod::camera, DispersionMethod::chen_guan),
                         [](const auto& method) {
                           return method.param == DispersionMethod::camera ? "Camera" : "Paper";
                         });

}  // namespace
}  // namespace vlp
