// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "detection/boards/blurred_step.h"
#include "detection/boards/edge_field.h"
#include "detection/boards/edge_fit.h"
#include "detection/boards/tone_curve.h"
#include "geometry/homography.h"
#include "geometry/median.h"

namespace vlp {
namespace {

struct Band {
  double inside_px, outside_px;
};

/// Initial blur of edges.
constexpr double kRoughBlur_px = 0.8;

/// Pattern that adjoins the black stripe inside an edge: width of the stripe, start + by_along w,
/// and begin and end of white bits along the edge.
struct AdjoiningPattern {
  double start_px = 0, by_along_px = 0;
  std::vector<std::array<double, 2>> white;

  double stripe_width_px(double w) const { return start_px + by_along_px * w; }

  double predict_white_level(double w, double half_px, double blur_px) const {
    const Blur along_edge(blur_px);  // approximate; not estimated
    double sum = 0;
    for (const auto& [from, to] : white) {
      sum += BlurredStep((w - from) * half_px, along_edge).value -
             BlurredStep((w - to) * half_px, along_edge).value;
    }
    return sum / 2;
  }
};

/// Returns the pixels along edge k of a tag, from approximate edges and blur.
std::vector<EdgePixel> collect_edge_pixels(const cv::Mat1b& image,
                                           const std::array<EdgeCurve, 4>& approximate,
                                           std::size_t k, const AdjoiningPattern& pattern,
                                           const Band& band, double blur_px) {
  // Distance from the two adjacent edges, in blurs. It excludes the corners, which the blur rounds.
  constexpr double free_blurs = 3.125, max_free_fraction = 0.3;
  const EdgeCurve &edge = approximate[k], &next = approximate[(k + 1) % 4],
                  &previous = approximate[(k + 3) % 4];
  const double free_px =
      std::clamp(free_blurs * blur_px, free_blurs * kRoughBlur_px,
                 std::max(free_blurs * kRoughBlur_px, max_free_fraction * 2 * edge.half_length_px));
  const double reach_px = std::max(band.inside_px, band.outside_px) + edge.coefficients.lpNorm<1>();
  const Eigen::Vector2d wide =
      edge.along.cwiseAbs() * edge.half_length_px + edge.across.cwiseAbs() * reach_px;
  const Eigen::Array2i last(image.cols - 1, image.rows - 1);
  const Eigen::Vector2i roi_min = (edge.middle - wide).array().ceil().cast<int>().max(0);
  const Eigen::Vector2i roi_max = (edge.middle + wide).array().floor().cast<int>().min(last);
  std::vector<EdgePixel> pixels;
  for (int row = roi_min.y(); row <= roi_max.y(); ++row) {
    for (int column = roi_min.x(); column <= roi_max.x(); ++column) {
      const Eigen::Vector2d at(column, row);
      const double w = edge.along.dot(at - edge.middle) / edge.half_length_px;
      const double v = edge.across.dot(at - edge.middle), offset_px = v - edge.curve_offset_px(w);
      if (offset_px < -band.inside_px || offset_px > band.outside_px) continue;
      if (next.signed_distance_outwards_px(at) > -free_px ||
          previous.signed_distance_outwards_px(at) > -free_px)
        continue;
      pixels.push_back({w, v, static_cast<double>(image(row, column)), pattern.stripe_width_px(w),
                        pattern.predict_white_level(w, edge.half_length_px, blur_px)});
    }
  }
  return pixels;
}

/// Edges of a tag, each fitted from corner to corner.
class TagEdges {
 public:
  TagEdges(const TagDetection& tag, const cv::Mat1b& image, const TagGeometry& print);

  /// Returns true if the fits of all edges succeeded.
  bool are_all_edges_fitted() const { return found_; }
  double tag_width_px() const { return width_px_; }
  const std::array<EdgeCurve, 4>& edge_curves() const { return edges_; }
  const std::array<EdgeFit, 4>& edge_fits() const { return fits_; }

