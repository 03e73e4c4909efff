// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "geometry/angles.h"
#include "rig/board_layout.h"
#include "rig/yaml_parts.h"
#include "simulation/board_print.h"
#include "simulation/exposure.h"
#include "simulation/scene_parts.h"

namespace vlp {

static constexpr Range kLightFraction{0, 1, "(of the light)"};
static constexpr Range kDefocus{-20, 20, "px"}, kRadius{0, 20, "px"}, kSigma{0.3, 50, "px"};
static constexpr Range kSpotPosition{-1e4, 1e4, "px"}, kSpotRadius{1, 1e4, "px"};

static void describe(YamlMap& io, Room& room) {
  constexpr const char* keys[] = {"x_m", "y_m", "z_m"};
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector2d range_m;
    io.required(keys[axis], range_m, kPosition)
        .check(range_m[0] < range_m[1], "should be [least, most]");
    room.min_m[axis] = range_m[0];
    room.max_m[axis] = range_m[1];
  }
}

static void describe_scene_camera(YamlMap& io, Camera& camera) {
  describe(io, camera);
  for (const char* key : {"row_time_s", "readout"}) io.require(key);
  const YamlField intrinsics(io.require("intrinsics"));
  for (const std::size_t focal : {0U, 1U}) intrinsics.item(focal).check_range({1, 1e6, "px"});
  std::vector<int> imager_px;
  constexpr double max_px = 64e6;
  io.required("imager_px", imager_px, Range{8, 20000})
      .check(double(camera.imager_px[0]) * camera.imager_px[1] <= max_px,
             "has more than 64 million pixels");
}

static void describe(YamlMap& io, Defocus& defocus) {
  io.required("radius_px", defocus.radius_px, kRadius);
  io.optional("tilt_px", defocus.tilt_px, kDefocus);
}

static void describe(YamlMap& io, LensSmear& smear) {
  io.required("at_px", smear.at_px, kSpotPosition);
  io.required("radius_px", smear.radius_px, kSpotRadius);
  io.required("fraction", smear.fraction, kLightFraction);
  io.required("sigma_px", smear.sigma_px, kSigma);
}

static void describe(YamlMap& io, Dust& dust) {
  io.required("at_px", dust.at_px, kSpotPosition);
  io.required("radius_px", dust.radius_px, kSpotRadius);
  io.required("depth", dust.depth, kLightFraction);
}

static void describe(YamlMap& io, Optics& optics) {
  io.required("blur_px", optics.blur_px, kRadius);
  io.required("vignetting_power", optics.vignetting_power, Range{0, 20});
  io.optional("defocus", optics.defocus);
  io.optional("veil", optics.veiling_glare, kLightFraction);
  io.optional("smears", optics.smears);
  io.optional("dust", optics.dust);
}

static void describe(YamlMap& io, Bloom& bloom) {
  io.required("fraction", bloom.fraction, Range{0, 1, "(of the charge)"});
  io.required("sigma_px", bloom.sigma_px, kSigma);
}

static void describe(YamlMap& io, Sensor& sensor) {
  io.required("bits", sensor.bits, Range{8, 16})
      .check(sensor.bits == 8 || sensor.bits == 16, "should be 8 or 16");
  io.required("gain_dn_per_e", sensor.gain_dn_per_e, Range{1e-6, 1e4, "DN per electron"});
  io.required("black_level_dn", sensor.black_level_dn, Range{0, white_level_dn(sensor), "DN"});
  io.required("full_well_e", sensor.full_well_e, Range{1, 1e9, "electrons"});
  io.required("read_noise_e", sensor.read_noise_e, Range{0, 1e6, "electrons"});
  io.required("shot_noise", sensor.shot_noise);
  io.optional("bloom", sensor.bloom);
}

static void describe(YamlMap& io, Sharpening& sharpening) {
  io.required("amount", sharpening.amount, Range{0, 10, "(of the detail)"});
  io.required("radius_px", sharpening.radius_px, kSigma);
}

static void describe(YamlMap& io, Bayer& bayer) {
  constexpr Range ratio{0.05, 2, "(of what green filters pass)"};
  io.required("red_to_green_ratio", bayer.red_to_green_ratio, ratio);
  io.required("blue_to_green_ratio", bayer.blue_to_green_ratio, ratio);
}

