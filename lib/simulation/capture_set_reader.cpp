// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "geometry/angles.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

/// Largest number of captures of one folder.
constexpr int kMaxCaptures = 1'000'000;
const std::string kTooManyCaptures =
    "makes more than " + std::to_string(kMaxCaptures) + " captures";
constexpr const char* kOutsideRoom = "moves the camera outside the room";

/// Rejects a height at which a light would not be above the camera.
void check_height(const YamlValue& item, double height_m, const Scene& scene) {
  const auto check = [&](const Glow& glow, const std::string& name) {
    if (glow.position_m.z() <= height_m + 1e-3)
      throw item.make_error(name + " is not above the camera");
  };
  const Clutter& clutter = scene.clutter;
  for (const SceneLamp& lamp : scene.lamps) check(lamp.glow, "lamp " + std::to_string(lamp.id));
  for (const Glow& lamp : clutter.steady_lamps) check(lamp, "a steady lamp");
  for (const Reflection& reflection : clutter.reflections) check(reflection.glow, "a reflection");
  for (const ForeignLight& light : clutter.foreign_lights) check(light.glow, "a foreign light");
}

/// Positions of the rotation axis with space in the room for a rotation of the camera about it.
struct PivotArea {
  Eigen::Array2d min_m, max_m;
  double lever_arm_m;

  bool contains(const Eigen::Vector2d& pivot_m) const {
    return (pivot_m.array() - lever_arm_m >= min_m).all() &&
           (pivot_m.array() + lever_arm_m <= max_m).all();
  }
  /// Reads a pivot; throws InputError if it is outside.
  void operator()(const YamlValue& value, Eigen::Vector2d& pivot_m) const {
    read_value(value, pivot_m);
    if (!contains(pivot_m)) throw value.make_error(kOutsideRoom);
  }
};

struct PivotGrid {
  Eigen::Vector2d x_m, y_m;
  int columns, rows;
};

std::vector<Eigen::Vector2d> list_grid_positions(const PivotGrid& grid) {
  const double step_x_m = grid.x_m[1] - grid.x_m[0], step_y_m = grid.y_m[1] - grid.y_m[0];
  std::vector<Eigen::Vector2d> pivots_m;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      pivots_m.emplace_back(grid.x_m[0] + step_x_m * column / (grid.columns - 1),
                            grid.y_m[0] + step_y_m * row / (grid.rows - 1));
    }
  }
  return pivots_m;
}

std::vector<Eigen::Vector2d> list_positions(const StraightDrive& drive, double interval_s,
                                            const YamlField& value) {
  const Eigen::Vector2d displacement = drive.to_m - drive.from_m;
  const double step_m = drive.speed_m_per_s * interval_s;
  constexpr double rounding = 1e-12;
  const double steps = std::floor(displacement.norm() / step_m * (1 + rounding));
  value.check(steps + 1 <= kMaxCaptures, kTooManyCaptures);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i <= steps; ++i) {
    places.push_back(drive.from_m + displacement.normalized() * (step_m * i));
  }
  return places;
}

bool is_plain_name(const std::string& folder) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  return !folder.empty() && std::ranges::all_of(folder, is_plain);
}

}  // namespace

static void describe(YamlMap& io, StraightDrive& drive, const PivotArea& area) {
  io.required("from_m", drive.from_m, area);
  io.required("to_m", drive.to_m, area);
  io.required("speed_m_per_s", drive.speed_m_per_s, Range{1e-6, 20, "m/s"});
}

static void describe(YamlMap& io, PivotGrid& grid, const PivotArea& area) {
  io.required("x_m", grid.x_m);
  io.required("y_m", grid.y_m);
  io.required("columns", grid.columns, Range{2, 1000});
  io.required("rows", grid.rows, Range{2, 1000});
  for (const int end : {0, 1})
    io.check(area.contains({grid.x_m[end], grid.y_m[end]}), kOutsideRoom);
}

static void describe(YamlMap& io, Vibration& vibration) {
  io.required("amplitude_deg", vibration.amplitude_rad, DegreeRange{0, 10});
  io.required("frequency_hz", vibration.frequency_hz, Range{1e-3, 1000, "Hz"});
}