  /// Fits all edges to the same pixels again, from the previous fit if it succeeded. Saturated
  /// edges always start from the approximate edges: along the narrow valley of their cost, a fit
  /// from the optimum of another prior ends too early.
  void fit(const std::function<EdgePrior(const EdgeCurve& edge)>& prior_of);

  /// Returns the intersections of the edges, with the curvatures of the edges and the standard
  /// deviations of the corners. Returns std::nullopt if the fit of an edge failed or a corner moved
  /// too far.
  std::optional<TagDetection::Outline> intersect_edges() const;

  /// Returns the steps across the edges for a tone curve; unknown ones if the fit of an edge failed
  /// or the edge is saturated. Edges with a larger blur than the initial one are fitted again for
  /// the steps. These fits exclude pixels near corners and bits, which are blurred as well. Corners
  /// remain as fitted, because fewer pixels would make them less precise.
  TagDetection::Steps measure_edge_steps(const cv::Mat1b& image, double gamma) const;

 private:
  void predict_neighbors(const TagGeometry& print);
  void collect_all_pixels(const cv::Mat1b& image, double blur_px);

  const TagDetection& tag_;
  std::array<EdgeCurve, 4> approximate_, edges_;
  std::array<AdjoiningPattern, 4> patterns_;
  std::array<std::vector<EdgePixel>, 4> pixels_;
  Band band_{};
  double width_px_ = INFINITY;   // smallest width of the tag
  double max_curvature_px_ = 0;  // largest curvature of the edges
  std::array<EdgeFit, 4> fits_{};
  bool found_ = false;
};

/// Returns the curvature of an edge between its corners.
EdgeCurvature compute_curvature(const EdgeCurve& edge, const Eigen::Vector2d& from,
                                const Eigen::Vector2d& to, const std::vector<EdgePixel>& pixels) {
  const Eigen::Vector2d chord = to - from, along = chord.normalized();
  Eigen::Vector2d across(-along.y(), along.x());
  if (across.dot(edge.across) < 0) across = -across;
  const double begin = edge.along.dot(from - edge.middle) / edge.half_length_px,
               end = edge.along.dot(to - edge.middle) / edge.half_length_px;
  const auto off_px = [&](double w) {
    const double at = (begin + end + w * (end - begin)) / 2;
    const Eigen::Vector2d x = edge.middle + edge.along * (at * edge.half_length_px) +
                              edge.across * edge.curve_offset_px(at);
    return across.dot(x - from);
  };
  // Half extent of evenly distributed pixels with the same mean square.
  double squares = 0;
  for (const EdgePixel& pixel : pixels) squares += pixel.along * pixel.along;
  const double reach = std::sqrt(3 * squares / static_cast<double>(pixels.size()));
  return {-off_px(0), (off_px(-0.5) - off_px(0.5)) / 0.75, reach * 2 / (end - begin)};
}

/// Returns the standard deviation of the intersection of two edges, averaged over both axes. With
/// the variances v_a and v_b of the edges' positions across them:
///   variance = (v_a + v_b) / (2 sin^2 of the angle between the edges).
double compute_crossing_sd_px(const EdgeCurve& a, const EdgeFit& fit_a, const EdgeCurve& b,
                              const EdgeFit& fit_b) {
  const auto variance = [](const EdgeFit& fit) {
    return fit.sum_of_squares / static_cast<double>(fit.pixels) * fit.end_variance;
  };
  const double sine = a.along.x() * b.along.y() - a.along.y() * b.along.x();
  return std::sqrt((variance(fit_a) + variance(fit_b)) / 2) / std::abs(sine);
}

double compute_max_change_px(const std::array<EdgeCurve, 4>& a, const std::array<EdgeCurve, 4>& b) {
  double max_px = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    max_px = std::max(max_px, (a[k].coefficients - b[k].coefficients).lpNorm<Eigen::Infinity>());
  }
  return max_px;
}

/// Starts from the straight sides between libapriltag's corners.
TagEdges::TagEdges(const TagDetection& tag, const cv::Mat1b& image, const TagGeometry& print)
    : tag_(tag) {
  // Pixels keep 2 px away from the other side of a stripe, because it is blurred, too.
  constexpr double min_px = 1.5, max_px = 4.5, away_px = 2;
  constexpr double refit_threshold_px = 0.5, cubic_threshold_px = 1, tolerance_px = 0.05;
  constexpr int max_iterations = 4;
  const auto& corners = tag.corners_px;
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d from = corners[k], to = corners[(k + 1) % 4];
    EdgeCurve& edge = approximate_[k];
    edge.middle = (from + to) / 2;
    edge.half_length_px = (to - from).norm() / 2;
    edge.along = (to - from) / (2 * edge.half_length_px);
    edge.across = {-edge.along.y(), edge.along.x()};
    if (edge.across.dot(edge.middle - middle) < 0) edge.across = -edge.across;
    for (const std::size_t other : {k + 2, k + 3}) {
      width_px_ = std::min(width_px_, edge.across.dot(from - corners[other % 4]));
    }
  }
  edges_ = approximate_;
  predict_neighbors(print);
  const double bit_px = width_px_ / print.width_bits();
  band_ = {std::clamp(print.inner_stripe_bits() * bit_px - away_px, min_px, max_px),
           std::clamp(print.outer_stripe_bits() * bit_px - away_px, min_px, max_px)};
  const auto fit_without_curve = [&] {
    collect_all_pixels(image, kRoughBlur_px);
    fit([](const EdgeCurve&) { return EdgePrior(); });
  };
  fit_without_curve();
  // A wide lens bends an edge out of the band along the straight side, which misses the corners.
  for (int iteration = 0;
       iteration < max_iterations && found_ && max_curvature_px_ > refit_threshold_px;
       ++iteration) {
    if (iteration > 0 && compute_max_change_px(edges_, approximate_) < tolerance_px) break;
    for (EdgeCurve& edge : edges_) {
      edge.cubic = edge.cubic || std::abs(edge.coefficients[2]) > cubic_threshold_px;
    }
    approximate_ = edges_;
    fit_without_curve();
  }
}

