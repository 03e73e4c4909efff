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
    const YamlValue value = map.get_required_yaml_value(key);
    const auto range = value.read_yaml_numbers(2);
    if (!(range[0] < range[1])) throw value.make_yaml_error("should be [least, most]");
    value.read_yaml_numbers_within(2, -200, 200, "m");
    room.min_m[axis] = range[0];
    room.max_m[axis] = range[1];
  }
  return room;
}

Camera read_scene_camera(YamlMap& map) {
  Camera camera = read_camera_from_yaml(map);
  for (const std::string key : {"row_time_s", "readout"}) map.get_required_yaml_value(key);
  for (int focal : {0, 1}) {
    map.get_required_yaml_value("intrinsics")
        .read_yaml_list()[std::size_t(focal)]
        .read_yaml_number_within(1, 1e6, "px");
  }
  const YamlValue imager = map.get_required_yaml_value("imager_px");
  for (const YamlValue& side : imager.read_yaml_list()) side.read_yaml_integer_within(8, 20000);
  constexpr double max_px = 64e6;
  if (double(camera.imager_px[0]) * camera.imager_px[1] > max_px) {
    throw imager.make_yaml_error("has more than 64 million pixels");
  }
  return camera;
}

Defocus read_defocus(YamlMap& map) {
  Defocus defocus{
      map.get_required_yaml_value("radius_px").read_yaml_number_within(0, kMaxDefocus_px, "px")};
  if (const auto tilt = map.get_optional_yaml_value("tilt_px")) {
    defocus.tilt_px = Eigen::Vector2d(
        tilt->read_yaml_numbers_within(2, -kMaxDefocus_px, kMaxDefocus_px, "px").data());
  }
  return defocus;
}

Eigen::Vector2d read_pivot(YamlMap& map) {
  return Eigen::Vector2d(map.get_required_yaml_value("at_px")
                             .read_yaml_numbers_within(2, -kMaxSpot_px, kMaxSpot_px, "px")
                             .data());
}

LensSmear read_smear(YamlMap& map) {
  return {read_pivot(map),
          map.get_required_yaml_value("radius_px").read_yaml_number_within(1, kMaxSpot_px, "px"),
          map.get_required_yaml_value("fraction").read_yaml_number_within(0, 1, "(of the light)"),
          map.get_required_yaml_value("sigma_px").read_yaml_number_within(0.3, 50, "px")};
}

Dust read_dust(YamlMap& map) {
  return {read_pivot(map),
          map.get_required_yaml_value("radius_px").read_yaml_number_within(1, kMaxSpot_px, "px"),
          map.get_required_yaml_value("depth").read_yaml_number_within(0, 1, "(of the light)")};
}

Optics read_optics(YamlMap& map) {
  return {map.get_required_yaml_value("blur_px").read_yaml_number_within(0, 20, "px"),
          map.get_required_yaml_value("vignetting_power").read_yaml_number_within(0, 20, ""),
          map.convert_optional_yaml_mapping("defocus", read_defocus),
          map.get_optional_yaml_number("veil", 0, 1, "(of the light)").value_or(0),
          map.convert_yaml_mapping_list_or_empty("smears", read_smear),
          map.convert_yaml_mapping_list_or_empty("dust", read_dust)};
}

Bloom read_bloom(YamlMap& map) {
  return {map.get_required_yaml_value("fraction").read_yaml_number_within(0, 1, "(of the charge)"),
          map.get_required_yaml_value("sigma_px").read_yaml_number_within(0.3, 50, "px")};
}

