// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_fit.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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
    // Faster than std::pow, whose last digits are not needed.
    level = kWhite * std::exp(std::log(clamped_light / kWhite) / gamma);
    slope = level / (gamma * clamped_light);
  }

  double level, slope;
};

double convert_level_to_light(double level, double gamma) {
  return gamma == 1 ? level : kWhite * std::pow(level / kWhite, gamma);
}

/// Residuals and Jacobian for ceres::TinySolver. Parameters: blur, middle, contrast, slope of the
/// light along and across the edge, coefficients of the polynomial. The solver evaluates an
/// accepted step twice, the second time with derivatives; these are stored at the first evaluation.
template <int terms>
class Edge {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 5 + terms };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS>;

  /// Levels above max_level are censored.
  Edge(const std::vector<EdgePixel>& pixels, const EdgePrior& prior, double max_level)
      : pixels_(pixels),
        prior_(prior),
        max_level_(max_level),
        residuals_(rows()),
        d_residuals_d_kurtosis_(Eigen::VectorXd::Zero(rows())),
        jacobian_(rows(), +NUM_PARAMETERS) {}

  int NumResiduals() const { return static_cast<int>(rows()); }

  bool operator()(const double* p, double* residuals, double* jacobian) const {
    const Eigen::Map<const Parameters> parameters(p);
    if (parameters != at_) evaluate(parameters);
    Eigen::Map<Eigen::VectorXd>(residuals, rows()) = residuals_;
    if (jacobian) Eigen::Map<Jacobian>(jacobian, rows(), +NUM_PARAMETERS) = jacobian_;
    return true;
  }

  double sum_squared_prior_residuals(const Parameters& p) const {
    if (p != at_) evaluate(p);
    return residuals_.template tail<kPriors>().squaredNorm();
  }
  /// Returns the variance of a linear combination `sum` of the parameters for a noise of one level.
  double variance(const Parameters& p, const Parameters& sum) const {
    if (p != at_) evaluate(p);
    const Eigen::Matrix<double, NUM_PARAMETERS, NUM_PARAMETERS> normal =
        jacobian_.transpose() * jacobian_;
    return normal.ldlt().solve(sum).dot(sum);
  }
  /// Returns the sigma of the Gaussian with the MTF50 of the step. One Gauss-Newton step first
  /// estimates the excess kurtosis of the line spread (BlurredStep). That of a disc is -1, that of
  /// a Gaussian 0; it stays near 0 if the pixels do not determine it.
  double compute_equivalent_blur(const Parameters& p) const {
    constexpr double kurtosis_sd = 0.5, min_noise = 0.3;  // in levels: that of rounding
    constexpr double min_kurtosis = -1.5, max_kurtosis = 3;
    // A larger change of the blur, as a fraction of it, is not linear: the Gaussian's blur remains.
    constexpr double max_change = 0.3;
    if (p != at_) evaluate(p);
    constexpr int count = NUM_PARAMETERS + 1;
    Eigen::Matrix<double, Eigen::Dynamic, count> derivatives(rows(), count);
    derivatives << jacobian_, d_residuals_d_kurtosis_;
    Eigen::Matrix<double, count, count> normal = derivatives.transpose() * derivatives;
    const double variance =
        std::max(residuals_.squaredNorm() / static_cast<double>(rows()), min_noise * min_noise);
    normal(count - 1, count - 1) += variance / (kurtosis_sd * kurtosis_sd);
    const Eigen::Matrix<double, count, 1> right = -derivatives.transpose() * residuals_;
    Eigen::Matrix<double, count, 1> change = normal.ldlt().solve(right);
    const double kurtosis = std::clamp(change[count - 1], min_kurtosis, max_kurtosis);
    if (kurtosis != change[count - 1]) {
      const auto head = normal.template topLeftCorner<count - 1, count - 1>();
      const auto by_kurtosis = normal.template topRightCorner<count - 1, 1>();
      change.template head<count - 1>() =
          head.ldlt().solve(right.template head<count - 1>() - kurtosis * by_kurtosis);
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
  /// Returns EdgeFit::end_variance: the mean variance of both ends with a known curvature.
  double compute_variance_at_edge_end(const Parameters& p) const {
    constexpr int straight = 7;
    using Square = Eigen::Matrix<double, straight, straight>;
    if (p != at_) evaluate(p);
    const auto without_bow = jacobian_.template leftCols<straight>();
    const Square inverse =
        Square(without_bow.transpose() * without_bow).ldlt().solve(Square::Identity());
    return inverse(straight - 2, straight - 2) + inverse(straight - 1, straight - 1);
  }

 private:
  /// Number of residuals of the prior, which are the last ones.
  static constexpr Eigen::Index kPriors = 2;
  Eigen::Index rows() const { return static_cast<Eigen::Index>(pixels_.size()) + kPriors; }

  void evaluate(const Parameters& p) const {
    at_ = p;
    const Blur blur(p[0]);
    for (Eigen::Index i = 0; i + kPriors < rows(); ++i) {
      const auto& [w, v, level, stripe_px, white] = pixels_[static_cast<std::size_t>(i)];
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
      residuals_[i] = std::min(encoded.level, max_level_) - std::min(level, max_level_);
      const double effective_slope = encoded.level < max_level_ ? encoded.slope : 0;
      const double bright = lit * effective_slope, plain = unlit * effective_slope;
      auto row = jacobian_.row(i);
      row.template head<5>() << bright * p[2] * step.d_value_d_blur, bright, bright * step.value,
          plain * w, plain * v;
      d_residuals_d_kurtosis_[i] = bright * p[2] * step.d_value_d_kurtosis;
      double by_term = -bright * p[2] * step.slope;
      for (int k = 0; k < terms; ++k, by_term *= w) row[5 + k] = by_term;
    }
    const Eigen::Index blurs = rows() - 2, brights = rows() - 1;
    jacobian_.template bottomRows<kPriors>().setZero();
    residuals_[blurs] = prior_.blur_weight * (p[0] - prior_.blur_px);
    jacobian_(blurs, 0) = prior_.blur_weight;
    const double outside = p[2] < 0 ? -1 : 1;
    residuals_[brights] = prior_.bright_weight * (p[1] + outside * p[2] - prior_.bright_light);
    jacobian_(brights, 1) = prior_.bright_weight;
    jacobian_(brights, 2) = outside * prior_.bright_weight;
  }

  const std::vector<EdgePixel>& pixels_;
  EdgePrior prior_;
  double max_level_;
  mutable Parameters at_ = Parameters::Constant(std::numeric_limits<double>::quiet_NaN());
  mutable Eigen::VectorXd residuals_, d_residuals_d_kurtosis_;
  mutable Jacobian jacobian_;
};

/// Mean light of the pixels on both sides of an edge, and fraction of white pixels on the brighter
/// side.
struct EdgeSides {
  EdgeSides(const std::vector<EdgePixel>& pixels, const EdgeCurve& edge, double gamma) {
    constexpr double white = 254;
    double ins = 0, outs = 0, whites_in = 0, whites_out = 0;
    for (const EdgePixel& pixel : pixels) {
      const bool inside = pixel.across_px < edge.curve_offset_from_straight_line_px(pixel.along);
      (inside ? in : out) += convert_level_to_light(pixel.level, gamma);
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
    return convert_level_to_light(EncodedLevel(side, light.gamma).level, gamma);
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
  using Step = Edge<terms>;
  EdgeLight light;
  bool is_saturated = false;
  if (previous) {
    light = convert_light(previous->light, prior.gamma);
  } else {
    const EdgeSides sides(pixels, edge, prior.gamma);
    light = make_initial_light(sides, prior.gamma);
    is_saturated = sides.white_fraction >= min_white_fraction;
  }
  typename Step::Parameters p;
  p << edge.blur_px, light.middle, light.contrast, light.slope, edge.coefficients.head<terms>();
  const double max_level = is_saturated ? censoring_level : std::numeric_limits<double>::infinity();
  const Step step(pixels, prior, max_level);
  ceres::TinySolver<Step> solver;
  // Blur, contrast and position of a saturated step are strongly correlated: slow convergence.
  solver.options.max_num_iterations = is_saturated ? 60 : 15;
  solver.options.function_tolerance = is_saturated ? 1e-6 : 1e-3;  // levels squared
  solver.Solve(step, &p);
  edge.coefficients.setZero();
  edge.coefficients.head<terms>() = p.template tail<terms>();
  edge.blur_px = p[0];
  const double outside = p[2] < 0 ? -1 : 1;
  const double squares = 2 * solver.summary.final_cost - step.sum_squared_prior_residuals(p);
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
  result.end_variance = step.compute_variance_at_edge_end(p);
  result.equivalent_blur_px = step.compute_equivalent_blur(p);
  if (is_saturated || prior.gamma != 1) {
    typename Step::Parameters brighter = Step::Parameters::Zero();
    brighter.template segment<2>(1) << 1, outside;
    result.blur_variance = step.variance(p, Step::Parameters::Unit(0));
    result.bright_variance = step.variance(p, brighter);
  }
  return result;
}

}  // namespace

Eigen::Vector2d EdgeCurve::compute_gradient_of_curve_distance_wrt_pixel(
    const Eigen::Vector2d& x) const {
  const double w = along.dot(x - middle) / half_length_px;
  const Coefficients& c = coefficients;
  const double slope = c[1] + w * (2 * c[2] + w * 3 * c[3]);
  return across - slope / half_length_px * along;
}

Eigen::Vector2d find_edge_intersection(const EdgeCurve& a, const EdgeCurve& b,
                                       Eigen::Vector2d point) {
  constexpr int steps = 4;
  for (int i = 0; i < steps; ++i) {
    Eigen::Matrix2d gradients;
    gradients << a.compute_gradient_of_curve_distance_wrt_pixel(point).transpose(),
        b.compute_gradient_of_curve_distance_wrt_pixel(point).transpose();
    point -= gradients.inverse() *
             Eigen::Vector2d(a.distance_from_curve_px(point), b.distance_from_curve_px(point));
  }
  return point;
}

std::optional<EdgeFit> fit_edge_curve_and_blur(EdgeCurve& edge,
                                               const std::vector<EdgePixel>& pixels,
                                               const EdgePrior& prior, const EdgeFit* previous) {
  constexpr std::size_t min_pixels = 24;
  if (pixels.size() < min_pixels) return {};
  return edge.cubic ? fit<EdgeCurve::kMaxTerms>(edge, pixels, prior, previous)
                    : fit<EdgeCurve::kTerms>(edge, pixels, prior, previous);
}

}  // namespace vlp
