// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "geometry/frames.h"
#include "rig/board.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Returns a random generator seeded by a seed, a name and an index alone; the same on every
/// machine.
cv::RNG make_generator(std::uint64_t seed, std::string_view name, std::size_t index);

/// Draws a random number of 64 bits from `random`, for use as the seed of another generator.
std::uint64_t draw_seed(cv::RNG& random);

/// Square wave that switches a lamp: lit while frac(frequency t + phase) < duty.
struct SquareWave {
  double frequency_hz;
  double duty;
  double phase;  // in periods

  /// Returns the lit fraction of the time from begin_s to end_s > begin_s, in closed form.
  double compute_mean_light_fraction(double begin_s, double end_s) const;
};

/// Wave of a light on the mains, as a fraction of its greatest brightness:
///   1 - depth + depth |sin(pi (frequency t + phase))|
/// The frequency is that of the light, twice the mains frequency.
struct RectifiedSine {
  double frequency_hz;
  double depth;
  double phase;  // in periods

  /// Returns the mean over the time from begin_s to end_s > begin_s, in closed form.
  double compute_mean_light_fraction(double begin_s, double end_s) const;
};

using LightWave = std::variant<SquareWave, RectifiedSine>;

/// Returns the wave with another phase, in periods.
LightWave copy_with_phase(LightWave wave, double phase);

/// Straight drive at constant speed.
struct StraightDrive {
  Eigen::Vector2d from_m, to_m;
  double speed_m_per_s;
};

/// Sinusoidal vibration of roll and pitch.
struct Vibration {
  double amplitude_rad, frequency_hz;
};

/// Captures of the lamps, at pivots or on a drive; the last-named index changes fastest.
///   At pivots: at each height, at each pivot, at each yaw, `repeat` captures.
///   On a drive: at each height, at each yaw, `repeat` passes, with a capture every interval_s.
struct LampShots {
  std::vector<double> heights_m;
  /// Position of the rotation axis in the world; on a drive, at each capture of a pass.
  std::vector<Eigen::Vector2d> pivots_m;
  std::optional<StraightDrive> drive;
  std::vector<double> yaws_rad;
  /// Amplitude of the uniform random error of each yaw.
  double yaw_jitter_rad;
  /// Yaw rate during each capture; on a drive also between captures.
  double turn_rate_rad_per_s;
  int repeat;
  /// Time from one capture to the next.
  double interval_s;
  /// True if captures.csv contains the exact camera position, as from a fixture that holds the
  /// camera itself.
  bool has_known_positions;
  /// Roll and pitch of the base at the first and at the last capture, linear in between, and their
  /// vibration.
  std::pair<double, double> roll_rad{0, 0}, pitch_rad{0, 0};
  Vibration vibration{0, 0};
};

/// Random views of the board from all sides.
struct BoardViews {
  int count;
  /// Minimum and maximum distance from the camera to the board's center.
  std::pair<double, double> distance_m;
  /// Largest angle between the board's normal and the line of sight, and largest rotation about the
  /// normal.
  double tilt_rad, roll_rad;
  /// Range of the board's center over the image: 0 for the image center, 1 up to the image edges.
  double field_coverage;
  /// Velocity of the board relative to the camera, in the camera frame.
  Eigen::Vector3d velocity_m_per_s;
};

/// Captures of one folder, either of the lamps or of the board.
struct CaptureSet {
  std::string folder;
  double exposure_s;
  std::optional<LampShots> lamps;
  std::optional<BoardViews> board;
};

/// Radiances (names that end in _e_per_s) are photoelectrons per second in a pixel on the optical
/// axis that the source fills.

/// Darkening of a reflector towards one side.
struct DarkSide {
  /// Fraction of the source's radiance at the rim in the direction of the azimuth.
  double reflector_ratio;
  /// Azimuth in the world, from x to y.
  double azimuth_rad;
};

