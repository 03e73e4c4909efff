// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/glow_envelope.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace vlp {
namespace {

/// A line and its level.
struct Peak {
  int line;
  double level;
};

/// By the line through the logarithms of two peaks.
double between(const Peak& a, const Peak& b, int line) {
  return a.level * std::pow(b.level / a.level, double(line - a.line) / (b.line - a.line));
}

/// Lines that are brighter than those around.
std::vector<Peak> peaks_of(const std::vector<double>& signal) {
  constexpr int around = 4;
  const int n = static_cast<int>(signal.size());
  const auto at = [&](int i) { return signal[static_cast<std::size_t>(i)]; };
  std::vector<Peak> peaks;
  for (int i = 0; i < n; ++i) {
    bool peak = at(i) > 0;
    for (int j = std::max(0, i - around); peak && j <= std::min(n - 1, i + around); ++j) {
      peak = at(j) < at(i) || (at(j) == at(i) && j >= i);
    }
    if (peak) peaks.push_back({i, at(i)});
  }
  return peaks;
}

}  // namespace

std::vector<double> envelope_of(const std::vector<double>& signal) {
  constexpr double least_share = 0.5;
  std::vector<Peak> peaks = peaks_of(signal);
  // A peak in the dark between two stripes is none.
  for (std::size_t i = 1; i + 1 < peaks.size();) {
    const bool dark =
        peaks[i].level < least_share * between(peaks[i - 1], peaks[i + 1], peaks[i].line);
    if (!dark) {
      ++i;
      continue;
    }
    peaks.erase(peaks.begin() + std::ptrdiff_t(i));
    i = std::max<std::size_t>(1, i - 1);
  }
  std::vector<double> envelope(signal.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < envelope.size() && !peaks.empty(); ++i) {
    const int line = static_cast<int>(i);
    while (next < peaks.size() && peaks[next].line < line) ++next;
    if (next == 0 || next == peaks.size()) {
      envelope[i] = peaks[std::min(next, peaks.size() - 1)].level;
    } else {
      envelope[i] = between(peaks[next - 1], peaks[next], line);
    }
  }
  return envelope;
}

std::vector<double> without_glow(const std::vector<double>& signal) {
  constexpr double lost = 0.08;  // of the brightest line
  const auto envelope = envelope_of(signal);
  std::vector<double> result;
  if (envelope.empty()) return result;
  const double least = lost * *std::max_element(envelope.begin(), envelope.end());
  result.reserve(signal.size());
  for (std::size_t i = 0; i < signal.size(); ++i) {
    if (envelope[i] > least) result.push_back(std::clamp(signal[i] / envelope[i], 0.0, 1.0));
  }
  return result;
}

std::vector<double> striped_part(const std::vector<double>& brightness) {
  constexpr int enough_stripes = 4;
  constexpr std::ptrdiff_t beyond = 2;
  const auto lit = [](double line) { return line >= 0.5; };
  const auto first = std::find_if(brightness.begin(), brightness.end(), lit);
  const auto last = std::find_if(brightness.rbegin(), brightness.rend(), lit).base();
  if (first >= last) return {};
  int stripes = 1;
  for (auto at = first + 1; at < last; ++at) stripes += lit(*at) && !lit(*(at - 1));
  if (stripes >= enough_stripes) return {first, last};
  return {first - std::min(beyond, first - brightness.begin()),
          last + std::min(beyond, brightness.end() - last)};
}

}  // namespace vlp
