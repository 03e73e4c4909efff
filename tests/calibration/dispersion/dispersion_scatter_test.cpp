// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo: what the dispersion reports of itself is its scatter. 600 draws know a standard
/// deviation within 2.9 %: 9 % is three of those.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace vlp
