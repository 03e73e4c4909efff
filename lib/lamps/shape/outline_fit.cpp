// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "lamps/shape/plane_patch.h"
#include "lamps/shape/shear.h"
#include "rig/detection.h"

namespace vlp {
namespace {

/// Tone curve light^(1 / gamma) of consumer cameras.
constexpr float kGamma = 2.2F;
/// Prior mean and standard deviation of the weight of the tone curve, which is 0 for a linear
/// camera.
constexpr double kMeanTone = 0.85, kToneSd = 0.2;
/// Blur at which the fit becomes fine, and prior standard deviation of its logarithm.
constexpr double kBlur_px = 0.9, kLogBlurSd = 0.4;
/// Minimum unevenness of a rim. The noise of a sharp image causes less.
constexpr double kMinUnevenness = 0.02;
/// Standard deviation of the area of a pixel.
constexpr double kMinBlur_px = 0.29;
/// Depth, in blurs, from which on a pixel is well inside the outline.
constexpr double kClearBlurs = 2.5;

/// Unknowns: center, size and ovality in pixels of the outline, the logarithm of the blur, and the
/// weight of the tone curve. The residual follows as a further column of the normal equations.
enum Unknown { kX, kY, kSize, kOval0, kOval1, kLogBlur, kTone, kUnknowns };
constexpr int kGeometry = kOval1 + 1;
using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Geometry = Eigen::Matrix<float, kGeometry, 1>;

/// Levels of a cell.
enum Level { kOut, kIn, kInSlope, kOutSlope };

/// Sums of weighted products of derivatives and residual, after elimination of the levels.
template <typename Scalar>
using Products = Eigen::Matrix<Scalar, kUnknowns + 1, kUnknowns + 1>;

/// Part of a scanline on one side of the center.
struct Cell {
  std::size_t begin, end;  ///< samples
  Eigen::Vector4d levels = Eigen::Vector4d::Zero();
  double deepest_px = -std::numeric_limits<double>::infinity();
  Products<float> products;
  /// Tukey's biweight of the cell, 0 to 1.
  double weight = 1;
  /// Number of pixels minus that of the levels that they determine.
  double degrees_of_freedom;
  /// Mean squared residual, weighted and in gray levels, and mean level above the dark level.
  double mean_weighted_square, mean_square, mean_level;

