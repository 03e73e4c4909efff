// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <set>

#include "geometry/angles.h"
#include "rig/yaml_parts.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

constexpr double kLargest = 1e12;

Room read_room(YamlMap map) {
  Room room;
  for (const auto& [key, axis] : {std::pair("x_m", 0), std::pair("y_m", 1), std::pair("z_m", 2)}) {
    const YamlValue value = map.required(key);
    const auto range = value.numbers(2);
    if (!(range[0] < range[1])) throw value.error("should be [least, most]");
    for (const YamlValue& end : value.list()) end.number_within(-200, 200, "m");
    room.min_m[axis] = range[0];
    room.max_m[axis] = range[1];
  }
  map.finish();
  return room;
}

Camera read_scene_camera(YamlMap map) {
  Camera camera = read_camera(map);
  for (const std::string key : {"row_time_s", "readout"}) map.required(key);
  for (int focal : {0, 1}) {
    map.required("intrinsics").list()[std::size_t(focal)].number_within(1, 1e6, "px");
  }
  const YamlValue imager = map.required("imager_px");
  for (const YamlValue& side : imager.list()) side.integer_within(8, 20000);
  constexpr double max_px = 64e6;
  if (double(camera.imager_px[0]) * camera.imager_px[1] > max_px) {
    throw imager.error("has more than 64 million pixels");
  }
  map.finish();
  return camera;
}

constexpr double kMaxDefocus_px = 20;
constexpr double kMaxSpot_px = 1e4;

Defocus read_defocus(YamlMap map) {
  Defocus defocus{map.required("radius_px").number_within(0, kMaxDefocus_px, "px")};
  if (const auto tilt = map.optional("tilt_px")) {
    defocus.tilt_px = Eigen::Vector2d(tilt->numbers(2).data());
    for (const YamlValue& component : tilt->list()) {
      component.number_within(-kMaxDefocus_px, kMaxDefocus_px, "px");
    }
  }
  map.finish();
  return defocus;
}

Eigen::Vector2d read_spot(YamlMap& map) {
  const YamlValue at = map.required("at_px");
  const Eigen::Vector2d at_px(at.numbers(2).data());
  for (const YamlValue& component : at.list()) {
    component.number_within(-kMaxSpot_px, kMaxSpot_px, "px");
  }
  return at_px;
}

LensSmear read_smear(YamlMap map) {
  const LensSmear smear{read_spot(map),
                        map.required("radius_px").number_within(1, kMaxSpot_px, "px"),
                        map.required("fraction").number_within(0, 1, "(of the light)"),
                        map.required("sigma_px").number_within(0.3, 50, "px")};
  map.finish();
  return smear;
}

Dust read_dust(YamlMap map) {
  const Dust dust{read_spot(map), map.required("radius_px").number_within(1, kMaxSpot_px, "px"),
                  map.required("depth").number_within(0, 1, "(of the light)")};
  map.finish();
  return dust;
}

template <typename Item>
std::vector<Item> read_each(const YamlValue& list, Item (*read)(YamlMap map)) {
  const std::vector<YamlValue> values = list.list();
  std::vector<Item> items;
  items.reserve(values.size());
  for (const YamlValue& value : values) items.push_back(read(value.map()));
  return items;
}

Optics read_optics(YamlMap map) {
  Optics optics{map.required("blur_px").number_within(0, 20, "px"),
                map.required("vignetting_power").number_within(0, 20, "")};
  if (const auto defocus = map.optional("defocus")) optics.defocus = read_defocus(defocus->map());
  if (const auto veil = map.optional("veil")) {
    optics.veil = veil->number_within(0, 1, "(of the light)");
  }
  if (const auto smears = map.optional("smears")) {
    optics.smears = read_each<LensSmear>(*smears, read_smear);
  }
  if (const auto dust = map.optional("dust")) optics.dust = read_each<Dust>(*dust, read_dust);
  map.finish();
  return optics;
}

Bloom read_bloom(YamlMap map) {
  const Bloom bloom{map.required("fraction").number_within(0, 1, "(of the charge)"),
                    map.required("sigma_px").number_within(0.3, 50, "px")};
  map.finish();
  return bloom;
}

