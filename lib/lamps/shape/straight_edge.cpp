// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/straight_edge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "geometry/normal_equations.h"
#include "lamps/shape/m_estimate.h"

namespace vlp {
namespace {

/// Pixel near the side.
struct Sample {
  int line;
  LineLevel lit;
  /// Level as a fraction of that of the brightest scanline.
  double value;
  /// Position along the side, from 0 to 1.
  double t;
  /// Distance from the side, in pixels, inside positive, and its decrease if the side moves inwards
  /// by a pixel of the plane.
  double depth_px, per_move;
};

/// Unknowns, in this order.
enum Unknown {
  kFrom,
  kTo,
  kBlur,
  kLevelFrom,
  kLevelTo,
  kLevelBend,
  kInsideSlope,
  kOutside,
  kOutsideSlope,
  kBow
};
constexpr int kUnknowns = kBow + 1;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

struct Model {
  Unknowns x;

  /// Returns the residual and its derivative with respect to the unknowns. `d_residual_d_level`
  /// receives the derivative with respect to the scanline's level.
  CurveDistance<kUnknowns> residual(const Sample& sample,
                                    double* d_residual_d_level = nullptr) const {
    const double t = sample.t, middle = 4 * t * (1 - t);
    const double move = (1 - t) * x[kFrom] + t * x[kTo] + middle * x[kBow];
    const double depth_px = sample.depth_px - sample.per_move * move, depth = depth_px / x[kBlur];
    const double inside = std::erfc(-depth / std::numbers::sqrt2) / 2;
    const double density = std::exp(-depth * depth / 2) / std::sqrt(2 * std::numbers::pi);
    const double level = (1 - t) * x[kLevelFrom] + t * x[kLevelTo] + middle * x[kLevelBend] +
                         depth_px * x[kInsideSlope];
    const double outside = x[kOutside] + depth_px * x[kOutsideSlope];
    const double s = sample.lit.level, step = s * (level - outside);
    const double modeled = outside + (level - outside) * inside;
    CurveDistance<kUnknowns> result;
    result.error = sample.value - s * modeled;
    const double d_residual_d_move =
        (step * density / x[kBlur] + s * (1 - inside) * x[kOutsideSlope] +
         s * inside * x[kInsideSlope]) *
        sample.per_move;
    result.slope[kFrom] = d_residual_d_move * (1 - t);
    result.slope[kTo] = d_residual_d_move * t;
    result.slope[kBlur] = step * density * depth / x[kBlur];
    result.slope[kLevelFrom] = -s * inside * (1 - t);
    result.slope[kLevelTo] = -s * inside * t;
    result.slope[kLevelBend] = -s * inside * middle;
    result.slope[kInsideSlope] = -s * inside * depth_px;
    result.slope[kOutside] = -s * (1 - inside);
    result.slope[kOutsideSlope] = depth_px * result.slope[kOutside];
    result.slope[kBow] = d_residual_d_move * middle;
    if (d_residual_d_level != nullptr) *d_residual_d_level = -modeled;
    return result;
  }
};

/// Collects the samples of a side.
class Samples {
 public:
  Samples(const EdgeImage& image, const Side& side, const EdgeSearch& search,
          bool can_leave_image = false)
      : image_(image), side_(side), can_leave_image_(can_leave_image) {
    // A corner is blurred by both sides.
    constexpr double max_corner_px = 4, corner_fraction = 0.25, min_length_px = 6;
    const auto from = find_pixel(0), to = find_pixel(1);
    if (!from || !to) return;
    const Eigen::Vector2d direction = *to - *from;
    length_px = direction.norm();
    if (length_px < min_length_px) return;
    const double corner_px = std::min(max_corner_px, corner_fraction * length_px);
    const int along = std::abs(direction.y()) >= std::abs(direction.x()) ? 1 : 0;
    const double margin = corner_px / length_px, used = 1 - 2 * margin;
    const int count = static_cast<int>(used * std::abs(direction[along]));
    std::vector<Eigen::Vector2d> places;
    for (int i = 0; i <= count; ++i) {
      const auto place = find_pixel(margin + used * i / count);
      if (!place) return;
      if (along == 0 || is_scanline_lit(static_cast<int>(place->y()))) places.push_back(*place);
    }
    const std::size_t every = (places.size() + search.positions - 1) / search.positions;
    for (std::size_t i = 0; i < places.size(); i += every) {
      if (add_place(places[i], 1 - along, search.reach_px, used / 2)) continue;
      samples.clear();
      return;
    }
  }