  std::size_t size() const { return end - begin; }
  double contrast() const { return std::abs(levels[kIn] - levels[kOut]); }
};

/// Returns the derivative of the plane with respect to (column, line) at a pixel, or at the pixel
/// of the box nearest to it.
Matrix2 compute_derivative(const PlanePatch& patch, const PixelBox& box,
                           const Eigen::Vector2d& pixel) {
  const double column = std::clamp(pixel.x(), double(box.x), box.end_column() - 1.0),
               line = std::clamp(pixel.y(), double(box.y), box.end_row() - 1.0);
  return PlanePatch::Row(patch, line).at_column(column).d_at_d_pixel;
}

/// Returns the value that the given fraction of the values does not exceed.
double compute_quantile(std::vector<double> values, double fraction) {
  const auto at = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

class DiscFit {
 public:
  DiscFit(const ImageView& lines, const PlanePatch& patch, const PixelBox& box,
          const PlaneEllipse& start, double period_lines, const Background& background,
          const Eigen::Vector2d& center_px, bool is_round,
          const std::optional<KnownRadius>& known_radius)
      : lines_(lines),
        patch_(patch),
        box_(box),
        start_center_(start.center),
        outline_(start),
        period_lines_(period_lines > 0 ? period_lines : 1),
        background_(background),
        center_px_(center_px),
        is_round_(is_round),
        known_radius_(known_radius),
        d_plane_d_pixel_(compute_derivative(patch, box, center_px)),
        px_per_unit_(1 / std::sqrt(std::abs(d_plane_d_pixel_.determinant()))) {
    update_radius();
  }

  std::optional<OutlineFit> run(double start_blur_px) {
    constexpr int max_rounds = 60;
    constexpr double shrink = 0.6, max_fine_blur_px = 1.2, tolerance_px = 0.01;
    blur_px_ = std::max(kMinBlur_px, start_blur_px);
    const double start_radius_px = radius_px_;
    double step_px = 0;
    for (int round = 0; round < max_rounds; ++round) {
      is_coarse_ = is_coarse_ && blur_px_ > max_fine_blur_px;
      if (!update_samples()) return std::nullopt;
      if (round == 0) initialize_levels();
      if (!accumulate_products()) return std::nullopt;
      step_px = take_step();
      if (!std::isfinite(step_px) || is_far_from_start(start_radius_px)) return std::nullopt;
      if (!is_coarse_ && step_px < tolerance_px) break;
      if (is_coarse_ && step_px < blur_px_) blur_px_ *= shrink;
    }
    if (is_coarse_) return std::nullopt;
    auto fit = make_result();
    if (!fit) return fit;
    if (step_px >= tolerance_px) fit->add_error_to_center(step_px);
    fit->unevenness = compute_unevenness();
    fit->level = compute_median_level();
    if (fit->unevenness < kMinUnevenness) return fit;
    const auto shift_px = measure_shift_in_narrow_band_px();
    if (!shift_px) return std::nullopt;
    fit->add_error_to_center(*shift_px);
    return fit;
  }

 private:
  /// Returns true if center or radius differ from the first ones by more than a quarter of the
  /// radius.
  bool is_far_from_start(double radius_px) const {
    constexpr double max_change = 0.25;
    return (outline_.center - start_center_).norm() * px_per_unit_ > max_change * radius_px ||
           std::abs(radius_px_ - radius_px) > max_change * radius_px;
  }

  /// Returns the RMS slope of the levels inside along the scanlines, as a fraction of the level.
  double compute_unevenness() const {
    double sum = 0, count = 0;
    for (const Cell& cell : cells_) {
      if (cell.size() == 0 || !(cell.contrast() > min_contrast_)) continue;
      sum += std::pow(cell.levels[kInSlope] / std::max(1.0, cell.levels[kIn]), 2);
      ++count;
    }
    return std::sqrt(sum / std::max(1.0, count));
  }

  /// Returns the median of the levels inside of the cells with contrast.
  double compute_median_level() const {
    std::vector<double> levels;
    for (const Cell& cell : cells_) {
      if (cell.size() > 0 && cell.contrast() > min_contrast_)
        levels.push_back(cell.levels[kIn] - background_.level);
    }
    return levels.empty() ? 0 : upper_median(std::move(levels));
  }

  /// Returns the distance of the center from that of a fit in a narrower band. Levels that do not
  /// vary linearly with the depth shift the outline by a distance that depends on the band. Returns
  /// std::nullopt if the narrower band does not determine the outline.
  std::optional<double> measure_shift_in_narrow_band_px() {
    constexpr double narrow_band = 0.65;
    constexpr int rounds = 2;
    const PlaneEllipse outline = outline_;
    band_ = narrow_band;
    levels_.clear();
    for (int round = 0; round < rounds; ++round) {
      if (!update_samples() || !accumulate_products() || !std::isfinite(take_step())) {
        return std::nullopt;
      }
    }
    return (outline_.center - outline.center).norm() * px_per_unit_;
  }

  void update_radius() { radius_px_ = px_per_unit_ * outline_.radius(); }

  /// Selects the pixels of the band around the outline if it has moved out of it, and computes
  /// their depths. Returns false if there are too few.
  bool update_samples() {
    constexpr double min_reach_px = 5, reach_blurs = 3, coarse_reach_blurs = 3.5;
    constexpr double max_reach_change_px = 0.5, max_move_px = 0.5;
    constexpr std::size_t min_samples = 60;
    const double reach_px = is_coarse_ ? coarse_reach_blurs * blur_px_
                                       : band_ * std::max(min_reach_px, reach_blurs * blur_px_);
    if (levels_.empty() || moved_px_ + std::abs(size_change_px_) > max_move_px ||
        std::abs(reach_px - reach_px_) > max_reach_change_px) {
      reach_px_ = reach_px;
      moved_px_ = size_change_px_ = 0;
      select_samples();
    }
    compute_depths();
    return levels_.size() >= min_samples;
  }

  void compute_depths() {
    const auto n = Eigen::Index(levels_.size());
    const Eigen::Map<const Eigen::ArrayXf> x(plane_x_.data(), n), y(plane_y_.data(), n),
        scale_px(scales_px_.data(), n);
    const Eigen::Matrix2f unit_from_plane = outline_.unit_from_plane.cast<float>();
    const Eigen::Vector2f offset =
        (outline_.unit_from_plane * (start_center_ - outline_.center)).cast<float>();
    z_ = unit_from_plane(0, 0) * x + unit_from_plane(0, 1) * y + offset.x();
    t_ = unit_from_plane(1, 0) * x + unit_from_plane(1, 1) * y + offset.y();
    depths_px_ = (1 - (z_.square() + t_.square()).sqrt()) * scale_px *
                 static_cast<float>(radius_px_ / selection_radius_px_);
  }

  void select_samples() {
    constexpr double bright_quantile = 0.95;
    constexpr std::size_t sample_step = 4;
    levels_.clear();
    plane_x_.clear();
    plane_y_.clear();
    scales_px_.clear();
    d_depths_.clear();
    selection_radius_px_ = radius_px_;
    cells_.resize(2 * std::size_t(box_.height));
    const Matrix2 unit_from_pixel = outline_.unit_from_plane * d_plane_d_pixel_;
    const Eigen::Vector2d offset = outline_.unit_from_plane * (start_center_ - outline_.center);
    // Bounds of the distance from the center by the map linearized at the center.
    const auto compute_nonlinearity = [&](double column, double line) {
      const Eigen::Vector2d at = PlanePatch::Row(patch_, line).at_column(column).at;
      const Eigen::Vector2d linear =
          start_center_ + d_plane_d_pixel_ * (Eigen::Vector2d(column, line) - center_px_);
      return (outline_.unit_from_plane * (at - linear)).norm();
    };
    double nonlinearity = 0;
    for (const int line : {box_.y, box_.end_row() - 1}) {
      for (const int column : {box_.x, box_.end_column() - 1})
        nonlinearity = std::max(nonlinearity, compute_nonlinearity(column, line));
    }
    const double max_difference =
        nonlinearity + (1 + nonlinearity) * reach_px_ * unit_from_pixel.norm();
    const double inner = std::pow(std::max(0.01, 1 - max_difference), 2),
                 outer = std::pow(1 + max_difference, 2);
    const int middle =
        std::clamp(static_cast<int>(std::floor(center_px_.x())) + 1, box_.x, box_.end_column());
    for (int line = box_.y; line < box_.end_row(); ++line) {
      const PlanePatch::Row row(patch_, line);
      const Eigen::Vector2d line_offset = offset + unit_from_pixel.col(1) * (line - center_px_.y());
      for (const int side : {0, 1}) {
        Cell& cell = cells_[2 * std::size_t(line - box_.y) + std::size_t(side)];
        cell.begin = levels_.size();
        const int end = side == 0 ? middle : box_.end_column();
        for (int column = side == 0 ? box_.x : middle; column < end; ++column) {
          const double square =
              (line_offset + unit_from_pixel.col(0) * (column - center_px_.x())).squaredNorm();
          if (square > inner && square < outer) add_sample(row, column, line);
        }
        cell.end = levels_.size();
        if (cell.size() == 0) cell.deepest_px = -std::numeric_limits<double>::infinity();
      }
    }
    if (levels_.empty()) return;
    std::vector<double> sampled_levels;
    for (std::size_t i = 0; i < levels_.size(); i += sample_step)
      sampled_levels.push_back(levels_[i]);
    bright_level_ = std::max(1.0, compute_quantile(std::move(sampled_levels), bright_quantile));
  }

  /// Estimates the levels of the cells by the means of the pixels clearly inside and outside.
  void initialize_levels() {
    constexpr float clear_blurs = 1.5;
    const float clear_px = clear_blurs * static_cast<float>(blur_px_);
    for (Cell& cell : cells_) {
      std::array<float, 2> sums{}, counts{};
      for (std::size_t i = cell.begin; i < cell.end; ++i) {
        if (std::abs(depths_px_[Eigen::Index(i)]) < clear_px) continue;
        const std::size_t side = depths_px_[Eigen::Index(i)] > 0 ? kIn : kOut;
        sums[side] += levels_[i];
        ++counts[side];
        cell.deepest_px = std::max(cell.deepest_px, double(depths_px_[Eigen::Index(i)]));
      }
      for (const std::size_t side : {kOut, kIn}) {
        const std::size_t known = counts[side] > 0 ? side : 1 - side;
        cell.levels[Eigen::Index(side)] = sums[known] / std::max(1.F, counts[known]);
      }
    }
  }

  /// Adds a pixel if it is in the band, with the derivatives of its depth.
  void add_sample(const PlanePatch::Row& row, int column, int line) {
    const PlanePatch::Point plane = row.at_column(column);
    const Eigen::Vector2d u = outline_.unit_from_plane * (plane.at - outline_.center);
    const double q = u.norm();
    const Eigen::Vector2d d_plane = outline_.unit_from_plane.transpose() * u / q;
    const double px = 1 / (plane.d_at_d_pixel.transpose() * d_plane).norm();
    if (!(std::abs((1 - q) * px) < reach_px_)) return;
    const Eigen::Vector2d from_start = plane.at - start_center_;
    levels_.push_back(static_cast<float>(lines_.gray_level_at_pixel(column, line)));
    plane_x_.push_back(static_cast<float>(from_start.x()));
    plane_y_.push_back(static_cast<float>(from_start.y()));
    scales_px_.push_back(static_cast<float>(px));
    const double c = u.x() / q, s = u.y() / q, per_px = q * px / radius_px_;
    d_depths_.push_back((Geometry() << float(d_plane.x() * px / px_per_unit_),
                         float(d_plane.y() * px / px_per_unit_), float(per_px),
                         float(per_px * (c * c - s * s)), float(per_px * 2 * c * s))
                            .finished());
  }

  /// Computes the coverages in levels, and their derivatives, of all samples.
  void compute_coverages() {
    constexpr float min_ratio = 1e-3F, max_ratio = 0.98F;
    const auto n = Eigen::Index(levels_.size());
    for (Eigen::ArrayXf* each : {&ratio_, &power_, &sign_}) each->resize(n);
    for (const Cell& cell : cells_) {
      const auto begin = Eigen::Index(cell.begin), size = Eigen::Index(cell.size());
      if (size == 0) continue;
      const auto out = static_cast<float>(cell.levels[kOut]),
                 in = static_cast<float>(cell.levels[kIn]);
      const float brighter = std::max(out, in);
      const float ratio =
          brighter > 0 ? std::clamp(std::min(out, in) / brighter, min_ratio, max_ratio) : max_ratio;
      ratio_.segment(begin, size) = ratio;
      power_.segment(begin, size) = std::pow(ratio, kGamma);
      sign_.segment(begin, size) = out > in ? -1.F : 1.F;
    }
    z_ = depths_px_ * float(1 / blur_px_);
    density_ = (-0.5F * z_.square()).exp() * float(1 / std::sqrt(2 * std::numbers::pi));
    // Normal distribution, Abramowitz and Stegun 26.2.17; error 7.5e-8.
    t_ = (1 + 0.2316419F * z_.abs()).inverse();
    t_ = density_ * t_ *
         (0.319381530F +
          t_ * (-0.356563782F + t_ * (1.781477937F + t_ * (-1.821255978F + t_ * 1.330274429F))));
    // The tone curve acts on the coverage by the brighter side.
    coverage_ = (sign_ * z_ > 0).select(1 - t_, t_);
    t_ = power_ + (1 - power_) * coverage_;
    coded_ = (t_.log() * (1 / kGamma)).exp();
    const auto tone = static_cast<float>(tone_);
    d_z_ = density_ * (1 - tone + tone * (1 - power_) * coded_ / (kGamma * t_ * (1 - ratio_)));
    d_tone_ = (coded_ - ratio_) / (1 - ratio_) - coverage_;
    coverage_ += tone * d_tone_;
    d_tone_ *= sign_;
    coverage_ = (sign_ > 0).select(coverage_, 1 - coverage_);
  }

  /// Returns the shares of the levels of the cell in that of a sample.
  Eigen::Vector4f compute_shares(std::size_t sample) const {
    const float inside = coverage_[Eigen::Index(sample)],
                depth_px = depths_px_[Eigen::Index(sample)];
    return {1 - inside, inside, depth_px * inside, depth_px * (1 - inside)};
  }

  float predict_variance(float level) const {
    constexpr float min_fraction = 0.1F;
    // Errors of the model are not proportional to the level: dark pixels must not dominate.
    return predict_variance(static_cast<float>(variance_per_level_),
                            std::max(level - static_cast<float>(background_.level),
                                     min_fraction * static_cast<float>(bright_level_)));
  }
  float predict_variance(float variance_per_level, float level) const {
    constexpr float quantization = 0.1F, model_error = 0.003F;
    return static_cast<float>(background_.noise * background_.noise) + quantization +
           (variance_per_level + model_error * model_error * level) * level;
  }

  /// Solves for the levels of all cells, and sums the products of their derivatives. Returns false
  /// if the levels are not finite.
  bool accumulate_products() {
    compute_coverages();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i].size() > 0 && !solve_cell(i)) return false;
    }
    add_cells();
    return true;
  }

