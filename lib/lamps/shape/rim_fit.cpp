// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/rim_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "lamps/shape/m_estimate.h"

namespace vlp {
namespace {

/// Level above which a pixel is clipped, so that it is only a lower bound of its light. It is
/// slightly below the maximum because of sharpening and compression.
constexpr double kClipped = 0.98 * 255;

/// Levels of an image scaled to 8 bits. For more bits the brightest level of a light is 255.
class Levels {
 public:
  Levels(const ImageView& image, const Eigen::Vector2d& low, const Eigen::Vector2d& high)
      : image_(image) {
    if (image.bits == 8) return;
    const int x = static_cast<int>(low.x()), y = static_cast<int>(low.y());
    const PixelBox box{x, y, static_cast<int>(high.x()) + 1 - x,
                       static_cast<int>(high.y()) + 1 - y};
    int brightest = 0;
    const ImageView pixels = image.crop_to_box(box);
    for (int row = 0; row < pixels.height; ++row) {
      for (int column = 0; column < pixels.width; ++column) {
        brightest = std::max(brightest, pixels.gray_level_at_pixel(column, row));
      }
    }
    if (brightest > 0) scale_ = 255.0 / brightest;
  }

  int columns() const { return image_.width; }
  double to_relative_level(double level) const { return scale_ * level; }
  double at(int row, int column) const {
    return to_relative_level(image_.gray_level_at_pixel(column, row));
  }

 private:
  ImageView image_;
  double scale_ = 1;
};

/// Pixel next to the rim: depth behind it, position along it in scanlines, and level.
struct StepSample {
  double depth_px, along, level;

  bool clipped() const { return level >= kClipped; }
};

/// Crossing of a scanline and the outline, and the change of depth per column there.
struct Crossing {
  int line;
  double column, per_column;
};

struct Piece {
  std::vector<StepSample> samples;
  std::vector<Crossing> crossings;
};

/// Unknowns of the step model; levels and the blur are logarithms.
enum StepUnknown { kAt, kOut, kOutSlope, kIn, kInSlope, kAlong, kLogBlur, kStepUnknowns };
using StepVector = Eigen::Matrix<double, kStepUnknowns, 1>;

struct StepModel {
  StepVector x;
  double gamma;
  /// Light without the lamp.
  double floor_light;

  /// Returns the residual of a sample for the blur s = exp(x[kLogBlur]).
  CurveDistance<kStepUnknowns> residual(const StepSample& sample, double s) const {
    const auto fraction = [](double v) { return std::erfc(-v / std::numbers::sqrt2) / 2; };
    const auto density = [](double v) {
      return std::exp(-v * v / 2) / std::sqrt(2 * std::numbers::pi);
    };
    const double u = sample.depth_px - x[kAt];
    const double p = x[kOutSlope], q = x[kInSlope];
    const double outer = std::exp(x[kAlong] * sample.along + x[kOut] + p * u + p * p * s * s / 2);
    const double inner = std::exp(x[kAlong] * sample.along + x[kIn] + q * u + q * q * s * s / 2);
    const double before = -u / s - p * s, behind = u / s + q * s;
    const double out = outer * fraction(before), in = inner * fraction(behind);
    const double at_out = outer * density(before), at_in = inner * density(behind);
    const double light = out + in + floor_light;
    const double modeled_level = std::exp(std::log(light) / gamma),
                 d_level_d_light = modeled_level / light / gamma;
    CurveDistance<kStepUnknowns> result;
    result.error = modeled_level - std::min(sample.level, kClipped);
    result.slope[kAt] = -d_level_d_light * (p * out - at_out / s + q * in + at_in / s);
    result.slope[kOut] = d_level_d_light * out;
    result.slope[kOutSlope] = d_level_d_light * (out * (u + p * s * s) - at_out * s);
    result.slope[kIn] = d_level_d_light * in;
    result.slope[kInSlope] = d_level_d_light * (in * (u + q * s * s) + at_in * s);
    result.slope[kAlong] = d_level_d_light * (out + in) * sample.along;
    result.slope[kLogBlur] =
        d_level_d_light * s *
        (p * p * s * out + at_out * (u / (s * s) - p) + q * q * s * in - at_in * (u / (s * s) - q));
    return result;
  }
};

/// Splits the scanlines into pieces of at most `limit` consecutive ones.
std::vector<std::vector<int>> split_into_pieces(const std::vector<int>& lines, int limit) {
  std::vector<std::vector<int>> pieces;
  for (std::size_t begin = 0; begin < lines.size();) {
    std::size_t end = begin + 1;
    while (end < lines.size() && lines[end] == lines[end - 1] + 1) ++end;
    const std::size_t all = end - begin,
                      parts = (all + std::size_t(limit) - 1) / std::size_t(limit);
    for (std::size_t i = 0; i < parts; ++i) {
      const auto first = lines.begin() + std::ptrdiff_t(begin);
      pieces.emplace_back(first + std::ptrdiff_t(all * i / parts),
                          first + std::ptrdiff_t(all * (i + 1) / parts));
    }
    begin = end;
  }
  return pieces;
}

/// Outline of a light and its crossings with scanlines.
class CrossedOutline {
 public:
  CrossedOutline(const Light& light, const LightShape& shape)
      : light_(light),
        shape_(shape),
        low_(shape.swap_image_and_scanline_axes(light.box_min)),
        high_(shape.swap_image_and_scanline_axes(light.box_max)) {}