/// Source deep in a reflector, visible through its rim, a circle of the diameter D.
///
/// A ray has the slope s (meters sideways for each meter up). It crosses the rim's plane at p from
/// its center, and the source's plane at q = p + depth s. Its radiance is
///   radiance (w + (1 - w) cos(a)^beam_power 2^-((2 |q| / source_diameter)^source_power))
/// with the angle a of the ray to the vertical. Half of the source's radiance is left at the source
/// diameter. The source appears at -depth s from the rim's center. The rim hides parts of it if
/// that is near or beyond D / 2.
///
/// The walls contribute the fraction
///   w = w0 (2 |p| / D)^rim_power 2^-((1 + cos(b) 2 |p| / D) |s| / (2 far_side_slope))
/// with the angle b between p and s. Walls are dark between source and rim and, for oblique views,
/// on the far side. The side next to the camera, where the source appears, keeps its light.
///
/// w0 is reflector_ratio. With a dark side, w0 varies linearly with the component of p along the
/// azimuth: from reflector_ratio at p = -D / 2 to that of the dark side at D / 2.
struct Recess {
  double depth_m;
  double source_diameter_m;
  double reflector_ratio;
  std::optional<DarkSide> dark_side;
  /// Exponents of the equation. source_power 2 is a Gaussian source; rim_power 0 are evenly lit
  /// walls; beam_power 0 is a source of equal radiance in all directions.
  double source_power = 2, rim_power = 0, beam_power = 0;
  /// Slope at which half of the light of the far side is left; all of it if not set.
  std::optional<double> far_side_slope = {};
};

/// Ceiling around a glow, lit by it. At r > D / 2 from the center of the diameter D it adds
///   radiance fraction exp(-(r - D / 2) / length)
/// up to 8 lengths from the rim.
struct Halo {
  double fraction;
  double length_m;
};

/// LED chips on a square grid that shine through a diffuser. Each chip within the disc, with its
/// center c, adds to the radiance at p
///   radiance fraction 2^-((2 |p - c| / width)^2).
/// Rows and columns of the grid have the distance `pitch_m`, along x and y of the world. One chip
/// is at the center of the disc.
struct Chips {
  double fraction;
  double pitch_m, width_m;
};

/// Bright spot of a disc. At p from the disc's center it adds to the radiance
///   radiance excess exp(-|p - center|^2 / (2 sigma^2))
struct HotSpot {
  Eigen::Vector2d center_m;  ///< from the disc's center, along x and y of the world
  double sigma_m;
  double excess;
};

/// LED chips behind a diffuser at random positions: `count` hot spots, distributed evenly over the
/// area. Sigma and the largest distance from the disc's center are fractions of its radius. The
/// excess is drawn uniformly between its bounds.
struct RandomChips {
  int count;
  double sigma_fraction;
  double within_fraction;
  double min_excess, max_excess;
};

/// Horizontal light with the shape of a lamp. At the fraction r of the distance from the center to
/// the outline, a round one has the radiance
///   radiance (1 - (1 - rim_to_center_ratio) r^2)
/// to which the chips of a disc add. A disc with a recess is the rim of the recess and has the
/// radiance of Recess instead. Other shapes have one such factor for each of their axes. Only discs
/// have a recess, chips, hot spots or a halo.
struct Glow {
  Eigen::Vector3d position_m;
  LampShape shape;
  double electron_rate_e_per_s;
  double rim_to_center_ratio;
  std::optional<Recess> recess = {};
  std::optional<Halo> halo = {};
  std::optional<Chips> chips = {};
  std::optional<RandomChips> random_chips = {};
  /// Hot spots drawn from random_chips by draw_random_parts().
  std::vector<HotSpot> hot_spots = {};

  /// Returns half of the first axis: the radius of a disc.
  double glow_radius_m() const { return shape.size_m->x() / 2; }
};

/// Lamp of the lamp map: a glow switched by a square wave.
struct SceneLamp {
  int id;
  Glow glow;
  double frequency_hz;
  double duty;
  /// Phase in periods at time 0: lit while frac(frequency t + phase) < duty. Without it the lamp
  /// runs free and has a random phase in each capture.
  std::optional<double> phase;
  /// Position in lamps.yaml minus true position, in the world.
  Eigen::Vector3d map_error_m;
};

/// Light of a lamp reflected by a shiny floor onto the ceiling. It fades to zero at its rim or
/// sides, and flickers with its lamp.
struct Reflection {
  Glow glow;
  std::size_t lamp;  // index into Scene::lamps
};