  bool solve_cell(std::size_t index) {
    Cell& cell = cells_[index];
    Eigen::Matrix4f shares_square = Eigen::Matrix4f::Zero();
    Eigen::Vector4f right = Eigen::Vector4f::Zero();
    const Eigen::Vector4f old_levels = cell.levels.cast<float>();
    float deepest = -std::numeric_limits<float>::infinity();
    weights_.resize(cell.size());
    for (std::size_t i = cell.begin; i < cell.end; ++i) {
      const Eigen::Vector4f shares = compute_shares(i);
      const float weight = 1 / predict_variance(shares.dot(old_levels));
      weights_[i - cell.begin] = weight;
      shares_square.noalias() += weight * shares * shares.transpose();
      right += weight * levels_[i] * shares;
      deepest = std::max(deepest, depths_px_[Eigen::Index(i)]);
    }
    cell.deepest_px = deepest;
    const auto [prediction, information] = predict_levels(index);
    const Eigen::Matrix4d inverse =
        (shares_square.cast<double>() + Eigen::Matrix4d(information.asDiagonal())).inverse();
    cell.levels = inverse * (right.cast<double>() + information.cwiseProduct(prediction));
    if (!cell.levels.allFinite()) return false;
    cell.degrees_of_freedom =
        std::max(1.0, double(cell.size()) - 4 + inverse.diagonal().dot(information));
    compute_products(inverse, cell);
    return true;
  }

