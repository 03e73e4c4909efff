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
/// Above it pixels tell only that: white that runs over has some levels below 255 left by a
/// camera's processing, and none of the step's upper end.
constexpr double kMostTold = 250;

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

/// Coefficients of the polynomial of an edge that is much bent; of others the last is 0.
constexpr int kMostTerms = 4, kTerms = 3;
using Coefficients = Eigen::Matrix<double, kMostTerms, 1>;

/// Parameters: blur, middle, contrast, light along and across, the polynomial's. A step that is
/// taken is asked for twice, with its derivatives the second time: they are kept from the first.
template <int terms>
class Edge {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 5 + terms };
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
    const Blur blur(p[0]);
    for (Eigen::Index i = 0; i < rows(); ++i) {
      const auto& [w, v, grey] = pixels_[static_cast<std::size_t>(i)];
      double off = p[4 + terms];
      for (int k = terms - 2; k >= 0; --k) off = p[5 + k] + w * off;
      const BlurredStep step(v - off, blur);
      const double lit = 1 + p[3] * w + p[4] * v, unlit = p[1] + p[2] * step.value;
      const Coded coded(unlit * lit, gamma_);
      residuals_[i] = std::min(coded.level, kMostTold) - std::min(grey, kMostTold);
      const double told = coded.level < kMostTold ? coded.slope : 0;
      const double bright = lit * told, plain = unlit * told;
      auto row = jacobian_.row(i);
      row.template head<5>() << bright * p[2] * step.by_blur, bright, bright * step.value,
          plain * w, plain * v;
      double by_term = -bright * p[2] * step.slope;
      for (int k = 0; k < terms; ++k, by_term *= w) row[5 + k] = by_term;
    }
  }

  const std::vector<EdgePixel>& pixels_;
  double gamma_;
  mutable Parameters at_ = Parameters::Constant(std::numeric_limits<double>::quiet_NaN());
  mutable Eigen::VectorXd residuals_;
  mutable Jacobian jacobian_;
};

double value_at(const Coefficients& c, double w) {
  return c[0] + w * (c[1] + w * (c[2] + w * c[3]));
}

/// Points x with across.(x - middle) = a + b w + c w^2 + ..., w = along.(x - middle) / half_px.
struct EdgeCurve {
  Eigen::Vector2d middle, along, across;
  double half_px;
  Coefficients coefficients = Coefficients::Zero();
  bool cubic = false;
  double blur_px = 0.8;

  /// How far outside a point is.
  double off(const Eigen::Vector2d& x) const {
    return across.dot(x - middle) - value_at(coefficients, along.dot(x - middle) / half_px);
  }

  /// Of 0 on it, and its gradient.
  double off(const Eigen::Vector2d& x, Eigen::Vector2d& gradient) const {
    const double w = along.dot(x - middle) / half_px;
    const Coefficients& c = coefficients;
    const double slope = c[1] + w * (2 * c[2] + w * 3 * c[3]);
    gradient = across - slope / half_px * along;
    return off(x);
  }
};

struct Band {
  double inside_px, outside_px;
};

/// The pixels along an edge of a tag, by where its edges are roughly.
std::vector<EdgePixel> pixels_beside(const cv::Mat1b& image,
                                     const std::array<EdgeCurve, 4>& roughly, std::size_t k,
                                     const Band& band) {
  // Of the edges beside it, which are as blurred; so the corners, which are round, are away.
  constexpr double free_px = 2.5;
  const EdgeCurve &edge = roughly[k], &next = roughly[(k + 1) % 4],
                  &previous = roughly[(k + 3) % 4];
  const double reach_px = std::max(band.inside_px, band.outside_px) + edge.coefficients.lpNorm<1>();
  const Eigen::Vector2d wide =
      edge.along.cwiseAbs() * edge.half_px + edge.across.cwiseAbs() * reach_px;
  const Eigen::Array2i last(image.cols - 1, image.rows - 1);
  const Eigen::Vector2i low = (edge.middle - wide).array().ceil().cast<int>().max(0);
  const Eigen::Vector2i high = (edge.middle + wide).array().floor().cast<int>().min(last);
  std::vector<EdgePixel> pixels;
  for (int row = low.y(); row <= high.y(); ++row) {
    for (int column = low.x(); column <= high.x(); ++column) {
      const Eigen::Vector2d at(column, row);
      const double w = edge.along.dot(at - edge.middle) / edge.half_px;
      const double v = edge.across.dot(at - edge.middle), off = v - value_at(edge.coefficients, w);
      if (off < -band.inside_px || off > band.outside_px) continue;
      if (next.off(at) > -free_px || previous.off(at) > -free_px) continue;
      pixels.push_back({w, v, static_cast<double>(image(row, column))});
    }
  }
  return pixels;
}

