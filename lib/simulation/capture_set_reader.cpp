// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "geometry/angles.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

/// Rejects a height at which a light would not be above the camera.
void check_height(const YamlValue& item, double height_m, const Scene& scene) {
  const auto check = [&](const Glow& glow, const std::string& name) {
    if (glow.position_m.z() <= height_m + 1e-3) throw item.error(name + " is not above the camera");
  };
  for (const SceneLamp& lamp : scene.lamps) check(lamp.glow, "lamp " + std::to_string(lamp.id));
  for (const Glow& lamp : scene.clutter.steady_lamps) check(lamp, "a steady lamp");
  for (const Reflection& reflection : scene.clutter.reflections) {
    check(reflection.glow, "a reflection");
  }
  for (const ForeignLight& light : scene.clutter.foreign_lights) {
    check(light.glow, "a foreign light");
  }
}

void read_heights(const YamlValue& list, const Scene& scene, const Room& room,
                  LampShots& captures) {
  for (const YamlValue& item : list.list()) {
    const double height_m = item.number_within(-200, 200, "m");
    check_height(item, height_m, scene);
    if (height_m < room.min_m.z() || height_m > room.max_m.z()) {
      throw item.error("takes the camera outside the room");
    }
    captures.heights_m.push_back(height_m);
  }
  if (captures.heights_m.empty()) throw list.error("holds no height");
}

void read_yaws(YamlMap& map, LampShots& captures) {
  captures.yaw_jitter_rad = 0;
  const auto yaws = map.optional("yaws_deg"), turn = map.optional("turn");
  if (yaws.has_value() == turn.has_value()) {
    throw map.error("needs one of the keys yaws_deg and turn");
  }
  if (yaws) {
    for (const YamlValue& yaw : yaws->list()) {
      captures.yaws_rad.push_back(rad_from_deg(yaw.number_within(-360, 360, "degrees")));
    }
    if (captures.yaws_rad.empty()) throw yaws->error("holds no yaw");
    return;
  }
  YamlMap keys = turn->map();
  const int count = keys.required("count").integer_within(1, 100'000);
  captures.yaw_jitter_rad =
      rad_from_deg(keys.required("jitter_deg").number_within(0, 180, "degrees"));
  keys.finish();
  for (int i = 0; i < count; ++i) captures.yaws_rad.push_back(rad_from_deg(360.0 * i / count));
}

void read_roll_pitch(YamlMap map, LampShots& captures) {
  const auto ramp = [&](const std::string& key) {
    const auto value = map.optional(key);
    if (!value) return std::pair(0.0, 0.0);
    for (const YamlValue& end : value->list()) end.number_within(-85, 85, "degrees");
    const auto ends = value->numbers(2);
    return std::pair(rad_from_deg(ends[0]), rad_from_deg(ends[1]));
  };
  captures.roll_rad = ramp("roll_deg");
  captures.pitch_rad = ramp("pitch_deg");
  if (const auto vibration = map.optional("vibration")) {
    YamlMap keys = vibration->map();
    captures.vibration = {
        rad_from_deg(keys.required("amplitude_deg").number_within(0, 10, "degrees")),
        keys.required("frequency_hz").number_within(1e-3, 1000, "Hz")};
    keys.finish();
  }
  map.finish();
}

LampShots read_lamp_captures(YamlMap& map, const Scene& scene, const Room& room) {
  if (scene.lamps.empty()) throw map.error("the scene has no lamps");
  LampShots captures;
  captures.interval_s = map.required("interval_s").number_within(1e-6, 1e5, "s");
  read_places(map, scene, room, captures);
  read_heights(map.required("heights_m"), scene, room, captures);
  read_yaws(map, captures);
  const auto rate = map.optional("turn_rate_deg_per_s");
  captures.turn_rate_rad_per_s =
      rate ? rad_from_deg(rate->number_within(-720, 720, "degrees per second")) : 0;
  if (const auto lean = map.optional("roll_pitch")) read_roll_pitch(lean->map(), captures);
  const auto repeat = map.optional("repeat");
  captures.repeat = repeat ? repeat->integer_within(1, kMaxCaptures) : 1;
  const auto known = map.optional("known");
  captures.known = known && known->boolean();
  check_count(double(captures.spots_m.size()) * double(captures.heights_m.size()) *
                  double(captures.yaws_rad.size()) * captures.repeat,
              map);
  if (captures.drive && captures.yaw_jitter_rad > 0) {
    throw map.error("yaws do not jitter on a drive: set jitter_deg to 0");
  }
  return captures;
}

BoardViews read_board_views(YamlMap map) {
  BoardViews views;
  views.count = map.required("count").integer_within(1, kMaxCaptures);
  views.distance_m = read_range(map.required("distance_m"), 1e-3, 100, "m");
  views.tilt_rad = rad_from_deg(map.required("tilt_deg").number_within(0, 80, "degrees"));
  views.roll_rad = rad_from_deg(map.required("roll_deg").number_within(0, 180, "degrees"));
  views.spread =
      map.required("field_coverage").number_within(0, 1, "(of the way to the image's edge)");
  views.velocity_m_per_s.setZero();
  if (const auto velocity = map.optional("velocity_m_per_s")) {
    views.velocity_m_per_s = Eigen::Vector3d(velocity->numbers(3).data());
    for (const YamlValue& part : velocity->list()) part.number_within(-10, 10, "m/s");
  }
  map.finish();
  return views;
}

std::string read_folder(const YamlValue& value) {
  const std::string folder = value.text();
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (folder.empty() || !std::all_of(folder.begin(), folder.end(), plain)) {
    throw value.error("should be a name of letters, digits, - and _");
  }
  return folder;
}

}  // namespace

CaptureSet read_capture_set(YamlMap map, const Scene& scene, const Room& room) {
  CaptureSet set;
  set.folder = read_folder(map.required("folder"));
  set.exposure_s = map.required("exposure_s").number_within(1e-7, 1, "s");
  if (const auto views = map.optional("views")) {
    if (!scene.board) throw map.error("views are of a board, and the scene has none");
    set.board = read_board_views(views->map());
  } else {
    set.lamps = read_lamp_captures(map, scene, room);
  }
  map.finish();
  return set;
}

}  // namespace vlp
