// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "detection/boards/blurred_step.h"

namespace vlp {
namespace {

constexpr double kWhite = 255;

/// Gray level of a light after a tone curve, and its derivative with respect to the light.
struct EncodedLevel {
  EncodedLevel(double light, double gamma) : level(light), slope(1) {
    if (gamma == 1) return;
    constexpr double min_light = 1e-3;  // the curve is vertical at 0
    const double clamped_light = std::max(light, min_light);
    // Single precision: faster, and far below the rounding of the levels.
    const auto fraction = static_cast<float>(clamped_light / kWhite);
    level = kWhite * std::exp(std::log(fraction) / static_cast<float>(gamma));
    slope = level / (gamma * clamped_light);
  }

  double level, slope;
};

double convert_to_light(double level, double gamma) {
  return gamma == 1 ? level : kWhite * std::pow(level / kWhite, gamma);
}

/// Sums, over the rows of a matrix, of the products of each pair of its columns.
template <int columns>
class ColumnProducts {
 public:
  static constexpr std::size_t kColumns = columns + columns % 2;  // pairs are added at a time
  using Row = std::array<double, kColumns>;

  /// Returns the next row, which the caller fills. An additional last column stays 0.
  Row& add_row() {
    if (count_ == rows_.size()) add_products();
    return rows_[count_++];
  }
  /// Returns the sum for columns a <= b after finish().
  double operator()(int a, int b) const {
    return sums_[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)];
  }
  void finish() {
    while (count_ < rows_.size()) rows_[count_++].fill(0);
    add_products();
  }

 private:
  void add_products() {
    // The compiler unrolls and vectorizes loops of constant length.
    const auto add = [this]<std::size_t... a>(std::index_sequence<a...>) {
      (this->template add_products_of_column<a>(), ...);
    };
    add(std::make_index_sequence<kColumns>());
    count_ = 0;
  }
  template <std::size_t a>
  void add_products_of_column() {
    for (std::size_t b = a - a % 2; b < kColumns; ++b) {
      sums_[a][b] += (rows_[0][a] * rows_[0][b] + rows_[1][a] * rows_[1][b]) +
                     (rows_[2][a] * rows_[2][b] + rows_[3][a] * rows_[3][b]);
    }
  }

  std::array<Row, 4> rows_{};
  std::array<Row, kColumns> sums_{};
  std::size_t count_ = 0;
};

/// Normal equations of the residuals of an edge at some parameters.
template <int parameters>
struct EdgeEquations {
  using Column = Eigen::Matrix<double, parameters, 1>;
  using Square = Eigen::Matrix<double, parameters, parameters>;

  /// J' J and J' r, with the Jacobian J of the residuals r.
  Square normal;
  Column gradient;
  /// Sum of the squared residuals, and the part of the prior in it.
  double squares, prior_squares;
  /// J' k, k' k and k' r, with the derivatives k of the residuals with respect to the excess
  /// kurtosis of the line spread.
  Column by_kurtosis;
  double kurtosis_squares, kurtosis_gradient;
};

/// Model of the gray levels of an edge. Parameters: blur, middle, contrast, slope of the light
/// along and across the edge, coefficients of the polynomial.
template <int terms>
class Edge {
 public:
  static constexpr int kParameters = 5 + terms;
  using Equations = EdgeEquations<kParameters>;
  using Parameters = typename Equations::Column;
  using Square = typename Equations::Square;

  /// Levels above max_level are censored.
  Edge(const std::vector<EdgePixel>& pixels, const EdgePrior& prior, double max_level)
      : pixels_(pixels), prior_(prior), max_level_(max_level) {}

