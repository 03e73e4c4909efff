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
struct Behind {
  double start_px = 0, by_along_px = 0;
  std::vector<std::array<double, 2>> white;

  double stripe_px(double w) const { return start_px + by_along_px * w; }

  double white_at(double w, double half_px, double blur_px) const {
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
std::vector<EdgePixel> pixels_beside(const cv::Mat1b& image,
                                     const std::array<EdgeCurve, 4>& roughly, std::size_t k,
                                     const Behind& behind, const Band& band, double blur_px) {
  // Distance from the two adjacent edges, in blurs. It excludes the corners, which the blur rounds.
  constexpr double free_blurs = 3.125, max_free_fraction = 0.3;
  const EdgeCurve &edge = roughly[k], &next = roughly[(k + 1) % 4],
                  &previous = roughly[(k + 3) % 4];
  const double free_px =
      std::clamp(free_blurs * blur_px, free_blurs * kRoughBlur_px,
                 std::max(free_blurs * kRoughBlur_px, max_free_fraction * 2 * edge.half_px));
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
      const double v = edge.across.dot(at - edge.middle), off = v - edge.value_at(w);
      if (off < -band.inside_px || off > band.outside_px) continue;
      if (next.off(at) > -free_px || previous.off(at) > -free_px) continue;
      pixels.push_back({w, v, static_cast<double>(image(row, column)), behind.stripe_px(w),
                        behind.white_at(w, edge.half_px, blur_px)});
    }
  }
  return pixels;
}

/// Edges of a tag, each fitted from corner to corner.
class TagEdges {
 public:
  TagEdges(const SeenTag& tag, const cv::Mat1b& image, const TagPrint& print);

  /// Returns true if the fits of all edges succeeded.
  bool found() const { return found_; }
  double width_px() const { return width_px_; }
  const std::array<EdgeCurve, 4>& edges() const { return edges_; }
  const std::array<EdgeFit, 4>& fits() const { return fits_; }
  double squares() const;
  double pixels() const;

  /// Fits all edges to the same pixels again, from the approximate edges.
  void fit(const std::function<EdgePrior(const EdgeCurve& edge)>& prior_of);

  /// Returns the intersections of the edges, with the curvatures of the edges and the standard
  /// deviations of the corners. Returns std::nullopt if the fit of an edge failed or a corner moved
  /// too far.
  std::optional<SeenTag::Outline> crossed() const;

  /// Returns the steps across the edges for a tone curve; unknown ones if the fit of an edge failed
  /// or the edge is saturated. Edges with a larger blur than the initial one are fitted again for
  /// the steps. These fits exclude pixels near corners and bits, which are blurred as well. Corners
  /// remain as fitted, because fewer pixels would make them less precise.
  SeenTag::Steps steps(const cv::Mat1b& image, double gamma) const;

 private:
  void look_behind(const TagPrint& print);
  void look_beside(const cv::Mat1b& image, double blur_px);

  const SeenTag& tag_;
  std::array<EdgeCurve, 4> roughly_, edges_;
  std::array<Behind, 4> behind_;
  std::array<std::vector<EdgePixel>, 4> pixels_;
  Band band_{};
  double width_px_ = INFINITY;  // smallest width of the tag
  double bow_px_ = 0;           // largest curvature of the edges
  std::array<EdgeFit, 4> fits_{};
  bool found_ = false;
};

