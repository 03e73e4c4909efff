// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/bootstrap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "captures/parallel_for.h"
#include "evaluation/errors/split_mix.h"

namespace vlp {
namespace {

constexpr std::size_t kDraws = 2000, kMaxGroups = 1000, kRanks = 256;

/// Draws a number in [0, count).
/// @pre count < 2^32
std::size_t draw_index_below(std::size_t count, SplitMix& random) {
  return static_cast<std::size_t>(((random() >> 32) * count) >> 32);
}

/// Group of each error, number of groups, number of clusters.
struct Groups {
  std::vector<std::uint32_t> of_error;
  std::size_t count = 0, clusters = 0;
};

Groups assign_groups(std::span<const std::size_t> clusters) {
  const std::size_t numbers = *std::max_element(clusters.begin(), clusters.end()) + 1;
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> group_of(numbers, none);  // rank of the cluster by first occurrence
  Groups groups;
  for (const std::size_t cluster : clusters) {
    if (group_of[cluster] == none)
      group_of[cluster] = static_cast<std::uint32_t>(groups.clusters++);
  }
  groups.count = std::min(groups.clusters, kMaxGroups);
  std::vector<std::uint32_t> group_order(groups.clusters);
  std::iota(group_order.begin(), group_order.end(), std::uint32_t{0});
  if (groups.clusters > kMaxGroups) {
    SplitMix random(1);
    for (std::size_t i = group_order.size(); i > 1; --i)
      std::swap(group_order[i - 1], group_order[draw_index_below(i, random)]);
  }
  groups.of_error.reserve(clusters.size());
  for (const std::size_t cluster : clusters) {
    groups.of_error.push_back(
        static_cast<std::uint32_t>(group_order[group_of[cluster]] % groups.count));
  }
  return groups;
}

Interval make_interval(std::vector<double> resampled) {
  constexpr std::size_t outside = kDraws / 40;  // 2.5 % on either side
  std::sort(resampled.begin(), resampled.end());
  return {resampled[outside - 1], resampled[kDraws - outside]};
}

/// Returns value - sd t for the quantiles of t. A mean of values without sign is not below 0.
Interval make_t_interval(double value, double sd, double min_error, std::vector<double> ts) {
  const auto [low, high] = make_interval(std::move(ts));
  const double lower = value - sd * high;
  return {min_error >= 0 ? std::max(lower, 0.0) : lower, value - sd * low};
}

/// Mean of values that are correlated within groups, by the totals of the groups: the ratio of
/// their sums, with the linearized standard deviation of this ratio.
class GroupedMean {
 public:
  void add_group(double weight, double count, double sum) {
    groups_ += weight;
    counts_ += weight * count;
    sums_ += weight * sum;
    counts_squared_ += weight * count * count;
    products_ += weight * count * sum;
    sums_squared_ += weight * sum * sum;
  }
  double value() const { return sums_ / counts_; }
  double sd() const {
    const double mean = value();
    const double squares = sums_squared_ - 2 * mean * products_ + mean * mean * counts_squared_;
    return std::sqrt(groups_ / (groups_ - 1) * std::max(squares, 0.0)) / counts_;
  }

 private:
  double groups_ = 0, counts_ = 0, sums_ = 0, counts_squared_ = 0, products_ = 0, sums_squared_ = 0;
};

/// Errors preprocessed so that a resample of groups is cheap.
class Resampler {
 public:
  Resampler(std::span<const double> errors, const Groups& groups)
      : groups_(groups.count), totals_(groups.count) {
    const auto count = static_cast<double>(errors.size());
    for (const double error : errors) {
      mean_ += error / count;
      mean_square_ += error * error / count;
    }
    sorted_.reserve(errors.size());
    for (std::size_t i = 0; i < errors.size(); ++i) {
      sorted_.push_back({errors[i], groups.of_error[i]});
      Totals& total = totals_[groups.of_error[i]];
      total.count += 1;
      total.sum += errors[i] - mean_;
      total.squares += errors[i] * errors[i] - mean_square_;
    }
    const std::vector<std::uint32_t> once(groups_, 1);
    mean_sd_ = average(once, &Totals::sum).sd();
    mean_square_sd_ = average(once, &Totals::squares).sd();
    std::sort(sorted_.begin(), sorted_.end(), [](const Error& a, const Error& b) {
      return a.value != b.value ? a.value < b.value : a.group < b.group;
    });
    step_ = (sorted_.size() + kRanks - 1) / kRanks;
    std::vector<std::uint32_t> so_far(groups_);
    for (std::size_t i = 0; i < sorted_.size(); ++i) {
      if (i % step_ == 0) counts_below_.insert(counts_below_.end(), so_far.begin(), so_far.end());
      ++so_far[sorted_[i].group];
    }
  }