  /// Samples; empty if the side is too short or not fully inside the image.
  std::vector<Sample> samples;
  /// Length of the side in the image.
  double length_px = 0;

 private:
  /// Returns true if a scanline is not dark.
  bool is_scanline_lit(int line) const {
    constexpr double minimum = 0.1;
    const auto lit = image_.levels.relative_scanline_level(line);
    return lit && lit->level > minimum;
  }

  /// Returns the pixel, (column, row), on the side; std::nullopt if it is outside the image.
  std::optional<Eigen::Vector2d> find_pixel(double t) const {
    const auto pixel =
        image_.shape.pixel_from_level_plane_point(side_.from + t * (side_.to - side_.from));
    if (!pixel) return std::nullopt;
    const Eigen::Vector2d at = image_.shape.swap_image_and_scanline_axes(*pixel).array().round();
    const ImageSize size = image_.lines.size();
    const bool is_inside = at.minCoeff() >= 0 && at.x() < size.width && at.y() < size.height;
    return is_inside ? std::optional(at) : std::nullopt;
  }

  /// Adds the pixels across the side at one of its pixels, up to a fraction of the side from its
  /// middle. Returns false if they are outside the image or the plane.
  bool add_place(const Eigen::Vector2d& middle, int across, double reach_px,
                 double max_off_middle_fraction) {
    constexpr double apart_px = 2;
    const auto plane = [&](const Eigen::Vector2d& pixel) {
      return image_.shape.level_plane_point_from_pixel(
          image_.shape.swap_image_and_scanline_axes(pixel));
    };
    const auto here = plane(middle);
    const auto right = plane(middle + Eigen::Vector2d(apart_px, 0));
    const auto below = plane(middle + Eigen::Vector2d(0, apart_px));
    if (!here || !right || !below) return false;
    Matrix2 plane_from_pixel;
    plane_from_pixel << (*right - *here) / apart_px, (*below - *here) / apart_px;
    const Eigen::Vector2d inwards = side_.inward_normal();
    const Eigen::Vector2d gradient = plane_from_pixel.transpose() * inwards;
    const double px = gradient.norm();  // size of a pixel in the plane, across the side
    const double length = (side_.to - side_.from).norm();
    // The window along the row or column is extended so that it covers `reach_px` from the side.
    const double slant = std::max(0.5, std::abs(gradient[across]) / px);
    const int reach = static_cast<int>(std::lround(reach_px / slant));
    for (int i = -reach; i <= reach; ++i) {
      Eigen::Vector2d pixel = middle;
      pixel[across] += i;
      const int column = static_cast<int>(pixel.x()), row = static_cast<int>(pixel.y());
      if (column < 0 || row < 0 || column >= image_.lines.width || row >= image_.lines.height) {
        if (can_leave_image_) continue;
        return false;
      }
      const auto lit = image_.levels.relative_scanline_level(row);
      if (!lit) continue;
      const Eigen::Vector2d away = *here + plane_from_pixel * (pixel - middle) - side_.from;
      const double t = away.dot(side_.edge_direction()) / length;
      if (std::abs(t - 0.5) > max_off_middle_fraction) continue;
      const double fraction = image_.levels.level_at_column_relative_to_middle(column);
      samples.push_back({row,
                         {fraction * lit->level, fraction * lit->sd},
                         (image_.lines.gray_level_at_pixel(column, row) - image_.dark) /
                             image_.levels.max_level_above_dark(),
                         t,
                         away.dot(inwards) / px,
                         image_.per_px / px});
    }
    return true;
  }

