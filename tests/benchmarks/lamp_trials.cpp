// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// lamp_trials KIND [IMAGES [SEED]]: renders images of lamps in memory, detects the lamps in them,
/// and compares with the truth. KIND is
///   recessed   scene datasets/recessed: sources deep in reflectors, viewed obliquely;
///   chips      scene datasets/paper-rig with seven random LED chips behind each lamp's diffuser,
///              drawn again in each image, and a halo of 12 % on the ceiling;
///   foreign    images of 400 x 300 with foreign lights, mirrors, blinds and signs, all drawn at
///              random in each image;
///   a scene    the path of a scene.yaml.
/// Scenes are rendered by their folders of lamps (except `sample`), one image of each alternately,
/// and then again with the next seed. IMAGES is 200. SEED is 1, or that of the scene.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <map>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>

#include "camera/lens.h"
#include "frontend/lights_table.h"
#include "frontend/mat_view.h"
#include "geometry/frames.h"
#include "lamps/light_detector.h"
#include "simulation/downlight.h"
#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"
#include "simulation/pixel_window.h"
#include "simulation/scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

/// The only call of the detector.
std::vector<Light> detect_lights(const LightDetector& detector, const cv::Mat& image) {
  return detector.detect_lights(to_image_view(image));
}

/// Returns the image of a shot as read from a file: gray, rows from the top.
cv::Mat render_image(const Scene& scene, const FrameRenderer& renderer, const LampShot& shot) {
  cv::Mat image = simulate_sensor_image(scene.sensor, renderer.render_lamps(shot), shot.noise_seed,
                                        scene.processing);
  if (scene.camera.readout == Readout::columns) image = image.t();
  if (!scene.processing) return image;
  return cv::imdecode(encode_image(image, scene.processing),
                      cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
}

/// Lamp in a shot.
struct Extent {
  double radius_px;  ///< largest distance of the rim or sides from the center
  double periods;    ///< periods of its stripes across the part that is bright
};

/// Points of a lamp's face that have at least 2 % of its maximum radiance. For an evenly lit lamp
/// they are on the contour, for a recessed one on the whole face.
std::vector<Eigen::Vector3d> bright_points(const Glow& lamp, const Eigen::Vector3d& eye_m) {
  constexpr double min_fraction = 0.02;
  constexpr int steps = 60;
  Glow rim = lamp;
  rim.halo.reset();
  if (!lamp.recess) return list_outline_points(rim);
  const double radius_m = lamp.glow_radius_m();
  std::vector<std::pair<double, Eigen::Vector3d>> fractions_at_points;
  double greatest = 0;
  for (int i = 0; i < steps * steps; ++i) {
    const Eigen::Vector2d at_m = radius_m * Eigen::Vector2d(2 * (i % steps + 0.5) / steps - 1,
                                                            2 * (i / steps + 0.5) / steps - 1);
    if (at_m.norm() > radius_m) continue;
    const double radiance_fraction =
        compute_relative_radiance(*lamp.recess, radius_m, eye_m - lamp.position_m, at_m);
    fractions_at_points.emplace_back(radiance_fraction,
                                     lamp.position_m + Eigen::Vector3d(at_m.x(), at_m.y(), 0));
    greatest = std::max(greatest, radiance_fraction);
  }
  std::vector<Eigen::Vector3d> points_m;
  for (const auto& [radiance_fraction, point_m] : fractions_at_points) {
    if (radiance_fraction >= min_fraction * greatest) points_m.push_back(point_m);
  }
  return points_m;
}

Extent compute_extent(const Scene& scene, const FrameRenderer& renderer, const LampShot& shot,
                      const SceneLamp& lamp, const Eigen::Vector2d& center) {
  const Eigen::Isometry3d camera_from_world = shot.motion.world_from_camera(0).inverse();
  const Lens& lens = renderer.pixel_rays().camera_lens();
  double radius_px = 0, first_line = INFINITY, last_line = -INFINITY;
  Glow rim = lamp.glow;
  rim.halo.reset();
  for (const Eigen::Vector3d& point_m : list_outline_points(rim)) {
    const auto pixel = lens.project_point(camera_from_world * point_m);
    if (pixel) radius_px = std::max(radius_px, (*pixel - center).norm());
  }
  const Eigen::Vector3d eye_m = shot.motion.world_from_camera(0).translation();
  for (const Eigen::Vector3d& point_m : bright_points(lamp.glow, eye_m)) {
    const auto pixel = lens.project_point(camera_from_world * point_m);
    if (!pixel) continue;
    const double line = renderer.pixel_rays().to_readout_order(*pixel)[0];
    first_line = std::min(first_line, line);
    last_line = std::max(last_line, line);
  }
  const double period_lines = 1 / (lamp.frequency_hz * *scene.camera.row_time_s);
  return {radius_px, (last_line - first_line) / period_lines};
}

/// Counts of lamps completely in view.
struct Tally {
  int lamps = 0, found = 0, missed = 0, wrong = 0;
};

/// Results of all processed images.
class Score {
 public:
  void add(const Scene& scene, const FrameRenderer& renderer, const LampShot& shot,
           const std::vector<Light>& lights) {
    ++images_;
    const auto truth = list_true_lamps(scene, renderer, shot);
    std::vector<Extent> extents;
    for (const TrueLamp& lamp : truth) {
      const auto in_scene = std::ranges::find(scene.lamps, lamp.id, &SceneLamp::id);
      extents.push_back(compute_extent(scene, renderer, shot, *in_scene, lamp.pixel));
    }
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (truth[i].visible_fraction == 1) add_lamp(truth[i], extents[i], lights);
    }
    for (const Light& light : lights) {
      if (light.kind != LightKind::lamp) continue;
      bool on_lamp = false;
      for (std::size_t i = 0; i < truth.size(); ++i) {
        on_lamp = on_lamp || (light.pixel - truth[i].pixel).norm() < extents[i].radius_px;
      }
      if (!on_lamp) ++false_lamps_[name_of_other(scene, renderer, shot, light.pixel)];
    }
  }

  void print(double seconds) const {
    const int lamps = tallies_[0].lamps + tallies_[1].lamps;
    fmt::print(
        "{} images in {:.1f} s of processor time, {:.1f} a second; {} lamps wholly in view\n",
        images_, seconds, images_ / seconds, lamps);
    for (std::size_t many = 0; many < 2; ++many) {
      const auto& [count, found, missed, wrong] = tallies_[many];
      fmt::print("  {} {} periods: {} lamps, {} found, {} missed, {} wrong identities\n",
                 many ? "at least" : "below", kPeriods, count, found, missed, wrong);
    }
    fmt::print("  lamps where none is:");
    if (false_lamps_.empty()) fmt::print(" none");
    for (const auto& [name, count] : false_lamps_) fmt::print(" {} {};", count, name);
    fmt::print("\n");
    print_centers();
    fmt::print("  reasons of the missed:");
    for (const auto& [reason, count] : reasons_) fmt::print(" {} {};", count, reason);
    fmt::print("\n");
  }

 private:
  static constexpr double kPeriods = 2.5;
  /// A gross error is larger than both.
  static constexpr double kMinGross_px = 1, kMinGrossSds = 3;

  void add_lamp(const TrueLamp& lamp, const Extent& extent, const std::vector<Light>& lights) {
    Tally& tally = tallies_[extent.periods >= kPeriods];
    ++tally.lamps;
    const Light* nearest = nullptr;
    bool is_wrong = false;
    for (const Light& light : lights) {
      const double distance_px = (light.pixel - lamp.pixel).norm();
      if (distance_px > extent.radius_px) continue;
      if (light.kind == LightKind::lamp) {
        if (*light.lamp == lamp.id) return add_found(distance_px, light.sigma_px, tally);
        is_wrong = true;
      }
      if (!nearest || distance_px < (nearest->pixel - lamp.pixel).norm()) nearest = &light;
    }
    ++(is_wrong ? tally.wrong : tally.missed);
    if (is_wrong) return;
    ++reasons_[nearest ? std::string(light_kind_name(nearest->kind)) + ": " +
                             std::string(light_reason_name(nearest->reason))
                       : "no light there"];
  }

  void add_found(double error_px, double sigma_px, Tally& tally) {
    ++tally.found;
    errors_px_.push_back(error_px);
    num_gross_ += error_px > std::max(kMinGross_px, kMinGrossSds * sigma_px) ? 1 : 0;
    chi_square_ += std::pow(error_px / sigma_px, 2) / 2;
  }

  static std::string name_of_other(const Scene& scene, const FrameRenderer& renderer,
                                   const LampShot& shot, const Eigen::Vector2d& pixel) {
    const double near_px = 0.08 * scene.camera.imager_px[0];
    std::string name = "elsewhere";
    double min_px = near_px;
    for (const TrueOtherLight& other : list_true_lights(scene, renderer, shot)) {
      const double distance_px = (other.pixel - pixel).norm();
      if (distance_px > min_px) continue;
      min_px = distance_px;
      name = "at " + other.kind;
    }
    return name;
  }

  void print_centers() const {
    if (errors_px_.empty()) return;
    auto sorted = errors_px_;
    std::ranges::sort(sorted);
    double squares = 0;
    for (const double error_px : sorted) squares += error_px * error_px;
    const auto count = static_cast<double>(sorted.size());
    fmt::print(
        "  centers: rms {:.3f}, median {:.3f}, worst {:.3f} px; chi-squared {:.2f}; {} gross\n",
        std::sqrt(squares / count), sorted[sorted.size() / 2], sorted.back(), chi_square_ / count,
        num_gross_);
  }

  int images_ = 0;
  std::array<Tally, 2> tallies_;  ///< below kPeriods, and others
  std::map<std::string, int> false_lamps_, reasons_;
  std::vector<double> errors_px_;
  double chi_square_ = 0;
  int num_gross_ = 0;
};

