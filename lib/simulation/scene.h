// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/frames.h"
#include "rig/board.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "simulation/capture_set.h"

namespace vlp {

/// Radiances, named ..._e_per_s, are the electrons per second that a source frees in a pixel on the
/// optical axis that it fills.

/// The side to which a reflector is dark: its share at the rim towards an azimuth in the world,
/// from x to y.
struct DarkSide {
  double reflector_share;
  double azimuth_rad;
};

/// A source deep in a reflector, seen through its rim, a circle of the diameter D. A ray with the
/// slope s (metres sideways for each metre up) that crosses the rim's plane at p from its centre
/// crosses the source's plane at q = p + depth s. Its radiance is
///   radiance (w + (1 - w) 2^-((2 |q| / source_diameter)^2)),
/// so that the source, of which half is left at its diameter, shows at -depth s from the rim's
/// centre. The walls give the share w = reflector_share; with a dark side w falls in proportion to
/// p's way towards the azimuth, from reflector_share at p = -D / 2 to the dark side's at D / 2.
struct Recess {
  double depth_m;
  double source_diameter_m;
  double reflector_share;
  std::optional<DarkSide> dark_side;
};

/// The ceiling around a glow, lit by it: at r > D / 2 from the centre of the diameter D it adds
///   radiance share exp(-(r - D / 2) / length), until 8 lengths from the rim.
struct Halo {
  double share;
  double length_m;
};

/// LED chips on a square grid behind a diffuser, which shine through: of each chip within the disc,
/// its centre c, the radiance at p is more by
///   radiance share 2^-((2 |p - c| / width)^2).
/// Rows and columns of the grid are pitch apart, along x and y of the world, and a chip is in the
/// disc's middle.
struct Chips {
  double share;
  double pitch_m, width_m;
};

/// A horizontal disc of light. Its radiance at the distance r of its centre is
///   radiance (1 - (1 - edge_share) (2 r / diameter)^2),
/// and its chips add to it; or that of its recess, of which the disc is the rim. Or a rectangle,
/// with such a factor for the distance from the middle along each of its sides, and nothing else of
/// what a disc has.
struct Glow {
  Eigen::Vector3d position_m;
  double diameter_m;
  double radiance_e_per_s;
  double edge_share;
  std::optional<Recess> recess = {};
  std::optional<Halo> halo = {};
  std::optional<LampRectangle> rectangle = {};
  std::optional<Chips> chips = {};
};

/// A lamp of the lamp map: a glow that a square wave switches.
struct SceneLamp {
  int id;
  Glow glow;
  double frequency_hz;
  double duty;
  /// In periods, at time 0: lit while frac(frequency t + phase) < duty. Without it the lamp runs
  /// free: its phase is another one in each capture.
  std::optional<double> phase;
  /// What lamps.yaml says of its place, minus where it is.
  Eigen::Vector3d map_error_m;
};

/// The light of a lamp thrown back by a shiny floor onto the ceiling: fades to nothing at its
/// rim, or sides, and flickers with its lamp.
struct Reflection {
  Glow glow;
  std::size_t lamp;  // in Scene::lamps
};

/// A rectangle in the world: a corner and, at right angles, its two edges from there.
struct Panel {
  Eigen::Vector3d corner_m;
  Eigen::Vector3d edge_a_m, edge_b_m;
  double radiance_e_per_s;
};

/// What is in view besides the lamps.
struct Clutter {
  std::vector<Glow> steady_lamps;
  std::vector<Panel> windows;
  std::vector<Reflection> reflections;
  /// Hide what is behind them.
  std::vector<Panel> occluders;
};

struct Optics {
  /// Sigma of the Gaussian point spread.
  double blur_px;
  /// A ray at the angle a from the optical axis arrives weakened by cos(a)^power; 4 is natural.
  double vignetting_power;
};

/// Charge above the full well: `share` of it goes to the pixels around, as a Gaussian.
struct Bloom {
  double share;
  double sigma_px;
};

/// From electrons to grey levels:
///   level = round(black_level + gain (min(Poisson(mean) + bloom, full well) + Normal(read noise)))
struct Sensor {
  int bits;  // 8 or 16
  double gain_dn_per_e;
  double black_level_dn;
  double full_well_e;
  double read_noise_e;
  bool shot_noise;
  std::optional<Bloom> bloom;
};

/// Unsharp mask, of levels v blurred by a Gaussian G of the sigma radius_px:
///   v + amount (v - G v)
struct Sharpening {
  double amount;
  double radius_px;
};

/// A mosaic of colour filters over the pixels: lines of red and green, then of green and blue, from
/// the first pixel on (RGGB). Red and blue filters pass so much of the light as green ones do. The
/// camera fills in each colour by the mean of the nearest pixels that have it, and divides it by
/// what its filter passes.
struct Bayer {
  double red_share, blue_share;
};

/// What a camera makes of the sensor's levels before they are rounded, in this order: colour, of
/// its filters;
///   v = white ((level - black level) / (white - black level))^(1 / gamma), from 0 to white;
/// sharpening; rounding; JPEG. Without a picture the levels are as the sensor has them.
struct Picture {
  double gamma;
  std::optional<Sharpening> sharpening;
  /// 1 to 100, as libjpeg has it, of images of 8 bits; PNG without it.
  std::optional<int> jpeg_quality;
  std::optional<Bayer> bayer = {};
};

/// How the camera sits on what carries it and turns about a vertical axis. It leans by a tilt that
/// adds no yaw (level_from_zenith): in the camera, up is (sin t cos a, sin t sin a, cos t), with
/// the tilt t and its azimuth a from the image's x to its y.
struct Mount {
  Eigen::Matrix3d level_from_camera;
  /// From the axis to the camera, in the level frame.
  Eigen::Vector2d lever_arm_m;
};

struct SceneBoard {
  Board print;
  double margin_m;
  /// Deflection into the paper at the middle, along x and along y (mrcal's calobject_warp):
  /// z = warp_x (1 - a^2) + warp_y (1 - b^2), with a and b from -1 to 1 over the tags.
  Eigen::Vector2d warp_m;
  double white_e_per_s, black_e_per_s, surround_e_per_s;
};

/// How the units of an archive differ from the scene; see archive.h. Each value is drawn evenly
/// from within so much of the scene's, up and down.
struct ArchiveSpreads {
  int sessions_per_camera;
  /// Of a camera: both focal lengths alike, each coordinate of the centre, each coefficient of
  /// distortion.
  double focal_share, center_px, distortion_share;
  /// Of a camera: how far it leans besides, in any direction, and each part of its lever arm.
  double tilt_rad, lever_arm_m;
  /// Of a session: each coordinate of each lamp in the map.
  double map_error_m;
  /// So many of the sessions have a fault, and so many are damaged.
  double fault_share, damage_share;
};

struct Scene {
  std::uint64_t seed;
  /// Row time and read-out are given.
  Camera camera;
  Optics optics;
  Sensor sensor;
  std::optional<Picture> picture;
  Mount mount;
  /// Radiance of the ceiling.
  double ambient_e_per_s;
  std::vector<SceneLamp> lamps;
  Clutter clutter;
  std::optional<SceneBoard> board;
  std::vector<CaptureSet> sets;
  std::optional<ArchiveSpreads> archive;
};

/// Reads `vlp-scene/1`; datasets/README.md lists the keys, the scenes there explain them. Angles
/// are in degrees there. Throws InputError, with line and key: unknown or missing keys, figures
/// that cannot be, a lamp that is not above the camera, a spot outside the room.
Scene read_scene(const std::filesystem::path& file);

}  // namespace vlp
