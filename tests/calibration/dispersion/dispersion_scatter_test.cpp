// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo: what the dispersion reports of itself is its scatter. 600 draws know a standard
/// deviation within 2.9 %: 9 % is three of those.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "calibration/dispersion/station.h"

namespace vlp {
namespace {

constexpr int kStations = 600;
constexpr double kStationTolerance = 0.09;

void expect_consistent(const Station& station, const std::vector<StationCapture>& exact,
                       DispersionMethod method, bool stated) {
  Random random(41);
  const auto reference = fit_dispersion(exact, station.rig.map, station.believed, method);
  Eigen::Array4d scatter = Eigen::Array4d::Zero(), reported = scatter;
  const bool world = method == DispersionMethod::camera;
  for (int i = 0; i < kStations; ++i) {
    auto captures = exact;
    for (auto& capture : captures) {
      capture.detections = with_noise(capture.detections, random);
      for (auto& detection : capture.detections) {
        if (!stated) detection.sigma_px.reset();
      }
    }
    const auto fit = fit_dispersion(captures, station.rig.map, station.believed, method);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    Eigen::Array4d error = Eigen::Array4d::Zero(), variance = error;
    error.head<2>() = fit.dispersion.offset_px - reference.dispersion.offset_px;
    variance.head<2>() = fit.dispersion.covariance->diagonal();
    if (world) {
      error.tail<2>() = *fit.world_offset_m - *reference.world_offset_m;
      variance.tail<2>() = fit.world_covariance.diagonal();
    }
    scatter += error.square() / kStations;
    reported += variance / kStations;
  }
  for (Eigen::Index i = 0; i < (world ? 4 : 2); ++i) {
    EXPECT_NEAR(std::sqrt(scatter[i] / reported[i]), 1, kStationTolerance) << i;
  }
}

TEST(DispersionScatter, IsTheReportedCovariance) {
  Station station(0.01);
  const auto exact = station.captures(16, true, {0.003, 0.001}, 0.1);
  expect_consistent(station, exact, DispersionMethod::camera, true);
}

TEST(DispersionScatter, IsTheReportedCovarianceWhenTheFixesTellTheNoise) {
  Station station(0.01);
  const auto exact = station.captures(16, true, {0.003, 0.001}, 0.1);
  expect_consistent(station, exact, DispersionMethod::camera, false);
}

TEST(DispersionScatter, OfHalfATurnIsTheReportedCovariance) {
  Station station(0.01);
  auto exact = station.captures(24, true, {0.003, 0.001}, 0.1);
  exact.resize(10);
  expect_consistent(station, exact, DispersionMethod::camera, true);
}

TEST(DispersionScatter, ByThePaperIsTheReportedCovariance) {
  Station station(0.01);
  expect_consistent(station, station.captures_at(0.7, 30), DispersionMethod::paper, true);
}

/// How the fixes of a few captures at one yaw scatter.
struct FewCaptures {
  const char* name;
  int count;
  bool noise_is_stated;
  /// Scatter of where the camera stood at the station, which no fix knows of.
  double placement_sd_m;
};

class DispersionOfFew : public testing::TestWithParam<FewCaptures> {};

/// 600 draws of two axes know an rms to 3 % and the fraction of 5 % to 0.6 %. Few captures do not
/// determine their scatter, so that the interval of 95 % is asserted, and sds that are larger.
TEST_P(DispersionOfFew, ByThePaperCoversTheErrorAsStated) {
  const FewCaptures& few = GetParam();
  Station station(0.01);
  const auto exact = station.captures_at(0.7, few.count);
  const auto reference =
      fit_dispersion(exact, station.rig.map, station.believed, DispersionMethod::paper);
  ASSERT_EQ(reference.status, DispersionStatus::ok);
  Random random(43);
  double squares = 0;
  int beyond = 0;
  for (int i = 0; i < kStations; ++i) {
    auto captures = exact;
    for (auto& capture : captures) {
      capture.detections = with_noise(capture.detections, random);
      capture.station_m += few.placement_sd_m * Eigen::Vector2d(random.normal(), random.normal());
      for (auto& detection : capture.detections) {
        if (!few.noise_is_stated) detection.sigma_px.reset();
      }
    }
    const auto fit =
        fit_dispersion(captures, station.rig.map, station.believed, DispersionMethod::paper);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    ASSERT_TRUE(fit.dispersion.covariance);
    EXPECT_EQ(fit.dispersion.captures, few.count);
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const double error = fit.dispersion.offset_px[axis] - reference.dispersion.offset_px[axis];
      const double square = error * error / (*fit.dispersion.covariance)(axis, axis);
      squares += square / (2 * kStations);
      beyond += square > 1.96 * 1.96 ? 1 : 0;
    }
  }
  const double ratio = std::sqrt(squares), fraction = beyond / (2.0 * kStations);
  std::printf("%s: e/sd %.2f, beyond 95 %%: %.1f %%\n", few.name, ratio, 100 * fraction);
  EXPECT_LT(ratio, 1.2);
  EXPECT_GT(ratio, 0.6);
  EXPECT_LT(fraction, 0.07);
}

INSTANTIATE_TEST_SUITE_P(Paper, DispersionOfFew,
                         testing::Values(FewCaptures{"Two", 2, true, 0},
                                         FewCaptures{"Three", 3, true, 0},
                                         FewCaptures{"Eight", 8, true, 0},
                                         FewCaptures{"TwoNoiseNotStated", 2, false, 0},
                                         FewCaptures{"ThreeNoiseNotStated", 3, false, 0},
                                         FewCaptures{"TwoPlacedBadly", 2, true, 2e-3},
                                         FewCaptures{"ThreePlacedBadly", 3, true, 2e-3},
                                         FewCaptures{"EightPlacedBadly", 8, true, 2e-3}),
                         [](const auto& few) { return few.param.name; });

}  // namespace
}  // namespace vlp