Sensor read_sensor(YamlMap& map) {
  Sensor sensor;
  const YamlValue bits = map.get_required_yaml_value("bits");
  sensor.bits = bits.read_yaml_integer_within(8, 16);
  if (sensor.bits != 8 && sensor.bits != 16) throw bits.make_yaml_error("should be 8 or 16");
  sensor.gain_dn_per_e = map.get_required_yaml_value("gain_dn_per_e")
                             .read_yaml_number_within(1e-6, 1e4, "DN per electron");
  sensor.black_level_dn = map.get_required_yaml_value("black_level_dn")
                              .read_yaml_number_within(0, sensor_white_level_dn(sensor), "DN");
  sensor.full_well_e =
      map.get_required_yaml_value("full_well_e").read_yaml_number_within(1, 1e9, "electrons");
  sensor.read_noise_e =
      map.get_required_yaml_value("read_noise_e").read_yaml_number_within(0, 1e6, "electrons");
  sensor.shot_noise = map.get_required_yaml_value("shot_noise").read_yaml_boolean();
  sensor.bloom = map.convert_optional_yaml_mapping("bloom", read_bloom);
  return sensor;
}

Sharpening read_sharpening(YamlMap& map) {
  return {map.get_required_yaml_value("amount").read_yaml_number_within(0, 10, "(of the detail)"),
          map.get_required_yaml_value("radius_px").read_yaml_number_within(0.3, 50, "px")};
}

Bayer read_bayer(YamlMap& map) {
  const std::string unit = "(of what green filters pass)";
  return {
      map.get_required_yaml_value("red_to_green_ratio").read_yaml_number_within(0.05, 2, unit),
      map.get_required_yaml_value("blue_to_green_ratio").read_yaml_number_within(0.05, 2, unit)};
}

ImageProcessing read_image_processing(YamlMap& map, const Sensor& sensor) {
  if (sensor.black_level_dn >= sensor_white_level_dn(sensor)) {
    throw map.make_yaml_error("needs levels between sensor.black_level_dn and white");
  }
  ImageProcessing picture;
  picture.gamma =
      map.get_required_yaml_value("gamma").read_yaml_number_within(0.1, 10, "(of the tone curve)");
  picture.sharpening = map.convert_optional_yaml_mapping("sharpening", read_sharpening);
  if (const auto quality = map.get_optional_yaml_value("jpeg_quality")) {
    picture.jpeg_quality = quality->read_yaml_integer_within(1, 100);
    if (sensor.bits != 8) throw quality->make_yaml_error("JPEG has 8 bits: set sensor.bits to 8");
  }
  picture.bayer = map.convert_optional_yaml_mapping("bayer", read_bayer);
  return picture;
}