  /// Computes the equations with a residual for each pixel and two for the prior.
  Equations linearize(const Parameters& p) const {
    // Columns: derivatives with respect to the parameters, to the kurtosis, and the residuals.
    constexpr int kurtosis = kParameters, residual = kParameters + 1;
    ColumnProducts<kParameters + 2> products;
    const Blur blur(p[0]);
    for (const auto& [w, v, level, stripe_px, white] : pixels_) {
      double offset_px = p[4 + terms];
      for (int k = terms - 2; k >= 0; --k) offset_px = p[5 + k] + w * offset_px;
      const double from_edge_px = v - offset_px;
      BlurredStep step(from_edge_px, blur);
      if (white > 0) {
        const BlurredStep behind(-from_edge_px - stripe_px, blur);
        step.value += white * (1 + behind.value);
        step.slope -= white * behind.slope;
        step.d_value_d_blur += white * behind.d_value_d_blur;
        step.d_value_d_kurtosis += white * behind.d_value_d_kurtosis;
      }
      const double lit = 1 + p[3] * w + p[4] * v, unlit = p[1] + p[2] * step.value;
      const EncodedLevel encoded(unlit * lit, prior_.gamma);
      const double effective_slope = encoded.level < max_level_ ? encoded.slope : 0;
      const double bright = lit * effective_slope, plain = unlit * effective_slope;
      auto& row = products.add_row();
      row[0] = bright * p[2] * step.d_value_d_blur;
      row[1] = bright;
      row[2] = bright * step.value;
      row[3] = plain * w;
      row[4] = plain * v;
      double by_term = -bright * p[2] * step.slope;
      for (std::size_t k = 0; k < terms; ++k, by_term *= w) row[5 + k] = by_term;
      row[kurtosis] = bright * p[2] * step.d_value_d_kurtosis;
      row[residual] = std::min(encoded.level, max_level_) - std::min(level, max_level_);
    }
    auto& blur_row = products.add_row();
    blur_row.fill(0);
    blur_row[0] = prior_.blur_weight;
    const double blur_residual = prior_.blur_weight * (p[0] - prior_.blur_px);
    blur_row[residual] = blur_residual;
    const double outside = p[2] < 0 ? -1 : 1;
    auto& bright_row = products.add_row();
    bright_row.fill(0);
    bright_row[1] = prior_.bright_weight;
    bright_row[2] = outside * prior_.bright_weight;
    const double bright_residual =
        prior_.bright_weight * (p[1] + outside * p[2] - prior_.bright_light);
    bright_row[residual] = bright_residual;
    products.finish();
    Equations equations;
    for (int a = 0; a < kParameters; ++a) {
      for (int b = a; b < kParameters; ++b)
        equations.normal(a, b) = equations.normal(b, a) = products(a, b);
      equations.by_kurtosis[a] = products(a, kurtosis);
      equations.gradient[a] = products(a, residual);
    }
    equations.squares = products(residual, residual);
    equations.prior_squares = blur_residual * blur_residual + bright_residual * bright_residual;
    equations.kurtosis_squares = products(kurtosis, kurtosis);
    equations.kurtosis_gradient = products(kurtosis, residual);
    return equations;
  }

  /// Returns the sigma of the Gaussian with the MTF50 of the step. One Gauss-Newton step first
  /// estimates the excess kurtosis of the line spread (BlurredStep). That of a disc is -1, that of
  /// a Gaussian 0; it stays near 0 if the pixels do not determine it.
  double compute_blur(const Parameters& p, const Equations& equations) const {
    constexpr double kurtosis_sd = 0.5, min_noise = 0.3;  // in levels: that of rounding
    constexpr double min_kurtosis = -1.5, max_kurtosis = 3;
    // A larger change of the blur, as a fraction of it, is not linear: the Gaussian's blur remains.
    constexpr double max_change = 0.3;
    constexpr int count = kParameters + 1;
    const double rows = static_cast<double>(pixels_.size()) + kPriors;
    const double variance = std::max(equations.squares / rows, min_noise * min_noise);
    Eigen::Matrix<double, count, count> normal;
    normal << equations.normal, equations.by_kurtosis, equations.by_kurtosis.transpose(),
        equations.kurtosis_squares + variance / (kurtosis_sd * kurtosis_sd);
    Eigen::Matrix<double, count, 1> right;
    right << -equations.gradient, -equations.kurtosis_gradient;
    Eigen::Matrix<double, count, 1> change = normal.ldlt().solve(right);
    const double kurtosis = std::clamp(change[count - 1], min_kurtosis, max_kurtosis);
    if (kurtosis != change[count - 1]) {
      change.template head<kParameters>() =
          equations.normal.ldlt().solve(-equations.gradient - kurtosis * equations.by_kurtosis);
    }
    const double blur = p[0] + change[0];
    if (!(std::abs(change[0]) <= max_change * p[0])) return p[0];
    // The transfer exp(-s^2 / 2) (1 + kurtosis s^4 / 24) is 0.5 at s; without kurtosis at gaussian.
    const double gaussian = std::sqrt(2 * std::numbers::ln2);
    double s = gaussian;
    for (int i = 0; i < 20; ++i) {
      s = std::sqrt(2 * std::log(2 * (1 + kurtosis * s * s * s * s / 24)));
    }
    return blur * gaussian / s;
  }

 private:
  /// Number of residuals of the prior.
  static constexpr int kPriors = 2;

