// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/map/map_errors.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "camera/lens.h"
#include "geometry/frames.h"
#include "geometry/median.h"
#include "geometry/similarity.h"
#include "geometry/symmetric.h"
#include "positioning/correction.h"
#include "positioning/inclination_rotation.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Probability of a false alarm per map.
constexpr double kFalseAlarm = 0.01;

/// Ray (z, 1) to a lamp in the level frame of the camera.
struct LevelRay {
  const Lamp* lamp;
  Eigen::Vector2d z;
};

/// Returns the rays to the lamps of the map. Omits lamps that are detected twice.
std::vector<LevelRay> compute_level_rays(const Frame& frame, const LampMap& map, const Lens& lens,
                                         const Eigen::Matrix3d& level_from_camera) {
  std::vector<LevelRay> rays;
  std::map<int, int> counts;
  for (const Detection& detection : frame.detections) ++counts[detection.lamp];
  for (const Detection& detection : frame.detections) {
    const Lamp* lamp = find_lamp_by_id(map.lamps, detection.lamp);
    if (lamp == nullptr || counts[lamp->id] > 1) continue;
    const auto ray = lens.unproject_pixel(detection.pixel);
    if (!ray) continue;
    const Eigen::Vector3d level = level_from_camera * ray->direction;
    if (level.z() > 0) rays.push_back({lamp, level.hnormalized()});
  }
  return rays;
}

double rms_radius(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d sum(0, 0);
  double squares = 0;
  for (const Eigen::Vector2d& point : points) {
    sum += point;
    squares += point.squaredNorm();
  }
  const auto count = static_cast<double>(points.size());
  return std::sqrt(std::max(0.0, squares / count - (sum / count).squaredNorm()));
}

using LampPositions = std::map<int, Eigen::Vector2d>;

/// Returns the displaced positions of the lamps, scaled to the size of the map.
std::vector<Eigen::Vector2d> compute_displaced_positions(const LampDisplacements& found) {
  Eigen::Vector2d mean_m(0, 0);
  std::vector<Eigen::Vector2d> positions_m;
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    positions_m.push_back(found.displaced_lamp_position_m(i));
    mean_m += positions_m.back() / static_cast<double>(found.lamps.size());
  }
  const double scale = rms_radius(found.map_m) / rms_radius(positions_m);
  for (Eigen::Vector2d& displaced_position_m : positions_m)
    displaced_position_m = mean_m + scale * (displaced_position_m - mean_m);
  return positions_m;
}

/// Projects the rays onto the ceiling from the camera pose that fits the displaced lamps best. The
/// height is the ratio of the sizes of both patterns, so that errors of the map barely change it.
std::optional<CeilingView> project_rays_to_ceiling(const std::vector<LevelRay>& rays,
                                                   const LampPositions& positions_m) {
  std::vector<Eigen::Vector2d> z, lamps_m;
  double mean_z_m = 0;
  for (const LevelRay& ray : rays) {
    lamps_m.push_back(positions_m.at(ray.lamp->id));
    z.push_back(ray.z);
    mean_z_m += ray.lamp->position_m.z() / static_cast<double>(rays.size());
  }
  double height_m = rms_radius(lamps_m) / rms_radius(z);
  const auto above_m = [&](std::size_t i) {
    return rays[i].lamp->position_m.z() - mean_z_m + height_m;
  };
  Similarity pose{{0, 0}, {1, 0}};
  constexpr int iterations = 3;
  constexpr double max_factor = 1.25;  // beyond it the fit is meaningless
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const auto fit = fit_similarity_transform(
        z.size(), [&](std::size_t i) -> Eigen::Vector2d { return above_m(i) * z[i]; },
        [&](std::size_t i) { return lamps_m[i]; });
    if (!fit) break;
    const double factor = fit->factor.norm();
    pose = {fit->offset, fit->factor / factor};
    if (std::max(factor, 1 / factor) > max_factor) break;
    height_m *= factor;
  }
  CeilingView view{pose.offset, {}, std::atan2(pose.factor.y(), pose.factor.x())};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!(above_m(i) > 0) || !std::isfinite(height_m)) return std::nullopt;
    view.lamps.push_back({rays[i].lamp->id,
                          pose.offset + complex_product(pose.factor, above_m(i) * z[i]),
                          above_m(i)});
  }
  return view;
}