  const EdgeImage& image_;
  const Side& side_;
  bool can_leave_image_;
};

/// Unit residual to which the weights of samples and priors refer.
constexpr double kNoise = 0.01;

/// Length of a side, in pixels, and prior knowledge about all sides of a light.
struct Priors {
  double length_px;
  /// Standard deviation of the blur; 0 if unknown.
  double blur_px;
  /// Standard deviation of the curvature of the edge: that of a lens of 115 degrees from corner to
  /// corner without a lens, nearly 0 with one.
  double bow_sd_px;
};

/// Number of priors. The level changes by 10 % in 100 px along the edge and its curvature is half
/// of that, one standard deviation each, because the pixels of short sides do not determine it. The
/// others are the blur, the slopes across the edge and the curvature of the edge.
constexpr std::size_t kNumPriors = 6;

CurveDistance<kUnknowns> evaluate_prior(const Model& model, std::size_t which,
                                        const Priors& priors) {
  constexpr double change = 0.1 / 100, curvature = 0.05 / 100, blur_sd = 0.15, slope_sd = 0.03;
  CurveDistance<kUnknowns> result{0, Unknowns::Zero()};
  const auto expect = [&](int unknown, double value, double sd) {
    result.error = kNoise / sd * (model.x[unknown] - value);
    result.slope[unknown] = kNoise / sd;
  };
  if (which == 0) {
    expect(kLevelTo, model.x[kLevelFrom], change * priors.length_px);
    result.slope[kLevelFrom] = -result.slope[kLevelTo];
  } else if (which == 1) {
    expect(kLevelBend, 0, curvature * priors.length_px);
  } else if (which == 2) {
    if (priors.blur_px > 0) expect(kBlur, priors.blur_px, blur_sd * priors.blur_px);
  } else if (which == 3) {
    expect(kInsideSlope, 0, slope_sd);
  } else if (which == 4) {
    expect(kOutsideSlope, 0, slope_sd);
  } else {
    expect(kBow, 0, priors.bow_sd_px);
  }
  return result;
}

/// Computes the covariance of the two ends from three sources. The squared residual of each pixel
/// is used, because bright pixels are noisier than dark ones (White 1980). Errors of the levels of
/// scanlines are common to their pixels. The priors contribute as well.
std::optional<Matrix2> compute_ends_covariance(const Model& model,
                                               const std::vector<Sample>& samples,
                                               const std::vector<double>& weights,
                                               const std::vector<bool>& inliers,
                                               const Priors& priors) {
  Normal<kUnknowns> normal;
  double count = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!inliers[i]) continue;
    normal.add_residual_row(model.residual(samples[i]).slope, 0, weights[i]);
    ++count;
  }
  for (std::size_t which = 0; which < kNumPriors; ++which) {
    normal.add_residual_row(evaluate_prior(model, which, priors).slope, 0);
  }
  const Cholesky<kUnknowns> factor(normal);
  if (!factor.has_full_rank(1e-12) || !(count > kUnknowns)) return std::nullopt;
  const auto from = factor.compute_inverse_column(kFrom), to = factor.compute_inverse_column(kTo);
  const auto ends_moved_by = [&](const Unknowns& pull) {
    Eigen::Vector2d moved(0, 0);
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      moved += pull[Eigen::Index(i)] * Eigen::Vector2d(from[i], to[i]);
    }
    return moved;
  };
  Matrix2 covariance = Matrix2::Zero();
  std::map<int, std::pair<Eigen::Vector2d, double>> line_errors;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!inliers[i]) continue;
    double d_residual_d_level = 0;
    const auto [error, slope] = model.residual(samples[i], &d_residual_d_level);
    const Eigen::Vector2d moved = weights[i] * ends_moved_by(slope);
    covariance += error * error * moved * moved.transpose();
    auto& [d_ends_d_level, sd] =
        line_errors.try_emplace(samples[i].line, Eigen::Vector2d(0, 0), 0).first->second;
    d_ends_d_level += d_residual_d_level * moved;
    sd = samples[i].lit.sd;
  }
  covariance *= count / (count - kUnknowns);
  for (std::size_t which = 0; which < kNumPriors; ++which) {
    const Eigen::Vector2d moved =
        kNoise * ends_moved_by(evaluate_prior(model, which, priors).slope);
    covariance += moved * moved.transpose();
  }
  for (const auto& [line, line_error] : line_errors) {
    const Eigen::Vector2d moved = line_error.first * line_error.second;
    covariance += moved * moved.transpose();
  }
  return covariance;
}

