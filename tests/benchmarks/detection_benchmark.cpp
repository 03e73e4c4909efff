// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Measures the detection of four lamps in an 800 x 600 frame, on one core, from pixels in memory
/// to identified centers. Compares it with two calls of OpenCV on the same frame. Then measures the
/// same in the middle of 33 Mpx.
#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "frontend/mat_view.h"
#include "lamps/image/background.h"
#include "lamps/light_detector.h"
#include "simulation/exposure.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

struct Captures {
  Captures() {
    cv::setNumThreads(1);
    scene.lamps.resize(4);
    const FrameRenderer renderer(scene);
    const LampShot shot = make_lamp_shot(scene, scene.sets.at(0), 0);
    frame = simulate_sensor_image(scene.sensor, renderer.render_lamps(shot), 1);
    scene.lamps.clear();
    const cv::Mat dark = simulate_sensor_image(
        scene.sensor, FrameRenderer(scene).render_lamps(shot), shot.noise_seed);
    large = cv::repeat(dark, 8, 10)(cv::Rect(0, 0, 7712, 4352)).clone();
    frame.copyTo(large(cv::Rect(3456, 1876, frame.cols, frame.rows)));
    turned = large.t();
  }
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  const LampMap lamps = make_lamp_map(scene, true);
  cv::Mat frame, large, turned;
};

const Captures& captures() {
  static const Captures only;
  return only;
}

void detect_in(benchmark::State& state, const cv::Mat& image, const DetectorCamera& camera) {
  const LightDetector detector(captures().lamps, camera);
  std::size_t lamps = 0;
  for (auto _ : state) lamps = detector.detect_lights(to_image_view(image)).size();
  state.counters["lamps"] = static_cast<double>(lamps);
}

void detect(benchmark::State& state) {
  detect_in(state, captures().frame, make_detector_camera(make_true_calibration(captures().scene)));
}

/// The image and the rig of tests/python/module_test.py, which times the same in Python.
void detect_sample(benchmark::State& state) {
  const std::string rendered = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/";
  const cv::Mat image = cv::imread(rendered + "sample/0000.png", cv::IMREAD_UNCHANGED);
  const LightDetector detector(
      read_lamp_map(rendered + "lamps.yaml"),
      make_detector_camera(read_calibration(rendered + "true_calibration.yaml")));
  cv::setNumThreads(1);
  std::size_t lamps = 0;
  for (auto _ : state) lamps = detector.detect_lights(to_image_view(image)).size();
  state.counters["lamps"] = static_cast<double>(lamps);
}

void opencv_components(benchmark::State& state) {
  const double threshold = estimate_background_of(to_image_view(captures().frame)).threshold;
  cv::Mat binary, labels, statistics, centroids;
  for (auto _ : state) {
    cv::threshold(captures().frame, binary, threshold, 255, cv::THRESH_BINARY);
    cv::connectedComponentsWithStats(binary, labels, statistics, centroids);
  }
}

/// 70 times the pixels, without the lens, which is that of the small frame.
void detect_in_33_mpx(benchmark::State& state) {
  detect_in(state, captures().large,
            {Readout::rows, captures().scene.camera.row_time_s, std::nullopt});
}

void detect_in_33_mpx_by_columns(benchmark::State& state) {
  detect_in(state, captures().turned,
            {Readout::columns, captures().scene.camera.row_time_s, std::nullopt});
}

BENCHMARK(detect)->Unit(benchmark::kMicrosecond);
BENCHMARK(detect_sample)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencv_components)->Unit(benchmark::kMicrosecond);
BENCHMARK(detect_in_33_mpx)->Unit(benchmark::kMicrosecond);
BENCHMARK(detect_in_33_mpx_by_columns)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vlp
