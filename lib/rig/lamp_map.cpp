// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp_map.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>

#include "rig/file.h"
#include "rig/find_lamp.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"
#include "rig/yaml_documents.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr const char* kLampsFormat = "vlp-lamps/1";
constexpr double kCoincident_m = 1e-3;
constexpr Range kLampHeight{-200, 200, "m"};  // higher ceilings indicate millimeters
constexpr Range kSurveySd{0, 1, "m"};         // larger values indicate millimeters

}  // namespace

template <typename Io>
void describe(Io& io, Described<Io, Lamp> lamp) {
  io.required("id", lamp.id);
  io.required("position_m", lamp.position_m).item(2).check_range(kLampHeight);
  describe(io, lamp.shape);
  io.optional("frequency_hz", lamp.frequency_hz, Range{50, 1e6, "Hz"});
  io.optional("duty", lamp.duty, Range{0.01, 0.99, "(a fraction of the period)"});
  io.optional("sd_m", lamp.sd_m, kSurveySd);
}

template void describe<YamlMap>(YamlMap& io, Lamp& lamp);

template <typename Io, typename... ReadLamp>
static auto describe(Io& io, Described<Io, LampMap> map, const ReadLamp&... read_lamp) {
  io.optional("lamps_below_camera", map.lamps_below_camera);
  return io.required("lamps", map.lamps, read_lamp...);
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
  return read_lamps_and_rooms(file, room).map;
}

LampMap read_overhead_lamps(const std::filesystem::path& file, const std::string& room) {
  LampMap map = read_lamps_of_room(file, room);
  if (map.lamps_below_camera) {
    throw InputError(file,
                     "lamps_below_camera: only vlp-detect and vlp-locate support a camera that "
                     "looks down; use a map of lamps above the camera");
  }
  return map;
}

LampMapFile read_lamps_and_rooms(const std::filesystem::path& file, const std::string& room) {
  YamlMap document = read_yaml_file(file, kLampsFormat);
  std::optional<double> sd_m;
  document.optional("sd_m", sd_m, kSurveySd);
  LampMapFile result{file, {}, {}};
  UniqueLamps in_room;
  std::unordered_set<int> ids_of_other_rooms;
  const auto read_lamp = [&](YamlMap& map, Lamp& lamp) {
    describe(map, lamp);
    if (!lamp.sd_m) lamp.sd_m = sd_m;
    std::string name;
    if (!map.optional("room", name) && !room.empty()) {
      // [LAMP-10] `no key room`
      throw map.make_error("has no key room, and lamps of room " + room +
                           " are selected: state the room of each lamp");
    }
    in_room.check_unique(lamp, map);
    if (ids_of_other_rooms.contains(lamp.id))
      throw map.make_error("id " + std::to_string(lamp.id) + " occurs twice");
    if (room.empty() || name == room) {
      in_room.add(lamp);
      result.map.lamps.push_back(lamp);
      result.rooms.push_back(std::move(name));
    } else {
      ids_of_other_rooms.insert(lamp.id);
    }
  };
  LampMap all;
  const YamlField list = describe(document, all, read_lamp);
  document.check_all_keys_read();
  result.map.lamps_below_camera = all.lamps_below_camera;
  if (!result.map.lamps.empty()) return result;
  list.check(!room.empty(), "contains no lamp");
  throw InputError(file,
                   "has no lamp with 'room: " + room + "': name another room, or correct the map");
}

std::string format_lamp_map(const LampMap& map) { return format_document(kLampsFormat, map); }

void write_lamp_map(const std::filesystem::path& file, const LampMap& map) {
  write_file(file, format_lamp_map(map));
}

}  // namespace vlp
