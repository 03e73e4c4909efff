// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_edges.h"

#include <ceres/tiny_solver.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "detection/boards/blurred_step.h"

namespace vlp {
namespace {

struct EdgePixel {
  double along, across_px, grey;
};

constexpr double kWhite = 255;

/// A level of light as the image has it, behind a tone curve, and the derivative by the light.
struct Coded {
  Coded(double light, double gamma) : level(light), slope(1) {
    if (gamma == 1) return;
    constexpr double least = 1e-3;  // the curve is vertical at 0
    const double some = std::max(light, least);
    level = kWhite * std::pow(some / kWhite, 1 / gamma);
    slope = level / (gamma * some);
  }

  double level, slope;
};

double light_behind(double level, double gamma) {
  return gamma == 1 ? level : kWhite * std::pow(level / kWhite, gamma);
}

/// Parameters: the parabola's three, blur, middle, contrast, light along and across. A step that is
/// taken is asked for twice, with its derivatives the second time: they are kept from the first.
class Edge {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 8 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS>;

  Edge(const std::vector<EdgePixel>& pixels, double gamma)
      : pixels_(pixels), gamma_(gamma), residuals_(rows()), jacobian_(rows(), +NUM_PARAMETERS) {}

  int NumResiduals() const { return static_cast<int>(pixels_.size()); }

  bool operator()(const double* p, double* residuals, double* jacobian) const {
    const Eigen::Map<const Parameters> parameters(p);
    if (parameters != at_) evaluate(parameters);
    Eigen::Map<Eigen::VectorXd>(residuals, rows()) = residuals_;
    if (jacobian) Eigen::Map<Jacobian>(jacobian, rows(), +NUM_PARAMETERS) = jacobian_;
    return true;
  }

 private:
  Eigen::Index rows() const { return static_cast<Eigen::Index>(pixels_.size()); }

  void evaluate(const Parameters& p) const {
    at_ = p;
    const Blur blur(p[3]);
    for (Eigen::Index i = 0; i < rows(); ++i) {
      const auto& [w, v, grey] = pixels_[static_cast<std::size_t>(i)];
      const BlurredStep step(v - p[0] - w * (p[1] + w * p[2]), blur);
      const double lit = 1 + p[6] * w + p[7] * v, unlit = p[4] + p[5] * step.value;
      const Coded coded(unlit * lit, gamma_);
      residuals_[i] = coded.level - grey;
      const double bright = lit * coded.slope, plain = unlit * coded.slope;
      const double by_distance = bright * p[5] * step.slope;
      jacobian_.row(i) << -by_distance, -by_distance * w, -by_distance * w * w,
          bright * p[5] * step.by_blur, bright, bright * step.value, plain * w, plain * v;
    }
  }