/// Rectangle in the world: a corner and the two edges from there, at right angles.
struct Panel {
  Eigen::Vector3d corner_m;
  Eigen::Vector3d edge_a_m, edge_b_m;
  double electron_rate_e_per_s;
};

/// Light of the building that is in no lamp map: dimmed by a square wave, or on the mains.
struct ForeignLight {
  Glow glow;
  /// Wave; its phase is replaced by the phase of each capture.
  LightWave wave;
  /// Phase in periods at time 0; without it, each capture has a random one.
  std::optional<double> phase;
};

/// Pane that reflects lamps, steady lamps and foreign lights on the camera's side of its plane,
/// without blur.
///
/// Each ray that meets the pane adds `reflectance` times the radiance met by the reflected ray.
/// Discs and rectangles are lit on both faces, recesses and halos only below. The light behind the
/// pane is unchanged. Panes do not reflect each other.
struct Mirror {
  Panel pane;  ///< its radiance is not used
  double reflectance;
};

/// Window behind a blind: bars along edge_a, one per slat, next to each other along edge_b. Each
/// bar covers `open_fraction` of its pitch, beginning at the side of the corner. The ceiling is
/// between the bars.
struct Blind {
  Panel window;
  int slats;
  double open_fraction;
};

/// Luminous text: `lines` rows of `letters` along edge_a, the first row at the end of edge_b. Each
/// letter is a random subset of the seven segments of a digit.
struct Sign {
  Panel panel;
  int lines, letters;
  /// Strokes as fractions of the edges, drawn by draw_random_parts().
  std::vector<Eigen::AlignedBox2d> strokes;
};

/// Objects in view other than the lamps.
struct Clutter {
  std::vector<Glow> steady_lamps;
  std::vector<Panel> windows;
  std::vector<Reflection> reflections;
  /// Opaque panels that hide everything behind them.
  std::vector<Panel> occluders;
  std::vector<ForeignLight> foreign_lights = {};
  std::vector<Mirror> mirrors = {};
  std::vector<Blind> blinds = {};
  std::vector<Sign> signs = {};
  /// Flicker of the ceiling's light (Scene::ambient_e_per_s), with a random phase in each capture.
  std::optional<RectifiedSine> ambient_flicker = {};
};

/// Disc of defocus with the radius |radius_px + tilt_px . (x, y)|. x and y run from -1 to 1 between
/// opposite edges of the image. The radius is 0 where a tilted focal plane crosses the sensor.
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

/// Speck of dust in front of the sensor, out of focus. Its soft shadow is fixed in the image and
/// takes the fraction `depth` of the light at its center.
struct Dust {
  Eigen::Vector2d at_px;
  double radius_px;
  double depth;
};

/// Blur, vignetting and contamination of a lens.
struct Optics {
  /// Sigma of the Gaussian point spread.
  double blur_px;
  /// Exponent p of the vignetting cos(a)^p, with the angle a to the optical axis; 4 is natural
  /// vignetting.
  double vignetting_power;
  std::optional<Defocus> defocus = {};
  /// Fraction of the light of the whole scene that a veil spreads evenly over the image.
  double veiling_glare = 0;
  std::vector<LensSmear> smears = {};
  std::vector<Dust> dust = {};
};

/// Overflow of charge above the full well: the given fraction goes to the surrounding pixels, as
/// a Gaussian.
struct Bloom {
  double fraction;
  double sigma_px;
};

/// Conversion of electrons to gray levels:
///   level = round(black level + gain (min(Poisson(mean) + bloom, full well) + Normal(read noise)))
struct Sensor {
  int bits;  // 8 or 16
  double gain_dn_per_e;
  double black_level_dn;
  double full_well_e;
  double read_noise_e;
  bool shot_noise;
  std::optional<Bloom> bloom;
};

/// Unsharp mask v + amount (v - G v), with the levels v and a Gaussian blur G of the sigma
/// radius_px.
struct Sharpening {
  double amount;
  double radius_px;
};

