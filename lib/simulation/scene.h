// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
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
#include "simulation/modulation.h"

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
///   radiance (w + (1 - w) cos(a)^beam_power 2^-((2 |q| / source_diameter)^source_power)),
/// with the angle a of the ray off the vertical, so that the source, of which half is left at its
/// diameter, shows at -depth s from the rim's centre, and is cut by the rim where that is near or
/// beyond D / 2. The walls give the share
///   w = w0 (2 |p| / D)^rim_power 2^-((1 + cos(b) 2 |p| / D) |s| / (2 far_side_slope)),
/// with the angle b between p and s: walls are dark between source and rim, and, seen from aside,
/// on the far side; the side next to the camera, where the source shows, keeps its light. w0 is
/// reflector_share; with a dark side it falls in proportion to p's way towards the azimuth, from
/// reflector_share at p = -D / 2 to the dark side's at D / 2.
struct Recess {
  double depth_m;
  double source_diameter_m;
  double reflector_share;
  std::optional<DarkSide> dark_side;
  /// Exponents of the equation: 2 is a Gaussian source; 0 are walls that are lit evenly, and a
  /// source that is as bright from all sides.
  double source_power = 2, rim_power = 0, beam_power = 0;
  /// Slope at which half of the light of the far side is left; without it all is.
  std::optional<double> far_side_slope = {};
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

/// A bright spot of a disc: at p from the disc's centre its radiance is more by
///   radiance excess exp(-|p - center|^2 / (2 sigma^2)).
struct HotSpot {
  Eigen::Vector2d center_m;  ///< from the disc's centre, along x and y of the world
  double sigma_m;
  double excess;
};

/// LED chips behind a diffuser at random places: `count` hot spots, sigma and the largest distance
/// of their centres from the disc's centre as fractions of its radius, the excess of each drawn
/// evenly between its bounds, places evenly over the area.
struct RandomChips {
  int count;
  double sigma_fraction;
  double within_fraction;
  double min_excess, max_excess;
};

/// A horizontal light of the shape of a lamp. The radiance of a round one at the fraction r of the
/// way from its centre to its outline is
///   radiance (1 - (1 - edge_share) r^2),
/// and the chips of a disc add to it; or that of its recess, of which the disc is the rim. Other
/// shapes have such a factor for the distance from the middle along each of their axes. Only discs
/// have a recess, chips, hot spots or a halo.
struct Glow {
  Eigen::Vector3d position_m;
  LampShape shape;
  double radiance_e_per_s;
  double edge_share;
  std::optional<Recess> recess = {};
  std::optional<Halo> halo = {};
  std::optional<Chips> chips = {};
  std::optional<RandomChips> random_chips = {};
  /// Drawn from random_chips by draw_random_parts().
  std::vector<HotSpot> hot_spots = {};

  /// Half of the first axis: the radius of a disc.
  double radius_m() const { return shape.size_m->x() / 2; }
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

/// A light of the building that is in no lamp map: dimmed by a square wave, or on the mains.
struct ForeignLight {
  Glow glow;
  /// The wave's phase is replaced by the phase of each capture.
  LightWave wave;
  /// Phase in periods at time 0; without it, each capture has a random one.
  std::optional<double> phase;
};

/// A pane that shows the mirror images of lamps, steady lamps and foreign lights on the camera's
/// side of its plane, sharply: each ray that meets the pane adds `reflectance` times the radiance
/// that the ray reflected there meets. Discs and rectangles are lit on both faces, recesses and
/// halos below. The light behind the pane stays as it is, and panes do not show each other.
struct Mirror {
  Panel pane;  ///< its radiance is not used
  double reflectance;
};

/// A window behind a blind: bars along edge_a, one per slat, side by side along edge_b. Each bar
/// takes up `open_fraction` of its pitch, from the side of the corner; the ceiling is between.
struct Blind {
  Panel window;
  int slats;
  double open_fraction;
};

/// Bright writing: `lines` of `letters` along edge_a, the first line at the end of edge_b. Each
/// letter is a random choice of the seven strokes of a digit on a calculator.
struct Sign {
  Panel panel;
  int lines, letters;
  /// In fractions of the edges, drawn by draw_random_parts().
  std::vector<Eigen::AlignedBox2d> strokes;
};

/// What is in view besides the lamps.
struct Clutter {
  std::vector<Glow> steady_lamps;
  std::vector<Panel> windows;
  std::vector<Reflection> reflections;
  /// Hide what is behind them.
  std::vector<Panel> occluders;
  std::vector<ForeignLight> foreign_lights = {};
  std::vector<Mirror> mirrors = {};
  std::vector<Blind> blinds = {};
  std::vector<Sign> signs = {};
  /// Flicker of the ceiling's light, Scene::ambient_e_per_s, with a random phase in each capture.
  std::optional<RectifiedSine> ambient_flicker = {};
};

/// Disc of defocus, with the radius |radius_px + tilt_px . (x, y)|: x and y are -1 to 1 from one
/// edge of the image to the other. A tilted focal plane crosses the sensor where the radius is 0.
struct Defocus {
  double radius_px;
  Eigen::Vector2d tilt_px{0, 0};
};

/// Smear on the lens: in a soft spot around `at_px` a fraction of the light spreads into a Gaussian
/// halo.
struct LensSmear {
  Eigen::Vector2d at_px;
  double radius_px;
  double fraction;
  double sigma_px;
};

/// Speck of dust in front of the sensor, out of focus: a soft shadow that is fixed in the image and
/// takes the fraction `depth` of the light in its middle.
struct Dust {
  Eigen::Vector2d at_px;
  double radius_px;
  double depth;
};

struct Optics {
  /// Sigma of the Gaussian point spread.
  double blur_px;
  /// A ray at the angle a from the optical axis arrives weakened by cos(a)^power; 4 is natural.
  double vignetting_power;
  std::optional<Defocus> defocus = {};
  /// Fraction of the light of all the scene that a veil spreads evenly over the image.
  double veil = 0;
  std::vector<LensSmear> smears = {};
  std::vector<Dust> dust = {};
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

/// Draws what a scene leaves to chance in all of its captures, from its seed: the hot spots of
/// random chips, for each lamp by its id, and the letters of signs. read_scene() does; to be done
/// again when the seed or one of these has changed.
void draw_random_parts(Scene& scene);

}  // namespace vlp