/// Detects the lamps of one image and adds them to the score.
void try_shot(const Scene& scene, const FrameRenderer& renderer, const LightDetector& detector,
              const LampShot& shot, Score& score) {
  const cv::Mat image = render_image(scene, renderer, shot);
  if (shot.motion.is_base_level()) {
    return score.add(scene, renderer, shot, detect_lights(detector, image));
  }
  const Eigen::Matrix3d level_from_camera =
      level_rotation_from_inclination(shot.motion.inclination_at(0)) *
      scene.mount.level_from_camera;
  score.add(scene, renderer, shot, detect_lights(detector.copy_for_tilt(level_from_camera), image));
}

LightDetector make_detector_for_image(const Scene& scene) {
  return {make_lamp_map(scene, false), make_detector_camera(make_true_calibration(scene))};
}

/// Images of a scene's folders of lamps. The seed of each round also changes the chips.
void try_scene(Scene scene, std::uint64_t seed, int images, bool new_seed_in_each, Score& score) {
  std::vector<CaptureSet> sets;
  for (const CaptureSet& set : scene.sets) {
    if (set.lamps && set.folder != "sample") sets.push_back(set);
  }
  if (sets.empty()) throw std::invalid_argument("the scene has no captures of lamps");
  const FrameRenderer renderer(scene);
  const LightDetector detector = make_detector_for_image(scene);
  for (int i = 0; i < images; ++i) {
    const auto index = static_cast<std::size_t>(i) / sets.size();
    const CaptureSet& set = sets[static_cast<std::size_t>(i) % sets.size()];
    const auto round = new_seed_in_each ? static_cast<std::size_t>(i) : index / count_shots(set);
    scene.seed = seed + round;
    draw_random_parts(scene);
    // Spread over the whole folder, even for few images.
    const auto wanted = static_cast<std::size_t>(images) / sets.size() + 1;
    const std::size_t step = std::max<std::size_t>(1, count_shots(set) / wanted);
    try_shot(scene, renderer, detector, make_lamp_shot(scene, set, index * step % count_shots(set)),
             score);
  }
}