Mount read_mount(YamlMap& map) {
  const double tilt = rad_from_deg(
      map.get_required_yaml_value("tilt_deg").read_yaml_number_within(0, 45, "degrees"));
  const double azimuth = rad_from_deg(map.get_required_yaml_value("tilt_azimuth_deg")
                                          .read_yaml_number_within(-360, 360, "degrees"));
  const Eigen::Vector3d zenith_in_camera(std::sin(tilt) * std::cos(azimuth),
                                         std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
  return {level_rotation_from_zenith(zenith_in_camera),
          Eigen::Vector2d(map.get_required_yaml_value("lever_arm_m")
                              .read_yaml_numbers_within(2, -5, 5, "m")
                              .data())};
}

SceneBoard read_scene_board(YamlMap& map) {
  SceneBoard board;
  const YamlValue print = map.get_required_yaml_value("pattern");
  board.pattern =
      print.convert_yaml_mapping([](YamlMap& keys) { return read_board_from_yaml(keys); });
  board.margin_m = map.get_required_yaml_value("margin_m").read_yaml_number_within(0, 2, "m");
  constexpr double micrometers = 1e6;  // unit of the bound in messages
  const double tenth_m =
      0.1 * compute_tag_pitch_m(board.pattern) * std::min(board.pattern.cols, board.pattern.rows);
  const double max_warp_m = std::round(micrometers * tenth_m) / micrometers;
  board.warp_m = Eigen::Vector2d(map.get_required_yaml_value("warp_m")
                                     .read_yaml_numbers_within(2, -max_warp_m, max_warp_m, "m")
                                     .data());
  board.white_e_per_s = read_yaml_electron_rate(map, "white_e_per_s");
  board.black_e_per_s = read_yaml_electron_rate(map, "black_e_per_s");
  board.surround_e_per_s = read_yaml_electron_rate(map, "surround_e_per_s");
  try {
    BoardPattern{board};
  } catch (const std::invalid_argument& failure) {
    throw print.make_yaml_error(failure.what());
  }
  return board;
}

ArchiveVariation read_archive_variation(YamlMap& map) {
  const auto fraction = [&](const char* key, double max_fraction) {
    return map.get_required_yaml_value(key).read_yaml_number_within(0, max_fraction, "");
  };
  return {map.get_required_yaml_value("sessions_per_camera").read_yaml_integer_within(1, 10'000),
          fraction("focal_fraction", 0.5),
          map.get_required_yaml_value("principal_point_px").read_yaml_number_within(0, 1e4, "px"),
          fraction("distortion_fraction", 0.5),
          rad_from_deg(
              map.get_required_yaml_value("tilt_deg").read_yaml_number_within(0, 20, "degrees")),
          map.get_required_yaml_value("lever_arm_m").read_yaml_number_within(0, 1, "m"),
          map.get_required_yaml_value("map_error_m").read_yaml_number_within(0, 1, "m"),
          fraction("fault_fraction", 1),
          fraction("damage_fraction", 1)};
}

}  // namespace

Eigen::Vector3d read_yaml_point(const YamlValue& value) {
  return Eigen::Vector3d(value.read_yaml_numbers_within(3, -200, 200, "m").data());
}

double read_yaml_electron_rate(YamlMap& map, const std::string& key) {
  return map.get_required_yaml_value(key).read_yaml_number_within(0, kLargest,
                                                                  "electrons per second");
}

std::pair<double, double> read_yaml_range(const YamlValue& value, double min, double max,
                                          std::string_view unit) {
  const auto range = value.read_yaml_numbers_within(2, min, max, unit);
  if (range[0] > range[1]) throw value.make_yaml_error("should be [least, most]");
  return {range[0], range[1]};
}

Scene read_scene_file(const std::filesystem::path& file) {
  YamlMap document = read_yaml_file(file, "vlp-scene/1");
  Scene scene;
  scene.seed =
      static_cast<std::uint64_t>(document.get_required_yaml_value("seed").read_yaml_integer_within(
          0, std::numeric_limits<int>::max()));
  const Room room = document.get_required_yaml_value("room").convert_yaml_mapping(read_room);
  scene.camera = document.get_required_yaml_value("camera").convert_yaml_mapping(read_scene_camera);
  scene.optics = document.get_required_yaml_value("optics").convert_yaml_mapping(read_optics);
  scene.sensor = document.get_required_yaml_value("sensor").convert_yaml_mapping(read_sensor);
  scene.processing = document.convert_optional_yaml_mapping(
      "processing", [&](YamlMap& map) { return read_image_processing(map, scene.sensor); });
  scene.mount = document.get_required_yaml_value("mount").convert_yaml_mapping(read_mount);
  scene.ambient_e_per_s = read_yaml_electron_rate(document, "ambient_e_per_s");
  if (const auto lamps = document.get_optional_yaml_value("lamps"))
    scene.lamps = read_scene_lamps(*lamps, room);
  if (const auto clutter = document.get_optional_yaml_value("clutter")) {
    scene.clutter = clutter->convert_yaml_mapping(
        [&](YamlMap& map) { return read_scene_clutter(map, scene.lamps, room); });
  }
  scene.board = document.convert_optional_yaml_mapping("board", read_scene_board);
  scene.archive = document.convert_optional_yaml_mapping("archive", read_archive_variation);
  const YamlValue captures = document.get_required_yaml_value("captures");
  document.check_all_yaml_keys_read();
  std::set<std::string> folders;
  for (const YamlValue& item : captures.read_yaml_list()) {
    scene.sets.push_back(item.convert_yaml_mapping(
        [&](YamlMap& map) { return read_scene_capture_set(map, scene, room); }));
    if (!folders.insert(scene.sets.back().folder).second) {
      throw item.make_yaml_error("folder '" + scene.sets.back().folder + "' occurs twice");
    }
  }
  if (scene.sets.empty()) throw captures.make_yaml_error("contains no captures");
  draw_random_scene_parts(scene);
  return scene;
}

}  // namespace vlp
