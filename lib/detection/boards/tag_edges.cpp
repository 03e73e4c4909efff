// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_edges.h"

#include <ceres/tiny_solver.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "detection/boards/blurred_step.h"

namespace vlp {
namespace {

struct EdgePixel {
  double along, across_px, grey;
};

/// Parameters: the parabola's three, blur, middle, contrast, light along and across.
struct Edge {
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 8 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;

  const std::vector<EdgePixel>& pixels;

  int NumResiduals() const { return static_cast<int>(pixels.size()); }

  bool operator()(const double* p, double* residuals, double* jacobian) const {
    const auto rows = static_cast<Eigen::Index>(pixels.size());
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto& [w, v, grey] = pixels[static_cast<std::size_t>(i)];
      const BlurredStep step(v - p[0] - w * (p[1] + w * p[2]), p[3]);
      const double lit = 1 + p[6] * w + p[7] * v, unlit = p[4] + p[5] * step.value;
      residuals[i] = unlit * lit - grey;
      if (jacobian == nullptr) continue;
      const double by_distance = lit * p[5] * step.slope;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS>> all(jacobian, rows,
                                                                            NUM_PARAMETERS);
      all.row(i) << -by_distance, -by_distance * w, -by_distance * w * w, lit * p[5] * step.by_blur,
          lit, lit * step.value, unlit * w, unlit * v;
    }
    return true;
  }
};

/// Points x with across.(x - middle) = a + b w + c w^2, w = along.(x - middle) / half_px.
struct Parabola {
  Eigen::Vector2d middle, along, across;
  double half_px;
  Eigen::Vector3d abc;

  /// Of 0 on it, and its gradient.
  double off(const Eigen::Vector2d& x, Eigen::Vector2d& gradient) const {
    const double w = along.dot(x - middle) / half_px;
    gradient = across - (abc[1] + 2 * abc[2] * w) / half_px * along;
    return across.dot(x - middle) - abc.dot(Eigen::Vector3d(1, w, w * w));
  }
};

struct Band {
  double inside_px, outside_px;
};

std::vector<EdgePixel> pixels_beside(const cv::Mat1b& image, const Parabola& edge,
                                     const Band& band) {
  constexpr double free_px = 2.5;  // of the corners, which are round
  const double end_px = edge.half_px - free_px;
  const Eigen::Vector2d wide = edge.along.cwiseAbs() * edge.half_px +
                               edge.across.cwiseAbs() * std::max(band.inside_px, band.outside_px);
  const Eigen::Array2i last(image.cols - 1, image.rows - 1);
  const Eigen::Vector2i low = (edge.middle - wide).array().ceil().cast<int>().max(0);
  const Eigen::Vector2i high = (edge.middle + wide).array().floor().cast<int>().min(last);
  std::vector<EdgePixel> pixels;
  for (int row = low.y(); row <= high.y(); ++row) {
    for (int column = low.x(); column <= high.x(); ++column) {
      const Eigen::Vector2d at = Eigen::Vector2d(column, row) - edge.middle;
      const double u = edge.along.dot(at), v = edge.across.dot(at);
      if (std::abs(u) > end_px || v < -band.inside_px || v > band.outside_px) continue;
      pixels.push_back({u / edge.half_px, v, static_cast<double>(image(row, column))});
    }
  }
  return pixels;
}

/// Middle and contrast of pixels, roughly: those well inside against those well outside.
void start_edge_levels(const std::vector<EdgePixel>& pixels, Edge::Parameters& p) {
  double in = 0, out = 0, ins = 0, outs = 0;
  for (const EdgePixel& pixel : pixels) {
    (pixel.across_px < 0 ? in : out) += pixel.grey;
    (pixel.across_px < 0 ? ins : outs) += 1;
  }
  in /= std::max(ins, 1.0);
  out /= std::max(outs, 1.0);
  p[4] = (in + out) / 2;
  p[5] = (out - in) / 2;
}

/// False when the pixels look otherwise.
bool fit(Parabola& edge, const cv::Mat1b& image, const Band& band) {
  constexpr std::size_t least_pixels = 24;
  constexpr int most_steps = 15;
  constexpr double usual_blur_px = 0.8, least_blur_px = 0.05, most_blur_px = 6;
  constexpr double enough = 1e-3;  // grey levels squared
  constexpr double least_contrast = 3, unlike = 0.35;
  const auto pixels = pixels_beside(image, edge, band);
  if (pixels.size() < least_pixels) return false;
  Edge::Parameters p = Edge::Parameters::Zero();
  p[3] = usual_blur_px;
  start_edge_levels(pixels, p);
  const Edge step{pixels};
  ceres::TinySolver<Edge> solver;
  solver.options.max_num_iterations = most_steps;
  solver.options.function_tolerance = enough;
  solver.Solve(step, &p);
  edge.abc = p.head<3>();
  const double rms = std::sqrt(2 * solver.summary.final_cost / static_cast<double>(pixels.size()));
  return p.allFinite() && p[3] > least_blur_px && p[3] < most_blur_px &&
         std::abs(p[5]) > least_contrast && rms < unlike * std::abs(p[5]);
}

/// Newton's method, from a point near it.
Eigen::Vector2d crossing(const Parabola& a, const Parabola& b, Eigen::Vector2d point) {
  constexpr int steps = 4;
  for (int i = 0; i < steps; ++i) {
    Eigen::Vector2d by_a, by_b, off;
    off << a.off(point, by_a), b.off(point, by_b);
    Eigen::Matrix2d gradients;
    gradients << by_a.transpose(), by_b.transpose();
    point -= gradients.inverse() * off;
  }
  return point;
}

}  // namespace

std::optional<SeenTag> with_exact_edges(const SeenTag& tag, const cv::Mat1b& image,
                                        const EdgeStripes& stripes) {
  // The stripe's other side is kept away from by 2 px: it is blurred, too.
  constexpr double least_px = 1.5, most_px = 4.5, away_px = 2, moved_px = 1.5, moved_share = 0.03;
  const auto& corners = tag.corners_px;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double width_px = INFINITY;
  for (std::size_t k = 0; k < 4; ++k) {
    middle += corners[k] / 4;
    width_px = std::min(width_px, (corners[(k + 1) % 4] - corners[k]).norm());
  }
  const Band band{std::clamp(stripes.inside * width_px - away_px, least_px, most_px),
                  std::clamp(stripes.outside * width_px - away_px, least_px, most_px)};
  const double most_moved_px = std::max(moved_px, moved_share * width_px);
  std::array<Parabola, 4> edges;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d from = corners[k], to = corners[(k + 1) % 4];
    Parabola& edge = edges[k];
    edge.middle = (from + to) / 2;
    edge.half_px = (to - from).norm() / 2;
    edge.along = (to - from) / (2 * edge.half_px);
    edge.across = {-edge.along.y(), edge.along.x()};
    if (edge.across.dot(edge.middle - middle) < 0) edge.across = -edge.across;
    if (!fit(edge, image, band)) return {};
  }
  SeenTag exact = tag;
  for (std::size_t k = 0; k < 4; ++k) {
    exact.corners_px[k] = crossing(edges[(k + 3) % 4], edges[k], corners[k]);
    if (!((exact.corners_px[k] - corners[k]).norm() < most_moved_px)) return {};
  }
  return exact;
}

}  // namespace vlp