  /// Computes the products of a cell, of which the inverse normal matrix of the levels is given.
  void compute_products(const Eigen::Matrix4d& inverse, Cell& cell) {
    using Row = Eigen::Matrix<float, kUnknowns + 1, 1>;
    Products<float> products = Products<float>::Zero();
    Eigen::Matrix<float, 4, kUnknowns + 1> with_shares;
    with_shares.setZero();
    const Eigen::Vector4f levels = cell.levels.cast<float>();
    const float contrast = levels[kIn] - levels[kOut],
                slope_contrast = levels[kInSlope] - levels[kOutSlope];
    const auto per_blur = static_cast<float>(1 / blur_px_);
    float squares = 0, sum = 0;
    for (std::size_t i = cell.begin; i < cell.end; ++i) {
      const auto at = Eigen::Index(i);
      const Eigen::Vector4f shares = compute_shares(i);
      const float d_coverage = contrast + slope_contrast * depths_px_[at];
      const float d_z = d_coverage * d_z_[at];
      const float d_depth =
          d_z * per_blur + levels[kInSlope] * shares[kIn] + levels[kOutSlope] * shares[kOut];
      Row row;
      row.head<kGeometry>() = d_depth * d_depths_[i];
      row[kLogBlur] = -d_z * z_[at];
      row[kTone] = d_coverage * d_tone_[at];
      const float residual = levels_[i] - shares.dot(levels);
      row[kUnknowns] = residual;
      const Row weighted = weights_[i - cell.begin] * row;
      products.noalias() += weighted * row.transpose();
      with_shares.noalias() += shares * weighted.transpose();
      squares += residual * residual;
      sum += levels_[i];
    }
    cell.mean_weighted_square = products(kUnknowns, kUnknowns) / cell.degrees_of_freedom;
    cell.mean_square = squares / cell.degrees_of_freedom;
    cell.mean_level = std::max(1.0, sum / double(cell.size()) - background_.level);
    const Eigen::Matrix<float, 4, kUnknowns + 1> gain =
        inverse.cast<float>().lazyProduct(with_shares);
    cell.products = products - with_shares.transpose().lazyProduct(gain);
  }