/// Captures of a stationary camera.
struct MapCaptures {
  std::span<const Frame> frames;
  const Calibration& calibration;
  const MapErrorOptions& options;
  const Lens lens{calibration.camera.lens_model, calibration.camera.intrinsics};
  /// Projects the captures with three lamps or more.
  std::vector<CeilingView> make_ceiling_views(const LampMap& map,
                                              const Eigen::Matrix3d& base_from_camera,
                                              const LampPositions& positions_m) const {
    constexpr std::size_t min_lamps = 3;
    std::vector<CeilingView> views;
    const auto& inclinations = options.inclinations;
    const std::size_t stride = 1 + (frames.size() - 1) / options.max_captures;
    for (std::size_t i = 0; i < frames.size(); i += stride) {
      const bool is_inclined = !inclinations.empty() && inclinations[i];
      const Eigen::Matrix3d level_from_base = compute_level_from_base(
          is_inclined ? *inclinations[i] : Inclination{0, 0}, options.yaw_in_robot_rad);
      const auto rays =
          compute_level_rays(frames[i], map, lens, level_from_base * base_from_camera);
      if (rays.size() < min_lamps) continue;
      if (auto view = project_rays_to_ceiling(rays, positions_m)) views.push_back(std::move(*view));
    }
    return views;
  }

  /// Estimates the displacements. Iterates, because the equations are linearized at the pose of
  /// each capture with respect to the tilt and to differences of height.
  std::optional<LampDisplacements> estimate_displacements(const LampMap& map) const {
    constexpr int max_iterations = 8;
    constexpr double tolerance_m = 1e-6;
    const bool tilt_is_free = !calibration.rotation_center;
    Eigen::Matrix3d base_from_camera =
        tilt_is_free ? Eigen::Matrix3d::Identity()
                     : compute_level_from_camera_matrix(calibration, Correction::all);
    LampPositions positions_m;
    for (const Lamp& lamp : map.lamps) positions_m[lamp.id] = lamp.position_m.head<2>();
    std::optional<LampDisplacements> found;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      found = estimate_lamp_displacements(
          map, make_ceiling_views(map, base_from_camera, positions_m), tilt_is_free);
      if (!found) return std::nullopt;
      double change_m = found->tilt.norm() * rms_radius(found->map_m);
      const std::vector<Eigen::Vector2d> displaced_m = compute_displaced_positions(*found);
      for (std::size_t i = 0; i < found->lamps.size(); ++i) {
        Eigen::Vector2d& displaced_position_m = positions_m.at(found->lamps[i]);
        change_m = std::max(change_m, (displaced_m[i] - displaced_position_m).norm());
        displaced_position_m = displaced_m[i];
      }
      if (change_m < tolerance_m) break;
      const Eigen::Vector3d up(-found->tilt.x(), -found->tilt.y(), 1);
      const Eigen::Vector3d zenith = base_from_camera.transpose() * up.normalized();
      if (!(zenith.z() > 0)) return std::nullopt;
      if (tilt_is_free) base_from_camera = level_rotation_from_zenith(zenith);
    }
    return found;
  }
};

/// Displacements as independent coordinates, and tests of the lamps that explain them.
class DisplacementTest {
 public:
  struct Fit {
    double chi_squared;
    /// Two rows per free lamp.
    Eigen::VectorXd offsets_m;
    Eigen::MatrixXd covariance_m2;
  };

  DisplacementTest(const LampDisplacements& found, const LampMap& map)
      : lamps_(found.lamps.size()) {
    const Eigen::Index size = found.displacement_m.size();
    Eigen::MatrixXd covariance = found.covariance_m2;
    for (Eigen::Index i = 0; i < size; ++i) {
      const auto sd_m =
          find_lamp_by_id(map.lamps, found.lamps[static_cast<std::size_t>(i / 2)])->sd_m;
      variance_is_known_ = variance_is_known_ && sd_m;
      covariance(i, i) += sd_m.value_or(0) * sd_m.value_or(0) + kNumericVariance_m2;
    }
    const auto range = eigendecompose_symmetric_matrix(found.projector);
    const Eigen::Index rank = (range.values.array() > 0.5).count();
    const Eigen::MatrixXd basis = range.vectors.rightCols(rank);
    const auto [values, vectors] =
        eigendecompose_symmetric_matrix(Eigen::MatrixXd(basis.transpose() * covariance * basis));
    variances_m2_ = values.cwiseMax(kNumericVariance_m2);
    basis_ = basis * vectors;
    coordinates_ = basis_.transpose() * found.displacement_m;
  }

  Eigen::Index count_determined_unknowns() const { return basis_.cols(); }