/// Mosaic of color filters over the pixels (RGGB): lines of red and green alternate with lines of
/// green and blue, from the first pixel on.
///
/// The members are the light that red and blue filters pass, divided by that of green ones. The
/// camera fills in each color by the mean of the nearest pixels that have it, and divides it by
/// that ratio.
struct Bayer {
  double red_to_green_ratio, blue_to_green_ratio;
};

/// In-camera processing of the sensor's levels, in this order:
///   demosaicing of rounded levels, if there are color filters
///   tone curve v = white ((level - black level) / (white - black level))^(1 / gamma), 0 to white
///   sharpening, rounding, JPEG
/// A scene without it has the levels of the sensor.
struct ImageProcessing {
  double gamma;
  std::optional<Sharpening> sharpening;
  /// JPEG quality as in libjpeg, 1 to 100, images of 8 bits only; PNG if not set.
  std::optional<int> jpeg_quality;
  std::optional<Bayer> bayer = {};
};

/// Mounting of the camera on a base that rotates about a vertical axis.
///
/// The camera is tilted without yaw (level_rotation_from_zenith()). Let t be the tilt and a its
/// azimuth, from the image's x to its y. The up direction in the camera frame is then (sin t cos a,
/// sin t sin a, cos t).
struct Mount {
  Eigen::Matrix3d level_from_camera;
  /// Vector from the rotation axis to the camera, in the level frame.
  Eigen::Vector2d lever_arm_m;
};

/// Calibration board with its radiances and its warp.
struct SceneBoard {
  Board pattern;
  double margin_m;
  /// Deflection into the paper at the center, along x and along y (calobject_warp of mrcal):
  ///   z = warp_x (1 - a^2) + warp_y (1 - b^2)
  /// with a and b from -1 to 1 over the tags.
  Eigen::Vector2d warp_m;
  double white_e_per_s, black_e_per_s, surround_e_per_s;
};

/// Variation of the cameras and sessions of an archive around the scene, see archive.h. Each value
/// is the half width of a uniform distribution.
struct ArchiveVariation {
  int sessions_per_camera;
  /// Variation of a camera: relative of both focal lengths together, of each coordinate of the
  /// center, and relative of each distortion coefficient.
  double focal_fraction, principal_point_px, distortion_fraction;
  /// Variation of a camera: additional tilt in a random direction, and each component of the lever
  /// arm.
  double tilt_rad, lever_arm_m;
  /// Variation of a session: map error of each coordinate of each lamp.
  double map_error_m;
  /// Fractions of the sessions with a fault, and with damage.
  double fault_fraction, damage_fraction;
};

/// Simulated world: camera, lamps, board, and the captures to render.
struct Scene {
  std::uint64_t seed;
  /// Camera with row time and readout direction.
  Camera camera;
  Optics optics;
  Sensor sensor;
  std::optional<ImageProcessing> processing;
  Mount mount;
  /// Radiance of the ceiling.
  double ambient_e_per_s;
  std::vector<SceneLamp> lamps;
  Clutter clutter;
  std::optional<SceneBoard> board;
  std::vector<CaptureSet> sets;
  std::optional<ArchiveVariation> archive;
};

/// Reads `vlp-scene/1`; datasets/README.md lists the keys, and the scenes there explain them.
/// Angles in the file are in degrees.
/// @throws InputError with line and key: unknown or missing keys, invalid values, a lamp that is
/// not above the camera, a pivot outside the room
Scene read_scene_file(const std::filesystem::path& file);

/// Draws the random parts of a scene that are the same in all captures, from its seed: the hot
/// spots of random chips, for each lamp by its id, and the letters of signs.
///
/// read_scene_file() calls it. Call it again after a change of the seed or of one of these parts.
void draw_random_parts(Scene& scene);

/// Returns the reflection about a panel's plane, in the world:
///   p -> p - 2 n n'(p - corner), with the unit normal n.
/// It is its own inverse; its linear part has the determinant -1.
Eigen::Isometry3d make_reflection_transform(const Panel& pane);

/// Returns true if light and eye are on one side of the mirror's plane, so that the mirror may show
/// the light.
bool are_on_same_side(const Mirror& mirror, const Eigen::Vector3d& light_m,
                      const Eigen::Vector3d& eye_m);

}  // namespace vlp
