// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp_map.h"

#include <algorithm>
#include <limits>

#include "rig/file.h"
#include "rig/find_lamp.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr const char* kLampsFormat = "vlp-lamps/1";
constexpr double kMaxHeight_m = 200;  // higher ceilings indicate millimeters
constexpr double kCoincident_m = 1e-3;
constexpr double kMaxSurveySd_m = 1;  // larger values indicate millimeters

}  // namespace

Lamp read_lamp_from_yaml(YamlMap& map) {
  Lamp lamp;
  lamp.id = map.require("id").read_integer({0, std::numeric_limits<int>::max()});
  const auto position = map.require("position_m");
  lamp.position_m = Eigen::Vector3d(position.read_numbers(3).data());
  position.read_list()[2].read_number({-kMaxHeight_m, kMaxHeight_m, "m"});
  lamp.shape = read_lamp_shape_from_yaml(map);
  map.optional("frequency_hz", lamp.frequency_hz, Range{50, 1e6, "Hz"});
  map.optional("duty", lamp.duty, Range{0.01, 0.99, "(a fraction of the period)"});
  map.optional("sd_m", lamp.sd_m, Range{0, kMaxSurveySd_m, "m"});
  return lamp;
}

void UniqueLamps::check_unique(const Lamp& lamp, const YamlMap& map) const {
  if (ids_.contains(lamp.id))
    throw map.make_error("id " + std::to_string(lamp.id) + " occurs twice");
  const double x_m = lamp.position_m.x();
  const auto end = lamps_.upper_bound(x_m + kCoincident_m);
  for (auto near = lamps_.lower_bound(x_m - kCoincident_m); near != end; ++near) {
    const Lamp& other = near->second;
    if ((other.position_m - lamp.position_m).norm() < kCoincident_m) {
      throw map.make_error("lamp " + std::to_string(lamp.id) + " is where lamp " +
                           std::to_string(other.id) + " is");
    }
  }
}

void UniqueLamps::add(const Lamp& lamp) {
  ids_.insert(lamp.id);
  lamps_.emplace(lamp.position_m.x(), lamp);
}

const Lamp* find_lamp_by_id(std::span<const Lamp> lamps, int id) {
  const auto lamp =
      std::find_if(lamps.begin(), lamps.end(), [&](const Lamp& one) { return one.id == id; });
  return lamp == lamps.end() ? nullptr : &*lamp;
}

LampMap read_lamp_map(const std::filesystem::path& file) { return read_lamps_of_room(file, ""); }

LampMap read_lamps_of_room(const std::filesystem::path& file, const std::string& room) {
  return read_lamps_and_room_names(file, room).map;
}

LampMap read_overhead_lamps_of_room(const std::filesystem::path& file, const std::string& room) {
  LampMap map = read_lamps_of_room(file, room);
  if (map.lamps_below_camera) {
    throw InputError(file,
                     "lamps_below_camera: only vlp-detect and vlp-locate support a camera that "
                     "looks down; use a map of lamps above the camera");
  }
  return map;
}

LampMapFile read_lamps_and_room_names(const std::filesystem::path& file, const std::string& room) {
  YamlMap document = read_yaml_file(file, kLampsFormat);
  std::optional<double> sd_m;
  document.optional("sd_m", sd_m, Range{0, kMaxSurveySd_m, "m"});
  const auto below = document.find("lamps_below_camera");
  const YamlValue list = document.require("lamps");
  document.check_all_keys_read();
  LampMapFile result{file, {{}, below && below->read_boolean()}, {}};
  UniqueLamps in_room;
  std::unordered_set<int> ids_of_other_rooms;
  const auto items = list.read_list();
  std::vector<Lamp>& lamps = result.map.lamps;
  lamps.reserve(items.size());
  result.rooms.reserve(items.size());
  for (const YamlValue& item : items) {
    YamlMap keys = item.read_mapping();
    Lamp lamp = read_lamp_from_yaml(keys);
    const auto lamp_room = keys.find("room");
    if (!room.empty() && !lamp_room) {
      // [LAMP-10] `no key room`
      throw item.make_error("has no key room, and lamps of room " + room +
                            " are selected: state the room of each lamp");
    }
    std::string room_name = lamp_room ? lamp_room->read_text() : "";
    const bool is_in_room = room.empty() || room_name == room;
    if (!lamp.sd_m) lamp.sd_m = sd_m;
    keys.check_all_keys_read();
    in_room.check_unique(lamp, keys);
    if (ids_of_other_rooms.contains(lamp.id)) {
      throw item.make_error("id " + std::to_string(lamp.id) + " occurs twice");
    }
    if (is_in_room) {
      in_room.add(lamp);
      lamps.push_back(std::move(lamp));
      result.rooms.push_back(std::move(room_name));
    } else {
      ids_of_other_rooms.insert(lamp.id);
    }
  }
  if (lamps.empty() && !room.empty()) {
    throw InputError(
        file, "has no lamp with 'room: " + room + "': name another room, or correct the map");
  }
  if (lamps.empty()) throw list.make_error("contains no lamp");
  return result;
}

void write_lamp_map(const std::filesystem::path& file, const LampMap& map) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  emit_yaml_plain_word(out, "format", kLampsFormat);
  if (map.lamps_below_camera) emit_yaml_plain_word(out, "lamps_below_camera", "true");
  out << YAML::Key << "lamps" << YAML::Value << YAML::BeginSeq;
  for (const Lamp& lamp : map.lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_yaml_integer(out, "id", lamp.id);
    emit_yaml_numbers(out, "position_m", lamp.position_m);
    emit_yaml_lamp_shape(out, lamp.shape);
    if (lamp.frequency_hz) emit_yaml_number(out, "frequency_hz", *lamp.frequency_hz);
    if (lamp.duty) emit_yaml_number(out, "duty", *lamp.duty);
    if (lamp.sd_m) emit_yaml_number(out, "sd_m", *lamp.sd_m);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap << YAML::Newline;
  write_file(file, out.c_str());
}

}  // namespace vlp