  /// Fits offsets of the free lamps to the coordinates, with the variance of the other lamps.
  Fit fit_map_errors(const std::vector<std::size_t>& free, double added_m2) const {
    const auto size = 2 * std::ssize(free);
    const Eigen::ArrayXd weights = (variances_m2_.array() + added_m2).inverse();
    Eigen::MatrixXd jacobian(size, count_determined_unknowns());
    for (Eigen::Index k = 0; k < size; k += 2) {
      const auto lamp = static_cast<Eigen::Index>(free[static_cast<std::size_t>(k / 2)]);
      jacobian.middleRows<2>(k) = basis_.middleRows<2>(2 * lamp);
    }
    const Eigen::MatrixXd weighted = jacobian * weights.matrix().asDiagonal();
    const Eigen::VectorXd gradient = weighted * coordinates_;
    Fit fit{(weights * coordinates_.array().square()).sum(), {}, {}};
    fit.covariance_m2 = solve_symmetric_system(weighted * jacobian.transpose(),
                                               Eigen::MatrixXd::Identity(size, size));
    fit.offsets_m = fit.covariance_m2 * gradient;
    fit.chi_squared -= gradient.dot(fit.offsets_m);
    return fit;
  }

  /// Returns the variance to add to the known ones, so that chi^2 equals its degrees of freedom.
  double compute_added_variance_m2(const std::vector<std::size_t>& free) const {
    const double freedom = static_cast<double>(count_determined_unknowns() - 2 * std::ssize(free));
    double low = 0, high = coordinates_.squaredNorm() / freedom;
    if (fit_map_errors(free, 0).chi_squared <= freedom) return 0;
    constexpr int iterations = 60;
    for (int iteration = 0; iteration < iterations; ++iteration) {
      const double middle = low + (high - low) / 2;
      (fit_map_errors(free, middle).chi_squared > freedom ? low : high) = middle;
    }
    return high;
  }

  /// Returns the bound of a drop of chi^2 if `tests` sets of `free` lamps are tested together.
  double compute_chi_squared_drop_bound(std::size_t free, double tests) const {
    const double exponent = -2 * std::log(kFalseAlarm / tests);
    if (variance_is_known_) return exponent;
    const double freedom =
        static_cast<double>(count_determined_unknowns()) - 2 * static_cast<double>(free);
    return freedom * std::expm1(exponent / freedom);
  }

  /// Adds the lamp, other than `excluded`, that reduces chi^2 most together with the free ones.
  /// Returns chi^2.
  double add_best_explaining_error(std::vector<std::size_t>& free, double added_m2,
                                   std::optional<std::size_t> excluded = {}) const {
    std::size_t best = 0;
    double smallest = std::numeric_limits<double>::infinity();
    free.push_back(0);
    for (std::size_t lamp = 0; lamp < lamps_; ++lamp) {
      if (lamp == excluded || std::find(free.begin(), free.end() - 1, lamp) != free.end() - 1) {
        continue;
      }
      free.back() = lamp;
      const double chi_squared = fit_map_errors(free, added_m2).chi_squared;
      if (chi_squared < smallest) std::tie(smallest, best) = std::pair(chi_squared, lamp);
    }
    free.back() = best;
    return smallest;
  }

  /// Returns true if replacing any of the free lamps by another lamp increases chi^2 by more than
  /// the bound.
  bool is_significant(const std::vector<std::size_t>& free, double added_m2) const {
    double sets = 1;
    for (std::size_t k = 0; k < free.size(); ++k) {
      sets *= static_cast<double>(lamps_ - k) / static_cast<double>(k + 1);
    }
    const double limit = fit_map_errors(free, added_m2).chi_squared +
                         compute_chi_squared_drop_bound(free.size(), sets);
    return std::all_of(free.begin(), free.end(), [&](std::size_t lamp) {
      std::vector<std::size_t> other = free;
      std::erase(other, lamp);
      return add_best_explaining_error(other, added_m2, lamp) > limit;
    });
  }

 private:
  /// Numeric noise of simulated captures without noise.
  static constexpr double kNumericVariance_m2 = 1e-14;

  std::size_t lamps_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd variances_m2_, coordinates_;
  bool variance_is_known_ = true;
};

/// Alternative map that may explain the captures, with the displacements relative to it.
struct OtherMap {
  MapError error;
  LampMap map;
  std::optional<LampDisplacements> found = {};

