// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// consistency_trials [DRAWS [METHOD]]: compares the standard deviations that each method reports
/// with its errors, over synthetic captures with known truth. DRAWS per cell is 200; METHOD is one
/// of `circle`, `axis`, `lamps`, `dispersion-camera`, `dispersion-paper`, `adjust`,
/// `locate`, or all of them by default.
///
/// A cell is a map error, a number of captures, the headings of the camera and the reported noise
/// of the detections. Each draw has its own map, captures and noise. Columns:
///   results   draws with a result;
///   warned    of these, draws with a warning;
///   no sd     of these, draws without a standard deviation;
///   e/sd, in  per parameter, over the draws without a warning: root mean square of the error over
///             its standard deviation, and the percentage of errors within 1.96 of them.
/// `*` marks a cell outside 0.85 to 1.2 or 93 to 97 %, `**` one that is outside by more than three
/// standard errors of the draws. Cells are evaluated if at least 10 % of their draws have a
/// standard deviation and no warning.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/tilt/drive.h"
#include "geometry/angles.h"
#include "geometry/frames.h"
#include "rig/calibration_error.h"
#include "session/adjust_step.h"
#include "session/dispersion_step.h"
#include "session/locate_step.h"
#include "session/rotation_step.h"
#include "support/random.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr double kNoise_px = 0.3;
/// Factor by which reported noise is too small in the cells of Noise::too_small.
constexpr double kUnderstatement = 1.4;
constexpr double kTilt_rad = 0.026;  // 1.5 degrees
constexpr double kTiltAzimuth_rad = 0.7;
/// Standard deviation of the known positions of an adjustment.
constexpr double kPlaceSd_m = 1e-3;

constexpr double kMinRatio = 0.85, kMaxRatio = 1.2;
constexpr double kMinCoverage = 0.93, kMaxCoverage = 0.97;
/// Minimum fraction of the draws without a warning for a cell to be evaluated.
constexpr double kMinPassingFraction = 0.1;
/// Number of standard errors beyond which a deviation is not due to the number of draws.
constexpr double kMaxStandardErrors = 3;

enum class Heading { all, opposite, one };
enum class Noise { stated, not_stated, too_small };

constexpr std::array kMapSds_m{0.0, 2e-3};
constexpr std::array kCaptures{3, 6, 12, 40};
constexpr std::array kHeadings{Heading::all, Heading::opposite, Heading::one};
constexpr std::array kNoises{Noise::stated, Noise::not_stated, Noise::too_small};

constexpr const char* to_string(Heading heading) {
  switch (heading) {
    case Heading::all:
      return "all yaws";
    case Heading::opposite:
      return "opposite";
    case Heading::one:
      return "+-10 deg";
  }
  return "";
}

constexpr const char* to_string(Noise noise) {
  switch (noise) {
    case Noise::stated:
      return "stated";
    case Noise::not_stated:
      return "not stated";
    case Noise::too_small:
      return "too small";
  }
  return "";
}

struct Cell {
  double map_sd_m;
  int captures;
  Heading heading;
  Noise noise;
};

/// Errors of one parameter over their standard deviations, one entry per axis and capture.
using NormalizedErrors = std::vector<double>;

/// Result of one draw.
struct Trial {
  bool has_result = false;
  bool is_warned = false;
  /// One entry per parameter of the method; empty without a standard deviation.
  std::vector<NormalizedErrors> errors = {};
};

/// Returns the height of capture `k`, one of two. It changes with every second capture, so that it
/// does not go together with opposite yaws.
double height_m(int k) { return k / 2 % 2 == 0 ? 0 : 0.3; }

/// Draws the captures of one cell: lamps, a tilted camera, and a survey of the lamps.
class Room {
 public:
  Room(const Cell& cell, double tilt_rad, Random& random)
      : cell_(cell),
        random_(random),
        rig_(make_tilted_rig(tilt_rad, kTiltAzimuth_rad)),
        surveyed_(rig_.map),
        base_yaw_rad_(random.uniform(-std::numbers::pi, std::numbers::pi)) {
    for (Lamp& lamp : surveyed_.lamps) {
      lamp.sd_m = cell.map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += cell.map_sd_m * random.normal();
    }
  }