/// Returns the curvature of an edge between its corners.
EdgeBow bow_between(const EdgeCurve& edge, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                    const std::vector<EdgePixel>& pixels) {
  const Eigen::Vector2d chord = to - from, along = chord.normalized();
  Eigen::Vector2d across(-along.y(), along.x());
  if (across.dot(edge.across) < 0) across = -across;
  const double begin = edge.along.dot(from - edge.middle) / edge.half_px,
               end = edge.along.dot(to - edge.middle) / edge.half_px;
  const auto off_px = [&](double w) {
    const double at = (begin + end + w * (end - begin)) / 2;
    const Eigen::Vector2d x =
        edge.middle + edge.along * (at * edge.half_px) + edge.across * edge.value_at(at);
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
double crossing_sd_px(const EdgeCurve& a, const EdgeFit& fit_a, const EdgeCurve& b,
                      const EdgeFit& fit_b) {
  const auto variance = [](const EdgeFit& fit) {
    return fit.squares / static_cast<double>(fit.pixels) * fit.end_variance;
  };
  const double sine = a.along.x() * b.along.y() - a.along.y() * b.along.x();
  return std::sqrt((variance(fit_a) + variance(fit_b)) / 2) / std::abs(sine);
}

double difference_px(const std::array<EdgeCurve, 4>& a, const std::array<EdgeCurve, 4>& b) {
  double most_px = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    most_px = std::max(most_px, (a[k].coefficients - b[k].coefficients).lpNorm<Eigen::Infinity>());
  }
  return most_px;
}

EdgePrior without_curve(const EdgeCurve&) { return {}; }

/// Starts from the straight sides between libapriltag's corners.
TagEdges::TagEdges(const SeenTag& tag, const cv::Mat1b& image, const TagPrint& print) : tag_(tag) {
  // Pixels keep 2 px away from the other side of a stripe, because it is blurred, too.
  constexpr double least_px = 1.5, most_px = 4.5, away_px = 2;
  constexpr double bent_px = 0.5, no_parabola_px = 1, settled_px = 0.05;
  constexpr int most_rounds = 4;
  const auto& corners = tag.corners_px;
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d from = corners[k], to = corners[(k + 1) % 4];
    EdgeCurve& edge = roughly_[k];
    edge.middle = (from + to) / 2;
    edge.half_px = (to - from).norm() / 2;
    edge.along = (to - from) / (2 * edge.half_px);
    edge.across = {-edge.along.y(), edge.along.x()};
    if (edge.across.dot(edge.middle - middle) < 0) edge.across = -edge.across;
    for (const std::size_t other : {k + 2, k + 3}) {
      width_px_ = std::min(width_px_, edge.across.dot(from - corners[other % 4]));
    }
  }
  edges_ = roughly_;
  look_behind(print);
  const double bit_px = width_px_ / print.width();
  band_ = {std::clamp(print.inside() * bit_px - away_px, least_px, most_px),
           std::clamp(print.outside() * bit_px - away_px, least_px, most_px)};
  look_beside(image, kRoughBlur_px);
  fit(without_curve);
  // A wide lens bends an edge out of the band along the straight side, which misses the corners.
  for (int round = 0; round < most_rounds && found_ && bow_px_ > bent_px; ++round) {
    if (round > 0 && difference_px(edges_, roughly_) < settled_px) break;
    for (EdgeCurve& edge : edges_) {
      edge.cubic = edge.cubic || std::abs(edge.coefficients[2]) > no_parabola_px;
    }
    roughly_ = edges_;
    look_beside(image, kRoughBlur_px);
    fit(without_curve);
  }
}

void TagEdges::look_behind(const TagPrint& print) {
  const double width = print.width(), deep = print.inside();
  const std::array<Eigen::Vector2d, 4> square{{{0, 0}, {width, 0}, {width, width}, {0, width}}};
  const TagPrint::Sides white = print.white_behind(tag_.id);
  for (std::size_t k = 0; k < 4; ++k) {
    std::array<PlanePair, 4> pairs;
    for (std::size_t i = 0; i < 4; ++i) pairs[i] = {square[i], tag_.corners_px[(k + i) % 4]};
    const Eigen::Matrix3d px_from_bits = homography(pairs);
    const EdgeCurve& edge = roughly_[k];
    const auto at = [&](double along) {
      const Eigen::Vector2d x =
          (px_from_bits * Eigen::Vector3d(along, deep, 1)).hnormalized() - edge.middle;
      return Eigen::Vector2d(edge.along.dot(x) / edge.half_px, edge.across.dot(x));
    };
    const Eigen::Vector2d from = at(0), to = at(width);
    behind_[k].by_along_px = (from.y() - to.y()) / (to.x() - from.x());
    behind_[k].start_px = -from.y() - behind_[k].by_along_px * from.x();
    for (const auto& run : white[k]) {
      behind_[k].white.push_back({at(run.from).x(), at(run.to).x()});
    }
  }
}

void TagEdges::look_beside(const cv::Mat1b& image, double blur_px) {
  for (std::size_t k = 0; k < 4; ++k) {
    pixels_[k] = pixels_beside(image, roughly_, k, behind_[k], band_, blur_px);
  }
}

void TagEdges::fit(const std::function<EdgePrior(const EdgeCurve& edge)>& prior_of) {
  constexpr double most_bow = 0.25;  // fraction of the tag; the fit of a larger one is an outlier
  bow_px_ = 0;
  found_ = false;
  for (std::size_t k = 0; k < 4; ++k) {
    edges_[k].coefficients = roughly_[k].coefficients;
    edges_[k].blur_px = roughly_[k].blur_px;
    const auto fitted = fit_edge(edges_[k], pixels_[k], prior_of(roughly_[k]));
    if (!fitted) return;
    fits_[k] = *fitted;
    bow_px_ = std::max(bow_px_, std::abs(edges_[k].coefficients[2]));
  }
  found_ = bow_px_ <= most_bow * width_px_;
}

