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

#include "calibration/adjustment/adjustment.h"
#include "geometry/frames.h"
#include "geometry/median.h"
#include "geometry/plane.h"
#include "geometry/similarity.h"
#include "geometry/symmetric.h"
#include "positioning/correction.h"
#include "positioning/inclination_rotation.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Probability of a false alarm per map.
constexpr double kFalseAlarm = 0.01;

/// Displacements of the lamps according to the captures.
struct LampDisplacements {
  std::vector<int> lamps = {};
  std::vector<Eigen::Vector2d> map_m = {};
  /// Number of used captures of each lamp.
  std::vector<int> captures = {};
  /// Residuals of the detections rejected as outliers, by lamp, in px.
  std::map<int, std::vector<double>> outliers_px = {};
  /// Displacement (x, y) of each lamp in the world, two rows per lamp, in the order of `lamps`.
  Eigen::VectorXd displacement_m = {};
  /// Covariance of the displacements; projector onto the displacements that are no similarity of
  /// the map.
  Eigen::MatrixXd covariance_m2 = {}, projector = {};
  /// Mean height of the lamps above the camera.
  double height_m = 0;
  /// Fraction of the detections that is used.
  double inlier_fraction = 1;

  /// Returns the ids of the lamps with outliers and without used detections.
  std::vector<int> list_rejected_lamps() const {
    std::vector<int> ids;
    for (const auto& [lamp, residuals_px] : outliers_px) {
      if (std::ranges::find(lamps, lamp) == lamps.end()) ids.push_back(lamp);
    }
    return ids;
  }

  /// Returns the displaced position of a lamp, up to a similarity of all lamps.
  Eigen::Vector2d displaced_lamp_m(std::size_t lamp) const {
    return map_m[lamp] + displacement_m.segment<2>(2 * static_cast<Eigen::Index>(lamp));
  }
};

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

/// Returns an orthonormal basis of the displacements of points by shift, rotation and scale.
Eigen::MatrixXd make_similarity_basis(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean(0, 0);
  for (const Eigen::Vector2d& point : points) mean += point / static_cast<double>(points.size());
  Eigen::MatrixXd moves(2 * std::ssize(points), 4);
  for (Eigen::Index i = 0; i < std::ssize(points); ++i) {
    const Eigen::Vector2d p = points[static_cast<std::size_t>(i)] - mean;
    moves.middleRows<2>(2 * i) << 1, 0, -p.y(), p.x(), 0, 1, p.x(), p.y();
  }
  return moves.colwise().normalized();
}

std::size_t count_detections(const std::vector<AdjustmentCapture>& captures) {
  std::size_t count = 0;
  for (const AdjustmentCapture& capture : captures) count += capture.detections.size();
  return count;
}

std::map<int, int> count_captures(const std::vector<AdjustmentCapture>& captures) {
  std::map<int, int> counts;
  for (const AdjustmentCapture& capture : captures) {
    for (const Detection& detection : capture.detections) ++counts[detection.lamp];
  }
  return counts;
}

/// Removes detections that do not connect a lamp to other lamps.
void remove_unconnected(std::vector<AdjustmentCapture>& captures) {
  constexpr std::size_t min_lamps = 3;
  constexpr int min_captures = 2;
  for (std::size_t removed = 1; removed > 0;) {
    std::erase_if(captures, [](const AdjustmentCapture& capture) {
      return capture.detections.size() < min_lamps;
    });
    std::map<int, int> counts = count_captures(captures);
    removed = 0;
    for (AdjustmentCapture& capture : captures) {
      removed += std::erase_if(capture.detections, [&](const Detection& detection) {
        return counts[detection.lamp] < min_captures;
      });
    }
  }
}

/// Captures of a stationary camera.
struct MapCaptures {
  std::span<const Frame> frames;
  const Calibration& calibration;
  const MapErrorOptions& options;