/// Middle and contrast of pixels, roughly: those well inside against those well outside.
template <typename Parameters>
void start_edge_levels(const std::vector<EdgePixel>& pixels, const EdgeCurve& edge, double gamma,
                       Parameters& p) {
  double in = 0, out = 0, ins = 0, outs = 0;
  for (const EdgePixel& pixel : pixels) {
    const bool inside = pixel.across_px < value_at(edge.coefficients, pixel.along);
    (inside ? in : out) += light_behind(pixel.grey, gamma);
    (inside ? ins : outs) += 1;
  }
  in /= std::max(ins, 1.0);
  out /= std::max(outs, 1.0);
  p[1] = (in + out) / 2;
  p[2] = (out - in) / 2;
}

/// From where the edge is. The sum of the squares that are left over; infinite when the pixels look
/// otherwise.
template <int terms>
double fit(EdgeCurve& edge, const std::vector<EdgePixel>& pixels, double gamma) {
  constexpr std::size_t least_pixels = 24;
  constexpr int most_steps = 15;
  constexpr double least_blur_px = 0.05, most_blur_px = 6;
  constexpr double enough = 1e-3;  // grey levels squared
  constexpr double least_contrast = 3, unlike = 0.35;
  constexpr double no_edge = std::numeric_limits<double>::infinity();
  if (pixels.size() < least_pixels) return no_edge;
  using Step = Edge<terms>;
  typename Step::Parameters p = Step::Parameters::Zero();
  p[0] = edge.blur_px;
  p.template tail<terms>() = edge.coefficients.head<terms>();
  start_edge_levels(pixels, edge, gamma, p);
  const Step step(pixels, gamma);
  ceres::TinySolver<Step> solver;
  solver.options.max_num_iterations = most_steps;
  solver.options.function_tolerance = enough;
  solver.Solve(step, &p);
  edge.coefficients.setZero();
  edge.coefficients.head<terms>() = p.template tail<terms>();
  edge.blur_px = p[0];
  const double squares = 2 * solver.summary.final_cost;
  const double rms = std::sqrt(squares / static_cast<double>(pixels.size()));
  const bool good = p.allFinite() && p[0] > least_blur_px && p[0] < most_blur_px &&
                    std::abs(p[2]) > least_contrast && rms < unlike * std::abs(p[2]);
  return good ? squares : no_edge;
}