void TagEdges::predict_neighbors(const TagGeometry& print) {
  const double width = print.width_bits(), deep = print.inner_stripe_bits();
  const std::array<Eigen::Vector2d, 4> square{{{0, 0}, {width, 0}, {width, width}, {0, width}}};
  const TagGeometry::Sides white = print.list_white_segments(tag_.id);
  for (std::size_t k = 0; k < 4; ++k) {
    std::array<PlanePair, 4> pairs;
    for (std::size_t i = 0; i < 4; ++i) pairs[i] = {square[i], tag_.corners_px[(k + i) % 4]};
    const Eigen::Matrix3d px_from_bits = estimate_homography(pairs);
    const EdgeCurve& edge = approximate_[k];
    const auto at = [&](double along) {
      const Eigen::Vector2d x =
          (px_from_bits * Eigen::Vector3d(along, deep, 1)).hnormalized() - edge.middle;
      return Eigen::Vector2d(edge.along.dot(x) / edge.half_length_px, edge.across.dot(x));
    };
    const Eigen::Vector2d from = at(0), to = at(width);
    patterns_[k].by_along_px = (from.y() - to.y()) / (to.x() - from.x());
    patterns_[k].start_px = -from.y() - patterns_[k].by_along_px * from.x();
    for (const auto& run : white[k]) {
      patterns_[k].white.push_back({at(run.from).x(), at(run.to).x()});
    }
  }
}

void TagEdges::collect_all_pixels(const cv::Mat1b& image, double blur_px) {
  for (std::size_t k = 0; k < 4; ++k) {
    pixels_[k] = collect_edge_pixels(image, approximate_, k, patterns_[k], band_, blur_px);
  }
  found_ = false;
}