  double compute_room_size_m() const {
    return found ? found->displacement_m.norm() : std::numeric_limits<double>::infinity();
  }
};

/// Returns the two maps with two lamps swapped that have the smallest residuals, best first. Omits
/// maps whose residuals are no smaller than those of the original map.
std::vector<OtherMap> make_swapped_maps(const LampDisplacements& found, const LampMap& map) {
  Eigen::Matrix2Xd lamps_m(2, std::ssize(found.lamps));
  for (Eigen::Index i = 0; i < lamps_m.cols(); ++i) {
    lamps_m.col(i) = found.map_m[static_cast<std::size_t>(i)];
  }
  const auto squares_m2 = [&] {
    return lamps_m.reshaped().dot(found.information * lamps_m.reshaped());
  };
  const Eigen::Map<const Eigen::Matrix2Xd> moved_m(found.displacement_m.data(), 2, lamps_m.cols());
  const double unchanged_m2 = squares_m2();
  std::vector<std::tuple<double, Eigen::Index, Eigen::Index>> pairs;
  for (Eigen::Index i = 0; i < lamps_m.cols(); ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      constexpr double min_fraction = 0.1;  // of lamps that are displaced by their distance
      const double distance_m = (lamps_m.col(i) - lamps_m.col(k)).norm();
      if (std::min(moved_m.col(i).norm(), moved_m.col(k).norm()) < min_fraction * distance_m) {
        continue;
      }
      lamps_m.col(i).swap(lamps_m.col(k));
      if (squares_m2() < unchanged_m2) pairs.emplace_back(squares_m2(), k, i);
      lamps_m.col(i).swap(lamps_m.col(k));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<OtherMap> maps;
  for (const auto& [squares, k, i] : pairs) {
    const int first = found.lamps[static_cast<std::size_t>(k)];
    const int second = found.lamps[static_cast<std::size_t>(i)];
    LampMap swapped = map;
    for (Lamp& lamp : swapped.lamps) {
      if (lamp.id == first) lamp.position_m = find_lamp_by_id(map.lamps, second)->position_m;
      if (lamp.id == second) lamp.position_m = find_lamp_by_id(map.lamps, first)->position_m;
    }
    maps.push_back({{MapErrorKind::swapped, {first, second}}, std::move(swapped)});
    if (maps.size() == 2) break;
  }
  return maps;
}

/// Returns true if most detections are outliers, so that the remaining lamps prove nothing.
bool is_map_contradicted(const std::optional<LampDisplacements>& found) {
  constexpr double min_inlier_fraction = 0.5;
  return !found || found->inlier_fraction < min_inlier_fraction;
}

/// Returns true if the RMS displacement of the lamps exceeds the tolerance of Positioner, relative
/// to the size of the map.
bool is_map_of_other_room(const LampDisplacements& found) {
  constexpr double max_residual_fraction = 0.1;  // PositionerOptions::max_residual_fraction
  const double rms_m =
      found.displacement_m.norm() / std::sqrt(static_cast<double>(found.lamps.size()));
  return rms_m > max_residual_fraction * rms_radius(found.map_m);
}

/// Returns true if a map explains the captures: most detections agree, and the displacement of the
/// lamps is small. Survey errors stay far below this limit.
bool explains_captures(const OtherMap& other) {
  return !is_map_contradicted(other.found) && !is_map_of_other_room(*other.found);
}

/// Finds two lamps that are swapped, or a mirrored map. The captures have to fit the alternative
/// map far better than the original map, and two swapped lamps better than any other pair.
std::optional<MapError> find_swapped_lamps(const MapCaptures& captures, const LampMap& map,
                                           const std::optional<LampDisplacements>& found) {
  std::vector<OtherMap> others;
  if (found) others = make_swapped_maps(*found, map);
  if (!is_map_contradicted(found) && others.empty()) return std::nullopt;
  LampMap mirrored = map;
  for (Lamp& lamp : mirrored.lamps) lamp.position_m.y() *= -1;
  others.push_back({{MapErrorKind::mirrored}, std::move(mirrored)});
  for (OtherMap& other : others) other.found = captures.estimate_displacements(other.map);
  if (is_map_contradicted(found)) {
    const auto fits = std::ranges::find_if(others, explains_captures);
    return fits == others.end() ? std::nullopt : std::optional(fits->error);
  }
  // The mirror image of a square equals a square with two corners swapped.
  const bool is_mirrored =
      others.back().compute_room_size_m() <= 2 * others.front().compute_room_size_m();
  const std::size_t best = is_mirrored ? others.size() - 1 : 0;
  if (!explains_captures(others[best])) return std::nullopt;
  const DisplacementTest test(*others[best].found, map);
  const double added_m2 = test.compute_added_variance_m2({});
  const auto count = static_cast<double>(map.lamps.size());
  const double limit = test.fit_map_errors({}, added_m2).chi_squared +
                       test.compute_chi_squared_drop_bound(0, 1 + count * (count - 1) / 2);
  const auto is_worse = [&](const std::optional<LampDisplacements>& other) {
    return !other || DisplacementTest(*other, map).fit_map_errors({}, added_m2).chi_squared > limit;
  };
  if (!is_worse(found)) return std::nullopt;
  if (!is_mirrored && others.size() > 2 && !is_worse(others[1].found)) return std::nullopt;
  return others[best].error;
}

/// Finds the displaced lamps: the largest set in which each lamp is significant.
std::vector<MapError> find_moved_lamps(const LampDisplacements& found,
                                       const DisplacementTest& test) {
  constexpr std::size_t max_lamps = 8;  // more lamps indicate an error of the whole map
  std::vector<std::size_t> free, moved;
  while (free.size() < max_lamps && 2 * (free.size() + 1) < found.lamps.size() &&
         test.count_determined_unknowns() > 2 * std::ssize(free) + 2) {
    test.add_best_explaining_error(free, test.compute_added_variance_m2(free));
    if (test.is_significant(free, test.compute_added_variance_m2(free))) {
      moved = free;
    }
  }
  std::vector<MapError> errors;
  if (moved.empty()) return errors;
  const auto fit = test.fit_map_errors(moved, test.compute_added_variance_m2(moved));
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const auto row = 2 * static_cast<Eigen::Index>(k);
    errors.push_back({MapErrorKind::moved, {found.lamps[moved[k]]}});
    MapError& error = errors.back();
    // Exact offset; the one in d is linearized.
    error.offset_m.head<2>() = compute_lamp_offset_relative_to_others(found, moved[k], moved)
                                   .value_or(fit.offsets_m.segment<2>(row));
    error.sd_m.head<2>() = fit.covariance_m2.diagonal().segment<2>(row).cwiseSqrt();
  }
  return errors;
}