  /// Returns the levels that a cell has if its pixels do not show them, and their information.
  std::pair<Eigen::Vector4d, Eigen::Vector4d> predict_levels(std::size_t index) const {
    constexpr double unknown_level_sd = 30, slope_sd = 0.03, min_level = 0.02;
    const Cell& cell = cells_[index];
    const double lowest = min_level * bright_level_;
    Eigen::Vector4d prediction = Eigen::Vector4d::Zero(),
                    sd = Eigen::Vector4d::Constant(unknown_level_sd * bright_level_);
    sd[kInSlope] = slope_sd * std::max(std::abs(cell.levels[kIn]), lowest);
    sd[kOutSlope] = slope_sd * std::max(std::abs(cell.levels[kOut]), lowest);
    if (!is_clear(cell)) {
      const auto [level, level_sd] = predict_level_inside(index);
      if (level_sd > 0) prediction[kIn] = level, sd[kIn] = std::max(level_sd, lowest);
    }
    return {prediction, sd.cwiseAbs2().cwiseInverse()};
  }

  bool is_clear(const Cell& cell) const { return cell.deepest_px > kClearBlurs * blur_px_; }

  /// Returns the level inside from the cells of the same side whole periods away, and its standard
  /// deviation; 0 if there are none.
  std::pair<double, double> predict_level_inside(std::size_t index) const {
    constexpr double half_ramp = 0.5, sd_of_several = 0.08, sd_of_one = 0.3;
    const std::size_t row = index / 2;
    double sum = 0, squares = 0, ramps = 0, count = 0;
    for (const int periods : {-2, -1, 1, 2}) {
      const double line = double(row) + periods * period_lines_, low = std::floor(line);
      if (low < 0 || low + 1 >= double(box_.height)) continue;
      const Cell& a = cells_[2 * std::size_t(low) + index % 2];
      const Cell& b = cells_[2 * std::size_t(low) + 2 + index % 2];
      if (!is_clear(a) || !is_clear(b)) continue;
      const double ramp = b.levels[kIn] - a.levels[kIn];
      const double level = a.levels[kIn] + (line - low) * ramp;
      sum += level;
      squares += level * level;
      ramps += std::abs(ramp);
      ++count;
    }
    if (count == 0) return {0, 0};
    const double mean = sum / count, ramp = half_ramp * ramps / count;
    const double scatter = std::max(0.0, squares / count - mean * mean);
    const double unknown = (count > 1 ? sd_of_several : sd_of_one) * mean;
    return {mean, std::sqrt(scatter + ramp * ramp + unknown * unknown)};
  }

