// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo: what the dispersion reports of itself is its scatter. 600 draws know a standard
/// deviation within 2.9 %: 9 % is three of those.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

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
  // Two captures have two degrees of freedom: without the noise, t^2 has no mean.
  if (few.count > 2 || few.placement_sd_m == 0) {
    EXPECT_LT(ratio, 1.2);
  }
  EXPECT_GT(ratio, 0.75);
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

/// Captures by a station under a map with errors of its sd_m, and how noise is stated.
struct Captures {
  const char* name;
  DispersionMethod method;
  int count;
  double map_sd_m;
  /// Stated noise over the noise; std::nullopt if it is not stated.
  std::optional<double> stated_ratio;
  /// Whether the captures are at two opposite yaws, each at a height of its own.
  bool has_tied_heights = false;
};

std::vector<StationCapture> make_captures(Station& station, const Captures& captures) {
  constexpr double noise_px = 0.3;
  if (captures.method == DispersionMethod::paper) {
    return station.captures_at(0.7, captures.count, noise_px);
  }
  std::vector<StationCapture> made;
  for (int k = 0; k < captures.count; ++k) {
    const bool second = k % 2 == 1;
    const double yaw_rad =
        captures.has_tied_heights ? (second ? M_PI : 0.0) : 2 * M_PI * k / captures.count;
    station.rig.camera = {{0.05, -0.1, second ? 0.3 : 0.0}, 0.7 + yaw_rad};
    made.push_back({seen_from(station.rig, noise_px), station.rig.camera.position_m.head<2>()});
  }
  return made;
}

class DispersionSd : public testing::TestWithParam<Captures> {};

/// 600 draws of two axes know an rms to 3 % and the fraction of 5 % to 0.6 %.
TEST_P(DispersionSd, CoversTheErrorAsStated) {
  const Captures& cell = GetParam();
  Station station(0.01);
  const auto exact = make_captures(station, cell);
  const auto truth = fit_dispersion(exact, station.rig.map, station.believed, cell.method);
  ASSERT_EQ(truth.status, DispersionStatus::ok);
  Random random(44);
  double squares = 0;
  int beyond = 0;
  for (int i = 0; i < kStations; ++i) {
    LampMap surveyed = station.rig.map;
    for (Lamp& lamp : surveyed.lamps) {
      lamp.sd_m = cell.map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += cell.map_sd_m * random.normal();
    }
    auto captures = exact;
    for (auto& capture : captures) {
      capture.detections = with_noise(capture.detections, random);
      for (auto& detection : capture.detections) {
        detection.sigma_px = cell.stated_ratio
                                 ? std::optional(*cell.stated_ratio * *detection.sigma_px)
                                 : std::nullopt;
      }
    }
    const auto fit = fit_dispersion(captures, surveyed, station.believed, cell.method);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    ASSERT_TRUE(fit.dispersion.covariance);
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const double error = fit.dispersion.offset_px[axis] - truth.dispersion.offset_px[axis];
      const double square = error * error / (*fit.dispersion.covariance)(axis, axis);
      squares += square / (2 * kStations);
      beyond += square > 1.96 * 1.96 ? 1 : 0;
    }
  }
  const double ratio = std::sqrt(squares), fraction = beyond / (2.0 * kStations);
  std::printf("%s: e/sd %.2f, beyond 95 %%: %.1f %%\n", cell.name, ratio, 100 * fraction);
  // Three captures whose noise is not stated have two degrees of freedom: t^2 has no mean.
  if (cell.count > 3 || cell.stated_ratio) {
    EXPECT_LT(ratio, 1.2);
    EXPECT_GT(ratio, 0.8);
  }
  EXPECT_LT(fraction, 0.08);
  EXPECT_GT(fraction, 0.01);
}

constexpr DispersionMethod kCamera = DispersionMethod::camera, kPaper = DispersionMethod::paper;
INSTANTIATE_TEST_SUITE_P(
    Captures, DispersionSd,
    testing::Values(Captures{"PaperThreeUnderMapErrors", kPaper, 3, 2e-3, 1},
                    Captures{"PaperTwelveUnderMapErrors", kPaper, 12, 2e-3, 1},
                    Captures{"PaperTwelveUnderMapErrorsNoiseNotStated", kPaper, 12, 2e-3, {}},
                    Captures{"PaperThree", kPaper, 3, 0, 1},
                    Captures{"PaperThreeNoiseTooSmall", kPaper, 3, 0, 1 / 1.4},
                    Captures{"Three", kCamera, 3, 0, 1},
                    Captures{"ThreeNoiseTooSmall", kCamera, 3, 0, 1 / 1.4},
                    Captures{"ThreeNoiseNotStated", kCamera, 3, 0, {}},
                    Captures{"FourNoiseNotStated", kCamera, 4, 0, {}},
                    Captures{"SixUnderMapErrors", kCamera, 6, 2e-3, 1},
                    Captures{"TiedFourUnderMapErrors", kCamera, 4, 2e-3, 1, true},
                    Captures{"TiedTwelveUnderMapErrors", kCamera, 12, 2e-3, 1, true},
                    Captures{"TiedFourNoiseNotStated", kCamera, 4, 0, {}, true}),
    [](const auto& captures) { return captures.param.name; });

}  // namespace
}  // namespace vlp