std::optional<SeenTag::Outline> TagEdges::crossed() const {
  constexpr double moved_px = 1.5, moved_share = 0.03;
  if (!found_) return {};
  // A straight line fitted to an edge misses its ends by two thirds of the curvature. Two such
  // edges meet at a corner.
  const double most_moved_px = std::max(moved_px, moved_share * width_px_) + bow_px_;
  SeenTag::Outline outline;
  SeenTag::Corners& corners = outline.corners_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d& from = tag_.corners_px[k];
    corners[k] = crossing(edges_[(k + 3) % 4], edges_[k], from);
    if (!((corners[k] - from).norm() < most_moved_px)) return {};
  }
  for (std::size_t k = 0; k < 4; ++k) {
    outline.bows[k] = bow_between(edges_[k], corners[k], corners[(k + 1) % 4], pixels_[k]);
    const std::size_t previous = (k + 3) % 4;
    outline.sds_px[k] = crossing_sd_px(edges_[previous], fits_[previous], edges_[k], fits_[k]);
  }
  return outline;
}

SeenTag::Steps TagEdges::steps(const cv::Mat1b& image, double gamma) const {
  SeenTag::Steps steps;
  if (!found_) return steps;
  double blur_px = 0;
  for (const EdgeCurve& edge : edges_) blur_px = std::max(blur_px, edge.blur_px);
  std::optional<TagEdges> blurred;
  if (blur_px > 1.5 * kRoughBlur_px) {
    blurred.emplace(*this);
    blurred->roughly_ = edges_;
    blurred->look_beside(image, blur_px);
    blurred->fit([&](const EdgeCurve&) { return EdgePrior{gamma}; });
  }
  const TagEdges& measured = blurred && blurred->found_ ? *blurred : *this;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const EdgeFit& fit = measured.fits_[k];
    if (!fit.runs_over) steps[k] = {fit.equivalent_blur_px, fit.dark_light, fit.bright_light};
  }
  return steps;
}

double TagEdges::squares() const {
  return fits_[0].squares + fits_[1].squares + fits_[2].squares + fits_[3].squares;
}

double TagEdges::pixels() const {
  return static_cast<double>(fits_[0].pixels + fits_[1].pixels + fits_[2].pixels + fits_[3].pixels);
}

/// Returns the negative log-likelihood of the edges of some tags, up to a constant, with the noise
/// eliminated; a very large value if the fit of a tag failed.
double cost_of(std::span<const TagEdges> tags, std::span<const std::size_t> asked) {
  constexpr double least_rms = 0.1, otherwise = 1e9;
  double squares = 0, pixels = 0;
  for (const std::size_t i : asked) {
    if (!tags[i].found()) return otherwise;
    squares += tags[i].squares();
    pixels += tags[i].pixels();
  }
  return pixels * std::log(std::max(std::sqrt(squares / pixels), least_rms));
}

/// Selection of an image's tags.
struct SomeTags {
  std::span<const TagEdges> all;
  std::span<const std::size_t> which;

  /// Calls edge(curve, fit) for each edge of the tags whose fits succeeded.
  template <typename Edge>
  void for_each_edge(Edge edge) const {
    for (const std::size_t i : which) {
      for (std::size_t k = 0; all[i].found() && k < 4; ++k)
        edge(all[i].edges()[k], all[i].fits()[k]);
    }
  }
  bool run_over() const {
    bool any = false;
    for_each_edge([&](const EdgeCurve&, const EdgeFit& fit) { any = any || fit.runs_over; });
    return any;
  }
};

/// Smooth models of the blur and the light of all edges of an image, as priors for single edges.
class CommonEdges {
 public:
  /// Estimates the blur and the noise from independent fits of the edges.
  explicit CommonEdges(const SomeTags& tags);
  /// Estimates the light from fits with a prior of the blur.
  void take_light(const SomeTags& tags);

  /// Return the prior of an edge for a tone curve, of its blur only or of its blur and light.
  EdgePrior with_blur(const EdgeCurve& edge, double gamma) const;
  EdgePrior with_light(const EdgeCurve& edge, double gamma) const;

 private:
  /// Standard deviation of a grey level.
  double noise_ = 0;
  std::optional<EdgeField> blur_, light_;
};

/// Fits a model to the valid samples; std::nullopt if there are none.
std::optional<EdgeField> field_of(std::vector<EdgeFigure> figures, EdgeField::Terms terms) {
  std::erase_if(figures, [](const EdgeFigure& figure) {
    return !(figure.value > 0 && figure.sd >= 0 && std::isfinite(figure.value + figure.sd));
  });
  if (figures.empty()) return {};
  return EdgeField(figures, terms);
}