Scene chips_scene() {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  for (SceneLamp& lamp : scene.lamps) {
    lamp.glow.rim_to_center_ratio = 1;
    lamp.glow.random_chips = RandomChips{7, 0.12, 0.75, 0.3, 0.8};
    lamp.glow.halo = Halo{0.12, 0.03};
  }
  return scene;
}

/// Rig like paper-rig with half the resolution, eight lamps, and foreign lights drawn at random for
/// each image.
class ForeignScene {
 public:
  explicit ForeignScene(std::uint64_t seed) : seed_(seed) {
    scene_ = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
    scene_.board.reset();
    Camera& camera = scene_.camera;
    camera.imager_px = {400, 300};
    for (std::size_t i = 0; i < 4; ++i) camera.intrinsics[i] /= 2;
    camera.row_time_s = 6e-5;
    scene_.lamps.clear();
    constexpr std::array frequencies_hz = {1100, 1400, 1800, 2300, 2900, 3500, 4100, 4700};
    for (int i = 0; i < 8; ++i) {
      Glow glow{{-0.75 + 0.5 * (i % 4), i < 4 ? -0.3 : 0.3, kCeilingM},
                make_disc_lamp_shape(0.18),
                2e8,
                0.9};
      scene_.lamps.push_back(
          {i + 1, glow, double(frequencies_hz[std::size_t(i)]), 0.5, {}, Eigen::Vector3d::Zero()});
    }
    set_ = scene_.sets.at(0);
    set_.exposure_s = 5e-5;
    set_.lamps = LampShots{};
    set_.lamps->yaw_jitter_rad = set_.lamps->turn_rate_rad_per_s = 0;
    set_.lamps->repeat = 1;
    set_.lamps->interval_s = 1;
  }

