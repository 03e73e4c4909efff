// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "rig/yaml_parts.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

constexpr Range kRadianceFraction{0, 1, "(of the source's radiance)"};
constexpr Range kPhase{0, 1, "(of a period)"};

/// Returns the height of the lowest light, m. Mirror images do not count.
double compute_lowest_light_m(const std::vector<SceneLamp>& lamps, const Clutter& clutter) {
  double lowest_m = std::numeric_limits<double>::infinity();
  const auto include_glow = [&](const Glow& glow) {
    lowest_m = std::min(lowest_m, glow.position_m.z());
  };
  const auto include_panel = [&](const Panel& panel) {
    lowest_m = std::min(lowest_m, panel.corner_m.z() + std::min(0.0, panel.edge_a_m.z()) +
                                      std::min(0.0, panel.edge_b_m.z()));
  };
  for (const SceneLamp& lamp : lamps) include_glow(lamp.glow);
  for (const Glow& lamp : clutter.steady_lamps) include_glow(lamp);
  for (const Reflection& reflection : clutter.reflections) include_glow(reflection.glow);
  for (const ForeignLight& light : clutter.foreign_lights) include_glow(light.glow);
  for (const Panel& window : clutter.windows) include_panel(window);
  for (const Blind& blind : clutter.blinds) include_panel(blind.window);
  for (const Sign& sign : clutter.signs) include_panel(sign.panel);
  return lowest_m;
}

/// Returns the height of the highest point of a panel, m.
double compute_highest_m(const Panel& panel) {
  return panel.corner_m.z() + std::max(0.0, panel.edge_a_m.z()) + std::max(0.0, panel.edge_b_m.z());
}

}  // namespace

static void describe(YamlMap& io, DarkSide& side) {
  io.required("reflector_ratio", side.reflector_ratio, kRadianceFraction);
  io.required("azimuth_deg", side.azimuth_rad, kAzimuth);
}

static void describe(YamlMap& io, Recess& recess, const Glow& rim) {
  constexpr Range exponent{0, 30};
  io.required("depth_m", recess.depth_m, Range{0, 2, "m"});
  io.required("source_diameter_m", recess.source_diameter_m, Range{1e-3, 10, "m"})
      .check(recess.source_diameter_m <= 2 * rim.glow_radius_m(),
             "is larger than the rim, diameter_m");
  io.required("reflector_ratio", recess.reflector_ratio, kRadianceFraction);
  io.optional("dark_side", recess.dark_side);
  io.optional("source_power", recess.source_power, Range{0.5, 30});
  io.optional("rim_power", recess.rim_power, exponent);
  io.optional("beam_power", recess.beam_power, exponent);
  io.optional("far_side_slope", recess.far_side_slope,
              Range{0.01, 100, "(meters sideways for each meter up)"});
}

static void describe(YamlMap& io, Chips& chips, const Glow& disc) {
  io.required("fraction", chips.fraction, kRadianceFraction);
  io.required("pitch_m", chips.pitch_m, Range{1e-3, 10, "m"})
      .check(chips.pitch_m <= 2 * disc.glow_radius_m(), "is larger than the disc, diameter_m");
  io.required("width_m", chips.width_m, Range{1e-4, 10, "m"})
      .check(chips.width_m <= 2 * chips.pitch_m,
             "is more than twice pitch_m: such chips are an even disc");
}

static void describe(YamlMap& io, RandomChips& chips) {
  constexpr Range radius_fraction{0, 1, "(of the disc's radius)"};
  constexpr Range radiance_fraction{0, 10, "(of the disc's radiance)"};
  std::pair<double, double> excess;
  io.required("count", chips.count, Range{1, 1000});
  io.required("sigma_fraction", chips.sigma_fraction, Range{0.01, 1, "(of the disc's radius)"});
  io.required("within_fraction", chips.within_fraction, radius_fraction);
  io.required("excess", excess, radiance_fraction)
      .check(excess.first <= excess.second, "should be [least, most]");
  std::tie(chips.min_excess, chips.max_excess) = excess;
}

static void describe(YamlMap& io, Halo& halo) {
  io.required("fraction", halo.fraction, kRadianceFraction);
  io.required("length_m", halo.length_m, Range{1e-3, 2, "m"});
}

/// Describes a glow without its brightness profile.
static void describe_glow(YamlMap& io, Glow& glow, const Room& room) {
  const YamlField position = io.required("position_m", glow.position_m, kPosition);
  describe(io, glow.shape);
  if (!glow.shape.size_m) io.require("diameter_m");
  io.required("electron_rate_e_per_s", glow.electron_rate_e_per_s, kElectronRate);
  glow.rim_to_center_ratio = 1;
  const Eigen::Array3d at = glow.position_m.array();
  position.check((at >= room.min_m.array()).all() && (at <= room.max_m.array()).all(),
                 "is outside the room");
}

/// Describes a glow. A disc has a recess or a rim_to_center_ratio, and a halo; other shapes are
/// evenly bright.
static void describe(YamlMap& io, Glow& glow, const Room& room) {
  describe_glow(io, glow, room);
  if (glow.shape.kind != ShapeKind::disc) return;
  if (!io.optional("recess", glow.recess, glow)) {
    io.required("rim_to_center_ratio", glow.rim_to_center_ratio,
                Range{0, 2, "(of the radiance at the center)"});
    io.optional("chips", glow.chips, glow);
    io.optional("random_chips", glow.random_chips)
        .check(!glow.chips, "excludes chips: a disc has one of them; leave one out");
  }
  io.optional("halo", glow.halo);
}