  const LampMap& true_map() const { return rig_.map; }
  const LampMap& surveyed_map() const { return surveyed_; }
  const Calibration& calibration() const { return rig_.calibration; }
  const RotationCenter& center() const { return *rig_.calibration.rotation_center; }

  /// Returns the yaw of capture `k`. All yaws: unevenly around the circle, which already three
  /// captures cover.
  double draw_yaw(int k) {
    constexpr double uneven = 0.3;
    switch (cell_.heading) {
      case Heading::all:
        return base_yaw_rad_ +
               2 * std::numbers::pi * (k + random_.uniform(-uneven, uneven)) / cell_.captures;
      case Heading::opposite:
        return base_yaw_rad_ + (k % 2 == 0 ? 0 : std::numbers::pi);
      case Heading::one:
        break;
    }
    return base_yaw_rad_ + rad_from_deg(random_.uniform(-10, 10));
  }

  /// Returns a pose anywhere below the lamps, at two heights.
  Pose draw_pose(int k) {
    const double x_m = random_.uniform(-0.5, 0.5), y_m = random_.uniform(-0.3, 0.3);
    return {{x_m, y_m, height_m(k)}, draw_yaw(k)};
  }

  /// Computes the lamps that lie in the image, without noise.
  std::vector<Detection> exact_detections(const Pose& pose) {
    rig_.camera = pose;
    std::vector<Detection> detections = seen_from(rig_, kNoise_px);
    std::erase_if(detections, [&](const Detection& detection) {
      const auto& [width_px, height_px] = rig_.calibration.camera.imager_px;
      return detection.pixel.minCoeff() < 0 || detection.pixel.x() >= width_px ||
             detection.pixel.y() >= height_px;
    });
    return detections;
  }

  /// Adds noise to detections, and sets its reported size as the cell requires.
  std::vector<Detection> draw_noise(std::vector<Detection> exact) {
    std::vector<Detection> detections = with_noise(std::move(exact), random_);
    for (Detection& detection : detections) {
      if (cell_.noise == Noise::not_stated) detection.sigma_px.reset();
      if (cell_.noise == Noise::too_small) detection.sigma_px = kNoise_px / kUnderstatement;
    }
    return detections;
  }

  std::vector<Detection> draw_detections(const Pose& pose) {
    return draw_noise(exact_detections(pose));
  }

 private:
  const Cell& cell_;
  Random& random_;
  SyntheticRig rig_;
  LampMap surveyed_;
  double base_yaw_rad_;
};

/// Camera that rotates about an axis at one or more heights.
struct Turn {
  Eigen::Vector2d axis_m{0.05, -0.03};
  Eigen::Vector2d lever_arm_m;
  std::vector<double> heights_m;

  Pose pose(std::size_t height, double yaw_rad) const {
    Eigen::Vector3d position_m(axis_m.x(), axis_m.y(), heights_m[height]);
    position_m.head<2>() += rotation_about_z(yaw_rad).topLeftCorner<2, 2>() * lever_arm_m;
    return {position_m, yaw_rad};
  }
};

/// Rotation with a lever arm, at two heights, which determine it.
Turn make_two_turns() { return {.lever_arm_m = {0.012, -0.009}, .heights_m = {0, 0.3}}; }

/// Divides errors by the square roots of the variances on the diagonal of `covariance`.
NormalizedErrors normalize(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  NormalizedErrors normalized;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    normalized.push_back(error[i] / std::sqrt(covariance(i, i)));
  }
  return normalized;
}

/// Returns true unless a warning is the one about the lever arm, which `circle` gives
/// for all captures.
bool has_warning(const StepResult& result) {
  return std::ranges::any_of(result.warnings, [](const std::string& warning) {
    return warning.find("lever arm") == std::string::npos;
  });
}