  /// Returns captures with the lamps of the map. Omits lamps that are detected twice, and the noise
  /// of the detections.
  std::vector<AdjustmentCapture> make_captures(const LampMap& map) const {
    std::vector<AdjustmentCapture> captures;
    const std::size_t stride = 1 + (frames.size() - 1) / options.max_captures;
    for (std::size_t i = 0; i < frames.size(); i += stride) {
      std::map<int, int> counts;
      for (const Detection& detection : frames[i].detections) ++counts[detection.lamp];
      AdjustmentCapture capture{frames[i].image, {}};
      for (const Detection& detection : frames[i].detections) {
        if (counts[detection.lamp] == 1 && find_lamp_by_id(map.lamps, detection.lamp) != nullptr)
          capture.detections.push_back({detection.lamp, detection.pixel, {}});
      }
      if (!options.inclinations.empty() && options.inclinations[i]) {
        const Eigen::Matrix3d level_from_base =
            compute_level_from_base(*options.inclinations[i], options.yaw_in_robot_rad);
        const Eigen::Vector3d up = level_from_base.row(2);
        capture.inclination = Inclination{std::atan2(up.y(), up.z()), -std::asin(up.x())};
      }
      captures.push_back(std::move(capture));
    }
    return captures;
  }

  /// Estimates the displacements by an adjustment with exact lens and heights. Captures do not
  /// determine similarities of the floor plan (MapPrior::heights).
  ///
  /// Uses lamps that at least two captures contain together with at least two other lamps. Returns
  /// std::nullopt if captures do not tie all these lamps together or if there is no redundancy.
  /// `inlier_fraction` is 0 and `lamps` is empty if the adjustment fails or has large residuals.
  std::optional<LampDisplacements> estimate_displacements(const LampMap& map) const {
    constexpr double no_limit = std::numeric_limits<double>::infinity();
    AdjustmentInput input{make_captures(map), map, {}};
    for (Lamp& lamp : input.lamps.lamps) lamp.sd_m.reset();
    input.calibration.camera = calibration.camera;
    input.map_prior = MapPrior::heights;
    input.zenith_is_exact = calibration.rotation_center.has_value();
    if (input.zenith_is_exact) {
      input.calibration.rotation_center = calibration.rotation_center;
      input.calibration.rotation_center->zenith_in_camera =
          compute_level_from_camera_matrix(calibration, Correction::all).row(2);
    }
    LampDisplacements found;
    AdjustmentResult adjusted;
    remove_unconnected(input.captures);
    const std::size_t detections = count_detections(input.captures);
    // Rejected detections may leave others unconnected.
    for (std::size_t used = 0; count_detections(input.captures) != used;) {
      if (input.captures.empty()) return std::nullopt;
      adjusted = adjust_bundle(input, {no_limit, no_limit});
      constexpr double max_residual_fraction = 0.01;  // of the focal length; lenses are better
      if (!adjusted.has_succeeded() ||
          adjusted.residual_px > max_residual_fraction * calibration.camera.focal_px().mean()) {
        found.inlier_fraction = 0;
        return found;
      }
      used = static_cast<std::size_t>(adjusted.detections);
      std::vector<std::vector<Detection>> inliers(input.captures.size());
      for (const auto& [capture, lamp, distance_px, is_used] : adjusted.residuals) {
        const auto& all = input.captures[capture].detections;
        if (is_used) inliers[capture].push_back(*std::ranges::find(all, lamp, &Detection::lamp));
        if (!is_used) found.outliers_px[lamp].push_back(distance_px);
      }
      for (std::size_t i = 0; i < inliers.size(); ++i)
        input.captures[i].detections = std::move(inliers[i]);
      remove_unconnected(input.captures);
    }
    constexpr double min_degrees_of_freedom = 0.5;
    if (input.captures.empty() || !(adjusted.degrees_of_freedom > min_degrees_of_freedom))
      return std::nullopt;
    found.height_m = adjusted.lamp_height_m;
    found.inlier_fraction =
        static_cast<double>(count_detections(input.captures)) / static_cast<double>(detections);
    set_displacements(map, adjusted, count_captures(input.captures), found);
    // Lamps without a tie move independently, by the size of a guess.
    if (!(found.covariance_m2.diagonal().maxCoeff() < std::pow(rms_radius(found.map_m), 2)))
      return std::nullopt;
    return found;
  }