  /// Returns the depth of a pixel behind the outline.
  double depth_behind_outline_px(double column, double line) const {
    constexpr double half = 0.5;
    const double radii = relative_radius_at(column, line);
    const Eigen::Vector2d slope(
        relative_radius_at(column + half, line) - relative_radius_at(column - half, line),
        relative_radius_at(column, line + half) - relative_radius_at(column, line - half));
    return (1 - radii) / slope.norm();
  }

  Eigen::Vector2d inward_normal(const Crossing& at) const {
    const double per_line = (depth_behind_outline_px(at.column, at.line + 1) -
                             depth_behind_outline_px(at.column, at.line - 1)) /
                            2;
    return Eigen::Vector2d(at.per_column, per_line).normalized();
  }

  std::optional<Crossing> find_outline_crossing(int line, bool begins) const {
    constexpr double flattest = 0.3;
    const Eigen::Vector2d center = (low_ + high_) / 2, half = (high_ - low_) / 2;
    const double up = (line - center.y()) / half.y();
    if (std::abs(up) >= 1) return std::nullopt;
    const double sign = begins ? 1 : -1;
    Crossing result{line, center.x() - sign * half.x() * std::sqrt(1 - up * up), 0};
    for (int round = 0; round < 3; ++round) {
      result.per_column = (depth_behind_outline_px(result.column + 1, line) -
                           depth_behind_outline_px(result.column - 1, line)) /
                          2;
      if (!(sign * result.per_column > flattest)) return std::nullopt;
      result.column -= depth_behind_outline_px(result.column, line) / result.per_column;
    }
    return std::isfinite(result.column) ? std::optional(result) : std::nullopt;
  }

 private:
  /// Returns the distance from the center as a fraction of that of the outline.
  double relative_radius_at(double column, double line) const {
    constexpr double far = 10;
    const auto plane = shape_.level_plane_point_from_pixel(
        shape_.swap_image_and_scanline_axes(Eigen::Vector2d(column, line)));
    return plane ? (light_.unit_from_plane * (*plane - light_.plane_center)).norm() : far;
  }