/// Newton's method, from a point near it.
Eigen::Vector2d crossing(const EdgeCurve& a, const EdgeCurve& b, Eigen::Vector2d point) {
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
  using Four = std::array<EdgeCurve, 4>;

  Four roughly, edges;
  double width_px = INFINITY;  // where it is narrowest
  double bow_px = 0;           // of the most bent
  /// Infinite where an edge is none.
  double squares = 0;
  /// Pixels outside, and those of them that run over.
  std::size_t outside = 0, over = 0;

  /// The sides of the quad, which libapriltag has.
  explicit TagEdges(const SeenTag& tag) {
    const auto& corners = tag.corners_px;
    const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d from = corners[k], to = corners[(k + 1) % 4];
      EdgeCurve& edge = roughly[k];
      edge.middle = (from + to) / 2;
      edge.half_px = (to - from).norm() / 2;
      edge.along = (to - from) / (2 * edge.half_px);
      edge.across = {-edge.along.y(), edge.along.x()};
      if (edge.across.dot(edge.middle - middle) < 0) edge.across = -edge.across;
      for (const std::size_t other : {k + 2, k + 3}) {
        width_px = std::min(width_px, edge.across.dot(from - corners[other % 4]));
      }
    }
    edges = roughly;
  }

  void fit_all(const cv::Mat1b& image, const EdgeStripes& stripes, double gamma) {
    // The stripe's other side is kept away from by 2 px: it is blurred, too.
    constexpr double least_px = 1.5, most_px = 4.5, away_px = 2;
    constexpr double most_bow = 0.25;  // of the tag: beyond, the fit went to something else
    const Band band{std::clamp(stripes.inside * width_px - away_px, least_px, most_px),
                    std::clamp(stripes.outside * width_px - away_px, least_px, most_px)};
    squares = bow_px = 0;
    outside = over = 0;
    for (std::size_t k = 0; k < 4 && std::isfinite(squares); ++k) {
      const auto pixels = pixels_beside(image, roughly, k, band);
      for (const auto& [along, across_px, grey] : pixels) {
        if (across_px <= value_at(roughly[k].coefficients, along)) continue;
        ++outside;
        if (grey > kMostTold) ++over;
      }
      squares += edges[k].cubic ? fit<kMostTerms>(edges[k], pixels, gamma)
                                : fit<kTerms>(edges[k], pixels, gamma);
      bow_px = std::max(bow_px, std::abs(edges[k].coefficients[2]));
    }
    if (bow_px > most_bow * width_px) squares = std::numeric_limits<double>::infinity();
  }
};

double difference_px(const TagEdges::Four& a, const TagEdges::Four& b) {
  double most_px = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    most_px = std::max(most_px, (a[k].coefficients - b[k].coefficients).lpNorm<Eigen::Infinity>());
  }
  return most_px;
}

TagEdges fitted(const SeenTag& tag, const cv::Mat1b& image, const EdgeStripes& stripes,
                double gamma) {
  constexpr double bent_px = 0.5, no_parabola_px = 1, settled_px = 0.05;
  constexpr int most_rounds = 4;
  TagEdges found(tag);
  found.fit_all(image, stripes, gamma);
  // A wide lens bends an edge out of a band along the quad's side, which ends beside the corners.
  for (int round = 0; round < most_rounds && found.bow_px > bent_px; ++round) {
    if (!std::isfinite(found.squares)) break;
    if (round > 0 && difference_px(found.edges, found.roughly) < settled_px) break;
    for (EdgeCurve& edge : found.edges) {
      edge.cubic = edge.cubic || std::abs(edge.coefficients[2]) > no_parabola_px;
    }
    found.roughly = found.edges;
    found.fit_all(image, stripes, gamma);
  }
  return found;
}

/// Nothing when an edge is none, or a corner has gone too far.
std::optional<SeenTag> crossed(const SeenTag& tag, const TagEdges& found) {
  constexpr double moved_px = 1.5, moved_share = 0.03;
  if (!std::isfinite(found.squares)) return {};
  // A straight line through all of an edge ends beside it by two thirds of what that bends, and at
  // a corner two do.
  const double most_moved_px = std::max(moved_px, moved_share * found.width_px) + found.bow_px;
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
  std::size_t outside = 0, over = 0;
  for (const std::size_t i : widest) {
    outside += found[i].outside;
    over += found[i].over;
    as_it_is += found[i].squares;
    TagEdges other = found[i];
    other.fit_all(image, stripes, usual_gamma);  // to the same pixels
    behind_curve += other.squares;
    const auto [less, more] = std::minmax(as_it_is, behind_curve);
    if (++told >= fewest && more > clearly * less) break;
  }
  // Of a step whose upper end is not seen the curve cannot be told.
  const bool curved = behind_curve < better * as_it_is && 4 * over < outside;
  std::vector<std::optional<SeenTag>> exact;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    if (curved) found[i] = fitted(tags[i], image, stripes, usual_gamma);
    exact.push_back(crossed(tags[i], found[i]));
  }
  return exact;
}

}  // namespace vlp