std::optional<StraightEdge> fit(const Samples& all, const Side& side, double per_px,
                                const Priors& priors) {
  constexpr std::array tolerances = {5.0, 5.0, 5.0, 5.0, 2.0, 1.0, 0.5, 0.3, 0.3, 0.3};
  constexpr double first_blur_px = 1.5, sharpest_px = 0.3, softest_px = 6;
  constexpr double max_move_px = 1.5, farthest_px = 8, min_step = 0.2, max_sd_px = 0.5;
  constexpr double near = 3, min_lit = 0.3, explained = 0.15, min_fraction = 0.8;
  const std::vector<Sample>& samples = all.samples;
  std::vector<double> weights(samples.size() + kNumPriors, 1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    weights[i] = 1 / (1 + std::pow(samples[i].lit.sd / kNoise, 2));
  }
  Model model{Unknowns::Zero()};
  model.x[kBlur] = priors.blur_px > 0 ? priors.blur_px : first_blur_px;
  model.x[kLevelFrom] = model.x[kLevelTo] = 1;
  std::optional<MEstimateStep<kUnknowns>> last;
  for (const double tolerance : tolerances) {
    last = compute_m_estimate_step<kUnknowns>(weights, tolerance, [&](std::size_t i) {
      return i < samples.size() ? model.residual(samples[i])
                                : evaluate_prior(model, i - samples.size(), priors);
    });
    if (!last) return std::nullopt;
    auto step = last->step;
    for (const int end : {kFrom, kTo}) {
      step[end] = std::clamp(step[end], -max_move_px, max_move_px);
    }
    model.x -= step;
    model.x[kBlur] = std::clamp(model.x[kBlur], sharpest_px, softest_px);
    if (model.x.head<2>().cwiseAbs().maxCoeff() > farthest_px) return std::nullopt;
  }
  const auto& x = model.x;
  const double min_level = std::min(x[kLevelFrom], x[kLevelTo]);
  if (!(min_level - x[kOutside] > min_step)) return std::nullopt;
  const auto covariance = compute_ends_covariance(model, samples, weights, last->inliers, priors);
  if (!covariance) return std::nullopt;

  const Eigen::Vector2d inwards = side.inward_normal() * per_px;
  StraightEdge edge;
  edge.side = {side.from + x[kFrom] * inwards, side.to + x[kTo] * inwards};
  edge.covariance_px = *covariance;
  edge.profile = {x[kBlur], (x[kLevelFrom] + x[kLevelTo]) / 2 + x[kLevelBend], x[kInsideSlope],
                  x[kOutside], x[kOutsideSlope]};
  edge.sagitta_px = x[kBow];
  if (!(edge.covariance_px.diagonal().maxCoeff() < max_sd_px * max_sd_px)) return std::nullopt;
  int close = 0, like = 0;
  for (const Sample& sample : samples) {
    if (sample.lit.level < min_lit || std::abs(sample.depth_px) > near) continue;
    ++close;
    like += std::abs(model.residual(sample).error) < explained * sample.lit.level + 0.02;
  }
  edge.explained_fraction = close > 0 ? double(like) / close : 0;
  if (edge.explained_fraction < min_fraction) return std::nullopt;
  return edge;
}