 private:
  static void set_displacements(const LampMap& map, const AdjustmentResult& adjusted,
                                const std::map<int, int>& captures, LampDisplacements& found) {
    const auto& ids = adjusted.covariance_lamp_ids;
    const Eigen::Index size = 2 * std::ssize(captures);
    found.displacement_m.resize(size);
    std::vector<Eigen::Index> rows;
    for (const auto& [lamp, count] : captures) {
      const Eigen::Vector3d& map_m = find_lamp_by_id(map.lamps, lamp)->position_m;
      const Eigen::Vector3d& found_m =
          find_lamp_by_id(adjusted.refined_map.lamps, lamp)->position_m;
      found.displacement_m.segment<2>(2 * std::ssize(found.lamps)) = (found_m - map_m).head<2>();
      found.lamps.push_back(lamp);
      found.captures.push_back(count);
      found.map_m.emplace_back(map_m.head<2>());
      const Eigen::Index row = adjusted.refined_covariance.rows() - 3 * std::ssize(ids) +
                               3 * (std::ranges::find(ids, lamp) - ids.begin());
      rows.insert(rows.end(), {row, row + 1});
    }
    const Eigen::MatrixXd basis = make_similarity_basis(found.map_m);
    found.projector = Eigen::MatrixXd::Identity(size, size) - basis * basis.transpose();
    found.displacement_m = (found.projector * found.displacement_m).eval();
    found.covariance_m2 =
        found.projector * adjusted.refined_covariance(rows, rows) * found.projector;
  }
};

/// Returns the offset of a lamp after the similarity that maps the lamps without `excluded` to the
/// map. Returns std::nullopt if there is no such similarity.
std::optional<Eigen::Vector2d> find_lamp_offset(const LampDisplacements& found, std::size_t lamp,
                                                const std::vector<std::size_t>& excluded) {
  std::vector<Eigen::Vector2d> from_m, to_m;
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    if (std::find(excluded.begin(), excluded.end(), i) != excluded.end()) continue;
    from_m.push_back(found.displaced_lamp_m(i));
    to_m.push_back(found.map_m[i]);
  }
  const auto to_map = fit_similarity_transform(
      from_m.size(), [&](std::size_t i) { return from_m[i]; },
      [&](std::size_t i) { return to_m[i]; });
  if (!to_map) return std::nullopt;
  return to_map->offset + complex_product(to_map->factor, found.displaced_lamp_m(lamp)) -
         found.map_m[lamp];
}