  /// Median and 90th percentile of a resample, and the deviations of its mean and mean square from
  /// those of all errors, divided by their standard deviations in the resample.
  struct Statistics {
    double mean_t, median, p90, mean_square_t;
  };
  Statistics draw(std::uint64_t seed) const {
    SplitMix random(seed);
    std::vector<std::uint32_t> weights(groups_);
    for (std::size_t i = 0; i < groups_; ++i) ++weights[draw_index_below(groups_, random)];
    double count = 0;
    for (std::size_t group = 0; group < groups_; ++group)
      count += weights[group] * totals_[group].count;
    return {compute_t(average(weights, &Totals::sum), mean_sd_), quantile(weights, 0.5 * count),
            quantile(weights, 0.9 * count),
            compute_t(average(weights, &Totals::squares), mean_square_sd_)};
  }

  /// Returns the interval of the mean from its deviations in the resamples.
  Interval make_mean_interval(std::vector<double> ts) const {
    return make_t_interval(mean_, mean_sd_, sorted_.front().value, std::move(ts));
  }
  Interval make_rms_interval(std::vector<double> ts) const {
    const Interval squares = make_t_interval(mean_square_, mean_square_sd_, 0, std::move(ts));
    return {std::sqrt(squares.low), std::sqrt(squares.high)};
  }

 private:
  struct Error {
    double value;
    std::uint32_t group;
  };
  /// Number of the errors of a group, and sums of their deviations from the mean of all errors and
  /// of their squares' deviations from the mean square.
  struct Totals {
    double count = 0, sum = 0, squares = 0;
  };

  GroupedMean average(const std::vector<std::uint32_t>& weights, double Totals::*sum) const {
    GroupedMean mean;
    for (std::size_t group = 0; group < groups_; ++group)
      mean.add_group(weights[group], totals_[group].count, totals_[group].*sum);
    return mean;
  }

  /// A resample of nearly equal groups has an sd near 0, which would make t infinite.
  double compute_t(const GroupedMean& deviation, double sd) const {
    if (sd == 0) return 0;
    return deviation.value() / std::max(deviation.sd(), sd / static_cast<double>(groups_));
  }

  /// Returns the sum of the weights of all errors before rank * step_.
  double sum_weights_below(const std::vector<std::uint32_t>& weights, std::size_t rank) const {
    const auto counts = counts_below_.begin() + static_cast<std::ptrdiff_t>(rank * groups_);
    return static_cast<double>(
        std::inner_product(weights.begin(), weights.end(), counts, std::uint64_t{0}));
  }

  /// Returns the smallest error for which the cumulative weight reaches `wanted`.
  double quantile(const std::vector<std::uint32_t>& weights, double wanted) const {
    constexpr double numeric_tolerance = 1e-6;
    wanted -= numeric_tolerance;
    std::size_t low = 0, high = counts_below_.size() / groups_;
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (sum_weights_below(weights, middle) < wanted ? low : high) = middle;
    }
    double weight = sum_weights_below(weights, low);
    for (std::size_t i = low * step_; i < sorted_.size(); ++i) {
      weight += weights[sorted_[i].group];
      if (weight >= wanted) return sorted_[i].value;
    }
    return sorted_.back().value;
  }

  std::size_t groups_, step_ = 1;
  double mean_ = 0, mean_square_ = 0, mean_sd_ = 0, mean_square_sd_ = 0;
  std::vector<Totals> totals_;
  std::vector<Error> sorted_;
  std::vector<std::uint32_t> counts_below_;  // at each multiple of step_, by group
};

}  // namespace

std::optional<ErrorIntervals> bootstrap_intervals(std::span<const double> errors,
                                                  std::span<const std::size_t> clusters,
                                                  int threads) {
  if (errors.empty()) return std::nullopt;
  const Groups groups = assign_groups(clusters);
  if (groups.clusters < kMinClusters) return std::nullopt;
  const Resampler resampler(errors, groups);
  std::array<std::vector<double>, 4> resampled;
  for (auto& values : resampled) values.resize(kDraws);
  parallel_for(kDraws, threads, [&](std::size_t i) {
    const auto [mean_t, median, p90, mean_square_t] = resampler.draw(i);
    resampled[0][i] = mean_t;
    resampled[1][i] = median;
    resampled[2][i] = p90;
    resampled[3][i] = mean_square_t;
  });
  std::optional<Interval> p90;
  if (groups.clusters >= kMinClustersForP90) p90 = make_interval(resampled[2]);
  return ErrorIntervals{resampler.make_mean_interval(resampled[0]), make_interval(resampled[1]),
                        p90, resampler.make_rms_interval(resampled[3]), groups.clusters};
}

}  // namespace vlp
