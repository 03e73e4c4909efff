// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/bootstrap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "captures/in_parallel.h"
#include "evaluation/errors/split_mix.h"

namespace vlp {
namespace {

constexpr std::size_t kDraws = 2000, kMostParts = 1000, kRanks = 256;

/// Draws a number in [0, count).
/// @pre count < 2^32
std::size_t below(std::size_t count, SplitMix& random) {
  return static_cast<std::size_t>(((random() >> 32) * count) >> 32);
}

/// Group of each error, number of groups, number of clusters.
struct Parts {
  std::vector<std::uint32_t> of_error;
  std::size_t count = 0, units = 0;
};

Parts dealt_out(std::span<const std::size_t> units) {
  const std::size_t numbers = *std::max_element(units.begin(), units.end()) + 1;
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> part_of(numbers, none);  // rank of the cluster by first occurrence
  Parts parts;
  for (const std::size_t unit : units) {
    if (part_of[unit] == none) part_of[unit] = static_cast<std::uint32_t>(parts.units++);
  }
  parts.count = std::min(parts.units, kMostParts);
  std::vector<std::uint32_t> deal(parts.units);
  std::iota(deal.begin(), deal.end(), std::uint32_t{0});
  if (parts.units > kMostParts) {
    SplitMix random(1);
    for (std::size_t i = deal.size(); i > 1; --i) std::swap(deal[i - 1], deal[below(i, random)]);
  }
  parts.of_error.reserve(units.size());
  for (const std::size_t unit : units) {
    parts.of_error.push_back(static_cast<std::uint32_t>(deal[part_of[unit]] % parts.count));
  }
  return parts;
}

/// Errors preprocessed so that a resample of groups is cheap.
class Resampler {
 public:
  Resampler(std::span<const double> errors, const Parts& parts)
      : parts_(parts.count), totals_(parts.count) {
    sorted_.reserve(errors.size());
    for (std::size_t i = 0; i < errors.size(); ++i) {
      sorted_.push_back({errors[i], parts.of_error[i]});
      Totals& total = totals_[parts.of_error[i]];
      total.count += 1;
      total.sum += errors[i];
      total.squares += errors[i] * errors[i];
    }
    std::sort(sorted_.begin(), sorted_.end(), [](const Error& a, const Error& b) {
      return a.value != b.value ? a.value < b.value : a.part < b.part;
    });
    step_ = (sorted_.size() + kRanks - 1) / kRanks;
    std::vector<std::uint32_t> so_far(parts_);
    for (std::size_t i = 0; i < sorted_.size(); ++i) {
      if (i % step_ == 0) counts_below_.insert(counts_below_.end(), so_far.begin(), so_far.end());
      ++so_far[sorted_[i].part];
    }
  }

  struct Figures {
    double mean, median, p90, rms;
  };
  Figures draw(std::uint64_t seed) const {
    SplitMix random(seed);
    std::vector<std::uint32_t> weights(parts_);
    for (std::size_t i = 0; i < parts_; ++i) ++weights[below(parts_, random)];
    Totals all;
    for (std::size_t part = 0; part < parts_; ++part) {
      all.count += weights[part] * totals_[part].count;
      all.sum += weights[part] * totals_[part].sum;
      all.squares += weights[part] * totals_[part].squares;
    }
    return {all.sum / all.count, quantile(weights, 0.5 * all.count),
            quantile(weights, 0.9 * all.count), std::sqrt(all.squares / all.count)};
  }

 private:
  struct Error {
    double value;
    std::uint32_t part;
  };
  struct Totals {
    double count = 0, sum = 0, squares = 0;
  };

  /// Returns the sum of the weights of all errors before rank * step_.
  double weight_below(const std::vector<std::uint32_t>& weights, std::size_t rank) const {
    const auto counts = counts_below_.begin() + static_cast<std::ptrdiff_t>(rank * parts_);
    return static_cast<double>(
        std::inner_product(weights.begin(), weights.end(), counts, std::uint64_t{0}));
  }

  /// Returns the smallest error for which the cumulative weight reaches `wanted`.
  double quantile(const std::vector<std::uint32_t>& weights, double wanted) const {
    constexpr double rounding = 1e-6;
    wanted -= rounding;
    std::size_t low = 0, high = counts_below_.size() / parts_;
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (weight_below(weights, middle) < wanted ? low : high) = middle;
    }
    double weight = weight_below(weights, low);
    for (std::size_t i = low * step_; i < sorted_.size(); ++i) {
      weight += weights[sorted_[i].part];
      if (weight >= wanted) return sorted_[i].value;
    }
    return sorted_.back().value;
  }

  std::size_t parts_, step_ = 1;
  std::vector<Totals> totals_;
  std::vector<Error> sorted_;
  std::vector<std::uint32_t> counts_below_;  // at each multiple of step_, by group
};

Interval percentiles(std::vector<double> drawn) {
  constexpr std::size_t outside = kDraws / 40;  // 2.5 % on either side
  std::sort(drawn.begin(), drawn.end());
  return {drawn[outside - 1], drawn[kDraws - outside]};
}

}  // namespace

std::optional<ErrorIntervals> error_intervals(std::span<const double> errors,
                                              std::span<const std::size_t> units, int threads) {
  if (errors.empty()) return std::nullopt;
  const Parts parts = dealt_out(units);
  if (parts.units < kFewestUnits) return std::nullopt;
  const Resampler resampler(errors, parts);
  std::array<std::vector<double>, 4> drawn;
  for (auto& values : drawn) values.resize(kDraws);
  in_parallel(kDraws, threads, [&](std::size_t i) {
    const auto [mean, median, p90, rms] = resampler.draw(i);
    drawn[0][i] = mean;
    drawn[1][i] = median;
    drawn[2][i] = p90;
    drawn[3][i] = rms;
  });
  std::optional<Interval> p90;
  if (parts.units >= kFewestUnitsOfP90) p90 = percentiles(drawn[2]);
  return ErrorIntervals{percentiles(drawn[0]), percentiles(drawn[1]), p90, percentiles(drawn[3]),
                        parts.units};
}

}  // namespace vlp