  const std::vector<EdgePixel>& pixels_;
  double gamma_;
  mutable Parameters at_ = Parameters::Constant(std::numeric_limits<double>::quiet_NaN());
  mutable Eigen::VectorXd residuals_;
  mutable Jacobian jacobian_;
};

/// Points x with across.(x - middle) = a + b w + c w^2, w = along.(x - middle) / half_px.
struct Parabola {
  Eigen::Vector2d middle, along, across;
  double half_px;
  Eigen::Vector3d abc = Eigen::Vector3d::Zero();
  double blur_px = 0.8;

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
void start_edge_levels(const std::vector<EdgePixel>& pixels, double gamma, Edge::Parameters& p) {
  double in = 0, out = 0, ins = 0, outs = 0;
  for (const EdgePixel& pixel : pixels) {
    (pixel.across_px < 0 ? in : out) += light_behind(pixel.grey, gamma);
    (pixel.across_px < 0 ? ins : outs) += 1;
  }
  in /= std::max(ins, 1.0);
  out /= std::max(outs, 1.0);
  p[4] = (in + out) / 2;
  p[5] = (out - in) / 2;
}

/// From where the edge is. The sum of the squares that are left over; infinite when the pixels look
/// otherwise.
double fit(Parabola& edge, const cv::Mat1b& image, const Band& band, double gamma) {
  constexpr std::size_t least_pixels = 24;
  constexpr int most_steps = 15;
  constexpr double least_blur_px = 0.05, most_blur_px = 6;
  constexpr double enough = 1e-3;  // grey levels squared
  constexpr double least_contrast = 3, unlike = 0.35;
  const auto pixels = pixels_beside(image, edge, band);
  constexpr double no_edge = std::numeric_limits<double>::infinity();
  if (pixels.size() < least_pixels) return no_edge;
  Edge::Parameters p = Edge::Parameters::Zero();
  p.head<4>() << edge.abc, edge.blur_px;
  start_edge_levels(pixels, gamma, p);
  const Edge step(pixels, gamma);
  ceres::TinySolver<Edge> solver;
  solver.options.max_num_iterations = most_steps;
  solver.options.function_tolerance = enough;
  solver.Solve(step, &p);
  edge.abc = p.head<3>();
  edge.blur_px = p[3];
  const double squares = 2 * solver.summary.final_cost;
  const double rms = std::sqrt(squares / static_cast<double>(pixels.size()));
  const bool good = p.allFinite() && p[3] > least_blur_px && p[3] < most_blur_px &&
                    std::abs(p[5]) > least_contrast && rms < unlike * std::abs(p[5]);
  return good ? squares : no_edge;
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

/// The edges of a tag, each fitted from corner to corner.
struct TagEdges {
  std::array<Parabola, 4> edges;
  double width_px = INFINITY;  // of the shortest
  /// Infinite where an edge is none.
  double squares = 0;
};

/// With `before`, of another gamma, from where that has the edges.
TagEdges fitted(const SeenTag& tag, const cv::Mat1b& image, const EdgeStripes& stripes,
                double gamma, const TagEdges* before = nullptr) {
  // The stripe's other side is kept away from by 2 px: it is blurred, too.
  constexpr double least_px = 1.5, most_px = 4.5, away_px = 2;
  const auto& corners = tag.corners_px;
  TagEdges found;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    middle += corners[k] / 4;
    found.width_px = std::min(found.width_px, (corners[(k + 1) % 4] - corners[k]).norm());
  }
  const Band band{std::clamp(stripes.inside * found.width_px - away_px, least_px, most_px),
                  std::clamp(stripes.outside * found.width_px - away_px, least_px, most_px)};
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d from = corners[k], to = corners[(k + 1) % 4];
    Parabola& edge = found.edges[k];
    if (before) edge = before->edges[k];
    edge.middle = (from + to) / 2;
    edge.half_px = (to - from).norm() / 2;
    edge.along = (to - from) / (2 * edge.half_px);
    edge.across = {-edge.along.y(), edge.along.x()};
    if (edge.across.dot(edge.middle - middle) < 0) edge.across = -edge.across;
    found.squares += fit(edge, image, band, gamma);
    if (!std::isfinite(found.squares)) break;
  }
  return found;
}

/// Nothing when an edge is none, or a corner has gone too far.
std::optional<SeenTag> crossed(const SeenTag& tag, const TagEdges& found) {
  constexpr double moved_px = 1.5, moved_share = 0.03;
  if (!std::isfinite(found.squares)) return {};
  const double most_moved_px = std::max(moved_px, moved_share * found.width_px);
  SeenTag exact = tag;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d& from = tag.corners_px[k];
    exact.corners_px[k] = crossing(found.edges[(k + 3) % 4], found.edges[k], from);
    if (!((exact.corners_px[k] - from).norm() < most_moved_px)) return {};
  }
  return exact;
}

}  // namespace

std::vector<std::optional<SeenTag>> with_exact_edges(std::span<const SeenTag> tags,
                                                     const cv::Mat1b& image,
                                                     const EdgeStripes& stripes) {
  constexpr std::size_t asked = 8;  // tags, the widest
  constexpr double usual_gamma = 2.2;
  constexpr double better = 0.99;  // of the squares, or it is chance
  // One or the other, so that no further tag is asked; a glare can be on one.
  constexpr double clearly = 1.5;
  constexpr int fewest = 3;
  std::vector<TagEdges> found;
  std::vector<std::size_t> widest;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    found.push_back(fitted(tags[i], image, stripes, 1));
    if (std::isfinite(found[i].squares)) widest.push_back(i);
  }
  std::stable_sort(widest.begin(), widest.end(), [&](std::size_t a, std::size_t b) {
    return found[a].width_px > found[b].width_px;
  });
  widest.resize(std::min(widest.size(), asked));
  double as_it_is = 0, behind_curve = 0;
  int told = 0;
  for (const std::size_t i : widest) {
    as_it_is += found[i].squares;
    behind_curve += fitted(tags[i], image, stripes, usual_gamma, &found[i]).squares;
    const auto [less, more] = std::minmax(as_it_is, behind_curve);
    if (++told >= fewest && more > clearly * less) break;
  }
  const bool curved = behind_curve < better * as_it_is;
  std::vector<std::optional<SeenTag>> exact;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    if (curved) found[i] = fitted(tags[i], image, stripes, usual_gamma);
    exact.push_back(crossed(tags[i], found[i]));
  }
  return exact;
}

}  // namespace vlp