Trial make_trial(const StepResult& result) {
  return {.has_result = result.has_succeeded(),
          .is_warned = result.has_succeeded() && has_warning(result)};
}

void add_center_errors(Trial& trial, const Calibration& found, const RotationCenter& truth) {
  const auto covariance_px2 = compute_center_covariance(found);
  if (!covariance_px2) return;
  trial.errors.push_back(
      normalize(found.rotation_center->center_px - truth.center_px, *covariance_px2));
}

void add_lever_arm_errors(Trial& trial, const Calibration& found, const Eigen::Vector2d& arm_m) {
  const auto covariance_m2 = find_parameter_covariance(found, kLeverArmParameter);
  if (!covariance_m2) {
    trial.errors.clear();
    return;
  }
  trial.errors.push_back(normalize(*found.rotation_center->lever_arm_m - arm_m, *covariance_m2));
}

Trial try_rotation(const Cell& cell, Random& random, RotationMethod method, double tilt_rad,
                   const Turn& turn) {
  Room room(cell, tilt_rad, random);
  LampCaptures input{{}, room.surveyed_map(), {}, extract_camera(room.calibration())};
  for (std::size_t height = 0; height < turn.heights_m.size(); ++height) {
    for (int k = 0; k < cell.captures; ++k) {
      const Pose pose = turn.pose(height, room.draw_yaw(k));
      input.frames.push_back({std::to_string(input.frames.size()), room.draw_detections(pose)});
    }
  }
  const RotationResult result = run_rotation_step(input, method, {});
  Trial trial = make_trial(result);
  if (!trial.has_result) return trial;
  add_center_errors(trial, result.calibration, room.center());
  if (method == RotationMethod::axis) {
    add_lever_arm_errors(trial, result.calibration, turn.lever_arm_m);
  }
  return trial;
}

/// Level camera on its axis, for which `circle` is exact.
Trial try_circle(const Cell& cell, Random& random) {
  return try_rotation(cell, random, RotationMethod::circle, 0,
                      {.lever_arm_m = Eigen::Vector2d::Zero(), .heights_m = {0}});
}

Trial try_axis(const Cell& cell, Random& random) {
  return try_rotation(cell, random, RotationMethod::axis, kTilt_rad, make_two_turns());
}

Trial try_lamps(const Cell& cell, Random& random) {
  Room room(cell, kTilt_rad, random);
  LampCaptures input{{}, room.surveyed_map(), {}, extract_camera(room.calibration())};
  for (int k = 0; k < cell.captures; ++k) {
    input.frames.push_back({std::to_string(k), room.draw_detections(room.draw_pose(k))});
  }
  const TiltResult result = run_tilt_step(input, false, {});
  Trial trial = make_trial(result);
  if (trial.has_result) add_center_errors(trial, result.calibration, room.center());
  return trial;
}

/// Camera at a known reference point, with a zenith error of 0.01 rad. The true offset is that of
/// the same captures without noise, with the true map.
Trial try_dispersion(const Cell& cell, Random& random, DispersionMethod method) {
  constexpr double zenith_error_rad = 0.01;
  const Eigen::Vector2d reference_point_m(0.05, -0.1);
  const bool has_two_heights = method == DispersionMethod::camera;
  Room room(cell, kTilt_rad, random);
  Calibration believed = room.calibration();
  believed.rotation_center =
      tilted_by(believed.camera, kTilt_rad - zenith_error_rad, kTiltAzimuth_rad);
  std::vector<ReferencePointCapture> exact;
  LampCaptures input{{}, room.surveyed_map(), {}, believed};
  KnownPositions places;
  for (int k = 0; k < cell.captures; ++k) {
    const double z_m = has_two_heights ? height_m(k) : 0;
    const Pose pose{{reference_point_m.x(), reference_point_m.y(), z_m}, room.draw_yaw(k)};
    exact.push_back({room.exact_detections(pose), reference_point_m});
    places.captures.push_back({room.draw_noise(exact.back().detections), reference_point_m});
    places.measured_points.push_back(MeasuredPoint::camera);
    input.frames.push_back({std::to_string(k), places.captures.back().detections});
  }
  const DispersionResult result =
      run_dispersion_step(input, places, method, DispersionCircle::mean, {});
  Trial trial = make_trial(result);
  const DispersionFit truth = estimate_dispersion(exact, room.true_map(), believed, method);
  if (!trial.has_result || truth.status != DispersionStatus::ok) return trial;
  const Dispersion& found = result.fit.dispersion;
  const auto covariance_px2 = compute_offset_covariance(result.calibration);
  if (!covariance_px2) return trial;
  trial.errors.push_back(normalize(found.offset_px - truth.dispersion.offset_px, *covariance_px2));
  return trial;
}