/// Finds the lamp with most of the outliers: at least two, in more than 10 % of its captures. Their
/// median has to exceed `min_outlier_m` and three standard deviations of the lamp's survey.
std::optional<MapError> find_lamp_at_varying_position(const LampDisplacements& found,
                                                      const LampMap& map, double min_outlier_m) {
  constexpr std::size_t min_outliers = 2;
  constexpr double min_fraction = 0.1, max_survey_sigmas = 3;
  std::size_t all = 0;
  for (const auto& [lamp, outliers_m] : found.outliers_m) all += outliers_m.size();
  for (const auto& [lamp, outliers_m] : found.outliers_m) {
    const std::size_t count = outliers_m.size();
    const auto at = std::find(found.lamps.begin(), found.lamps.end(), lamp);
    const auto others = at == found.lamps.end()
                            ? 0
                            : found.captures[static_cast<std::size_t>(at - found.lamps.begin())];
    const std::size_t captures = count + static_cast<std::size_t>(others);
    const double survey_m = max_survey_sigmas * find_lamp_by_id(map.lamps, lamp)->sd_m.value_or(0);
    if (count < min_outliers || 2 * count <= all ||
        static_cast<double>(count) <= min_fraction * static_cast<double>(captures) ||
        upper_median(outliers_m) < std::max(min_outlier_m, survey_m)) {
      continue;
    }
    MapError error{MapErrorKind::inconsistent, {lamp}};
    error.contradicting_captures = static_cast<int>(count);
    error.captures = static_cast<int>(captures);
    return error;
  }
  return std::nullopt;
}

/// Describes an offset in whole millimeters from 10 mm on, otherwise in tenths. Includes the height
/// only if it does not round to 0.
std::string describe_offset(int lamp, const Eigen::Vector3d& offset_m) {
  const double unit_mm = offset_m.norm() < 9.95e-3 ? 0.1 : 1;
  const int digits = unit_mm < 1 ? 1 : 0;
  const auto rounded_mm = [&](double m) { return unit_mm * std::round(1e3 * m / unit_mm) + 0.0; };
  // [ROTATION-2] `from where the map has it` | lamp moved, or wrong position | add the offset to
  //   `position_m`, or put the lamp back
  std::string text = fmt::format("lamp {} hangs {:.{}f} mm from where the map has it (", lamp,
                                 rounded_mm(offset_m.norm()), digits);
  text += fmt::format("x {:+.{}f} mm, y {:+.{}f} mm", rounded_mm(offset_m.x()), digits,
                      rounded_mm(offset_m.y()), digits);
  if (const double z_mm = rounded_mm(offset_m.z()); z_mm != 0) {
    text += fmt::format(", z {:+.{}f} mm", z_mm, digits);
  }
  return text + "): moved, or entered wrongly";
}

}  // namespace