/// Likelihood of the position of an edge of known blur, from the pixels near the side.
class HiddenEdge {
 public:
  HiddenEdge(std::vector<Sample> samples, const EdgeProfile& profile)
      : samples_(std::move(samples)), profile_(profile) {
    std::stable_sort(samples_.begin(), samples_.end(),
                     [](const Sample& a, const Sample& b) { return a.line < b.line; });
  }

  /// Returns -2 log likelihood, up to a constant, for the given distances of the ends. The level of
  /// each scanline is the most probable one within its standard deviation, relative to a common
  /// factor near the edge, 1 within 20 %.
  double compute_cost(const Eigen::Vector2d& ends_px) const {
    constexpr double noise = 3 * kNoise, line_sd = 0.02, common_sd = 0.2;
    double sum = 0, common_moment = 0, common_squares = 1 / (common_sd * common_sd);
    for (auto sample = samples_.begin(); sample != samples_.end();) {
      const int line = sample->line;
      const double level = sample->lit.level, sd = std::hypot(sample->lit.sd, line_sd * level);
      double moment = 0, squares = 0;
      for (; sample != samples_.end() && sample->line == line; ++sample) {
        const double fraction = compute_level(*sample, ends_px) / noise;
        const double error = sample->value / noise - sample->lit.level * fraction;
        sum += error * error;
        moment += error * fraction;
        squares += fraction * fraction;
      }
      const double gain = 1 / (1 / (sd * sd) + squares);
      sum -= gain * moment * moment;
      common_moment += level * moment * (1 - gain * squares);
      common_squares += level * level * squares * (1 - gain * squares);
    }
    return sum - common_moment * common_moment / common_squares;
  }

  /// Returns the fraction of the pixels on lit scanlines that an edge with these ends explains.
  double compute_explained_fraction(const Eigen::Vector2d& ends_px) const {
    constexpr double min_lit = 0.3, explained = 0.15;
    int lit = 0, like = 0;
    for (const Sample& sample : samples_) {
      const double level = sample.lit.level;
      if (level < min_lit) continue;
      ++lit;
      const double error = sample.value - level * compute_level(sample, ends_px);
      like += std::abs(error) < explained * level + 2 * kNoise;
    }
    return lit > 0 ? double(like) / lit : 0;
  }

 private:
  double compute_level(const Sample& sample, const Eigen::Vector2d& ends_px) const {
    const double move = (1 - sample.t) * ends_px[0] + sample.t * ends_px[1];
    return profile_.compute_level(sample.depth_px - sample.per_move * move);
  }

  std::vector<Sample> samples_;  // ordered by line
  EdgeProfile profile_;
};

/// Mean and covariance of the distances of both ends from the side.
struct Ends {
  Eigen::Vector2d mean_px;
  Matrix2 covariance_px;
};

Ends average_edge_ends(const HiddenEdge& edge, const HiddenEdgePrior& prior, double reach_px) {
  constexpr int num_iterations = 4, offsets = 21, slants = 9;
  constexpr double deviations = 3.5;
  Matrix2 ends_from_node;  // a node is an offset and a slant
  ends_from_node << 1, -1, 1, 1;
  Eigen::Vector2d mean(prior.offset_px, 0);
  Eigen::Vector2d range(std::min(deviations * prior.offset_sd_px, reach_px),
                        deviations * prior.slant_sd_px);
  Matrix2 covariance = Matrix2::Zero();
  for (int round = 0; round < num_iterations; ++round) {
    const Eigen::Vector2d step = 2 * range.cwiseQuotient(Eigen::Vector2d(offsets - 1, slants - 1));
    std::vector<std::pair<Eigen::Vector2d, double>> nodes;
    double minimum = std::numeric_limits<double>::infinity();
    for (int i = 0; i < offsets; ++i) {
      for (int j = 0; j < slants; ++j) {
        const Eigen::Vector2d node = mean - range + step.cwiseProduct(Eigen::Vector2d(i, j));
        nodes.emplace_back(node, edge.compute_cost(ends_from_node * node) +
                                     std::pow((node[0] - prior.offset_px) / prior.offset_sd_px, 2) +
                                     std::pow(node[1] / prior.slant_sd_px, 2));
        minimum = std::min(minimum, nodes.back().second);
      }
    }
    double sum = 0;
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    for (auto& [node, weight] : nodes) {
      weight = std::exp((minimum - weight) / 2);
      sum += weight;
      moment += weight * node;
    }
    mean = moment / sum;
    covariance = (step.cwiseAbs2() / 12).asDiagonal();  // each node stands for its cell
    for (const auto& [node, weight] : nodes) {
      covariance += weight / sum * (node - mean) * (node - mean).transpose();
    }
    range = (deviations * covariance.diagonal().cwiseSqrt()).cwiseMax(step / 2);
  }
  return {ends_from_node * mean, ends_from_node * covariance * ends_from_node.transpose()};
}

}  // namespace

