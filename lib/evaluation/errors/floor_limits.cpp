// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/floor_limits.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "camera/lens.h"
#include "geometry/median.h"

namespace vlp {

namespace {

/// Returns the number of positions from `min_m` to `max_m`, which may exceed the range of int.
double count_positions_along(double min_m, double max_m, double step_m) {
  constexpr double tolerance = 1e-9;
  const double places = std::floor((max_m - min_m) / step_m + tolerance) + 1;
  if (!(step_m > 0) || !(places >= 1)) {
    throw std::invalid_argument(
        "the floor should have x_min <= x_max, y_min <= y_max and a positive step");
  }
  return places;
}

std::vector<FloorLimits::Position> make_positions_on(const FloorGrid& grid, double z_m,
                                                     double yaw_rad) {
  constexpr double max_places = 1e7;
  const double columns = count_positions_along(grid.x_min_m, grid.x_max_m, grid.step_m);
  const double rows = count_positions_along(grid.y_min_m, grid.y_max_m, grid.step_m);
  if (!(columns * rows <= max_places)) {
    throw std::invalid_argument("the floor has more than ten million places: take a larger step");
  }
  std::vector<FloorLimits::Position> places;
  for (int row = 0; row < static_cast<int>(rows); ++row) {
    for (int column = 0; column < static_cast<int>(columns); ++column) {
      const Eigen::Vector3d position_m(grid.x_min_m + column * grid.step_m,
                                       grid.y_min_m + row * grid.step_m, z_m);
      places.push_back({{position_m, yaw_rad}, 0, {}});
    }
  }
  return places;
}

std::vector<Eigen::Vector3d> get_lamp_positions(const LampMap& map,
                                                const std::vector<std::size_t>& lamps) {
  std::vector<Eigen::Vector3d> places_m;
  places_m.reserve(lamps.size());
  for (const std::size_t lamp : lamps) places_m.push_back(map.lamps[lamp].position_m);
  return places_m;
}

using Source = FloorLimits::Source;
constexpr Source kLampMap{"lamp map", "lamp_map"};

/// Returns the sources that are independent between images.
std::vector<Source> list_image_sources(const BodyPrior& prior) {
  std::vector<Source> sources{{"noise", "noise"}};
  if (prior.is_motion_estimated()) sources.push_back({"motion", "motion"});
  if (prior.is_tilt_estimated()) sources.push_back({"roll and pitch", "roll_pitch"});
  return sources;
}

template <typename Budget>
std::vector<Matrix4> split_covariance(const Budget& budget, const BodyPrior& prior) {
  std::vector<Matrix4> parts{budget.noise};
  if (prior.is_motion_estimated()) parts.push_back(budget.motion);
  if (prior.is_tilt_estimated()) parts.push_back(budget.roll_pitch);
  return parts;
}

}  // namespace

FloorGrid make_floor_grid(const LampMap& map, double step_m) {
  const Eigen::Vector3d& first = map.lamps.front().position_m;
  FloorGrid grid{first.x(), first.x(), first.y(), first.y(), step_m};
  for (const Lamp& lamp : map.lamps) {
    grid.x_min_m = std::min(grid.x_min_m, lamp.position_m.x());
    grid.x_max_m = std::max(grid.x_max_m, lamp.position_m.x());
    grid.y_min_m = std::min(grid.y_min_m, lamp.position_m.y());
    grid.y_max_m = std::max(grid.y_max_m, lamp.position_m.y());
  }
  return grid;
}

std::vector<Eigen::Vector3d> list_visible_positions(const LampMap& map, const Camera& camera,
                                                    const Pose& pose) {
  return get_lamp_positions(
      map, list_visible_lamps(map, Lens(camera.lens_model, camera.intrinsics), camera.imager_px,
                              Eigen::Matrix3d::Identity(), pose));
}

Matrix4 FloorLimits::Position::total_pose_covariance() const {
  Matrix4 sum = Matrix4::Zero();
  for (const Matrix4& part : covariances) sum += part;
  return sum;
}

FloorLimits compute_floor_limits(const LampMap& map, const Camera& camera, const FloorGrid& grid,
                                 double z_m, double yaw_rad, const ErrorSources& sources,
                                 const BodyPrior& prior) {
  const Lens lens(camera.lens_model, camera.intrinsics);
  const auto row_clock = make_readout_clock(camera);
  FloorLimits limits{list_image_sources(prior), make_positions_on(grid, z_m, yaw_rad)};
  for (const auto& source :
       {Source{"principal point", "principal_point"}, {"tilt", "tilt"}, kLampMap}) {
    limits.sources.push_back(source);
  }
  for (FloorLimits::Position& place : limits.positions) {
    const auto lamps =
        list_visible_lamps(map, lens, camera.imager_px, Eigen::Matrix3d::Identity(), place.camera);
    place.lamps = static_cast<int>(lamps.size());
    const auto lamps_m = get_lamp_positions(map, lamps);
    const auto budget = compute_fix_budget(lamps_m, lens, place.camera, sources, prior, row_clock);
    if (!budget) continue;
    place.covariances = split_covariance(*budget, prior);
    place.covariances.insert(place.covariances.end(),
                             {budget->center, budget->tilt, budget->lamp_map});
  }
  return limits;
}

FloorLimits compute_floor_limits(const UnitErrors& unit, const FloorGrid& grid, double z_m,
                                 double yaw_rad, double noise_px, const BodyPrior& prior) {
  FloorLimits limits{list_image_sources(prior), make_positions_on(grid, z_m, yaw_rad)};
  limits.sources.push_back({"lens", "lens"});
  limits.sources.push_back({"zenith", "zenith"});
  if (unit.has_offset_errors()) limits.sources.push_back({"offset", "offset"});
  limits.sources.push_back(kLampMap);
  for (FloorLimits::Position& place : limits.positions) {
    const auto lamps = unit.list_visible_lamps(place.camera);
    place.lamps = static_cast<int>(lamps.size());
    const auto budget = unit.compute_budget(place.camera, lamps, noise_px, prior);
    if (!budget) continue;
    place.covariances = split_covariance(*budget, prior);
    place.covariances.insert(place.covariances.end(), {budget->lens, budget->zenith});
    if (unit.has_offset_errors()) place.covariances.push_back(budget->offset);
    place.covariances.push_back(budget->lamp_map);
  }
  return limits;
}

namespace {

struct MedianAndWorst {
  double median, worst;
};

/// @pre `values` is not empty
MedianAndWorst compute_median_and_worst(const std::vector<double>& values) {
  return {lower_median(values), *std::max_element(values.begin(), values.end())};
}

/// Summarizes `covariance(place)` over the places that have a fix.
template <typename Covariance>
FloorSummary::Row summarize_source(const FloorLimits::Source& source, const FloorLimits& limits,
                                   const Covariance& covariance) {
  std::vector<double> horizontal_m, height_m, yaw_rad;
  double part = 0, whole = 0;
  for (const FloorLimits::Position& place : limits.positions) {
    if (place.covariances.empty()) continue;
    const FixSds spread = compute_fix_sds(covariance(place));
    horizontal_m.push_back(spread.horizontal_m);
    height_m.push_back(spread.height_m);
    yaw_rad.push_back(spread.yaw_rad);
    part += spread.horizontal_m * spread.horizontal_m;
    whole += place.total_pose_covariance().topLeftCorner<2, 2>().trace();
  }
  const auto h = compute_median_and_worst(horizontal_m), z = compute_median_and_worst(height_m),
             yaw = compute_median_and_worst(yaw_rad);
  return {source, {h.median, z.median, yaw.median}, {h.worst, z.worst, yaw.worst}, part / whole};
}

}  // namespace

FixSds compute_fix_sds(const Matrix4& covariance) {
  // The rounding errors of a zero part may be negative.
  const auto root = [](double variance) { return variance < 0 ? 0 : std::sqrt(variance); };
  return {root(covariance(0, 0) + covariance(1, 1)), root(covariance(2, 2)),
          root(covariance(3, 3))};
}

const FloorSummary::Row& FloorSummary::largest_error_source() const {
  return *std::max_element(sources.begin(), sources.end(),
                           [](const Row& a, const Row& b) { return a.fraction < b.fraction; });
}

std::optional<FloorSummary> summarize_limits(const FloorLimits& limits) {
  const auto with_fix =
      std::count_if(limits.positions.begin(), limits.positions.end(),
                    [](const FloorLimits::Position& place) { return !place.covariances.empty(); });
  if (with_fix == 0) return std::nullopt;
  using Position = FloorLimits::Position;
  FloorSummary summary{
      {},
      summarize_source({"total", "horizontal"}, limits,
                       [](const Position& place) { return place.total_pose_covariance(); }),
      static_cast<std::size_t>(with_fix)};
  for (std::size_t i = 0; i < limits.sources.size(); ++i) {
    summary.sources.push_back(summarize_source(
        limits.sources[i], limits, [i](const Position& place) { return place.covariances[i]; }));
  }
  return summary;
}

}  // namespace vlp