std::string describe_map_error(const MapError& error) {
  switch (error.kind) {
    case MapErrorKind::moved:
      return describe_offset(error.lamps[0], error.offset_m);
    case MapErrorKind::inconsistent:
      return fmt::format(
          "lamp {} contradicts the other lamps in {} of {} captures, in varying directions: it is "
          "confused with another light, was moved between captures, or has a wrong height",
          error.lamps[0], error.contradicting_captures, error.captures);
    case MapErrorKind::swapped:
      return fmt::format(
          "lamps {} and {} seem to be swapped: the captures fit the map if their positions or ids "
          "are exchanged",
          error.lamps[0], error.lamps[1]);
    case MapErrorKind::mirrored:
      return "the lamp map seems to be mirrored, as if drawn from below: the captures fit its "
             "mirror image; change the sign of x or of y of every lamp";
    case MapErrorKind::other_room:
      return "most captures contradict the lamp map: is it the map of this room, and the "
             "calibration of this camera?";
    // [STATION-19] `is never visible`
    case MapErrorKind::undetected:
      return fmt::format("lamp {} is never visible: is it lit, and not overexposed?",
                         error.lamps[0]);
  }
  return "";
}

std::string describe_map_errors(std::span<const MapError> errors) {
  std::string text;
  for (const MapError& error : errors)
    text += (text.empty() ? "" : "; ") + describe_map_error(error);
  return text;
}

std::string describe_lamps_moved_since_calibration(int lamps) {
  return fmt::format(
      "{} lamps have other positions than in the adjustment of the calibration, and sd lacks their "
      "uncertainty: give the map that vlp-adjust --refine-map wrote with it",
      lamps);
}

bool MapErrors::is_lamp_map_unusable() const {
  return std::any_of(errors.begin(), errors.end(), [](const MapError& error) {
    return error.kind == MapErrorKind::swapped || error.kind == MapErrorKind::mirrored;
  });
}

MapErrors detect_misplaced_or_swapped_lamps(std::span<const Frame> frames, const LampMap& map,
                                            const Calibration& calibration,
                                            const MapErrorOptions& options) {
  const MapCaptures captures{frames, calibration, options};
  const auto found = captures.estimate_displacements(map);
  MapErrors result;
  if (found) result.offsets = compute_lamp_offsets_relative_to_others(*found);
  if (auto exchange = find_swapped_lamps(captures, map, found)) {
    result.errors.push_back(std::move(*exchange));
    return result;
  }
  if (!found) return result;
  if (is_map_contradicted(found)) {
    result.offsets.clear();
    result.errors.push_back({MapErrorKind::other_room});
    return result;
  }
  const DisplacementTest test(*found, map);
  result.errors = find_moved_lamps(*found, test);
  const double min_offset_m =
      options.min_offset_px * found->height_m / calibration.camera.focal_px().mean();
  std::erase_if(result.errors,
                [&](const MapError& error) { return error.offset_m.norm() < min_offset_m; });
  constexpr double min_outlier_ratio = 5;
  auto unsteady = find_lamp_at_varying_position(*found, map, min_outlier_ratio * min_offset_m);
  const bool is_named = unsteady && std::ranges::any_of(result.errors, [&](const MapError& error) {
                          return error.lamps == unsteady->lamps;
                        });
  if (unsteady && !is_named) result.errors.push_back(std::move(*unsteady));
  if (result.errors.empty() && is_map_of_other_room(*found)) {
    result.errors.push_back({MapErrorKind::other_room});
  }
  return result;
}

std::vector<MapError> find_undetected_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::set<int> seen;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) seen.insert(detection.lamp);
  }
  std::vector<MapError> unseen;
  for (const Lamp& lamp : map.lamps) {
    if (!seen.contains(lamp.id)) unseen.push_back({MapErrorKind::undetected, {lamp.id}});
  }
  return unseen;
}

}  // namespace vlp