double EdgeProfile::compute_level(double depth_px) const {
  constexpr double clear_blurs = 4, max_reach_px = 6;
  const double depth = depth_px / blur_px,
               within_px = std::clamp(depth_px, -max_reach_px, max_reach_px);
  const double in = inside + inside_slope * within_px,
               out = std::max(0.0, outside + outside_slope * within_px);
  if (std::abs(depth) > clear_blurs) return depth > 0 ? in : out;
  return out + (in - out) * std::erfc(-depth / std::numbers::sqrt2) / 2;
}

std::optional<StraightEdge> fit_straight_edge(const EdgeImage& image, const Side& side,
                                              const EdgeSearch& search) {
  constexpr double min_lit = 0.35;
  constexpr std::size_t minimum = 40;
  constexpr double straight_px = 1e-4;
  const auto& [lines, levels, dark, per_px, shape] = image;
  const Samples all(image, side, search);
  if (all.samples.size() < minimum) return std::nullopt;
  const double length_px = all.length_px;
  const double focal_px = std::hypot(lines.width, lines.height) / 2;
  const double bow_sd_px =
      shape.has_known_lens() ? straight_px : length_px * length_px / (12 * focal_px);
  auto edge =
      fit(all, side, per_px, {length_px, search.profile ? search.profile->blur_px : 0, bow_sd_px});
  if (!edge) return std::nullopt;
  const Side& found = edge->side;
  const auto points = static_cast<int>(length_px);
  for (int i = 0; i < points; ++i) {
    const double t = (i + 0.5) / points;
    const auto pixel = shape.pixel_from_level_plane_point(found.from + t * (found.to - found.from));
    if (!pixel) continue;
    const Eigen::Vector2d at = shape.swap_image_and_scanline_axes(*pixel);
    const auto lit = levels.relative_scanline_level(static_cast<int>(std::lround(at.y())));
    if (!lit || lit->level < min_lit) continue;
    edge->points.push_back(at);
  }
  return edge;
}

std::optional<StraightEdge> estimate_position_of_edge_in_dark_stripe(const EdgeImage& image,
                                                                     const Side& side,
                                                                     const EdgeSearch& search,
                                                                     const HiddenEdgePrior& prior) {
  constexpr double min_fraction = 0.7;
  const Samples all(image, side, search, true);
  if (all.samples.empty()) return std::nullopt;
  const HiddenEdge hidden(all.samples, *search.profile);
  const auto [ends_px, covariance_px] = average_edge_ends(hidden, prior, search.reach_px);
  const double fraction = hidden.compute_explained_fraction(ends_px);
  if (fraction < min_fraction) return std::nullopt;
  const Eigen::Vector2d inwards = side.inward_normal() * image.per_px;
  const Side found{side.from + ends_px[0] * inwards, side.to + ends_px[1] * inwards};
  return StraightEdge{found, covariance_px, *search.profile, 0, fraction, {}};
}

}  // namespace vlp