/// Computes the offset of each lamp from the similarity that fits the other lamps best. Omits lamps
/// whose offset the other lamps do not determine.
std::vector<LampOffset> list_lamp_offsets(const LampDisplacements& found) {
  constexpr double min_own_fraction = 1e-3;
  std::vector<LampOffset> offsets;
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const double own_fraction = found.projector(row, row);
    const auto offset_m = find_lamp_offset(found, i, {i});
    if (own_fraction < min_own_fraction || !offset_m) continue;
    const Eigen::Vector2d sd_m =
        found.covariance_m2.diagonal().segment<2>(row).cwiseMax(0).cwiseSqrt() / own_fraction;
    offsets.push_back({found.lamps[i], found.captures[i], found.map_m[i], *offset_m, sd_m});
  }
  return offsets;
}

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
    const auto range = eigendecompose(found.projector);
    const Eigen::Index rank = (range.values.array() > 0.5).count();
    const Eigen::MatrixXd basis = range.vectors.rightCols(rank);
    const auto [values, vectors] =
        eigendecompose(Eigen::MatrixXd(basis.transpose() * covariance * basis));
    variances_m2_ = values.cwiseMax(kNumericVariance_m2);
    basis_ = basis * vectors;
    coordinates_ = basis_.transpose() * found.displacement_m;
  }

  Eigen::Index count_determined() const { return basis_.cols(); }

  /// Fits offsets of the free lamps to the coordinates, with the variance of the other lamps.
  Fit fit_map_errors(const std::vector<std::size_t>& free, double added_m2) const {
    const auto size = 2 * std::ssize(free);
    const Eigen::ArrayXd weights = (variances_m2_.array() + added_m2).inverse();
    Eigen::MatrixXd jacobian(size, count_determined());
    for (Eigen::Index k = 0; k < size; k += 2) {
      const auto lamp = static_cast<Eigen::Index>(free[static_cast<std::size_t>(k / 2)]);
      jacobian.middleRows<2>(k) = basis_.middleRows<2>(2 * lamp);
    }
    const Eigen::MatrixXd weighted = jacobian * weights.matrix().asDiagonal();
    const Eigen::VectorXd gradient = weighted * coordinates_;
    Fit fit{(weights * coordinates_.array().square()).sum(), {}, {}};
    fit.covariance_m2 =
        solve_symmetric(weighted * jacobian.transpose(), Eigen::MatrixXd::Identity(size, size));
    fit.offsets_m = fit.covariance_m2 * gradient;
    fit.chi_squared -= gradient.dot(fit.offsets_m);
    return fit;
  }

  /// Returns the variance to add to the known ones, so that chi^2 equals its degrees of freedom.
  double compute_added_m2(const std::vector<std::size_t>& free) const {
    const double freedom = static_cast<double>(count_determined() - 2 * std::ssize(free));
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
  double compute_drop_bound(std::size_t free, double tests) const {
    const double exponent = -2 * std::log(kFalseAlarm / tests);
    if (variance_is_known_) return exponent;
    const double freedom = static_cast<double>(count_determined()) - 2 * static_cast<double>(free);
    return freedom * std::expm1(exponent / freedom);
  }

  /// Adds the lamp, other than `excluded`, that reduces chi^2 most together with the free ones.
  /// Returns chi^2.
  double add_best_error(std::vector<std::size_t>& free, double added_m2,
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
    const double limit =
        fit_map_errors(free, added_m2).chi_squared + compute_drop_bound(free.size(), sets);
    return std::all_of(free.begin(), free.end(), [&](std::size_t lamp) {
      std::vector<std::size_t> other = free;
      std::erase(other, lamp);
      return add_best_error(other, added_m2, lamp) > limit;
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

/// Returns true if most detections are outliers, so that the remaining lamps prove nothing.
bool is_map_contradicted(const std::optional<LampDisplacements>& found) {
  constexpr double min_inlier_fraction = 0.5;
  return !found || found->inlier_fraction < min_inlier_fraction;
}

/// Alternative map that may explain the captures, with the displacements relative to it.
struct OtherMap {
  MapError error;
  LampMap map;
  std::optional<LampDisplacements> found = {};

  /// Returns the RMS displacement of the lamps; infinity if the captures contradict the map.
  double compute_rms_m() const {
    if (is_map_contradicted(found)) return std::numeric_limits<double>::infinity();
    return found->displacement_m.norm() / std::sqrt(static_cast<double>(found->lamps.size()));
  }
};

OtherMap swap_lamps(const LampMap& map, int first, int second) {
  OtherMap other{{MapErrorKind::swapped, {first, second}}, map};
  for (Lamp& lamp : other.map.lamps) {
    if (lamp.id == first) lamp.position_m = find_lamp_by_id(map.lamps, second)->position_m;
    if (lamp.id == second) lamp.position_m = find_lamp_by_id(map.lamps, first)->position_m;
  }
  return other;
}

/// Returns the two maps with two lamps swapped that have the smallest displacements, best first.
/// Omits maps whose displacements are no smaller than those of the original map. Adds the maps with
/// two lamps swapped of which no detection is used.
std::vector<OtherMap> make_swapped_maps(const LampDisplacements& found, const LampMap& map) {
  std::vector<Eigen::Vector2d> lamps_m = found.map_m;
  Eigen::VectorXd displaced_m = found.displacement_m;
  for (std::size_t i = 0; i < lamps_m.size(); ++i)
    displaced_m.segment<2>(2 * static_cast<Eigen::Index>(i)) += lamps_m[i];
  // Squared displacements from the lamps in their present order, after the best similarity.
  const auto squares_m2 = [&] {
    const Eigen::MatrixXd basis = make_similarity_basis(lamps_m);
    return (displaced_m - basis * (basis.transpose() * displaced_m)).squaredNorm();
  };
  const double unchanged_m2 = squares_m2();
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < lamps_m.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      constexpr double min_fraction = 0.1;  // of lamps that are displaced by their distance
      const double min_m = min_fraction * (lamps_m[i] - lamps_m[k]).norm();
      const auto displacement_m = [&](std::size_t lamp) {
        return found.displacement_m.segment<2>(2 * static_cast<Eigen::Index>(lamp)).norm();
      };
      if (std::min(displacement_m(i), displacement_m(k)) < min_m) continue;
      std::swap(lamps_m[i], lamps_m[k]);
      if (squares_m2() < unchanged_m2) pairs.emplace_back(squares_m2(), k, i);
      std::swap(lamps_m[i], lamps_m[k]);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<OtherMap> maps;
  for (const auto& [squares, k, i] : pairs) {
    maps.push_back(swap_lamps(map, found.lamps[k], found.lamps[i]));
    if (maps.size() == 2) break;
  }
  constexpr std::size_t max_rejected = 5;  // more lamps indicate an error of the whole map
  const std::vector<int> rejected = found.list_rejected_lamps();
  for (std::size_t i = 0; i < rejected.size() && rejected.size() <= max_rejected; ++i) {
    for (std::size_t k = 0; k < i; ++k) maps.push_back(swap_lamps(map, rejected[k], rejected[i]));
  }
  return maps;
}

/// Returns the maps with any two lamps swapped; none for many lamps.
std::vector<OtherMap> make_all_swapped_maps(const LampMap& map) {
  constexpr std::size_t max_lamps = 10;
  std::vector<OtherMap> maps;
  for (std::size_t i = 0; i < map.lamps.size() && map.lamps.size() <= max_lamps; ++i) {
    for (std::size_t k = 0; k < i; ++k)
      maps.push_back(swap_lamps(map, map.lamps[k].id, map.lamps[i].id));
  }
  return maps;
}

/// Returns true if the RMS displacement of the lamps exceeds the tolerance of Positioner, relative
/// to the size of the map.
bool is_other_room(const LampDisplacements& found) {
  constexpr double max_residual_fraction = 0.1;  // PositionerOptions::max_residual_fraction
  const double rms_m =
      found.displacement_m.norm() / std::sqrt(static_cast<double>(found.lamps.size()));
  return rms_m > max_residual_fraction * rms_radius(found.map_m);
}

/// Returns true if a map explains the captures: most detections agree, and the displacement of the
/// lamps is small. Survey errors stay far below this limit.
bool explains_captures(const OtherMap& other) {
  return !is_map_contradicted(other.found) && !is_other_room(*other.found);
}

/// Finds two lamps that are swapped, or a mirrored map. The captures have to fit the alternative
/// map far better than the original map, and two swapped lamps better than any other pair.
std::optional<MapError> find_swapped_lamps(const MapCaptures& captures, const LampMap& map,
                                           const std::optional<LampDisplacements>& found) {
  const bool is_contradicted = is_map_contradicted(found);
  std::vector<OtherMap> others =
      is_contradicted ? make_all_swapped_maps(map) : make_swapped_maps(*found, map);
  if (!is_contradicted && others.empty()) return std::nullopt;
  LampMap mirrored = map;
  for (Lamp& lamp : mirrored.lamps) lamp.position_m.y() *= -1;
  others.push_back({{MapErrorKind::mirrored}, std::move(mirrored)});
  // Few captures suffice to contradict a wrong map.
  constexpr std::size_t max_captures = 50;
  MapErrorOptions options = captures.options;
  if (is_contradicted) options.max_captures = std::min(options.max_captures, max_captures);
  const MapCaptures few{captures.frames, captures.calibration, options};
  for (OtherMap& other : others) other.found = few.estimate_displacements(other.map);
  std::ranges::sort(others.begin(), others.end() - 1, {}, &OtherMap::compute_rms_m);
  // The mirror image of a square equals a square with two corners swapped.
  const bool is_mirrored = others.back().compute_rms_m() <= 2 * others.front().compute_rms_m();
  const std::size_t best = is_mirrored ? others.size() - 1 : 0;
  if (!explains_captures(others[best])) return std::nullopt;
  const DisplacementTest test(*others[best].found, map);
  const double added_m2 = test.compute_added_m2({});
  const auto count = static_cast<double>(map.lamps.size());
  const double limit = test.fit_map_errors({}, added_m2).chi_squared +
                       test.compute_drop_bound(0, 1 + count * (count - 1) / 2);
  const auto is_worse = [&](const std::optional<LampDisplacements>& other) {
    return is_map_contradicted(other) || other->lamps.size() < others[best].found->lamps.size() ||
           DisplacementTest(*other, map).fit_map_errors({}, added_m2).chi_squared > limit;
  };
  if (!is_worse(found)) return std::nullopt;
  if (!is_mirrored && others.size() > 2 && !is_worse(others[1].found)) return std::nullopt;
  return others[best].error;
}

/// Finds the displaced lamps: the largest set in which each lamp is significant.
std::vector<MapError> collect_moved_lamps(const LampDisplacements& found,
                                          const DisplacementTest& test) {
  constexpr std::size_t max_lamps = 8;  // more lamps indicate an error of the whole map
  std::vector<std::size_t> free, moved;
  while (free.size() < max_lamps && 2 * (free.size() + 1) < found.lamps.size() &&
         test.count_determined() > 2 * std::ssize(free) + 2) {
    test.add_best_error(free, test.compute_added_m2(free));
    if (test.is_significant(free, test.compute_added_m2(free))) {
      moved = free;
    }
  }
  std::vector<MapError> errors;
  if (moved.empty()) return errors;
  const auto fit = test.fit_map_errors(moved, test.compute_added_m2(moved));
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const auto row = 2 * static_cast<Eigen::Index>(k);
    errors.push_back({MapErrorKind::moved, {found.lamps[moved[k]]}});
    MapError& error = errors.back();
    // Exact offset; the one in d is linearized.
    error.offset_m.head<2>() =
        find_lamp_offset(found, moved[k], moved).value_or(fit.offsets_m.segment<2>(row));
    error.sd_m.head<2>() = fit.covariance_m2.diagonal().segment<2>(row).cwiseSqrt();
  }
  return errors;
}

/// Finds the lamp with most of the outliers: at least two, in more than 10 % of its captures. Their
/// median has to exceed `min_outlier_px` and three standard deviations of the lamp's survey.
std::optional<MapError> find_varying_lamp(const LampDisplacements& found, const LampMap& map,
                                          double min_outlier_px, double focal_px) {
  constexpr std::size_t min_outliers = 2;
  constexpr double min_fraction = 0.1, max_survey_sigmas = 3;
  std::size_t all = 0;
  for (const auto& [lamp, outliers_px] : found.outliers_px) all += outliers_px.size();
  for (const auto& [lamp, outliers_px] : found.outliers_px) {
    const std::size_t count = outliers_px.size();
    const auto at = std::find(found.lamps.begin(), found.lamps.end(), lamp);
    const auto others = at == found.lamps.end()
                            ? 0
                            : found.captures[static_cast<std::size_t>(at - found.lamps.begin())];
    const std::size_t captures = count + static_cast<std::size_t>(others);
    const double survey_px = max_survey_sigmas * focal_px / found.height_m *
                             find_lamp_by_id(map.lamps, lamp)->sd_m.value_or(0);
    if (count < min_outliers || 2 * count <= all ||
        static_cast<double>(count) <= min_fraction * static_cast<double>(captures) ||
        upper_median(outliers_px) < std::max(min_outlier_px, survey_px)) {
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

std::string describe_moved_lamps(int lamps) {
  return fmt::format(
      "{} lamps have other positions than in the adjustment of the calibration, and sd lacks their "
      "uncertainty: give the map that vlp-adjust --refine-map wrote with it",
      lamps);
}

bool MapErrors::is_map_unusable() const {
  return std::any_of(errors.begin(), errors.end(), [](const MapError& error) {
    return error.kind == MapErrorKind::swapped || error.kind == MapErrorKind::mirrored;
  });
}

MapErrors detect_map_errors(std::span<const Frame> frames, const LampMap& map,
                            const Calibration& calibration, const MapErrorOptions& options) {
  const MapCaptures captures{frames, calibration, options};
  const auto found = captures.estimate_displacements(map);
  MapErrors result;
  if (found) result.offsets = list_lamp_offsets(*found);
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
  result.errors = collect_moved_lamps(*found, test);
  const double focal_px = calibration.camera.focal_px().mean();
  const double min_offset_m = options.min_offset_px * found->height_m / focal_px;
  std::erase_if(result.errors,
                [&](const MapError& error) { return error.offset_m.norm() < min_offset_m; });
  constexpr double min_outlier_ratio = 5;
  auto unsteady =
      find_varying_lamp(*found, map, min_outlier_ratio * options.min_offset_px, focal_px);
  const bool is_named = unsteady && std::ranges::any_of(result.errors, [&](const MapError& error) {
                          return error.lamps == unsteady->lamps;
                        });
  if (unsteady && !is_named) result.errors.push_back(std::move(*unsteady));
  if (result.errors.empty() && is_other_room(*found)) {
    result.errors.push_back({MapErrorKind::other_room});
  }
  return result;
}

std::vector<MapError> list_undetected_lamps(std::span<const Frame> frames, const LampMap& map) {
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
