// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "geometry/angles.h"
#include "rig/board_layout.h"
#include "rig/yaml_parts.h"
#include "simulation/board_print.h"
#include "simulation/exposure.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

constexpr double kLargest = 1e12;
constexpr double kMaxDefocus_px = 20;
constexpr double kMaxSpot_px = 1e4;

Room read_room(YamlMap& map) {
  Room room;
  for (const auto& [key, axis] : {std::pair("x_m", 0), std::pair("y_m", 1), std::pair("z_m", 2)}) {
    const YamlValue value = map.get_required_column(key);
    const auto range = value.get_numbers(2);
    if (!(range[0] < range[1])) throw value.make_error("should be [least, most]");
    value.numbers_within(2, -200, 200, "m");
    room.min_m[axis] = range[0];
    room.max_m[axis] = range[1];
  }
  return room;
}

Camera read_scene_camera(YamlMap& map) {
  Camera camera = read_camera(map);
  for (const std::string key : {"row_time_s", "readout"}) map.get_required_column(key);
  for (int focal : {0, 1}) {
    map.get_required_column("intrinsics")
        .get_list()[std::size_t(focal)]
        .get_number_within(1, 1e6, "px");
  }
  const YamlValue imager = map.get_required_column("imager_px");
  for (const YamlValue& side : imager.get_list()) side.get_integer_within(8, 20000);
  constexpr double max_px = 64e6;
  if (double(camera.imager_px[0]) * camera.imager_px[1] > max_px) {
    throw imager.make_error("has more than 64 million pixels");
  }
  return camera;
}

Defocus read_defocus(YamlMap& map) {
  Defocus defocus{map.get_required_column("radius_px").get_number_within(0, kMaxDefocus_px, "px")};
  if (const auto tilt = map.get_optional("tilt_px")) {
    defocus.tilt_px =
        Eigen::Vector2d(tilt->numbers_within(2, -kMaxDefocus_px, kMaxDefocus_px, "px").data());
  }
  return defocus;
}

Eigen::Vector2d read_pivot(YamlMap& map) {
  return Eigen::Vector2d(
      map.get_required_column("at_px").numbers_within(2, -kMaxSpot_px, kMaxSpot_px, "px").data());
}

LensSmear read_smear(YamlMap& map) {
  return {read_pivot(map),
          map.get_required_column("radius_px").get_number_within(1, kMaxSpot_px, "px"),
          map.get_required_column("fraction").get_number_within(0, 1, "(of the light)"),
          map.get_required_column("sigma_px").get_number_within(0.3, 50, "px")};
}

Dust read_dust(YamlMap& map) {
  return {read_pivot(map),
          map.get_required_column("radius_px").get_number_within(1, kMaxSpot_px, "px"),
          map.get_required_column("depth").get_number_within(0, 1, "(of the light)")};
}

Optics read_optics(YamlMap& map) {
  return {map.get_required_column("blur_px").get_number_within(0, 20, "px"),
          map.get_required_column("vignetting_power").get_number_within(0, 20, ""),
          map.optional_map("defocus", read_defocus),
          map.get_optional_number("veil", 0, 1, "(of the light)").value_or(0),
          map.optional_maps("smears", read_smear),
          map.optional_maps("dust", read_dust)};
}

Bloom read_bloom(YamlMap& map) {
  return {map.get_required_column("fraction").get_number_within(0, 1, "(of the charge)"),
          map.get_required_column("sigma_px").get_number_within(0.3, 50, "px")};
}

Sensor read_sensor(YamlMap& map) {
  Sensor sensor;
  const YamlValue bits = map.get_required_column("bits");
  sensor.bits = bits.get_integer_within(8, 16);
  if (sensor.bits != 8 && sensor.bits != 16) throw bits.make_error("should be 8 or 16");
  sensor.gain_dn_per_e =
      map.get_required_column("gain_dn_per_e").get_number_within(1e-6, 1e4, "DN per electron");
  sensor.black_level_dn =
      map.get_required_column("black_level_dn").get_number_within(0, white_level_dn(sensor), "DN");
  sensor.full_well_e =
      map.get_required_column("full_well_e").get_number_within(1, 1e9, "electrons");
  sensor.read_noise_e =
      map.get_required_column("read_noise_e").get_number_within(0, 1e6, "electrons");
  sensor.shot_noise = map.get_required_column("shot_noise").get_boolean();
  sensor.bloom = map.optional_map("bloom", read_bloom);
  return sensor;
}

Sharpening read_sharpening(YamlMap& map) {
  return {map.get_required_column("amount").get_number_within(0, 10, "(of the detail)"),
          map.get_required_column("radius_px").get_number_within(0.3, 50, "px")};
}

Bayer read_bayer(YamlMap& map) {
  const std::string unit = "(of what green filters pass)";
  return {map.get_required_column("red_to_green_ratio").get_number_within(0.05, 2, unit),
          map.get_required_column("blue_to_green_ratio").get_number_within(0.05, 2, unit)};
}

ImageProcessing read_image_processing(YamlMap& map, const Sensor& sensor) {
  if (sensor.black_level_dn >= white_level_dn(sensor)) {
    throw map.make_error("needs levels between sensor.black_level_dn and white");
  }
  ImageProcessing picture;
  picture.gamma =
      map.get_required_column("gamma").get_number_within(0.1, 10, "(of the tone curve)");
  picture.sharpening = map.optional_map("sharpening", read_sharpening);
  if (const auto quality = map.get_optional("jpeg_quality")) {
    picture.jpeg_quality = quality->get_integer_within(1, 100);
    if (sensor.bits != 8) throw quality->make_error("JPEG has 8 bits: set sensor.bits to 8");
  }
  picture.bayer = map.optional_map("bayer", read_bayer);
  return picture;
}