  /// Adds the products of all cells. Applies the biweight to whole cells, as those of an occluder:
  /// far from the solution the pixels of the outline itself have the largest residuals. Estimates
  /// the variance per level from the residuals of the cells with contrast: in dark cells
  /// quantization would look like precision.
  void add_cells() {
    constexpr double min_contrast = 0.2, high_quantile = 0.95, reach_sds = 3, min_weight = 0.3;
    std::vector<double> contrasts, slopes, squares;
    for (const Cell& cell : cells_) {
      if (cell.size() > 0) contrasts.push_back(cell.contrast());
    }
    min_contrast_ = min_contrast * compute_quantile(std::move(contrasts), high_quantile);
    for (const Cell& cell : cells_) {
      if (cell.size() == 0 || !(cell.contrast() > min_contrast_)) continue;
      const float without_slope = predict_variance(0, static_cast<float>(cell.mean_level));
      slopes.push_back((cell.mean_square - without_slope) / cell.mean_level);
      squares.push_back(cell.mean_weighted_square);
    }
    double max_square = std::numeric_limits<double>::infinity();
    if (!slopes.empty()) {
      variance_per_level_ = std::max(0.0, upper_median(std::move(slopes)));
      max_square = reach_sds * reach_sds * upper_median(std::move(squares)) + 1e-30;
    }
    products_.setZero();
    squares_ = degrees_of_freedom_ = 0;
    double num_agreeing = 0, num_with_contrast = 0;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      Cell& cell = cells_[i];
      if (cell.size() == 0) continue;
      const double u = std::max(0.0, 1 - cell.mean_weighted_square / max_square), weight = u * u;
      cell.weight = weight;
      products_ += weight * cell.products.cast<double>();
      squares_ += weight * cell.mean_weighted_square * cell.degrees_of_freedom;
      degrees_of_freedom_ += weight * cell.degrees_of_freedom;
      if (cell.contrast() > min_contrast_)
        num_agreeing += weight > min_weight ? 1 : 0, ++num_with_contrast;
    }
    inlier_fraction_ = num_agreeing / std::max(1.0, num_with_contrast);
  }

  bool is_free(int unknown) const {
    if (unknown == kOval0 || unknown == kOval1) return !is_round_;
    return unknown < kGeometry || !is_coarse_;
  }

  void add_size_prior(Matrix& normal, Vector& gradient) const {
    if (!known_radius_) return;
    const double information = 1 / std::pow(known_radius_->log_sd * radius_px_, 2);
    normal(kSize, kSize) += information;
    gradient[kSize] +=
        information * radius_px_ * std::log(known_radius_->radius * px_per_unit_ / radius_px_);
  }

  /// Adds the priors, and removes the unknowns that are not free.
  void add_priors(Matrix& normal, Vector& gradient) const {
    constexpr double oval_sd = 0.25;
    add_size_prior(normal, gradient);
    const auto add = [&](int unknown, double sd, double difference) {
      normal(unknown, unknown) += 1 / (sd * sd);
      gradient[unknown] += difference / (sd * sd);
    };
    for (const int oval : {kOval0, kOval1}) add(oval, oval_sd * radius_px_, 0);
    add(kLogBlur, kLogBlurSd, std::log(kBlur_px / blur_px_));
    add(kTone, kToneSd, kMeanTone - tone_);
    for (int i = 0; i < kUnknowns; ++i) {
      if (is_free(i)) continue;
      normal.row(i).setZero();
      normal.col(i).setZero();
      normal(i, i) = 1;
      gradient[i] = 0;
    }
  }

  /// Takes a Gauss-Newton step of limited length. Returns the length of the full step in pixels.
  /// The size counts little: size, blur and tone converge slowly if they have the same effect.
  double take_step() {
    constexpr double max_step_px = 0.7, max_log_step = 0.2, max_tone = 1.3, size_weight = 0.2;
    Matrix normal = products_.topLeftCorner<kUnknowns, kUnknowns>();
    Vector gradient = products_.col(kUnknowns).head<kUnknowns>();
    add_priors(normal, gradient);
    Vector step = normal.ldlt().solve(gradient);
    if (!step.allFinite()) return std::numeric_limits<double>::infinity();
    const double size_px = std::abs(step[kSize]);
    const double step_px = std::hypot(step.head<2>().norm(), step.segment<2>(kOval0).norm());
    const double limit_px = is_coarse_ ? std::max(1.0, blur_px_) : max_step_px;
    step.head<kGeometry>() /= std::max(1.0, std::hypot(step_px, size_px) / limit_px);
    step[kLogBlur] = std::clamp(step[kLogBlur], -max_log_step, max_log_step);
    outline_.center += step.head<2>() / px_per_unit_;
    const Eigen::Vector2d oval = step.segment<2>(kOval0) / radius_px_;
    const Matrix2 unit_from_oval = Oval{oval, {}}.unit_from_oval();
    outline_.unit_from_plane = std::exp(-step[kSize] / radius_px_) /
                               std::sqrt(std::abs(unit_from_oval.determinant())) * unit_from_oval *
                               outline_.unit_from_plane;
    update_radius();
    blur_px_ = std::max(kMinBlur_px, blur_px_ * std::exp(step[kLogBlur]));
    tone_ = std::clamp(tone_ + step[kTone], 0.0, max_tone);
    moved_px_ += std::hypot(step.head<2>().norm(), step.segment<2>(kOval0).norm());
    size_change_px_ += step[kSize];
    products_.col(kUnknowns).head<kUnknowns>() -=
        products_.topLeftCorner<kUnknowns, kUnknowns>() * step;
    return std::max(step_px, size_weight * size_px);
  }

  /// Estimates the variance of the center, relative to that of the normal equations, by the power
  /// of radial errors that vary along the outline as cos(m a), with the direction a. An error with
  /// m = 1 moves the center and leaves no residuals; its power is taken to be the mean of those
  /// with m = 3 to 8.
  double estimate_inflation() const {
    constexpr int num_harmonics = 6;
    // Ratio of variances of independent errors and of the residuals after the biweight.
    constexpr double consistency = 1.5;
    std::array<std::complex<double>, num_harmonics> scores{};
    double information = 0;
    for (const Cell& cell : cells_) {
      if (cell.size() == 0) continue;
      const Geometry& d_depth = d_depths_[(cell.begin + cell.end) / 2];
      std::complex<double> turn(d_depth[kX], d_depth[kY]);
      turn /= std::abs(turn);
      std::complex<double> power = turn * turn;
      for (std::complex<double>& score : scores) {
        power *= turn;
        score += cell.weight * cell.products(kSize, kUnknowns) * power;
      }
      information += cell.weight * cell.products(kSize, kSize);
    }
    double sum = 0;
    for (const std::complex<double>& score : scores) sum += std::norm(score);
    return consistency * sum / (num_harmonics * std::max(1e-30, information));
  }

  /// Computes the covariance from the products of the last round.
  std::optional<OutlineFit> make_result() const {
    constexpr double min_inflation = 1e-9;
    Matrix normal = products_.topLeftCorner<kUnknowns, kUnknowns>();
    Vector gradient = products_.col(kUnknowns).head<kUnknowns>();
    const Matrix free_normal = normal;
    const Vector free_gradient = gradient;
    add_priors(normal, gradient);
    const Matrix covariance = normal.inverse();
    int num_free = 0;
    for (int i = 0; i < kUnknowns; ++i) num_free += is_free(i) ? 1 : 0;
    const double inflation =
        std::max({min_inflation, squares_ / std::max(1.0, degrees_of_freedom_ - num_free),
                  estimate_inflation()});
    const double variance_px2 = inflation * covariance.topLeftCorner<2, 2>().trace() / 2;
    if (!std::isfinite(variance_px2)) return std::nullopt;
    OutlineFit fit{
        outline_, std::sqrt(variance_px2), radius_px_, blur_px_, inlier_fraction_, 0, 0, {}, {}};
    // Eliminates blur and tone, with their priors; the ovality has none.
    constexpr int eliminated = kUnknowns - kGeometry;
    normal = free_normal;
    gradient = free_gradient;
    normal(kLogBlur, kLogBlur) += 1 / (kLogBlurSd * kLogBlurSd);
    normal(kTone, kTone) += 1 / (kToneSd * kToneSd);
    add_size_prior(normal, gradient);
    const Eigen::Matrix<double, kGeometry, eliminated> gain =
        normal.topRightCorner<kGeometry, eliminated>() *
        normal.bottomRightCorner<eliminated, eliminated>().inverse();
    const double square = radius_px_ * radius_px_ / inflation;
    fit.matrix = square * (normal.topLeftCorner<kGeometry, kGeometry>() -
                           gain * normal.bottomLeftCorner<eliminated, kGeometry>());
    fit.gradient =
        square / radius_px_ * (gradient.head<kGeometry>() - gain * gradient.tail<eliminated>());
    return fit;
  }

  const ImageView& lines_;
  const PlanePatch& patch_;
  PixelBox box_;
  Eigen::Vector2d start_center_;
  PlaneEllipse outline_;
  double period_lines_;
  const Background& background_;
  Eigen::Vector2d center_px_;
  bool is_round_;
  std::optional<KnownRadius> known_radius_;
  Matrix2 d_plane_d_pixel_;
  double px_per_unit_;
  double radius_px_ = 0, blur_px_ = kBlur_px, tone_ = kMeanTone, bright_level_ = 1,
         variance_per_level_ = 0.1;
  /// Half width of the band, and changes of the outline since its pixels were selected.
  double reach_px_ = 0, moved_px_ = 0, size_change_px_ = 0;
  double band_ = 1;  ///< factor of the half width
  bool is_coarse_ = true;
  // Pixels of the band, cell by cell: level, position in the plane relative to the first center,
  // pixels per unit of the distance from the center in radii, and derivatives of the depth.
  std::vector<float> levels_, plane_x_, plane_y_, scales_px_;
  std::vector<Geometry> d_depths_;
  double selection_radius_px_ = 1;  ///< radius to which scales_px_ belongs
  std::vector<Cell> cells_;
  // Values of each sample in one round.
  Eigen::ArrayXf depths_px_, ratio_, power_, sign_, z_, density_, t_, coverage_, coded_, d_tone_,
      d_z_;
  std::vector<float> weights_;  // weights of the samples of one cell
  Products<double> products_;
  double squares_ = 0, degrees_of_freedom_ = 0, inlier_fraction_ = 0, min_contrast_ = 0;
};