Trial try_camera_dispersion(const Cell& cell, Random& random) {
  return try_dispersion(cell, random, DispersionMethod::camera);
}

Trial try_paper_dispersion(const Cell& cell, Random& random) {
  return try_dispersion(cell, random, DispersionMethod::chen_guan);
}

/// Rotations at two heights, with the axis position measured once at each.
Trial try_adjustment(const Cell& cell, Random& random) {
  const Turn turn = make_two_turns();
  Room room(cell, kTilt_rad, random);
  AdjustStepInput input;
  input.lamps = room.surveyed_map();
  input.calibration = extract_camera(room.calibration());
  AdjustSet set{.name = "turns", .frames = {}, .captures = {}};
  for (std::size_t height = 0; height < turn.heights_m.size(); ++height) {
    Capture measured;
    measured.x_m = turn.axis_m.x() + kPlaceSd_m * random.normal();
    measured.y_m = turn.axis_m.y() + kPlaceSd_m * random.normal();
    measured.z_m = turn.heights_m[height] + kPlaceSd_m * random.normal();
    measured.measured_point = MeasuredPoint::axis;
    measured.position_sd_m = kPlaceSd_m;
    measured.pivot = std::to_string(height);
    for (int k = 0; k < cell.captures; ++k) {
      const std::string image = std::to_string(set.frames.size());
      const Pose pose = turn.pose(height, room.draw_yaw(k));
      set.frames.push_back({image, room.draw_detections(pose)});
      set.captures[image] = measured;
    }
  }
  input.sets.push_back(std::move(set));
  const AdjustStepResult result = run_adjust_step(input, {});
  Trial trial = make_trial(result);
  if (!trial.has_result) return trial;
  add_center_errors(trial, result.calibration, room.center());
  if (result.adjustment.center.lever_arm_m)
    add_lever_arm_errors(trial, result.calibration, turn.lever_arm_m);
  else
    trial.errors.clear();
  return trial;
}

/// Fixes of all captures of a cell; the calibration is exact.
Trial try_fixes(const Cell& cell, Random& random) {
  Room room(cell, kTilt_rad, random);
  LocateInput input{.frames = {}, .lamps = room.surveyed_map(), .calibration = room.calibration()};
  std::vector<Pose> truth;
  for (int k = 0; k < cell.captures; ++k) {
    truth.push_back(room.draw_pose(k));
    input.frames.push_back({std::to_string(k), room.draw_detections(truth.back())});
  }
  const LocateResult result = locate_from_detections(input);
  Trial trial = make_trial(result);
  if (!trial.has_result) return trial;
  trial.errors.resize(3);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const auto& fix = result.rows[k].fix;
    if (!fix || !fix->sd) continue;
    const Eigen::Vector3d error_m = fix->pose.position_m - truth[k].position_m;
    const double yaw_error_rad = wrap_angle_rad(fix->pose.yaw_rad - truth[k].yaw_rad);
    trial.errors[0].push_back(error_m.x() / (*fix->sd)[0]);
    trial.errors[0].push_back(error_m.y() / (*fix->sd)[1]);
    trial.errors[1].push_back(error_m.z() / (*fix->sd)[2]);
    trial.errors[2].push_back(yaw_error_rad / (*fix->sd)[3]);
  }
  if (trial.errors[0].empty()) trial.errors.clear();
  return trial;
}