  const Light& light_;
  const LightShape& shape_;
  Eigen::Vector2d low_, high_;
};

Piece sample_outline_piece(const Levels& levels, const std::vector<int>& lines, bool begins,
                           const CrossedOutline& outline, double reach_px) {
  constexpr double straight = 0.7;
  Piece piece;
  const int middle_line = lines[lines.size() / 2];
  for (const int line : lines) {
    const auto crossing = outline.find_outline_crossing(line, begins);
    if (!crossing) continue;
    piece.crossings.push_back(*crossing);
    const int middle = static_cast<int>(std::lround(crossing->column));
    const int reach = static_cast<int>(std::ceil(reach_px / std::abs(crossing->per_column)));
    for (int column = std::max(0, middle - reach);
         column <= std::min(levels.columns() - 1, middle + reach); ++column) {
      const double depth_px = std::abs(crossing->per_column) > straight
                                  ? crossing->per_column * (column - crossing->column)
                                  : outline.depth_behind_outline_px(column, line);
      if (std::abs(depth_px) > reach_px) continue;
      piece.samples.push_back({depth_px, double(line - middle_line), levels.at(line, column)});
    }
  }
  return piece;
}

struct Step {
  double at_px, sd_px;
  double log_blur, log_blur_sd;
};

constexpr std::size_t kMinStepSamples = 30;

/// Mean levels of the samples clearly outside and inside the rim, at least 1.
struct SideLevels {
  double out, in;
};

/// Returns std::nullopt if one side has no samples.
std::optional<SideLevels> measure_side_levels(const std::vector<StepSample>& samples) {
  constexpr double clear_px = 2;
  std::array<double, 2> sums{}, counts{};
  for (const StepSample& sample : samples) {
    if (std::abs(sample.depth_px) < clear_px) continue;
    const std::size_t side = sample.depth_px > 0 ? 1 : 0;
    sums[side] += sample.level;
    ++counts[side];
  }
  if (counts[0] == 0 || counts[1] == 0) return std::nullopt;
  return SideLevels{std::max(1.0, sums[0] / counts[0]), std::max(1.0, sums[1] / counts[1])};
}

/// Computes the residuals of the samples. A clipped pixel does not constrain a model in which it is
/// clipped (Tobin 1958).
std::vector<CurveDistance<kStepUnknowns>> compute_step_residuals(
    const std::vector<StepSample>& samples, const StepModel& model) {
  std::vector<CurveDistance<kStepUnknowns>> residuals;
  residuals.reserve(samples.size());
  const double blur_px = std::exp(model.x[kLogBlur]);
  for (const StepSample& sample : samples) {
    residuals.push_back(model.residual(sample, blur_px));
    if (sample.clipped() && residuals.back().error >= 0) residuals.pop_back();
  }
  return residuals;
}

std::optional<Step> fit_step_of_piece(const Piece& piece, double dark,
                                      const StepImageModel& image_model, bool blur_known) {
  constexpr int max_iterations = 12;
  constexpr double min_step_sds = 1e-4;  // a smaller step, in standard deviations, is the last one
  constexpr double farthest_px = 3;
  // Prior standard deviations of the slopes, of the change along the rim and of the log blur,
  // weighted relative to the noise in gray levels.
  constexpr double noise = 1.5, slope_sd = 0.3, along_sd = 0.05, log_blur_sd = 0.4;
  if (piece.samples.size() < kMinStepSamples) return std::nullopt;
  const auto levels = measure_side_levels(piece.samples);
  if (!levels) return std::nullopt;
  const auto [out, in] = *levels;
  StepModel model{{}, image_model.gamma, std::pow(std::max(0.5, dark), image_model.gamma)};
  model.x << 0, image_model.gamma * std::log(out), 0, image_model.gamma * std::log(in), 0, 0,
      std::log(image_model.blur_px);
  const double known_blur = model.x[kLogBlur];
  struct Prior {
    StepUnknown unknown;
    double value, sd;
  };
  const std::array priors{Prior{kOutSlope, 0, slope_sd}, Prior{kInSlope, 0, slope_sd},
                          Prior{kAlong, 0, along_sd},
                          Prior{kLogBlur, known_blur, blur_known ? 1e-3 : log_blur_sd}};
  const double tolerance = std::max({4.0, 0.2 * std::abs(in - out), 0.1 * in});
  std::optional<MEstimateStep<kStepUnknowns>> last;
  for (int round = 0; round < max_iterations; ++round) {
    const auto residuals = compute_step_residuals(piece.samples, model);
    if (residuals.size() < kMinStepSamples) return std::nullopt;
    const std::vector<double> weights(residuals.size() + priors.size(), 1);
    last = compute_m_estimate_step<kStepUnknowns>(weights, tolerance, [&](std::size_t i) {
      if (i < residuals.size()) return residuals[i];
      const auto& [unknown, value, sd] = priors[i - residuals.size()];
      CurveDistance<kStepUnknowns> prior{noise / sd * (model.x[unknown] - value),
                                         StepVector::Zero()};
      prior.slope[unknown] = noise / sd;
      return prior;
    });
    if (!last) return std::nullopt;
    const StepVector limit{0.7, 0.5, 0.1, 0.5, 0.1, 0.05, 0.3};
    model.x -= last->step.cwiseMin(limit).cwiseMax(-limit);
    if (!(std::abs(model.x[kAt]) < farthest_px)) return std::nullopt;
    const StepVector sds = last->parameter_covariance().diagonal().cwiseSqrt();
    if ((last->step.array().abs() < min_step_sds * sds.array()).all()) break;
  }
  const auto covariance = last->parameter_covariance();
  return Step{model.x[kAt], std::sqrt(covariance(kAt, kAt)), model.x[kLogBlur],
              std::sqrt(covariance(kLogBlur, kLogBlur))};
}

}  // namespace

RimSteps fit_brightness_steps_at_rim(const ImageView& image, const Light& light,
                                     const std::vector<int>& lit_lines,
                                     const Background& background,
                                     const StepImageModel& image_model, bool blur_known,
                                     const LightShape& shape) {
  constexpr double piece_radius_fraction = 0.2, min_lines = 6, max_sd_px = 0.5;
  constexpr double min_reach_px = 7, reach_blur_ratio = 4;
  constexpr double blur_sd_fraction = 0.05;  // effect of sharpening and compression
  constexpr std::size_t min_crossings = 3;
  const double reach_px = std::max(min_reach_px, reach_blur_ratio * image_model.blur_px);
  const CrossedOutline outline(light, shape);
  const Levels levels(image, shape.swap_image_and_scanline_axes(light.box_min),
                      shape.swap_image_and_scanline_axes(light.box_max));
  const int limit = static_cast<int>(std::max(min_lines, piece_radius_fraction * light.radius_px));
  RimSteps result{{}, 0, {}, image_model.blur_px};
  double log_blur = 0, weight = 0;
  for (const std::vector<int>& lines : split_into_pieces(lit_lines, limit)) {
    for (const bool begins : {true, false}) {
      const Piece piece = sample_outline_piece(levels, lines, begins, outline, reach_px);
      if (piece.crossings.size() < min_crossings) continue;
      ++result.num_examined;
      const auto step = fit_step_of_piece(piece, levels.to_relative_level(background.level),
                                          image_model, blur_known);
      if (!step || !(step->sd_px < max_sd_px)) continue;
      log_blur += step->log_blur / std::pow(step->log_blur_sd, 2);
      weight += 1 / std::pow(step->log_blur_sd, 2);
      const double sd_px = std::hypot(step->sd_px, blur_sd_fraction * image_model.blur_px);
      const Crossing& middle = piece.crossings[piece.crossings.size() / 2];
      result.pieces.push_back({outline.inward_normal(middle), step->at_px, sd_px});
      for (const Crossing& crossing : piece.crossings) {
        result.points.push_back(
            {{crossing.column + step->at_px / crossing.per_column, crossing.line},
             1 / sd_px,
             light.rise_px,
             begins});
      }
    }
  }
  if (!blur_known && weight > 0) result.blur_px = std::exp(log_blur / weight);
  return result;
}

namespace {

template <int N>
std::optional<OutlineOffset> estimate_shift(const std::vector<RimPiece>& pieces) {
  constexpr int num_iterations = 8;
  constexpr double tolerance = 10;  // its tenth, the smallest scale, is one standard deviation
  const std::vector<double> weights(pieces.size(), 1);
  Eigen::Matrix<double, N, 1> x = Eigen::Matrix<double, N, 1>::Zero();
  std::optional<MEstimateStep<N>> last;
  for (int round = 0; round < num_iterations; ++round) {
    last = compute_m_estimate_step<N>(weights, tolerance, [&](std::size_t i) {
      const auto& [inwards, step_depth_px, sd_px] = pieces[i];
      const double c = inwards.x(), s = inwards.y();
      CurveDistance<N> result;
      result.slope.template head<3>() << -c, -s, 1;
      if constexpr (N > 3) result.slope.template tail<2>() << s * s - c * c, -2 * c * s;
      result.slope /= sd_px;
      result.error = step_depth_px / sd_px + result.slope.dot(x);
      return result;
    });
    if (!last) return std::nullopt;
    x -= last->step;
  }
  return OutlineOffset{x.template head<2>(),
                       last->parameter_covariance(1).template topLeftCorner<2, 2>(),
                       last->sum_of_weights};
}

}  // namespace

std::optional<OutlineOffset> estimate_outline_offset(const std::vector<RimPiece>& pieces,
                                                     bool round) {
  return round ? estimate_shift<3>(pieces) : estimate_shift<5>(pieces);
}

}  // namespace vlp