  /// Sets a different duty cycle for each lamp, also in the lamp map.
  void draw_duties(int index) {
    cv::RNG random = make_generator(seed_, "duties", static_cast<std::size_t>(index));
    for (SceneLamp& lamp : scene_.lamps) lamp.duty = random.uniform(0.3, 0.7);
  }

  LampShot draw_shot(int index) {
    random_ = make_generator(seed_, "foreign lights", static_cast<std::size_t>(index));
    set_.lamps->pivots_m = {{random_.uniform(-0.7, 0.7), random_.uniform(-0.3, 0.3)}};
    set_.lamps->heights_m = {random_.uniform(0.0, 0.7)};
    set_.lamps->yaws_rad = {random_.uniform(0.0, 2 * std::numbers::pi)};
    scene_.seed = draw_seed(random_);
    draw_clutter();
    draw_random_parts(scene_);
    return make_lamp_shot(scene_, set_, 0);
  }

  const Scene& scene() const { return scene_; }

 private:
  static constexpr double kCeilingM = 1.6;

  struct Circle {
    Eigen::Vector2d center_m;
    double radius_m;
  };

  /// Returns a free position on the ceiling.
  std::optional<Eigen::Vector2d> draw_place(double radius_m) {
    constexpr int tries = 40;
    constexpr double gap_m = 0.02;
    for (int i = 0; i < tries; ++i) {
      const Eigen::Vector2d place_m(random_.uniform(-1.1, 1.1), random_.uniform(-0.8, 0.8));
      const bool is_free = std::ranges::all_of(occupied_, [&](const Circle& circle) {
        return (circle.center_m - place_m).norm() > circle.radius_m + radius_m + gap_m;
      });
      if (!is_free) continue;
      occupied_.push_back({place_m, radius_m});
      return place_m;
    }
    return std::nullopt;
  }

  bool draw_chance(double probability) { return random_.uniform(0.0, 1.0) < probability; }
  double draw_log(double min, double max) {
    return std::exp(random_.uniform(std::log(min), std::log(max)));
  }

  /// Returns a frequency at least 4 % from those of the lamps.
  double draw_pwm_frequency_hz() {
    constexpr double apart = 0.04;
    while (true) {
      const double frequency_hz = draw_log(200, 6000);
      const bool is_apart = std::ranges::all_of(scene_.lamps, [&](const SceneLamp& lamp) {
        return std::abs(std::log(frequency_hz / lamp.frequency_hz)) > apart;
      });
      if (is_apart) return frequency_hz;
    }
  }

  void draw_foreign_light() {
    Glow glow{{0, 0, kCeilingM}, {}, draw_log(4e7, 4e8), random_.uniform(0.4, 1.0)};
    const double length_m = random_.uniform(0.08, 0.35);
    if (draw_chance(0.5)) {
      glow.shape = make_disc_lamp_shape(length_m);
    } else {
      const double width_m = length_m * random_.uniform(0.15, 1.0);
      glow.shape = {ShapeKind::rectangle, Eigen::Vector2d(length_m, width_m),
                    random_.uniform(0.0, std::numbers::pi)};
    }
    const auto place_m = draw_place(0.7 * length_m);
    if (!place_m) return;
    glow.position_m.head<2>() = *place_m;
    ForeignLight light{glow, {}, {}};
    if (draw_chance(0.6)) {
      light.wave = SquareWave{draw_pwm_frequency_hz(), random_.uniform(0.1, 0.9), 0};
    } else {
      light.wave = RectifiedSine{draw_chance(0.5) ? 100.0 : 120.0, random_.uniform(0.1, 1.0), 0};
    }
    scene_.clutter.foreign_lights.push_back(light);
  }

  std::optional<Panel> draw_panel() {
    const double width_m = random_.uniform(0.15, 0.4),
                 height_m = width_m * random_.uniform(0.4, 1.);
    const auto place_m = draw_place(std::hypot(width_m, height_m) / 2);
    if (!place_m) return std::nullopt;
    const Eigen::Rotation2Dd turn(random_.uniform(0.0, 2 * std::numbers::pi));
    const Eigen::Vector2d a_m = turn * Eigen::Vector2d(width_m, 0);
    const Eigen::Vector2d b_m = turn * Eigen::Vector2d(0, height_m);
    const Eigen::Vector2d corner_m = *place_m - (a_m + b_m) / 2;
    return Panel{{corner_m.x(), corner_m.y(), kCeilingM},
                 {a_m.x(), a_m.y(), 0},
                 {b_m.x(), b_m.y(), 0},
                 draw_log(3e7, 3e8)};
  }

