// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Measures the steps of a rendered capture on one core: light, sensor, PNG.
#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>

#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"

namespace vlp {
namespace {

struct Rig {
  Rig() { cv::setNumThreads(1); }
  const CaptureSet& set(const std::string& folder) const {
    return *std::find_if(scene.sets.begin(), scene.sets.end(),
                         [&](const CaptureSet& each) { return each.folder == folder; });
  }
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  FrameRenderer renderer{scene};
};

const Rig& rig() {
  static const Rig only;
  return only;
}

void lamp_light(benchmark::State& state) {
  const LampShot shot = make_lamp_shot(rig().scene, rig().set("check"), 100);
  for (auto _ : state) benchmark::DoNotOptimize(rig().renderer.render_lamps(shot));
}

void board_light(benchmark::State& state) {
  const BoardShot shot = make_board_shot(rig().scene, rig().set("boards"), 3);
  for (auto _ : state) benchmark::DoNotOptimize(rig().renderer.render_board(shot));
}

cv::Mat1f electrons(bool board) {
  return board ? rig().renderer.render_board(make_board_shot(rig().scene, rig().set("boards"), 3))
               : rig().renderer.render_lamps(make_lamp_shot(rig().scene, rig().set("check"), 100));
}

void sensor(benchmark::State& state, bool board) {
  const cv::Mat1f light = electrons(board);
  for (auto _ : state)
    benchmark::DoNotOptimize(simulate_sensor_image(rig().scene.sensor, light, 1));
}

void png(benchmark::State& state, bool board) {
  const cv::Mat image = simulate_sensor_image(rig().scene.sensor, electrons(board), 1);
  std::vector<unsigned char> bytes;
  for (auto _ : state) cv::imencode(".png", image, bytes);
}

BENCHMARK(lamp_light)->Unit(benchmark::kMillisecond);
BENCHMARK(board_light)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(sensor, lamps, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(sensor, board, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(png, lamps, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(png, board, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vlp