struct Parameter {
  const char* name;
  int axes;
};

struct Method {
  const char* name;
  std::vector<Parameter> parameters;
  Trial (*run)(const Cell& cell, Random& random);
};

std::vector<Method> make_methods() {
  return {{"circle", {{"center", 2}}, try_circle},
          {"axis", {{"zenith", 2}, {"lever arm", 2}}, try_axis},
          {"lamps", {{"zenith", 2}}, try_lamps},
          {"dispersion-camera", {{"offset", 2}}, try_camera_dispersion},
          {"dispersion-paper", {{"offset", 2}}, try_paper_dispersion},
          {"adjust", {{"zenith", 2}, {"lever arm", 2}}, try_adjustment},
          {"locate", {{"x and y", 2}, {"height", 1}, {"yaw", 1}}, try_fixes}};
}

/// Errors of one parameter over all draws of a cell that have no warning. One that is not a number
/// counts as infinite.
struct Consistency {
  double squares = 0;
  int count = 0, within = 0;

  void add(const NormalizedErrors& errors) {
    for (const double error : errors) {
      squares += std::isnan(error) ? INFINITY : error * error;
      ++count;
      within += std::abs(error) <= 1.96 ? 1 : 0;
    }
  }
  double ratio() const { return std::sqrt(squares / count); }
  double coverage() const { return static_cast<double>(within) / count; }
};

/// Side of the limits on which a value lies.
enum class Verdict { honest, too_small, too_large };

/// Compares reported standard deviations with errors, with limits widened by a number of standard
/// errors of `independent` errors: too small if errors are larger than reported.
Verdict judge(const Consistency& found, int independent, double standard_errors) {
  const double n = independent;
  const double ratio_margin = standard_errors / std::sqrt(2 * n);
  const double coverage_margin = standard_errors * std::sqrt(0.05 * 0.95 / n);
  if (found.ratio() > kMaxRatio * (1 + ratio_margin) ||
      found.coverage() < kMinCoverage - coverage_margin) {
    return Verdict::too_small;
  }
  if (found.ratio() < kMinRatio * (1 - ratio_margin) ||
      found.coverage() > kMaxCoverage + coverage_margin) {
    return Verdict::too_large;
  }
  return Verdict::honest;
}

struct CellResult {
  int results = 0, warned = 0, without_sd = 0, passing = 0;
  std::vector<Consistency> parameters;
};

CellResult run_cell(const Method& method, const Cell& cell, int draws, std::uint64_t seed) {
  CellResult result;
  result.parameters.resize(method.parameters.size());
  Random random(seed);
  for (int i = 0; i < draws; ++i) {
    const Trial trial = method.run(cell, random);
    result.results += trial.has_result ? 1 : 0;
    result.warned += trial.is_warned ? 1 : 0;
    if (!trial.has_result) continue;
    if (trial.errors.empty()) ++result.without_sd;
    if (trial.is_warned || trial.errors.empty()) continue;
    ++result.passing;
    for (std::size_t p = 0; p < trial.errors.size(); ++p) {
      result.parameters[p].add(trial.errors[p]);
    }
  }
  return result;
}

/// Counts over the cells of one method.
struct Tally {
  int cells = 0, results = 0, judged = 0, outside = 0;
  /// Cells that are significantly outside, by side.
  int too_small = 0, too_large = 0;
};