static void describe(YamlMap& io, Reflection& reflection, const std::vector<SceneLamp>& lamps,
                     const Room& room) {
  int id = 0;
  const YamlField of_lamp = io.required("of_lamp", id);
  const auto lamp = std::ranges::find(lamps, id, &SceneLamp::id);
  of_lamp.check(lamp != lamps.end(), "there is no lamp " + std::to_string(id));
  reflection.lamp = std::size_t(lamp - lamps.begin());
  describe_glow(io, reflection.glow, room);
  reflection.glow.rim_to_center_ratio = 0;
}

/// Describes a panel's corner and edges.
static void describe_edges(YamlMap& io, Panel& panel) {
  io.required("corner_m", panel.corner_m, kPosition);
  std::vector<Eigen::Vector3d> vectors;
  const YamlField edges = io.required("edges_m", vectors, kPosition);
  edges.check(vectors.size() == 2, "should be two vectors, from the corner along each edge");
  panel.edge_a_m = vectors[0];
  panel.edge_b_m = vectors[1];
  const double lengths = panel.edge_a_m.norm() * panel.edge_b_m.norm();
  constexpr double right_angle = 1e-6;
  edges.check(lengths > 0 && std::abs(panel.edge_a_m.dot(panel.edge_b_m)) <= right_angle * lengths,
              "should be at right angles to each other and not of length zero");
}

static void describe(YamlMap& io, Panel& panel) {
  describe_edges(io, panel);
  io.required("electron_rate_e_per_s", panel.electron_rate_e_per_s, kElectronRate);
}

static void describe(YamlMap& io, RectifiedSine& mains) {
  io.required("frequency_hz", mains.frequency_hz, Range{10, 1000, "Hz"});
  io.required("depth", mains.depth, Range{0, 1, "(of the light)"});
}

static void describe(YamlMap& io, SquareWave& pwm) {
  io.required("frequency_hz", pwm.frequency_hz, Range{1, 1e6, "Hz"});
  io.required("duty", pwm.duty, Range{1e-3, 1, "(of a period)"});
}

static void describe(YamlMap& io, ForeignLight& light, const Room& room) {
  describe(io, light.glow, room);
  SquareWave pwm{};
  RectifiedSine mains{};
  const bool has_pwm(io.optional("pwm", pwm)), has_mains(io.optional("mains", mains));
  io.check(has_pwm != has_mains, "needs one of the keys pwm and mains");
  light.wave = has_pwm ? LightWave(pwm) : LightWave(mains);
  io.optional("phase", light.phase, kPhase);
}

static void describe(YamlMap& io, Mirror& mirror) {
  describe_edges(io, mirror.pane);
  io.required("reflectance", mirror.reflectance, Range{0, 1, "(of the light)"});
}

static void describe(YamlMap& io, Blind& blind) {
  describe(io, blind.window);
  io.required("slats", blind.slats, Range{1, 1000});
  io.required("open_fraction", blind.open_fraction, Range{0, 1, "(of a slat's pitch)"});
}

static void describe(YamlMap& io, Sign& sign) {
  describe(io, sign.panel);
  io.required("lines", sign.lines, Range{1, 100});
  io.required("letters", sign.letters, Range{1, 100});
}

void describe_scene_lamps(YamlMap& io, std::vector<SceneLamp>& lamps, const Room& room) {
  UniqueLamps earlier;
  io.optional("lamps", lamps, [&](YamlMap& map, SceneLamp& scene_lamp) {
    Lamp lamp{};
    describe(map, lamp);
    earlier.check_unique(lamp, map);
    earlier.add(lamp);
    scene_lamp.id = lamp.id;
    describe(map, scene_lamp.glow, room);
    map.required("frequency_hz", scene_lamp.frequency_hz);
    map.required("duty", scene_lamp.duty);
    map.optional("phase", scene_lamp.phase, kPhase);
    scene_lamp.map_error_m.setZero();
    map.optional("map_error_m", scene_lamp.map_error_m, kPosition);
  });
}

void describe(YamlMap& io, Clutter& clutter, const std::vector<SceneLamp>& lamps,
              const Room& room) {
  io.optional("steady_lamps", clutter.steady_lamps, room);
  io.optional("windows", clutter.windows);
  io.optional("reflections", clutter.reflections, lamps, room);
  io.optional("foreign_lights", clutter.foreign_lights, room);
  io.optional("mirrors", clutter.mirrors);
  io.optional("blinds", clutter.blinds);
  io.optional("signs", clutter.signs);
  io.optional("ambient_flicker", clutter.ambient_flicker);
  // An occluder is rendered as hiding all lights.
  const double lowest_m = compute_lowest_light_m(lamps, clutter);
  io.optional("occluders", clutter.occluders, [&](YamlMap& map, Panel& occluder) {
    describe(map, occluder);
    map.check(compute_highest_m(occluder) < lowest_m, "is not below every lamp and other light");
  });
}

}  // namespace vlp
