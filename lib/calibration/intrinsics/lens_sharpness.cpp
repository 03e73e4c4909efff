// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_sharpness.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <utility>

#include "calibration/intrinsics/image_coverage.h"
#include "detection/boards/edge_field.h"
#include "geometry/median.h"

namespace vlp {
namespace {

using Map = LensSharpness::Map;

/// Minimum number of views of a part of the image, for a median and for a quartile between two.
constexpr std::size_t kMinViews = 3, kMinViewsOfQuartile = 5;
/// Minimum number of edges of a view for a fit of the field of its light; EdgeField is constant
/// with fewer.
constexpr std::size_t kMinEdgesOfField = 32;

/// A value for each view in each part of the image.
class ViewValues {
 public:
  ViewValues(const Map& map, const std::array<int, 2>& imager_px)
      : cols_(map.cols), rows_(map.rows), imager_px_(imager_px), parts_(map.values.size()) {}

  /// Adds the statistic of the values of one view at each part.
  template <typename Statistic>
  void add(const std::vector<Eigen::Vector2d>& at_px, const std::vector<double>& values,
           const Statistic& statistic) {
    std::vector<std::vector<double>> values_by_part(parts_.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int col = ImageCoverage::cell_index(at_px[i].x(), imager_px_[0], cols_);
      const int row = ImageCoverage::cell_index(at_px[i].y(), imager_px_[1], rows_);
      values_by_part[static_cast<std::size_t>(row * cols_ + col)].push_back(values[i]);
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!values_by_part[i].empty()) parts_[i].push_back(statistic(values_by_part[i]));
    }
  }

  /// Sets the parts of the map that enough views show.
  template <typename Statistic>
  void summarize(std::size_t min_views, const Statistic& statistic, Map& map) const {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (parts_[i].size() >= min_views) map.values[i] = statistic(parts_[i]);
    }
  }

 private:
  int cols_, rows_;
  std::array<int, 2> imager_px_;
  std::vector<std::vector<double>> parts_;
};

struct MeasuredEdge {
  Eigen::Vector2d middle_px, along;
  EdgeStep step;
};

std::vector<MeasuredEdge> collect_edges(const BoardDetection& seen) {
  std::vector<MeasuredEdge> edges;
  edges.reserve(4 * seen.tags.size());
  for (const TagDetection& tag : seen.tags) {
    for (std::size_t k = 0; k < tag.steps.size(); ++k) {
      const EdgeStep& step = tag.steps[k];
      if (!(step.blur_px > 0 && step.bright > 0)) continue;
      const Eigen::Vector2d from = tag.corners_px[k], to = tag.corners_px[(k + 1) % 4];
      edges.push_back({(from + to) / 2, (to - from).normalized(), step});
    }
  }
  return edges;
}

/// Returns the light of each edge relative to a smooth field over the view: illumination and
/// vignetting change slowly. Empty if there are too few edges.
std::vector<double> compute_relative_lights(const std::vector<MeasuredEdge>& edges) {
  std::vector<double> lights;
  if (edges.size() < kMinEdgesOfField) return lights;
  std::vector<EdgeSample> edge_values;
  edge_values.reserve(edges.size());
  lights.reserve(edges.size());
  for (const auto& [middle_px, along, step] : edges) {
    edge_values.push_back({middle_px, along, step.bright, 0});
  }
  const EdgeField field(edge_values, EdgeField::Terms::position);
  for (const auto& [middle_px, along, step] : edges) {
    lights.push_back(step.bright / field.evaluate_at_edge(middle_px, along));
  }
  return lights;
}

double compute_mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double compute_median(const std::vector<double>& values) { return upper_median(values); }

/// Returns the lower quartile, interpolated so that its median does not depend on the number of
/// values (Hyndman and Fan, "Sample Quantiles in Statistical Packages", 1996, definition 8).
/// Precondition: kMinViewsOfQuartile values or more.
double lower_quartile(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  constexpr double p = 0.25, third = 1.0 / 3;
  const double position = p * (static_cast<double>(values.size()) + third) + third - 1;
  const auto below = static_cast<std::size_t>(position);
  const double fraction = position - static_cast<double>(below);
  return (1 - fraction) * values[below] + fraction * values[below + 1];
}

std::vector<double> collect_known_values(const Map& map) {
  std::vector<double> known;
  known.reserve(map.values.size());
  std::copy_if(map.values.begin(), map.values.end(), std::back_inserter(known),
               [](double value) { return std::isfinite(value); });
  return known;
}

Eigen::Vector2d compute_cell_center(const Map& map, int col, int row,
                                    const std::array<int, 2>& imager_px) {
  return {(col + 0.5) * imager_px[0] / map.cols - 0.5, (row + 0.5) * imager_px[1] / map.rows - 0.5};
}

/// Returns LensSharpness::asymmetry by least squares of
///   f = c0 + a x + b y + d (x^2 - y^2) + e 2 x y + c3 (x^2 + y^2),
/// with (x, y) from the image's middle, at the distance 1: half of the image's shorter side.
double compute_asymmetry(const Map& mtf50, double mean, const std::array<int, 2>& imager_px) {
  const double radius_px = std::min(imager_px[0], imager_px[1]) / 2.0;
  const Eigen::Vector2d middle_px(imager_px[0] / 2.0 - 0.5, imager_px[1] / 2.0 - 0.5);
  constexpr Eigen::Index terms = 6;
  Eigen::Matrix<double, Eigen::Dynamic, terms> rows(Eigen::Index{mtf50.cols} * mtf50.rows, terms);
  Eigen::VectorXd values(rows.rows());
  Eigen::Index count = 0;
  for (int row = 0; row < mtf50.rows; ++row) {
    for (int col = 0; col < mtf50.cols; ++col) {
      if (!std::isfinite(mtf50.at(col, row))) continue;
      const Eigen::Vector2d at =
          (compute_cell_center(mtf50, col, row, imager_px) - middle_px) / radius_px;
      const double x = at.x(), y = at.y();
      rows.row(count) << 1, x, y, x * x - y * y, 2 * x * y, x * x + y * y;
      values[count++] = mtf50.at(col, row) / mean;
    }
  }
  const Eigen::VectorXd c = rows.topRows(count).colPivHouseholderQr().solve(values.head(count));
  return 2 * (std::hypot(c[1], c[2]) + std::hypot(c[3], c[4]));
}