/// Returns the box of the pixels that may be near an outline, of which `center_px` is the image of
/// the center; an empty box if the lens does not cover the outline.
PixelBox find_box_of_outline(const PlaneEllipse& outline, const Eigen::Vector2d& center_px,
                             double margin_px, const ImageSize& size, const LightShape& shape) {
  constexpr double margin = 1.2;
  const Matrix2 rim_from_circle = outline.unit_from_plane.inverse();
  Eigen::Vector2d low = center_px, high = center_px;
  for (int i = 0; i < 16; ++i) {
    const double angle = std::numbers::pi / 8 * i;
    const auto rim = shape.pixel_from_level_plane_point(
        outline.center + rim_from_circle * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    if (!rim) return {};
    low = low.cwiseMin(shape.swap_image_and_scanline_axes(*rim));
    high = high.cwiseMax(shape.swap_image_and_scanline_axes(*rim));
  }
  const Eigen::Vector2d middle = (low + high) / 2,
                        half = margin * (high - low) / 2 + Eigen::Vector2d::Constant(margin_px);
  if (!half.allFinite() || half.maxCoeff() > size.width + size.height) return {};
  const int x = static_cast<int>(std::floor(middle.x() - half.x())),
            y = static_cast<int>(std::floor(middle.y() - half.y()));
  return intersect_boxes(
      {x, y, static_cast<int>(2 * half.x()) + 2, static_cast<int>(2 * half.y()) + 2},
      {0, 0, size.width, size.height});
}

}  // namespace

