// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// An 800 x 600 frame with four lamps from pixels in memory to identified centres, on one core, and
/// two calls of OpenCV on the same frame beside it.
#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "detection/background.h"
#include "detection/lamp_detector.h"
#include "simulation/exposure.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

struct Capture {
  Capture() {
    cv::setNumThreads(1);
    scene.lamps.resize(4);
    const FrameRenderer renderer(scene);
    const LampShot shot = lamp_shot(scene, scene.sets.at(0), 0);
    image = expose(scene.sensor, renderer.lamp_electrons(shot), 1);
  }
  Scene scene = read_scene(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  cv::Mat image;
};

const Capture& capture() {
  static const Capture only;
  return only;
}

void detect(benchmark::State& state) {
  const LampDetector detector(lamp_map_of(capture().scene, true),
                              detector_camera(true_calibration(capture().scene)));
  std::size_t lamps = 0;
  for (auto _ : state) lamps = detector.detect(capture().image).size();
  state.counters["lamps"] = static_cast<double>(lamps);
}

void opencv_components(benchmark::State& state) {
  const double threshold = background_of(capture().image).threshold;
  cv::Mat binary, labels, statistics, centroids;
  for (auto _ : state) {
    cv::threshold(capture().image, binary, threshold, 255, cv::THRESH_BINARY);
    cv::connectedComponentsWithStats(binary, labels, statistics, centroids);
  }
}

BENCHMARK(detect)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencv_components)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vlp