Mount read_mount(YamlMap& map) {
  const double tilt =
      rad_from_deg(map.get_required_column("tilt_deg").get_number_within(0, 45, "degrees"));
  const double azimuth = rad_from_deg(
      map.get_required_column("tilt_azimuth_deg").get_number_within(-360, 360, "degrees"));
  const Eigen::Vector3d zenith_in_camera(std::sin(tilt) * std::cos(azimuth),
                                         std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
  return {
      level_from_zenith(zenith_in_camera),
      Eigen::Vector2d(map.get_required_column("lever_arm_m").numbers_within(2, -5, 5, "m").data())};
}

SceneBoard read_scene_board(YamlMap& map) {
  SceneBoard board;
  const YamlValue print = map.get_required_column("pattern");
  board.print = print.read_map([](YamlMap& keys) { return read_board(keys); });
  board.margin_m = map.get_required_column("margin_m").get_number_within(0, 2, "m");
  constexpr double micrometers = 1e6;  // unit of the bound in messages
  const double tenth_m =
      0.1 * compute_tag_pitch_m(board.print) * std::min(board.print.cols, board.print.rows);
  const double max_warp_m = std::round(micrometers * tenth_m) / micrometers;
  board.warp_m = Eigen::Vector2d(
      map.get_required_column("warp_m").numbers_within(2, -max_warp_m, max_warp_m, "m").data());
  board.white_e_per_s = read_electron_rate(map, "white_e_per_s");
  board.black_e_per_s = read_electron_rate(map, "black_e_per_s");
  board.surround_e_per_s = read_electron_rate(map, "surround_e_per_s");
  try {
    BoardPattern{board};
  } catch (const std::invalid_argument& failure) {
    throw print.make_error(failure.what());
  }
  return board;
}

ArchiveVariation read_archive_variation(YamlMap& map) {
  const auto fraction = [&](const char* key, double max_fraction) {
    return map.get_required_column(key).get_number_within(0, max_fraction, "");
  };
  return {map.get_required_column("sessions_per_camera").get_integer_within(1, 10'000),
          fraction("focal_fraction", 0.5),
          map.get_required_column("principal_point_px").get_number_within(0, 1e4, "px"),
          fraction("distortion_fraction", 0.5),
          rad_from_deg(map.get_required_column("tilt_deg").get_number_within(0, 20, "degrees")),
          map.get_required_column("lever_arm_m").get_number_within(0, 1, "m"),
          map.get_required_column("map_error_m").get_number_within(0, 1, "m"),
          fraction("fault_fraction", 1),
          fraction("damage_fraction", 1)};
}

}  // namespace

Eigen::Vector3d read_yaml_point(const YamlValue& value) {
  return Eigen::Vector3d(value.numbers_within(3, -200, 200, "m").data());
}

double read_electron_rate(YamlMap& map, const std::string& key) {
  return map.get_required_column(key).get_number_within(0, kLargest, "electrons per second");
}

std::pair<double, double> read_yaml_range(const YamlValue& value, double min, double max,
                                          std::string_view unit) {
  const auto range = value.numbers_within(2, min, max, unit);
  if (range[0] > range[1]) throw value.make_error("should be [least, most]");
  return {range[0], range[1]};
}

Scene read_scene(const std::filesystem::path& file) {
  YamlMap document = read_yaml(file, "vlp-scene/1");
  Scene scene;
  scene.seed = static_cast<std::uint64_t>(
      document.get_required_column("seed").get_integer_within(0, std::numeric_limits<int>::max()));
  const Room room = document.get_required_column("room").read_map(read_room);
  scene.camera = document.get_required_column("camera").read_map(read_scene_camera);
  scene.optics = document.get_required_column("optics").read_map(read_optics);
  scene.sensor = document.get_required_column("sensor").read_map(read_sensor);
  scene.picture = document.optional_map(
      "processing", [&](YamlMap& map) { return read_image_processing(map, scene.sensor); });
  scene.mount = document.get_required_column("mount").read_map(read_mount);
  scene.ambient_e_per_s = read_electron_rate(document, "ambient_e_per_s");
  if (const auto lamps = document.get_optional("lamps"))
    scene.lamps = read_scene_lamps(*lamps, room);
  if (const auto clutter = document.get_optional("clutter")) {
    scene.clutter =
        clutter->read_map([&](YamlMap& map) { return read_clutter(map, scene.lamps, room); });
  }
  scene.board = document.optional_map("board", read_scene_board);
  scene.archive = document.optional_map("archive", read_archive_variation);
  const YamlValue captures = document.get_required_column("captures");
  document.check_all_keys_read();
  std::set<std::string> folders;
  for (const YamlValue& item : captures.get_list()) {
    scene.sets.push_back(
        item.read_map([&](YamlMap& map) { return read_capture_set(map, scene, room); }));
    if (!folders.insert(scene.sets.back().folder).second) {
      throw item.make_error("folder '" + scene.sets.back().folder + "' occurs twice");
    }
  }
  if (scene.sets.empty()) throw captures.make_error("contains no captures");
  draw_random_scene_parts(scene);
  return scene;
}

}  // namespace vlp