  const std::vector<EdgePixel>& pixels_;
  EdgePrior prior_;
  double max_level_;
};

/// Returns EdgeFit::end_variance: the mean variance of both ends with a known curvature.
template <int parameters>
double compute_end_variance(const EdgeEquations<parameters>& equations) {
  constexpr int straight = 7;
  using Square = Eigen::Matrix<double, straight, straight>;
  const Square inverse = Square(equations.normal.template topLeftCorner<straight, straight>())
                             .ldlt()
                             .solve(Square::Identity());
  return inverse(straight - 2, straight - 2) + inverse(straight - 1, straight - 1);
}

/// Stop criteria of minimize_residuals(). The tolerance is that of the sum of squares.
struct EdgeFitLimits {
  int max_iterations;
  double function_tolerance;
};

/// Minimizes the residuals of an edge by the method of Levenberg and Marquardt, with the damping of
/// ceres::TinySolver. Returns the equations at the final parameters. Unlike that solver, it does
/// not store the Jacobian and evaluates accepted parameters once.
template <int terms>
typename Edge<terms>::Equations minimize_residuals(const Edge<terms>& edge,
                                                   typename Edge<terms>::Parameters& p,
                                                   const EdgeFitLimits& limits) {
  using Parameters = typename Edge<terms>::Parameters;
  using Square = typename Edge<terms>::Square;
  constexpr double gradient_tolerance = 1e-10, parameter_tolerance = 1e-8;
  constexpr double min_squares = 2 * std::numeric_limits<double>::epsilon();
  constexpr double min_diagonal = 1e-6, max_diagonal = 1e32, negligible_fraction = 0.01;
  auto equations = edge.linearize(p);
  const Parameters scale = (1 + equations.normal.diagonal().array().sqrt()).inverse().matrix();
  double damping = 1e-4, growth = 2;
  Square scaled;
  Parameters gradient;
  const auto scale_equations = [&] {
    scaled = scale.asDiagonal() * equations.normal * scale.asDiagonal();
    gradient = -scale.cwiseProduct(equations.gradient);
    return gradient.template lpNorm<Eigen::Infinity>() >= gradient_tolerance &&
           equations.squares >= min_squares;
  };
  if (!scale_equations()) return equations;
  for (int iteration = 1; iteration < limits.max_iterations; ++iteration) {
    Square damped = scaled;
    damped.diagonal() += damping * scaled.diagonal().cwiseMax(min_diagonal).cwiseMin(max_diagonal);
    const Parameters scaled_step = damped.ldlt().solve(gradient);
    const Parameters step = scale.cwiseProduct(scaled_step);
    if (step.norm() < parameter_tolerance * (p.norm() + parameter_tolerance)) break;
    const double model_change = scaled_step.dot(2 * gradient - scaled * scaled_step);
    // Stops if the expected decrease is negligible compared with the tolerance.
    if (model_change < negligible_fraction * limits.function_tolerance) break;
    const Parameters next = p + step;
    const auto next_equations = edge.linearize(next);
    const double change = equations.squares - next_equations.squares;
    const double ratio = change / model_change;
    const bool has_converged = std::abs(change) < limits.function_tolerance;
    if (ratio > 0) {
      p = next;
      equations = next_equations;
      if (has_converged || !scale_equations()) break;
      const double deviation = 2 * ratio - 1;
      damping *= std::max(1 / 3.0, 1 - deviation * deviation * deviation);
      growth = 2;
    } else {
      if (has_converged) break;
      damping *= growth;
      growth *= 2;
    }
  }
  return equations;
}

/// Mean light of the pixels on both sides of an edge, and fraction of white pixels on the brighter
/// side.
struct EdgeSides {
  EdgeSides(const std::vector<EdgePixel>& pixels, const EdgeCurve& edge, double gamma) {
    constexpr double white = 254;
    double ins = 0, outs = 0, whites_in = 0, whites_out = 0;
    for (const EdgePixel& pixel : pixels) {
      const bool inside = pixel.across_px < edge.curve_offset_px(pixel.along);
      (inside ? in : out) += convert_to_light(pixel.level, gamma);
      (inside ? ins : outs) += 1;
      if (pixel.level >= white) (inside ? whites_in : whites_out) += 1;
    }
    in /= std::max(ins, 1.0);
    out /= std::max(outs, 1.0);
    white_fraction = out > in ? whites_out / std::max(outs, 1.0) : whites_in / std::max(ins, 1.0);
  }