void TagEdges::fit(const std::function<EdgePrior(const EdgeCurve& edge)>& prior_of) {
  constexpr double max_curvature_fraction =
      0.25;  // fraction of the tag; the fit of a larger one is an outlier
  max_curvature_px_ = 0;
  const bool is_again = std::exchange(found_, false);
  for (std::size_t k = 0; k < 4; ++k) {
    const bool is_known = is_again && !fits_[k].is_saturated;
    if (!is_known) {
      edges_[k].coefficients = approximate_[k].coefficients;
      edges_[k].blur_px = approximate_[k].blur_px;
    }
    const auto fitted = fit_edge_curve(edges_[k], pixels_[k], prior_of(approximate_[k]),
                                       is_known ? &fits_[k] : nullptr);
    if (!fitted) return;
    fits_[k] = *fitted;
    max_curvature_px_ = std::max(max_curvature_px_, std::abs(edges_[k].coefficients[2]));
  }
  found_ = max_curvature_px_ <= max_curvature_fraction * width_px_;
}

std::optional<TagDetection::Outline> TagEdges::intersect_edges() const {
  constexpr double moved_px = 1.5, moved_fraction = 0.03;
  if (!found_) return {};
  // A straight line fitted to an edge misses its ends by two thirds of the curvature. Two such
  // edges meet at a corner.
  const double max_displacement_px =
      std::max(moved_px, moved_fraction * width_px_) + max_curvature_px_;
  TagDetection::Outline outline;
  TagDetection::Corners& corners = outline.corners_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d& from = tag_.corners_px[k];
    corners[k] = intersect_edge_curves(edges_[(k + 3) % 4], edges_[k], from);
    if (!((corners[k] - from).norm() < max_displacement_px)) return {};
  }
  for (std::size_t k = 0; k < 4; ++k) {
    outline.curvatures[k] =
        compute_curvature(edges_[k], corners[k], corners[(k + 1) % 4], pixels_[k]);
    const std::size_t previous = (k + 3) % 4;
    outline.corner_sds_px[k] =
        compute_crossing_sd_px(edges_[previous], fits_[previous], edges_[k], fits_[k]);
  }
  return outline;
}

TagDetection::Steps TagEdges::measure_edge_steps(const cv::Mat1b& image, double gamma) const {
  TagDetection::Steps steps;
  if (!found_) return steps;
  double blur_px = 0;
  for (const EdgeCurve& edge : edges_) blur_px = std::max(blur_px, edge.blur_px);
  std::optional<TagEdges> blurred;
  if (blur_px > 1.5 * kRoughBlur_px) {
    blurred.emplace(*this);
    blurred->approximate_ = edges_;
    blurred->collect_all_pixels(image, blur_px);
    blurred->fit([&](const EdgeCurve&) { return EdgePrior{gamma}; });
  }
  const TagEdges& measured = blurred && blurred->found_ ? *blurred : *this;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const EdgeFit& fit = measured.fits_[k];
    if (!fit.is_saturated) steps[k] = {fit.equivalent_blur_px, fit.dark_light, fit.bright_light};
  }
  return steps;
}

/// Selection of an image's tags.
struct TagSelection {
  std::span<const TagEdges> all;
  std::span<const std::size_t> which;

  /// Calls edge(curve, fit) for each edge of the tags whose fits succeeded.
  template <typename Edge>
  void for_each_edge(Edge edge) const {
    for (const std::size_t i : which) {
      for (std::size_t k = 0; all[i].are_all_edges_fitted() && k < 4; ++k)
        edge(all[i].edge_curves()[k], all[i].edge_fits()[k]);
    }
  }
  /// Returns the sum of the squared residuals of these edges, and the number of their pixels.
  std::pair<double, double> sum_squares() const {
    double squares = 0, pixels = 0;
    for_each_edge([&](const EdgeCurve&, const EdgeFit& fit) {
      squares += fit.sum_of_squares;
      pixels += static_cast<double>(fit.pixels);
    });
    return {squares, pixels};
  }
  bool is_any_edge_saturated() const {
    bool any = false;
    for_each_edge([&](const EdgeCurve&, const EdgeFit& fit) { any = any || fit.is_saturated; });
    return any;
  }
};

