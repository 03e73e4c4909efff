// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Measures board detection and lens calibration.
#include <benchmark/benchmark.h>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "frontend/image_file.h"

namespace vlp {
namespace {

void detect(benchmark::State& state, const std::string& scene) {
  const std::string rig = VLP_SOURCE_DIR "/datasets/" + scene + "/rendered";
  const BoardDetector detector(read_board(rig + "/board.yaml"));
  const cv::Mat image = read_image(rig + "/sample-boards/0000.png");
  for (auto _ : state) benchmark::DoNotOptimize(detector.detect_board(image));
}
BENCHMARK_CAPTURE(detect, plain, "paper-rig")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(detect, kalibr, "paper-rig-faulty")->Unit(benchmark::kMillisecond);

/// OPENCV8 from this number of views with 0.05 px of noise.
void solve_lens(benchmark::State& state, bool kalibr) {
  const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
  Random random(1);
  const IntrinsicsInput input = views.input(static_cast<int>(state.range(0)), random, 0.05);
  for (auto _ : state) benchmark::DoNotOptimize(solve_intrinsics(input));
}
BENCHMARK_CAPTURE(solve_lens, plain, false)->Arg(36)->Arg(200)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(solve_lens, kalibr, true)->Arg(36)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vlp