  double in = 0, out = 0;
  double white_fraction;
};

EdgeLight make_initial_light(const EdgeSides& sides, double gamma) {
  return {gamma, (sides.in + sides.out) / 2, (sides.out - sides.in) / 2};
}

/// Returns the light with nearly the same levels for another tone curve.
EdgeLight convert_light(const EdgeLight& light, double gamma) {
  if (gamma == light.gamma) return light;
  const auto convert = [&](double side) {
    return convert_to_light(EncodedLevel(side, light.gamma).level, gamma);
  };
  const double in = convert(light.middle - light.contrast),
               out = convert(light.middle + light.contrast);
  return {gamma, (in + out) / 2, (out - in) / 2, light.slope * (gamma / light.gamma)};
}

template <int terms>
std::optional<EdgeFit> fit(EdgeCurve& edge, const std::vector<EdgePixel>& pixels,
                           const EdgePrior& prior, const EdgeFit* previous) {
  constexpr double min_blur_px = 0.05, max_blur_px = 6;
  constexpr double min_contrast = 3, max_relative_rms = 0.35;  // in levels
  constexpr double min_white_fraction = 0.25, censoring_level = 250;
  using Parameters = typename Edge<terms>::Parameters;
  EdgeLight light;
  bool is_saturated = false;
  if (previous) {
    light = convert_light(previous->light, prior.gamma);
  } else {
    const EdgeSides sides(pixels, edge, prior.gamma);
    light = make_initial_light(sides, prior.gamma);
    is_saturated = sides.white_fraction >= min_white_fraction;
  }
  Parameters p;
  p << edge.blur_px, light.middle, light.contrast, light.slope, edge.coefficients.head<terms>();
  const double max_level = is_saturated ? censoring_level : std::numeric_limits<double>::infinity();
  const Edge<terms> model(pixels, prior, max_level);
  // Blur, contrast and position of a saturated step are strongly correlated: slow convergence.
  const EdgeFitLimits limits = is_saturated ? EdgeFitLimits{60, 1e-6} : EdgeFitLimits{15, 1e-2};
  const auto equations = minimize_residuals(model, p, limits);
  edge.coefficients.setZero();
  edge.coefficients.head<terms>() = p.template tail<terms>();
  edge.blur_px = p[0];
  const double outside = p[2] < 0 ? -1 : 1;
  const double squares = equations.squares - equations.prior_squares;
  EdgeFit result{squares,
                 pixels.size(),
                 is_saturated,
                 p[1] + outside * p[2],
                 p[1] - outside * p[2],
                 {prior.gamma, p[1], p[2], p.template segment<2>(3)}};
  const double rms = std::sqrt(result.sum_of_squares / static_cast<double>(pixels.size()));
  const double bright = EncodedLevel(p[1] + p[2], prior.gamma).level;
  const double contrast = std::abs(bright - EncodedLevel(p[1] - p[2], prior.gamma).level) / 2;
  const bool is_accepted = p.allFinite() && p[0] > min_blur_px && p[0] < max_blur_px &&
                           contrast > min_contrast && rms < max_relative_rms * contrast;
  if (!is_accepted) return {};
  result.end_variance = compute_end_variance(equations);
  result.equivalent_blur_px = model.compute_blur(p, equations);
  if (is_saturated || prior.gamma != 1) {
    const auto factor = equations.normal.ldlt();
    Parameters brighter = Parameters::Zero();
    brighter.template segment<2>(1) << 1, outside;
    const Parameters blur = Parameters::Unit(0);
    result.blur_variance = factor.solve(blur).dot(blur);
    result.bright_variance = factor.solve(brighter).dot(brighter);
  }
  return result;
}

}  // namespace

Eigen::Vector2d EdgeCurve::compute_distance_gradient(const Eigen::Vector2d& x) const {
  const double w = along.dot(x - middle) / half_length_px;
  const Coefficients& c = coefficients;
  const double slope = c[1] + w * (2 * c[2] + w * 3 * c[3]);
  return across - slope / half_length_px * along;
}

Eigen::Vector2d intersect_edge_curves(const EdgeCurve& a, const EdgeCurve& b,
                                      Eigen::Vector2d point) {
  constexpr int steps = 4;
  for (int i = 0; i < steps; ++i) {
    Eigen::Matrix2d gradients;
    gradients << a.compute_distance_gradient(point).transpose(),
        b.compute_distance_gradient(point).transpose();
    point -= gradients.inverse() * Eigen::Vector2d(a.signed_distance_outwards_px(point),
                                                   b.signed_distance_outwards_px(point));
  }
  return point;
}

std::optional<EdgeFit> fit_edge_curve(EdgeCurve& edge, const std::vector<EdgePixel>& pixels,
                                      const EdgePrior& prior, const EdgeFit* previous) {
  constexpr std::size_t min_pixels = 24;
  if (pixels.size() < min_pixels) return {};
  return edge.cubic ? fit<EdgeCurve::kMaxTerms>(edge, pixels, prior, previous)
                    : fit<EdgeCurve::kTerms>(edge, pixels, prior, previous);
}

}  // namespace vlp