/// Returns the negative log-likelihood of the edges of some tags, up to a constant, with the noise
/// eliminated; a very large value if the fit of a tag failed.
double compute_cost(const TagSelection& tags) {
  constexpr double min_rms = 0.1, failure_cost = 1e9;
  if (!std::ranges::all_of(tags.which,
                           [&](std::size_t i) { return tags.all[i].are_all_edges_fitted(); })) {
    return failure_cost;
  }
  const auto [squares, pixels] = tags.sum_squares();
  return pixels * std::log(std::max(std::sqrt(squares / pixels), min_rms));
}

/// Smooth models of the blur and the light of all edges of an image, as priors for single edges.
class EdgeModels {
 public:
  /// Estimates the blur and the noise from independent fits of the edges.
  explicit EdgeModels(const TagSelection& tags);
  /// Estimates the light from fits with a prior of the blur.
  void fit_light(const TagSelection& tags);

  /// Returns the prior of an edge for a tone curve: of its blur, and of its light after
  /// fit_light_to_outline().
  EdgePrior make_prior(const EdgeCurve& edge, double gamma) const;

 private:
  /// Standard deviation of a gray level.
  double noise_ = 0;
  std::optional<EdgeField> blur_, light_;
};

/// Fits a model to the valid samples; std::nullopt if there are none.
std::optional<EdgeField> fit_edge_field(std::vector<EdgeSample> samples, EdgeField::Terms terms) {
  std::erase_if(samples, [](const EdgeSample& sample) {
    return !(sample.value > 0 && sample.sd >= 0 && std::isfinite(sample.value + sample.sd));
  });
  if (samples.empty()) return {};
  return EdgeField(samples, terms);
}

EdgeModels::EdgeModels(const TagSelection& tags) {
  const auto [squares, pixels] = tags.sum_squares();
  if (pixels == 0) return;
  noise_ = std::sqrt(squares / pixels);
  std::vector<EdgeSample> blurs;
  tags.for_each_edge([&](const EdgeCurve& edge, const EdgeFit& fit) {
    blurs.push_back({edge.middle, edge.along, edge.blur_px,
                     noise_ * std::sqrt(fit.blur_variance) / edge.blur_px});
  });
  blur_ = fit_edge_field(std::move(blurs), EdgeField::Terms::position_and_direction);
}

void EdgeModels::fit_light(const TagSelection& tags) {
  std::vector<EdgeSample> lights;
  tags.for_each_edge([&](const EdgeCurve& edge, const EdgeFit& fit) {
    lights.push_back({edge.middle, edge.along, fit.bright_light,
                      noise_ * std::sqrt(fit.bright_variance) / fit.bright_light});
  });
  light_ = fit_edge_field(std::move(lights), EdgeField::Terms::position);
}

EdgePrior EdgeModels::make_prior(const EdgeCurve& edge, double gamma) const {
  EdgePrior prior{gamma};
  if (blur_) {
    prior.blur_px = blur_->evaluate_at_edge(edge.middle, edge.along);
    prior.blur_weight = noise_ / (blur_->edge_scatter_beyond_fit_sd() * prior.blur_px);
  }
  if (light_) {
    prior.bright_light = light_->evaluate_at_edge(edge.middle, edge.along);
    prior.bright_weight = noise_ / (light_->edge_scatter_beyond_fit_sd() * prior.bright_light);
  }
  return prior;
}

/// Edges and outlines of all tags of an image.
class ImageEdges {
 public:
  ImageEdges(std::span<const TagDetection> tags, const cv::Mat1b& image, const TagGeometry& print);

  /// Indices of the tags whose edges were fitted, the widest first.
  std::span<const std::size_t> found_tags() const { return found_; }
  /// Latest outline of each tag.
  const std::vector<TagDetection::Outline>& outlines() const { return outlines_; }

  double compute_cost_of_tags(std::span<const std::size_t> which) const {
    return compute_cost({edges_, which});
  }
  void fit(std::span<const std::size_t> which,
           const std::function<EdgePrior(const EdgeCurve& edge)>& prior_of) {
    for (const std::size_t i : which) edges_[i].fit(prior_of);
  }
  /// Updates the outlines of the found tags from edges that were fitted for a tone curve. With a
  /// tone curve or saturated edges, fits all edges again with priors that are common to the image.
  void refine_outlines(const cv::Mat1b& image, double gamma);