/// Returns the median over pairs of opposite parts of the mean of the pair. A linear change over
/// the image does not affect it. NaN without a pair, as in a corner.
double predict_from_neighbors(const Map& map, int col, int row) {
  const int reach = map.cols / 6;  // a sixth of the image is larger than a speck
  const auto value = [&](int c, int r) {
    const bool inside = c >= 0 && r >= 0 && c < map.cols && r < map.rows;
    return inside ? map.at(c, r) : LensSharpness::kUnknown;
  };
  std::vector<double> means;
  means.reserve(static_cast<std::size_t>(2 * reach * (reach + 1)));
  for (int down = 0; down <= reach; ++down) {
    for (int right = down == 0 ? 1 : -reach; right <= reach; ++right) {
      const double mean = (value(col + right, row + down) + value(col - right, row - down)) / 2;
      if (std::isfinite(mean)) means.push_back(mean);
    }
  }
  return means.empty() ? LensSharpness::kUnknown : upper_median(std::move(means));
}

/// Largest loss of a part of a map relative to the surrounding parts; NaN if no part can be
/// compared.
struct LocalLoss {
  double fraction = LensSharpness::kUnknown;
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();
};

LocalLoss measure_local_loss(const Map& map, const std::array<int, 2>& imager_px) {
  LocalLoss largest;
  for (int row = 0; row < map.rows; ++row) {
    for (int col = 0; col < map.cols; ++col) {
      const double loss = 1 - map.at(col, row) / predict_from_neighbors(map, col, row);
      if (!std::isfinite(loss) || loss <= largest.fraction) continue;  // not if that is NaN
      largest = {loss, compute_cell_center(map, col, row, imager_px)};
    }
  }
  return largest;
}

/// Computes the Michelson contrast (white - black) / (white + black).
Map divide_by_neighbors(Map black_to_white) {
  for (double& ratio : black_to_white.values) ratio = (1 - ratio) / (1 + ratio);
  return black_to_white;
}

/// Fills the maps from the edges of all views.
void fill_sharpness_maps(std::span<const BoardView> views, const std::array<int, 2>& imager_px,
                         LensSharpness& result) {
  ViewValues blurs(result.mtf50, imager_px), ratios(result.black_to_white, imager_px);
  ViewValues lights(result.light, imager_px);
  for (const BoardView& view : views) {
    const std::vector<MeasuredEdge> edges = collect_edges(view.detection);
    std::vector<Eigen::Vector2d> at_px;
    std::vector<double> blurs_px, black_to_white;
    at_px.reserve(edges.size());
    blurs_px.reserve(edges.size());
    black_to_white.reserve(edges.size());
    for (const auto& [middle_px, along, step] : edges) {
      at_px.push_back(middle_px);
      blurs_px.push_back(step.blur_px);
      black_to_white.push_back(std::max(0.0, step.dark / step.bright));
    }
    blurs.add(at_px, blurs_px, compute_median);
    ratios.add(at_px, black_to_white, compute_median);
    lights.add(at_px, compute_relative_lights(edges), compute_mean);
  }
  blurs.summarize(
      kMinViewsOfQuartile,
      [](const auto& values) { return compute_mtf50_of_blur(lower_quartile(values)); },
      result.mtf50);
  ratios.summarize(kMinViews, compute_median, result.black_to_white);
  lights.summarize(kMinViews, compute_median, result.light);
}

}  // namespace

double compute_mtf50_of_blur(double sigma_px) {
  return std::sqrt(std::numbers::ln2 / 2) / (std::numbers::pi * sigma_px);
}

std::optional<double> compute_median_edge_mtf50(const BoardDetection& seen) {
  std::vector<double> blurs_px;
  blurs_px.reserve(4 * seen.tags.size());
  for (const MeasuredEdge& edge : collect_edges(seen)) blurs_px.push_back(edge.step.blur_px);
  if (blurs_px.empty()) return std::nullopt;
  return compute_mtf50_of_blur(upper_median(std::move(blurs_px)));
}

std::optional<LensSharpness> measure_sharpness(std::span<const BoardView> views,
                                               const std::array<int, 2>& imager_px) {
  LensSharpness result;
  fill_sharpness_maps(views, imager_px, result);
  const std::vector<double> known = collect_known_values(result.mtf50);
  if (2 * known.size() < result.mtf50.values.size()) return std::nullopt;
  result.mean_mtf50 = compute_mean(known);
  result.worst_ratio = *std::min_element(known.begin(), known.end()) / result.mean_mtf50;
  result.asymmetry = compute_asymmetry(result.mtf50, result.mean_mtf50, imager_px);
  result.black_level = upper_median(collect_known_values(result.black_to_white));
  const Map contrasts = divide_by_neighbors(result.black_to_white);
  result.local_loss = std::max(measure_local_loss(result.mtf50, imager_px).fraction,
                               measure_local_loss(contrasts, imager_px).fraction);
  const LocalLoss shadow = measure_local_loss(result.light, imager_px);
  result.local_shadow = shadow.fraction;
  result.local_shadow_px = shadow.at_px;
  return result;
}

}  // namespace vlp