/// Describes the position of the rotation axis at each capture: pivots, a grid or a drive.
static void describe_positions(YamlMap& io, LampShots& captures, const PivotArea& area) {
  std::optional<PivotGrid> grid;
  const YamlField pivots = io.optional("pivots_m", captures.pivots_m, area);
  io.optional("grid", grid, area);
  const YamlField drive = io.optional("drive", captures.drive, area);
  io.check(bool(pivots) + grid.has_value() + bool(drive) == 1,
           "needs one of the keys pivots_m, grid, drive, views");
  if (grid) captures.pivots_m = list_grid_positions(*grid);
  if (drive) {
    drive.check(captures.drive->from_m != captures.drive->to_m, "has no length");
    captures.pivots_m = list_positions(*captures.drive, captures.interval_s, drive);
  }
  pivots.check(!captures.pivots_m.empty(), "contains no pivot");
}

static void describe_yaws(YamlMap& io, LampShots& captures) {
  int count = 0;
  const YamlField yaws = io.optional("yaws_deg", captures.yaws_rad, kAzimuth);
  yaws.check(!captures.yaws_rad.empty(), "contains no yaw");
  const YamlField turn = io.optional("turn", captures, [&](YamlMap& map, LampShots& shots) {
    map.required("count", count, Range{1, 100'000});
    map.required("jitter_deg", shots.yaw_jitter_rad, DegreeRange{0, 180});
  });
  io.check(bool(yaws) != bool(turn), "needs one of the keys yaws_deg and turn");
  for (int i = 0; i < count; ++i) captures.yaws_rad.push_back(rad_from_deg(360.0 * i / count));
}

static void describe_roll_pitch(YamlMap& io, LampShots& captures) {
  constexpr DegreeRange range{-85, 85};
  io.optional("roll_deg", captures.roll_rad, range);
  io.optional("pitch_deg", captures.pitch_rad, range);
  io.optional("vibration", captures.vibration);
}

static void describe(YamlMap& io, LampShots& captures, const Scene& scene, const Room& room) {
  io.check(!scene.lamps.empty(), "the scene has no lamps");
  io.required("interval_s", captures.interval_s, Range{1e-6, 1e5, "s"});
  describe_positions(io, captures,
                     {room.min_m.head<2>(), room.max_m.head<2>(), scene.mount.lever_arm_m.norm()});
  const auto read_height = [&](const YamlValue& item, double& height_m) {
    read_value(item, height_m, kPosition);
    check_height(item, height_m, scene);
    if (height_m < room.min_m.z() || height_m > room.max_m.z()) throw item.make_error(kOutsideRoom);
  };
  io.required("heights_m", captures.heights_m, read_height)
      .check(!captures.heights_m.empty(), "contains no height");
  describe_yaws(io, captures);
  io.optional("turn_rate_deg_per_s", captures.turn_rate_rad_per_s,
              DegreeRange{-720, 720, "degrees per second"});
  io.optional("roll_pitch", captures, describe_roll_pitch);
  captures.repeat = 1;
  io.optional("repeat", captures.repeat, Range{1, kMaxCaptures});
  io.optional("known", captures.has_known_positions);
  io.check(double(captures.pivots_m.size()) * double(captures.heights_m.size()) *
                   double(captures.yaws_rad.size()) * captures.repeat <=
               kMaxCaptures,
           kTooManyCaptures);
  io.check(!captures.drive || captures.yaw_jitter_rad == 0,
           "yaws do not jitter on a drive: set jitter_deg to 0");
}

static void describe(YamlMap& io, BoardViews& views) {
  io.required("count", views.count, Range{1, kMaxCaptures});
  io.required("distance_m", views.distance_m, Range{1e-3, 100, "m"})
      .check(views.distance_m.first <= views.distance_m.second, "should be [least, most]");
  io.required("tilt_deg", views.tilt_rad, DegreeRange{0, 80});
  io.required("roll_deg", views.roll_rad, DegreeRange{0, 180});
  io.required("field_coverage", views.field_coverage,
              Range{0, 1, "(of the way to the image's edge)"});
  views.velocity_m_per_s.setZero();
  io.optional("velocity_m_per_s", views.velocity_m_per_s, Range{-10, 10, "m/s"});
}

void describe(YamlMap& io, CaptureSet& set, const Scene& scene, const Room& room) {
  io.required("folder", set.folder)
      .check(is_plain_name(set.folder), "should be a name of letters, digits, - and _");
  io.required("exposure_s", set.exposure_s, Range{1e-7, 1, "s"});
  if (io.optional("views", set.board)) {
    io.check(scene.board.has_value(), "views are of a board, and the scene has none");
  } else {
    describe(io, set.lamps.emplace(), scene, room);
  }
}

}  // namespace vlp