  /// Adds a glass wall along one side of the room.
  void draw_mirror() {
    const double side = draw_chance(0.5) ? 1 : -1;
    const double begin = random_.uniform(-1.0, 0.2), length = random_.uniform(0.4, 1.5);
    Panel pane{};
    if (draw_chance(0.5)) {
      pane = {{begin, 0.6 * side, 0.2}, {length, 0, 0}, {0, 0, kCeilingM - 0.2}, 0};
    } else {
      pane = {{1.05 * side, begin, 0.2}, {0, length, 0}, {0, 0, kCeilingM - 0.2}, 0};
    }
    scene_.clutter.mirrors.push_back({pane, draw_log(0.04, 0.8)});
  }

  void draw_clutter() {
    Clutter& clutter = scene_.clutter = {};
    occupied_.clear();
    for (const SceneLamp& lamp : scene_.lamps) {
      occupied_.push_back({lamp.glow.position_m.head<2>(), lamp.glow.glow_radius_m()});
    }
    const int lights = random_.uniform(1, 5);
    for (int i = 0; i < lights; ++i) draw_foreign_light();
    if (draw_chance(0.5)) {
      if (const auto place_m = draw_place(0.1)) {
        clutter.steady_lamps.push_back({{place_m->x(), place_m->y(), kCeilingM},
                                        make_disc_lamp_shape(0.2),
                                        draw_log(5e7, 4e8),
                                        0.8});
      }
    }
    if (draw_chance(0.3)) {
      if (const auto panel = draw_panel()) clutter.windows.push_back(*panel);
    }
    if (draw_chance(0.5)) {
      const int slats = random_.uniform(3, 16);
      const double open_fraction = random_.uniform(0.3, 0.7);
      if (const auto panel = draw_panel()) clutter.blinds.push_back({*panel, slats, open_fraction});
    }
    if (draw_chance(0.5)) {
      const int lines = random_.uniform(1, 4), letters = random_.uniform(3, 9);
      if (const auto panel = draw_panel()) clutter.signs.push_back({*panel, lines, letters, {}});
    }
    if (draw_chance(0.5)) draw_mirror();
    scene_.ambient_e_per_s = draw_log(3e5, 3e7);
    if (draw_chance(0.5)) {
      clutter.ambient_flicker =
          RectifiedSine{draw_chance(0.5) ? 100.0 : 120.0, random_.uniform(0.1, 0.9), 0};
    }
  }

  std::uint64_t seed_;
  Scene scene_;
  CaptureSet set_;
  cv::RNG random_;
  std::vector<Circle> occupied_;
};

void try_foreign(std::uint64_t seed, int images, Score& score) {
  constexpr int images_of_a_rig = 100;
  ForeignScene foreign(seed);
  const FrameRenderer renderer(foreign.scene());
  std::optional<LightDetector> detector;
  for (int i = 0; i < images; ++i) {
    if (i % images_of_a_rig == 0) {
      foreign.draw_duties(i);
      detector.emplace(make_detector_for_image(foreign.scene()));
    }
    const LampShot shot = foreign.draw_shot(i);
    try_shot(foreign.scene(), renderer, *detector, shot, score);
  }
}

void run(const std::string& kind, int images, std::optional<std::uint64_t> seed) {
  cv::setNumThreads(1);
  Score score;
  const std::clock_t begin = std::clock();
  if (kind == "foreign") {
    try_foreign(seed.value_or(1), images, score);
  } else if (kind == "chips") {
    try_scene(chips_scene(), seed.value_or(1), images, true, score);
  } else {
    const Scene scene =
        read_scene_file(kind == "recessed" ? VLP_SOURCE_DIR "/datasets/recessed/scene.yaml" : kind);
    try_scene(scene, seed.value_or(scene.seed), images, false, score);
  }
  score.print(double(std::clock() - begin) / CLOCKS_PER_SEC);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    fmt::print(stderr, "lamp_trials recessed|chips|foreign|SCENE [IMAGES [SEED]]\n");
    return 2;
  }
  try {
    std::optional<std::uint64_t> seed;
    if (argc > 3) seed = std::strtoull(argv[3], nullptr, 10);
    vlp::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 200, seed);
  } catch (const std::exception& error) {
    fmt::print(stderr, "lamp_trials: {}\n", error.what());
    return 2;
  }
}
