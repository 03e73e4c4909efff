// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Measures a fix from pixel positions, including the lens, and OpenCV's undistortPoints and
/// solvePnP on the same points in the same run.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "positioning/positioner.h"
#include "positioning/vlp.h"
#include "rig/calibration_error.h"
#include "support/body_rig.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

struct Scene {
  SyntheticRig rig;
  std::vector<Detection> detections;
};

Scene make_scene(std::size_t lamps) {
  Scene scene{{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.2, -0.1, 0}, 0.7}, {}},
              {}};
  scene.rig.map.lamps.resize(lamps);
  Random random(1);
  scene.detections = with_noise(seen_from(scene.rig, 0.1), random);
  return scene;
}

void fix(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)));
  const Positioner positioner(scene.rig.map, scene.rig.calibration);
  if (!positioner.compute_position_fix(scene.detections).has_succeeded())
    throw std::logic_error("no fix");
  for (auto _ : state) benchmark::DoNotOptimize(positioner.compute_position_fix(scene.detections));
}
BENCHMARK(fix)->ArgName("lamps")->Arg(2)->Arg(3)->Arg(4)->Arg(8);

/// The same through the C API.
void fix_in_c(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)));
  const std::string lamps = "fix_benchmark_lamps.yaml", calibration = "fix_benchmark.yaml";
  write_lamp_map(lamps, scene.rig.map);
  write_calibration(calibration, scene.rig.calibration);
  vlp_positioner* positioner = nullptr;
  const int opened = vlp_open(lamps.c_str(), calibration.c_str(), nullptr, &positioner);
  std::filesystem::remove(lamps);
  std::filesystem::remove(calibration);
  if (opened != VLP_OK) throw std::logic_error(vlp_last_error());
  std::vector<vlp_detection> seen;
  for (const Detection& detection : scene.detections) {
    seen.push_back({detection.lamp, detection.pixel.x(), detection.pixel.y(), 0.1});
  }
  vlp_fix fix;
  for (auto _ : state) {
    if (vlp_locate(positioner, seen.data(), seen.size(), nullptr, &fix) != VLP_OK) {
      throw std::logic_error("no fix");
    }
    benchmark::DoNotOptimize(fix);
  }
  vlp_close(positioner);
}
BENCHMARK(fix_in_c)->ArgName("lamps")->Arg(2)->Arg(3)->Arg(4)->Arg(8);

/// The same with the reported uncertainties of calibration and lamp map: lens, zenith, survey.
void fix_with_the_common_part(benchmark::State& state) {
  Scene scene = make_scene(static_cast<std::size_t>(state.range(0)));
  SyntheticRig& rig = scene.rig;
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.02, 1);
  rig.calibration.intrinsics_report = IntrinsicsReport{40, 4000, 0, 0.1, {}, {}, {}};
  rig.calibration.intrinsics_report->covariance = 1e-6 * MatrixX::Identity(12, 12);
  rig.calibration.covariance = make_lens_covariance(rig.calibration);
  append_parameters(*rig.calibration.covariance, list_pair_names(kZenithParameter),
                    MatrixX::Constant(2, 12, 1e-3), 4e-10 * Matrix2::Identity());
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.001;
  Random random(1);
  scene.detections = with_noise(seen_from(rig, 0.1), random);
  const Positioner positioner(rig.map, rig.calibration);
  const Fix once = positioner.compute_position_fix(scene.detections);
  if (!once.has_succeeded() || once.noise_covariance == once.covariance) {
    throw std::logic_error("no fix, or one without the common part");
  }
  for (auto _ : state) benchmark::DoNotOptimize(positioner.compute_position_fix(scene.detections));
}
BENCHMARK(fix_with_the_common_part)->ArgName("lamps")->Arg(2)->Arg(3)->Arg(4)->Arg(8);

/// The same lamps from a camera that drives at 1 m/s, rotates and is tilted, with more and more
/// unknowns.
void fix_of_a_body(benchmark::State& state, const Sensors& sensors, const BodyMotion& motion) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {{{0.1, -0.05, 0}, 0.4}, motion}, {}};
  rig.map.lamps.resize(static_cast<std::size_t>(state.range(0)));
  Random random(1);
  const auto detections = with_noise(seen_from(rig, 0.1), random);
  const Positioner positioner = rig.positioner();
  if (detections.size() != rig.map.lamps.size() ||
      !positioner.compute_position_fix(detections, sensors).has_succeeded()) {
    throw std::logic_error("no fix");
  }
  for (auto _ : state)
    benchmark::DoNotOptimize(positioner.compute_position_fix(detections, sensors));
}
const BodyMotion kDriving{{0.8, -0.6}, 0, {0, 0}};
const BodyMotion kTurning{{0.8, -0.6}, 1, {0, 0}};
const BodyMotion kLeaning{{0.8, -0.6}, 0, {0.06, -0.08}};
const KnownMotion kOneMeterPerSecond = KnownMotion::make_motion_prior_from_limits(2, 0);
Sensors make_sensors(double yaw_rate_sd_rad_per_s, double inclination_sigma_rad) {
  Sensors sensors;
  sensors.motion = kOneMeterPerSecond;
  sensors.motion->yaw_rate_sd_rad_per_s = yaw_rate_sd_rad_per_s;
  sensors.inclination_sigma_rad = inclination_sigma_rad;
  return sensors;
}
BENCHMARK_CAPTURE(fix_of_a_body, velocity, make_sensors(0, 0), kDriving)
    ->ArgName("lamps")
    ->Arg(2)
    ->Arg(4)
    ->Arg(8);
BENCHMARK_CAPTURE(fix_of_a_body, velocity_and_yaw_rate, make_sensors(1, 0), kTurning)
    ->ArgName("lamps")
    ->Arg(4)
    ->Arg(8);
BENCHMARK_CAPTURE(fix_of_a_body, velocity_and_inclination_sensor, make_sensors(0, 0.1), kLeaning)
    ->ArgName("lamps")
    ->Arg(4)
    ->Arg(8);
BENCHMARK_CAPTURE(fix_of_a_body, velocity_and_free_lean, make_sensors(0, 1.6), kLeaning)
    ->ArgName("lamps")
    ->Arg(4)
    ->Arg(8);

/// The iterative method of solvePnP requires four points.
void opencv_undistort_and_solve_pnp(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)));
  const auto& k = scene.rig.calibration.camera.intrinsics;
  const cv::Matx33d camera(k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1);
  const std::vector<double> distortion(k.begin() + 4, k.end());
  std::vector<cv::Point3d> lamps;
  std::vector<cv::Point2d> pixels;
  for (std::size_t i = 0; i < scene.detections.size(); ++i) {
    const auto& p = scene.rig.map.lamps[i].position_m;
    lamps.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(scene.detections[i].pixel.x(), scene.detections[i].pixel.y());
  }
  cv::setNumThreads(1);
  for (auto _ : state) {
    std::vector<cv::Point2d> plane;
    cv::Vec3d rotation, translation;
    cv::undistortPoints(pixels, plane, camera, distortion);
    cv::solvePnP(lamps, plane, cv::Matx33d::eye(), cv::noArray(), rotation, translation, false,
                 cv::SOLVEPNP_ITERATIVE);
    benchmark::DoNotOptimize(translation);
  }
}
BENCHMARK(opencv_undistort_and_solve_pnp)->ArgName("lamps")->Arg(4)->Arg(8);

}  // namespace
}  // namespace vlp