static void describe(YamlMap& io, ImageProcessing& processing, const Sensor& sensor) {
  io.check(sensor.black_level_dn < white_level_dn(sensor),
           "needs levels between sensor.black_level_dn and white");
  io.required("gamma", processing.gamma, Range{0.1, 10, "(of the tone curve)"});
  io.optional("sharpening", processing.sharpening);
  io.optional("jpeg_quality", processing.jpeg_quality, Range{1, 100})
      .check(sensor.bits == 8, "JPEG has 8 bits: set sensor.bits to 8");
  io.optional("bayer", processing.bayer);
}

static void describe(YamlMap& io, Mount& mount) {
  double tilt_rad = 0, azimuth_rad = 0;
  io.required("tilt_deg", tilt_rad, DegreeRange{0, 45});
  io.required("tilt_azimuth_deg", azimuth_rad, kAzimuth);
  io.required("lever_arm_m", mount.lever_arm_m, Range{-5, 5, "m"});
  mount.level_from_camera =
      level_rotation_from_zenith({std::sin(tilt_rad) * std::cos(azimuth_rad),
                                  std::sin(tilt_rad) * std::sin(azimuth_rad), std::cos(tilt_rad)});
}

static void describe(YamlMap& io, SceneBoard& board) {
  const YamlField pattern = io.required("pattern", board.pattern);
  io.required("margin_m", board.margin_m, Range{0, 2, "m"});
  constexpr double micrometers = 1e6;  // unit of the bound in messages
  const double tenth_m =
      0.1 * compute_tag_pitch_m(board.pattern) * std::min(board.pattern.cols, board.pattern.rows);
  const double max_warp_m = std::round(micrometers * tenth_m) / micrometers;
  io.required("warp_m", board.warp_m, Range{-max_warp_m, max_warp_m, "m"});
  io.required("white_e_per_s", board.white_e_per_s, kElectronRate);
  io.required("black_e_per_s", board.black_e_per_s, kElectronRate);
  io.required("surround_e_per_s", board.surround_e_per_s, kElectronRate);
  try {
    BoardPattern{board};
  } catch (const std::invalid_argument& failure) {
    pattern.check(false, failure.what());
  }
}

static void describe(YamlMap& io, ArchiveVariation& archive) {
  io.required("sessions_per_camera", archive.sessions_per_camera, Range{1, 10'000});
  io.required("focal_fraction", archive.focal_fraction, Range{0, 0.5});
  io.required("principal_point_px", archive.principal_point_px, Range{0, 1e4, "px"});
  io.required("distortion_fraction", archive.distortion_fraction, Range{0, 0.5});
  io.required("tilt_deg", archive.tilt_rad, DegreeRange{0, 20});
  io.required("lever_arm_m", archive.lever_arm_m, Range{0, 1, "m"});
  io.required("map_error_m", archive.map_error_m, Range{0, 1, "m"});
  io.required("fault_fraction", archive.fault_fraction, Range{0, 1});
  io.required("damage_fraction", archive.damage_fraction, Range{0, 1});
}

static void describe(YamlMap& io, Scene& scene) {
  int seed = 0;
  io.required("seed", seed);
  scene.seed = static_cast<std::uint64_t>(seed);
  Room room;
  io.required("room", room);
  io.required("camera", scene.camera, describe_scene_camera);
  io.required("optics", scene.optics);
  io.required("sensor", scene.sensor);
  io.optional("processing", scene.processing, scene.sensor);
  io.required("mount", scene.mount);
  io.required("ambient_e_per_s", scene.ambient_e_per_s, kElectronRate);
  describe_scene_lamps(io, scene.lamps, room);
  io.optional("clutter", scene.clutter, scene.lamps, room);
  io.optional("board", scene.board);
  io.optional("archive", scene.archive);
  std::set<std::string> folders;
  const auto read_set = [&](YamlMap& map, CaptureSet& set) {
    describe(map, set, scene, room);
    map.check(folders.insert(set.folder).second, "folder '" + set.folder + "' occurs twice");
  };
  io.required("captures", scene.sets, read_set).check(!scene.sets.empty(), "contains no captures");
}

Scene read_scene_file(const std::filesystem::path& file) {
  auto scene = read_yaml_document<Scene>(file, "vlp-scene/1");
  draw_random_parts(scene);
  return scene;
}

}  // namespace vlp