/// Evaluates the parameters of a cell, adds them to the tally, and returns the mark of the cell.
const char* mark_cell(const Method& method, const CellResult& cell, int draws, Tally& tally) {
  ++tally.cells;
  tally.results += cell.results;
  if (cell.passing < kMinPassingFraction * draws || cell.passing == 0) return "";
  ++tally.judged;
  bool is_outside = false, is_too_small = false, is_too_large = false;
  for (std::size_t p = 0; p < cell.parameters.size(); ++p) {
    const int independent = cell.passing * method.parameters[p].axes;
    is_outside = is_outside || judge(cell.parameters[p], independent, 0) != Verdict::honest;
    const Verdict verdict = judge(cell.parameters[p], independent, kMaxStandardErrors);
    is_too_small = is_too_small || verdict == Verdict::too_small;
    is_too_large = is_too_large || verdict == Verdict::too_large;
  }
  tally.outside += is_outside ? 1 : 0;
  tally.too_small += is_too_small ? 1 : 0;
  tally.too_large += is_too_large ? 1 : 0;
  if (is_too_small || is_too_large) return "**";
  return is_outside ? "*" : "";
}

void print_row(const Cell& cell, const CellResult& result, const char* mark) {
  fmt::print("{:3.0f} mm  {:8}  {:8}  {:10}  {:7}  {:6}  {:5}", 1e3 * cell.map_sd_m, cell.captures,
             to_string(cell.heading), to_string(cell.noise), result.results, result.warned,
             result.without_sd);
  for (const Consistency& parameter : result.parameters) {
    if (parameter.count == 0) {
      fmt::print("  {:>6} {:>6}", "-", "-");
    } else {
      fmt::print("  {:6.2f} {:5.1f}%", parameter.ratio(), 100 * parameter.coverage());
    }
  }
  fmt::print("  {}\n", mark);
}

/// Prints the table of a method. Returns false if no draw has a result.
bool run_method(const Method& method, int draws) {
  const std::clock_t begin = std::clock();
  fmt::print("{}: e/sd and coverage of", method.name);
  for (const Parameter& parameter : method.parameters) fmt::print(" {};", parameter.name);
  fmt::print("\n{:6}  {:8}  {:8}  {:10}  {:7}  {:6}  {:5}", "map", "captures", "heading", "noise",
             "results", "warned", "no sd");
  for (std::size_t p = 0; p < method.parameters.size(); ++p) {
    fmt::print("  {:>6} {:>6}", "e/sd", "in");
  }
  fmt::print("\n");
  Tally tally;
  for (const double map_sd_m : kMapSds_m) {
    for (const int captures : kCaptures) {
      for (const Heading heading : kHeadings) {
        for (const Noise noise : kNoises) {
          const Cell cell{map_sd_m, captures, heading, noise};
          const auto seed = static_cast<std::uint64_t>(tally.cells) + 1;
          const CellResult result = run_cell(method, cell, draws, seed);
          print_row(cell, result, mark_cell(method, result, draws, tally));
        }
      }
    }
  }
  fmt::print(
      "{}: {} cells, {} judged, {} outside; beyond chance: sd too small in {}, too large in {}; "
      "{:.1f} s of processor time\n\n",
      method.name, tally.cells, tally.judged, tally.outside, tally.too_small, tally.too_large,
      static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  return tally.results > 0;
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  constexpr int default_draws = 200;
  const int draws = argc > 1 ? std::atoi(argv[1]) : default_draws;
  if (draws < 1) {
    fmt::print(stderr, "consistency_trials: DRAWS is '{}', not a number above 0\n", argv[1]);
    return 2;
  }
  const std::string_view wanted = argc > 2 ? argv[2] : "";
  bool has_results = true, has_method = false;
  for (const vlp::Method& method : vlp::make_methods()) {
    if (!wanted.empty() && wanted != method.name) continue;
    has_method = true;
    has_results = vlp::run_method(method, draws) && has_results;
  }
  if (!has_method) {
    fmt::print(stderr, "consistency_trials: no method is called '{}'\n", wanted);
    return 2;
  }
  fmt::print("{:.1f} s of processor time\n", static_cast<double>(std::clock()) / CLOCKS_PER_SEC);
  return has_results ? 0 : 1;
}
