// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// board_trials [SCENE [SEEDS [VIEWS [PICTURE]]]]: compares lenses from rendered boards with the
/// truth, after the processing of cameras: tone curves, sharpening, JPEG, saturated white.
///
/// SCENE is a folder of datasets/ (default paper-rig). SEEDS is the number of seeds (default 3),
/// starting with the scene's. VIEWS is the number of views (0, the default: the scene's). PICTURE
/// selects the kinds of processing whose name contains it.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>

#include "calibration/intrinsics/projection_difference.h"
#include "captures/parallel_for.h"
#include "geometry/median.h"
#include "geometry/polygon.h"
#include "session/lens_step.h"
#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"
#include "support/observed_view.h"

namespace vlp {
namespace {

/// In-camera processing of the light of a board.
struct Development {
  std::string name;
  /// White level over the sensor's full scale; 0 for the scene's exposure.
  double white;
  std::optional<ImageProcessing> picture;
};

ImageProcessing curve(double gamma, std::optional<int> jpeg_quality = {},
                      std::optional<Sharpening> sharpening = {}) {
  ImageProcessing picture;
  picture.gamma = gamma;
  picture.jpeg_quality = jpeg_quality;
  picture.sharpening = sharpening;
  return picture;
}

std::vector<Development> developments() {
  const Sharpening sharp{1, 1};
  return {{"linear", 0, {}},
          {"JPEG 80", 0, curve(1, 80)},
          {"gamma 1.4", 0, curve(1.4)},
          {"gamma 1.4, JPEG 80", 0, curve(1.4, 80)},
          {"gamma 1.6", 0, curve(1.6)},
          {"gamma 1.6, JPEG 80", 0, curve(1.6, 80)},
          {"gamma 2.2, JPEG 90", 0, curve(2.2, 90)},
          {"gamma 2.4", 0, curve(2.4)},
          {"gamma 2.4, JPEG 80", 0, curve(2.4, 80)},
          {"sharpened, JPEG 80", 0, curve(1, 80, sharp)},
          {"gamma 2.2, sharpened, JPEG 90", 0, curve(2.2, 90, sharp)},
          {"gamma 2.4, sharpened, JPEG 80", 0, curve(2.4, 80, sharp)},
          {"1.5 times white", 1.5, {}},
          {"2 times white", 2, {}},
          {"3 times white", 3, {}},
          {"1.25 times white, gamma 1.8, JPEG 90", 1.25, curve(1.8, 90)},
          {"1.5 times white, gamma 2.2, JPEG 90", 1.5, curve(2.2, 90)},
          {"1.5 times white, gamma 2.4, JPEG 80", 1.5, curve(2.4, 80)},
          {"1.5 times white, sharpened, gamma 2.2, JPEG 80", 1.5, curve(2.2, 80, sharp)}};
}

/// JPEG has 8 bits: for sensors with more bits, white is the full well.
Sensor sensor_behind(const Sensor& sensor, const std::optional<ImageProcessing>& picture) {
  constexpr int bits = 8;
  constexpr double black_dn = 2, white_dn = 255;
  if (!picture || !picture->jpeg_quality || sensor.bits == bits) return sensor;
  Sensor coarse = sensor;
  coarse.bits = bits;
  coarse.black_level_dn = black_dn;
  coarse.gain_dn_per_e = (white_dn - black_dn) / sensor.full_well_e;
  return coarse;
}

cv::Mat developed(const Scene& scene, const cv::Mat1f& electrons, std::uint64_t seed,
                  const std::optional<ImageProcessing>& picture) {
  cv::Mat image = simulate_sensor_image(scene.sensor, electrons, seed, picture);
  if (scene.camera.readout == Readout::columns) image = image.t();  // lines are columns
  return cv::imdecode(encode_image(image, picture), cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
}

/// Difference over the pixels of a region, after rotating the lenses to the best agreement over the
/// image.
double worst_within(const ImageRegion& region, const Lens& truth, const Lens& lens,
                    const std::array<int, 2>& imager_px) {
  const auto pixels = make_pixel_grid(imager_px);
  const auto turned = fit_lens_rotation(truth, lens, pixels);
  double worst_px = 0;
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto ray = truth.unproject_pixel(pixel);
    if (!turned || !ray || !polygon_contains(region, pixel)) continue;
    const auto seen = lens.project_point(*turned * ray->direction);
    worst_px = std::max(worst_px, seen ? (*seen - pixel).norm() : INFINITY);
  }
  return worst_px;
}

void try_development(Scene scene, const CaptureSet& boards, const std::vector<cv::Mat1f>& electrons,
                     const BoardDetector& detector, const Development& development) {
  scene.sensor = sensor_behind(scene.sensor, development.picture);
  LensInput input;
  input.board = scene.board->pattern;
  input.camera = scene.camera;
  input.observations.images.resize(electrons.size());
  const auto threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const double holds_e = std::min(
      scene.sensor.full_well_e,
      (white_level_dn(scene.sensor) - scene.sensor.black_level_dn) / scene.sensor.gain_dn_per_e);
  const double white_e = scene.board->white_e_per_s * boards.exposure_s;
  const double exposures = development.white > 0 ? development.white * holds_e / white_e : 1;
  parallel_for(electrons.size(), threads, [&](std::size_t i) {
    const BoardShot shot = make_board_shot(scene, boards, i);
    cv::Mat1f lit;
    electrons[i].convertTo(lit, CV_32F, exposures);
    const cv::Mat image = developed(scene, lit, shot.noise_seed, development.picture);
    input.observations.images[i] =
        observed({shot.image, {image.cols, image.rows}, detector.detect_board(image)});
  });
  std::size_t tags = 0, usable = 0;
  for (const BoardView& view : collect_board_views(input.observations.images)) {
    usable += view.detection.tags.size();
    tags += view.detection.tags.size() + static_cast<std::size_t>(view.detection.num_unusable_tags);
  }
  const BoardLattice lattice(input.board);
  for (Observation& image : input.observations.images) {
    if (lattice.can_determine_pose(image.board->detection)) continue;
    image.reject(RejectionReason::too_few_corners, "shows too little of the board");
  }
  const LensResult result = run_lens_step(input, {});
  const std::string detected_percent =
      fmt::format("{:.1f}", 100 * static_cast<double>(usable) / static_cast<double>(tags));
  if (!result.has_succeeded()) {
    fmt::print("{:48} {:5} % of the tags: no lens\n", development.name, detected_percent);
    return;
  }
  const Camera& camera = scene.camera;
  const Lens truth(camera.lens_model, camera.intrinsics), lens = result.lens.solution.fitted_lens();
  const auto even = [](const Eigen::Vector2d&) { return 1; };
  const auto difference = compare_projections(truth, lens, camera.imager_px, even);
  fmt::print(
      "{:48} {:.4f} / {:.3f} px, in the region {:.3f}; {:.2f} x stated rms, worst stated {:.3f}, "
      "{:.3f} "
      "in the region; left {:.4f}, edges {:+.3f} px, gamma {:.2f}, {} % of {} tags\n",
      development.name, difference->mean_px, difference->worst_px,
      worst_within(result.lens.report.region, truth, lens, camera.imager_px),
      difference->rms_px / result.lens.report.expected_rms_px,
      std::max(result.lens.report.uncertainty_worst_px, result.lens.report.uncertainty_beyond_px),
      result.lens.report.uncertainty_worst_px, result.lens.solution.rms_px,
      upper_median(result.lens.solution.edge_displacements_px), result.lens.gamma, detected_percent,
      tags);
}

void try_seed(Scene scene, std::uint64_t seed, int views, const std::string& wanted) {
  scene.seed = seed;
  CaptureSet boards = *std::ranges::find(scene.sets, "boards", &CaptureSet::folder);
  if (views > 0) boards.board->count = views;
  const FrameRenderer renderer(scene);
  const BoardDetector detector(scene.board->pattern);
  std::vector<cv::Mat1f> electrons(count_shots(boards));
  parallel_for(electrons.size(), static_cast<int>(std::thread::hardware_concurrency()),
               [&](std::size_t i) {
                 electrons[i] = renderer.render_board(make_board_shot(scene, boards, i));
               });
  fmt::print("seed {}, {} views\n", seed, electrons.size());
  for (const Development& development : developments()) {
    if (development.name.find(wanted) == std::string::npos) continue;
    try_development(scene, boards, electrons, detector, development);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  constexpr int default_seeds = 3;
  const std::string name = argc > 1 ? argv[1] : "paper-rig";
  const int seeds = argc > 2 ? std::atoi(argv[2]) : default_seeds;
  const vlp::Scene scene = vlp::read_scene_file(VLP_SOURCE_DIR "/datasets/" + name + "/scene.yaml");
  for (int i = 0; i < seeds; ++i) {
    vlp::try_seed(scene, scene.seed + static_cast<std::uint64_t>(i),
                  argc > 3 ? std::atoi(argv[3]) : 0, argc > 4 ? argv[4] : "");
  }
}