CommonEdges::CommonEdges(const SomeTags& tags) {
  double squares = 0, pixels = 0;
  tags.for_each_edge([&](const EdgeCurve&, const EdgeFit& fit) {
    squares += fit.squares;
    pixels += static_cast<double>(fit.pixels);
  });
  if (pixels == 0) return;
  noise_ = std::sqrt(squares / pixels);
  std::vector<EdgeFigure> blurs;
  tags.for_each_edge([&](const EdgeCurve& edge, const EdgeFit& fit) {
    blurs.push_back({edge.middle, edge.along, edge.blur_px,
                     noise_ * std::sqrt(fit.blur_variance) / edge.blur_px});
  });
  blur_ = field_of(std::move(blurs), EdgeField::Terms::place_and_direction);
}

void CommonEdges::take_light(const SomeTags& tags) {
  std::vector<EdgeFigure> lights;
  tags.for_each_edge([&](const EdgeCurve& edge, const EdgeFit& fit) {
    lights.push_back({edge.middle, edge.along, fit.bright_light,
                      noise_ * std::sqrt(fit.bright_variance) / fit.bright_light});
  });
  light_ = field_of(std::move(lights), EdgeField::Terms::place);
}

EdgePrior CommonEdges::with_blur(const EdgeCurve& edge, double gamma) const {
  EdgePrior prior{gamma};
  if (!blur_) return prior;
  prior.blur_px = blur_->value(edge.middle, edge.along);
  prior.blur_weight = noise_ / (blur_->apart() * prior.blur_px);
  return prior;
}

EdgePrior CommonEdges::with_light(const EdgeCurve& edge, double gamma) const {
  EdgePrior prior = with_blur(edge, gamma);
  if (!light_) return prior;
  prior.bright_light = light_->value(edge.middle, edge.along);
  prior.bright_weight = noise_ / (light_->apart() * prior.bright_light);
  return prior;
}

}  // namespace

std::vector<double> find_exact_edges(std::span<SeenTag> tags, const cv::Mat1b& image,
                                     const TagPrint& print) {
  constexpr std::size_t most_asked = 8;
  constexpr double surely = 10;  // e^10 times more likely
  std::vector<TagEdges> edges;
  std::vector<SeenTag::Outline> outlines;  // as they were found last
  std::vector<std::size_t> widest;         // of those that are found, the widest first
  for (std::size_t i = 0; i < tags.size(); ++i) {
    edges.emplace_back(tags[i], image, print);
    const auto crossed = edges[i].crossed();
    outlines.push_back(crossed.value_or(SeenTag::Outline{tags[i].corners_px}));
    if (crossed) widest.push_back(i);
  }
  if (widest.empty()) return {};
  std::stable_sort(widest.begin(), widest.end(), [&](std::size_t a, std::size_t b) {
    return edges[a].width_px() > edges[b].width_px();
  });
  const auto asked = std::span(widest).first(std::min(widest.size(), most_asked));
  const auto others = std::span(widest).subspan(asked.size());
  const auto fit = [&](std::span<const std::size_t> some, const auto& prior_of) {
    for (const std::size_t i : some) edges[i].fit(prior_of);
  };
  std::vector<double> costs;
  std::vector<SeenTag::Outline> behind_none;
  for (const double gamma : kGammas) {
    const auto alone = [&](const EdgeCurve&) { return EdgePrior{gamma}; };
    if (gamma != 1) fit(asked, alone);
    costs.push_back(cost_of(edges, asked));
    if (costs.size() == 2 && costs[1] > costs[0] + surely) break;
    if (gamma != 1) fit(others, alone);
    const auto take = [&] {
      for (const std::size_t i : widest) {
        const SeenTag::Steps steps = outlines[i].steps;
        outlines[i] = edges[i].crossed().value_or(outlines[i]);
        outlines[i].steps = steps;
      }
    };
    take();
    // The fits below use a common model of the blur, which would hide a blurred part of the image.
    for (const std::size_t i : widest) outlines[i].steps = edges[i].steps(image, gamma);
    const SomeTags found{edges, widest};
    const bool over = found.run_over();
    if (over || gamma != 1) {
      CommonEdges common(found);
      fit(widest, [&](const EdgeCurve& edge) { return common.with_blur(edge, gamma); });
      if (over) {
        take();
        common.take_light(found);
        fit(widest, [&](const EdgeCurve& edge) { return common.with_light(edge, gamma); });
      }
      take();
    }
    if (gamma == 1) {
      behind_none = outlines;
    } else {
      for (std::size_t i = 0; i < tags.size(); ++i) {
        tags[i].behind_curves.push_back(outlines[i]);
      }
    }
  }
  for (std::size_t i = 0; i < tags.size(); ++i) {
    tags[i].corners_px = behind_none[i].corners_px;
    tags[i].bows = behind_none[i].bows;
    tags[i].sds_px = behind_none[i].sds_px;
    tags[i].steps = behind_none[i].steps;
  }
  return costs;
}

}  // namespace vlp