Sensor read_sensor(YamlMap map) {
  Sensor sensor;
  const YamlValue bits = map.required("bits");
  sensor.bits = bits.integer_within(8, 16);
  if (sensor.bits != 8 && sensor.bits != 16) throw bits.error("should be 8 or 16");
  const double white_dn = sensor.bits == 8 ? 255 : 65535;
  sensor.gain_dn_per_e = map.required("gain_dn_per_e").number_within(1e-6, 1e4, "DN per electron");
  sensor.black_level_dn = map.required("black_level_dn").number_within(0, white_dn, "DN");
  sensor.full_well_e = map.required("full_well_e").number_within(1, 1e9, "electrons");
  sensor.read_noise_e = map.required("read_noise_e").number_within(0, 1e6, "electrons");
  sensor.shot_noise = map.required("shot_noise").boolean();
  if (const auto bloom = map.optional("bloom")) sensor.bloom = read_bloom(bloom->map());
  map.finish();
  return sensor;
}

Mount read_mount(YamlMap map) {
  const double tilt = rad_from_deg(map.required("tilt_deg").number_within(0, 45, "degrees"));
  const double azimuth =
      rad_from_deg(map.required("tilt_azimuth_deg").number_within(-360, 360, "degrees"));
  const YamlValue lever_arm = map.required("lever_arm_m");
  const Eigen::Vector3d zenith_in_camera(std::sin(tilt) * std::cos(azimuth),
                                         std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
  const Mount mount{level_from_zenith(zenith_in_camera),
                    Eigen::Vector2d(lever_arm.numbers(2).data())};
  for (const YamlValue& component : lever_arm.list()) component.number_within(-5, 5, "m");
  map.finish();
  return mount;
}

}  // namespace

Eigen::Vector3d read_point(const YamlValue& value) {
  const Eigen::Vector3d point(value.numbers(3).data());
  for (const YamlValue& component : value.list()) component.number_within(-200, 200, "m");
  return point;
}

double read_radiance(YamlMap& map, const std::string& key) {
  return map.required(key).number_within(0, kLargest, "electrons per second");
}

std::pair<double, double> read_range(const YamlValue& value, double min, double max,
                                     std::string_view unit) {
  const auto range = value.numbers(2);
  for (const YamlValue& end : value.list()) end.number_within(min, max, unit);
  if (range[0] > range[1]) throw value.error("should be [least, most]");
  return {range[0], range[1]};
}

Scene read_scene(const std::filesystem::path& file) {
  YamlMap document = read_yaml(file, "vlp-scene/1");
  Scene scene;
  scene.seed = static_cast<std::uint64_t>(
      document.required("seed").integer_within(0, std::numeric_limits<int>::max()));
  const Room room = read_room(document.required("room").map());
  scene.camera = read_scene_camera(document.required("camera").map());
  scene.optics = read_optics(document.required("optics").map());
  scene.sensor = read_sensor(document.required("sensor").map());
  if (const auto picture = document.optional("processing")) {
    scene.picture = read_image_processing(picture->map(), scene.sensor);
  }
  scene.mount = read_mount(document.required("mount").map());
  scene.ambient_e_per_s = read_radiance(document, "ambient_e_per_s");
  if (const auto lamps = document.optional("lamps")) scene.lamps = read_scene_lamps(*lamps, room);
  if (const auto clutter = document.optional("clutter")) {
    scene.clutter = read_clutter(clutter->map(), scene.lamps, room);
  }
  if (const auto board = document.optional("board")) {
    scene.board = read_scene_board(board->map());
  }
  if (const auto archive = document.optional("archive")) {
    scene.archive = read_archive_variation(archive->map());
  }
  const YamlValue captures = document.required("captures");
  document.finish();
  std::set<std::string> folders;
  for (const YamlValue& item : captures.list()) {
    scene.sets.push_back(read_capture_set(item.map(), scene, room));
    if (!folders.insert(scene.sets.back().folder).second) {
      throw item.error("folder '" + scene.sets.back().folder + "' stands twice");
    }
  }
  if (scene.sets.empty()) throw captures.error("holds no captures");
  draw_random_parts(scene);
  return scene;
}

}  // namespace vlp