void OutlineFit::add_error_to_center(double sd_px) {
  const double total_px = std::hypot(center_sd_px, sd_px);
  const double ratio = std::pow(center_sd_px / total_px, 2);
  center_sd_px = total_px;
  matrix *= ratio;
  gradient *= ratio;
}

bool KnownRadius::agrees_with(const MeasuredLight& light) const {
  constexpr double max_sds = 2, max_rim_error = 0.02, max_edge_error = 0.03;
  return std::abs(std::log(light.plane_outline.radius() / radius)) <
         max_sds * log_sd +
             (light.outline_kind == LightOutline::rim ? max_rim_error : max_edge_error);
}

bool KnownRadius::improves_fit(const MeasuredLight& light) const {
  constexpr double min_fraction = 0.1, max_sds = 2;
  if (!light.outline_equations) return false;
  if (light.outline_kind == LightOutline::rim) return true;
  const Eigen::Matrix3d covariance =
      light.outline_equations->matrix.topLeftCorner<3, 3>().inverse();
  const double center_variance = covariance.topLeftCorner<2, 2>().trace();
  const double size_variance = covariance(kSize, kSize) + log_sd * log_sd;
  const double change = std::log(radius / light.plane_outline.radius());
  const double gain = covariance.col(kSize).head<2>().squaredNorm() / size_variance;
  return change * change > max_sds * max_sds * size_variance ||
         gain * change * change > min_fraction * min_fraction * center_variance * size_variance ||
         gain > min_fraction * center_variance;
}

std::optional<OutlineFit> fit_disc_outline(const ImageView& lines, const PlaneEllipse& start,
                                           double start_blur_px, double period_lines,
                                           const Background& background, const LightShape& shape,
                                           const std::optional<KnownRadius>& known_radius) {
  constexpr double min_margin_px = 6, margin_blurs = 3.5;
  constexpr int min_size_px = 8;
  const auto center = shape.pixel_from_level_plane_point(start.center);
  if (!center) return std::nullopt;
  const Eigen::Vector2d center_px = shape.swap_image_and_scanline_axes(*center);
  const PixelBox box = find_box_of_outline(
      start, center_px, std::max(min_margin_px, margin_blurs * start_blur_px), lines.size(), shape);
  if (std::min(box.width, box.height) < min_size_px) return std::nullopt;
  const auto patch = PlanePatch::fit(shape, box);
  if (!patch) return std::nullopt;
  DiscFit fit(lines, *patch, box, start, period_lines, background, center_px,
              shape.has_known_lens(), known_radius);
  return fit.run(start_blur_px);
}

bool set_fitted_outline(OutlineFit fit, const LightShape& shape, MeasuredLight& light) {
  constexpr double rim_error = 0.0005, min_unevenness = 0.03;  // in radii; of rims with this error
  if (light.has_bright_core || fit.unevenness > min_unevenness)
    fit.add_error_to_center(rim_error * fit.radius_px);
  if (!shape.set_outline_of_light(fit.outline, fit.radius_px, light)) return false;
  light.outline_kind = light.has_bright_core || fit.unevenness > kMinUnevenness
                           ? LightOutline::rim
                           : LightOutline::edge;
  light.inlier_fraction = fit.inlier_fraction;
  light.rise_px = kRisePerBlur * fit.blur_px;
  light.sigma_px = std::clamp(fit.center_sd_px, kMinSigma_px, kMaxSigma_px);
  if (shape.has_known_lens()) {
    const Circle circle{fit.outline.center, fit.outline.radius()};
    light.outline_equations = {circle, fit.matrix, fit.gradient,
                               shape.compute_scanline_gradient_wrt_position(circle)};
  }
  return true;
}

}  // namespace vlp