 private:
  void intersect_edges();

  std::vector<TagEdges> edges_;
  std::vector<TagDetection::Outline> outlines_;
  std::vector<std::size_t> found_;
};

ImageEdges::ImageEdges(std::span<const TagDetection> tags, const cv::Mat1b& image,
                       const TagGeometry& print) {
  for (std::size_t i = 0; i < tags.size(); ++i) {
    edges_.emplace_back(tags[i], image, print);
    const auto intersected = edges_[i].intersect_edges();
    outlines_.push_back(intersected.value_or(TagDetection::Outline{tags[i].corners_px}));
    if (intersected) found_.push_back(i);
  }
  std::stable_sort(found_.begin(), found_.end(), [&](std::size_t a, std::size_t b) {
    return edges_[a].tag_width_px() > edges_[b].tag_width_px();
  });
}

/// Sets the outlines of the found tags, except their steps.
void ImageEdges::intersect_edges() {
  for (const std::size_t i : found_) {
    const TagDetection::Steps steps = outlines_[i].steps;
    outlines_[i] = edges_[i].intersect_edges().value_or(outlines_[i]);
    outlines_[i].steps = steps;
  }
}

void ImageEdges::refine_outlines(const cv::Mat1b& image, double gamma) {
  intersect_edges();
  // The fits below use a common model of the blur, which would hide a blurred part of the image.
  for (const std::size_t i : found_) {
    outlines_[i].steps = edges_[i].measure_edge_steps(image, gamma);
  }
  const TagSelection found{edges_, found_};
  const bool any_saturated = found.is_any_edge_saturated();
  if (!any_saturated && gamma == 1) return;
  EdgeModels models(found);
  const auto prior_of = [&](const EdgeCurve& edge) { return models.make_prior(edge, gamma); };
  fit(found_, prior_of);
  intersect_edges();
  if (!any_saturated) return;
  models.fit_light(found);
  fit(found_, prior_of);
  intersect_edges();
}

}  // namespace

std::vector<double> refine_tags(std::span<TagDetection> tags, const cv::Mat1b& image,
                                const TagGeometry& print) {
  constexpr std::size_t max_selected = 8;
  constexpr double min_log_likelihood_ratio = 10;  // e^10 times more likely
  ImageEdges edges(tags, image, print);
  const auto found = edges.found_tags();
  if (found.empty()) return {};
  const auto selected = found.first(std::min(found.size(), max_selected));
  const auto remaining = found.subspan(selected.size());
  std::vector<double> costs;
  std::vector<TagDetection::Outline> linear_outlines;
  for (const double gamma : kGammas) {
    const auto prior_of_gamma = [&](const EdgeCurve&) { return EdgePrior{gamma}; };
    if (gamma != 1) edges.fit(selected, prior_of_gamma);
    costs.push_back(edges.compute_cost_of_tags(selected));
    // Gamma 1.3 is clearly worse than 1, and gammas from the last one on are excluded.
    if (costs.size() > 1 && costs[1] > costs[0] + min_log_likelihood_ratio / 2 &&
        costs.back() > costs[0] + min_log_likelihood_ratio) {
      for (TagDetection& tag : tags) tag.tone_curve_fits.clear();
      break;
    }
    if (gamma != 1) edges.fit(remaining, prior_of_gamma);
    edges.refine_outlines(image, gamma);
    if (gamma == 1) {
      linear_outlines = edges.outlines();
    } else {
      for (std::size_t i = 0; i < tags.size(); ++i) {
        tags[i].tone_curve_fits.push_back(edges.outlines()[i]);
      }
    }
  }
  for (std::size_t i = 0; i < tags.size(); ++i) {
    tags[i].corners_px = linear_outlines[i].corners_px;
    tags[i].curvatures = linear_outlines[i].curvatures;
    tags[i].corner_sds_px = linear_outlines[i].corner_sds_px;
    tags[i].steps = linear_outlines[i].steps;
  }
  return costs;
}

}  // namespace vlp
