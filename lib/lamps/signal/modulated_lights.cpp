// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/modulated_lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <iterator>
#include <numbers>
#include <utility>

#include "lamps/signal/frequency_identification.h"
#include "lamps/signal/stripes.h"

namespace vlp {
namespace {

/// Number of bins of the shortest period, sufficient for its third harmonic.
constexpr double kBinsPerPeriod = 8;
/// Maximum fraction of the variance that the period of a modulated light leaves unexplained.
constexpr double kMaxUnexplained = 0.45;
/// Minimum log-likelihood ratio that decides between two periods: odds of 55.
constexpr double kMinLogRatio = 4;
/// Modulation depth of the fundamental below which a light is steady.
constexpr double kMinLightDepth = 0.3;
/// Minimum phase coherence: that of a light whose phase changes by a quarter of a period across it.
constexpr double kMinPhaseCoherence = 0.9;
/// Minimum number of cells of a light.
constexpr int kMinCells = 4;
/// Maximum phase difference of two regions of one lamp, in rad.
constexpr double kMaxPhase_rad = 1.2;

/// Region with its profile and the fits to it.
struct RegionCandidate {
  ModulatedRegion region;
  LineProfile profile;
  PeriodFit fit;
  std::optional<std::size_t> lamp;
  /// Fits of the lamps' periods, by index of the lamp period.
  std::vector<PeriodFit> lamp_fits;
  double phase_coherence = 0;
  bool is_modulated = false;
  bool is_other_period = false;  ///< a period of no lamp fits better
  /// True if it is a part in phase of a region that is out of phase.
  bool is_split_off = false;
};

/// Returns the log-likelihood ratio of two fits. Three harmonics leave 6 independent values of a
/// period, or as many as it has scanlines; the unknowns are the coefficients and the period.
double compute_log_ratio(const PeriodFit& better, const PeriodFit& worse) {
  constexpr double values_per_period = 6, unknowns = 7, min_unexplained = 1e-3;
  const double periods =
      worse.periods > 0 ? std::min(better.periods, worse.periods) : better.periods;
  const double values = periods * std::min(values_per_period, better.period_lines);
  return std::max(1.0, values - unknowns) / 2 *
         std::log(std::max(worse.unexplained_fraction, min_unexplained) /
                  std::max(better.unexplained_fraction, min_unexplained));
}

/// Computes the brightness of a region along the readout direction, in the region and
/// `margin_lines` scanlines on both sides. A cell column is weighted by its amplitude in the
/// region.
LineProfile compute_profile(const CellLevels& cells, const ModulationMap& map,
                            const ModulatedRegion& region, double margin_lines) {
  const int first_cell = (region.box.x - cells.box.x) / kCellWidth_px;
  std::vector<float> weights(std::size_t(region.box.width / kCellWidth_px), 0);
  for (const auto& [step, begin, end] : region.spans) {
    for (int x = begin; x < end; x += kCellWidth_px) {
      const int cell = (x - cells.box.x) / kCellWidth_px;
      weights[std::size_t(cell - first_cell)] += map.amplitude[map.cell_index(step, cell)];
    }
  }
  const auto bin_at = [&](double line) {
    const double bin = (line - cells.box.y) / cells.lines_per_bin;
    return static_cast<int>(std::clamp(bin, 0.0, double(cells.bins)));
  };
  const int begin = bin_at(region.box.y - margin_lines);
  const int end = bin_at(region.box.end_row() + margin_lines);
  LineProfile profile{
      cells.box.y + (begin + 0.5) * cells.lines_per_bin - 0.5, cells.lines_per_bin, {}};
  for (int bin = begin; bin < end; ++bin) {
    const float* row = cells.levels_of_bin(bin) + first_cell;
    double sum = 0;
    for (std::size_t c = 0; c < weights.size(); ++c) sum += double(weights[c]) * double(row[c]);
    profile.levels.push_back(std::max(0.0, sum));
  }
  return profile;
}

/// Fits the period of each lamp to a profile.
std::vector<PeriodFit> fit_lamp_periods(const LineProfile& profile,
                                        std::span<const double> lamp_periods_lines) {
  std::vector<PeriodFit> fits;
  for (const double period : lamp_periods_lines) {
    fits.push_back(period < kMinPeriod_lines ? PeriodFit{period}
                                             : fit_period_near(profile, period, kLampDrift));
  }
  return fits;
}

std::size_t select_best_lamp(const std::vector<PeriodFit>& lamp_fits) {
  const auto best = std::ranges::min_element(lamp_fits, {}, &PeriodFit::unexplained_fraction);
  return std::size_t(best - lamp_fits.begin());
}

/// Returns the best lamp if it explains the profile and if every competing lamp is clearly worse.
template <typename IsCompeting>
std::optional<std::size_t> choose_lamp(const std::vector<PeriodFit>& lamp_fits,
                                       const IsCompeting& is_competing) {
  const std::size_t best = select_best_lamp(lamp_fits);
  if (lamp_fits[best].unexplained_fraction > kMaxUnexplained) return std::nullopt;
  for (std::size_t i = 0; i < lamp_fits.size(); ++i) {
    if (i != best && compute_log_ratio(lamp_fits[best], lamp_fits[i]) <= kMinLogRatio &&
        is_competing(i))
      return std::nullopt;
  }
  return best;
}

/// Returns true if two fits have the same phase at a scanline between two regions, where the effect
/// of a small difference of their periods is smallest.
bool are_in_phase(const RegionCandidate& a, const PeriodFit& fit_of_a, const RegionCandidate& b,
                  const PeriodFit& fit_of_b) {
  const auto middle = [](const PixelBox& box) { return box.y + box.height / 2.0; };
  const double line = (middle(a.region.box) + middle(b.region.box)) / 2;
  const auto phase_at = [&](const PeriodFit& fit) {
    return 2 * std::numbers::pi * line / fit.period_lines - fit.phase_rad;
  };
  const double difference = phase_at(fit_of_a) - phase_at(fit_of_b);
  return std::abs(std::remainder(difference, 2 * std::numbers::pi)) < kMaxPhase_rad;
}

/// Candidates that are assigned to a lamp without doubt, by index of the lamp period; nullptr if
/// none is.
using Claims = std::vector<const RegionCandidate*>;

/// Assigns the best lamp to a candidate if every competing lamp is clearly worse. A lamp that is
/// assigned to another candidate does not compete, unless the phase indicates that this candidate
/// is a part or a mirror image of it.
void assign_lamp(const Claims& claims, RegionCandidate& candidate) {
  const auto& fits = candidate.lamp_fits;
  if (fits.empty() || !candidate.is_modulated || candidate.is_other_period) return;
  candidate.lamp = choose_lamp(fits, [&](std::size_t i) {
    return claims[i] == nullptr || are_in_phase(candidate, fits[i], *claims[i], claims[i]->fit);
  });
  if (candidate.lamp) candidate.fit = fits[*candidate.lamp];
}

/// Returns |sum z| / sum |z| over the cells of a region, where z is the complex amplitude of a cell
/// at the given period: 1 if all parts of the region are modulated in phase.
double compute_phase_coherence(const CellLevels& cells, const ModulationMap& map,
                               const ModulatedRegion& region, double period_lines) {
  const double period = period_lines / cells.lines_per_bin;
  std::vector<std::complex<double>> carrier;
  carrier.reserve(static_cast<std::size_t>(cells.bins));
  for (int bin = 0; bin < cells.bins; ++bin)
    carrier.push_back(std::polar(1.0, -2 * std::numbers::pi * (bin + 0.5) / period));
  std::complex<double> sum;
  double amplitudes = 0;
  for (const auto& [step, begin, end] : region.spans) {
    const double middle = (map.middle_of_step(step) + 0.5 - cells.box.y) / cells.lines_per_bin;
    const int first = std::max(0, static_cast<int>(std::ceil(middle - period)));
    const int last = std::min(cells.bins, static_cast<int>(std::floor(middle + period)));
    for (int x = begin; x < end; x += kCellWidth_px) {
      const int cell = (x - cells.box.x) / kCellWidth_px;
      std::complex<double> z;
      for (int bin = first; bin < last; ++bin) {
        const double weight = std::max(0.0, period - std::abs(bin + 0.5 - middle));
        z += weight * double(cells.levels_of_bin(bin)[cell]) * carrier[std::size_t(bin)];
      }
      sum += z;
      amplitudes += std::abs(z);
    }
  }
  return amplitudes > 0 ? std::abs(sum) / amplitudes : 0;
}

/// Returns the number of periods in a region. The window of two periods widens the region by half a
/// period on both sides.
double count_periods(const RegionCandidate& candidate) {
  return std::max(0.0, candidate.region.box.height / candidate.fit.period_lines - 1);
}

RegionCandidate examine_region(const CellLevels& cells, const ModulationMap& map,
                               ModulatedRegion region, std::span<const double> lamp_periods_lines,
                               double min_period_lines) {
  RegionCandidate candidate{std::move(region), {}, {}, {}, {}, 0, false, false, false};
  double margin = min_period_lines;
  for (const double period : lamp_periods_lines) margin = std::max(margin, period);
  candidate.profile = compute_profile(cells, map, candidate.region, margin);
  const LineProfile& profile = candidate.profile;
  candidate.fit = fit_best_period(profile, min_period_lines);
  candidate.lamp_fits = fit_lamp_periods(profile, lamp_periods_lines);
  if (!lamp_periods_lines.empty()) {
    const PeriodFit& lamp = candidate.lamp_fits[select_best_lamp(candidate.lamp_fits)];
    candidate.is_other_period = compute_log_ratio(candidate.fit, lamp) > kMinLogRatio;
    if (!candidate.is_other_period) candidate.fit = lamp;
  }
  candidate.phase_coherence =
      compute_phase_coherence(cells, map, candidate.region, candidate.fit.period_lines);
  // Few periods are significant only if they match a lamp.
  const bool has_lamp_period = !lamp_periods_lines.empty() && !candidate.is_other_period;
  const double min_periods = has_lamp_period ? kMinPeriods : kMinReliablePeriods;
  candidate.is_modulated = candidate.fit.unexplained_fraction < kMaxUnexplained &&
                           candidate.fit.depth > kMinLightDepth &&
                           candidate.phase_coherence > kMinPhaseCoherence &&
                           count_periods(candidate) > min_periods;
  return candidate;
}

/// Returns true if two candidates are parts of one light.
bool are_one_light(const RegionCandidate& a, const RegionCandidate& b) {
  if (a.lamp != b.lamp) return false;
  const double ratio = a.fit.period_lines / b.fit.period_lines;
  if (!a.lamp && std::abs(ratio - 1) > 2 * kLampDrift) return false;
  const auto size = [](const RegionCandidate& c) {
    return std::max(c.region.box.width, c.region.box.height);
  };
  if (2 * compute_box_gap_px(a.region.box, b.region.box) > std::max(size(a), size(b))) return false;
  return are_in_phase(a, a.fit, b, b.fit);
}

/// Area of cells above a level, and the sums for their centroid.
struct LitArea {
  double cells = 0, energy = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();

  Eigen::Vector2d center() const { return sum / cells; }
};

/// Adds the cells of a region that are above each fraction of `peak`.
template <std::size_t n>
void add_region_area(const ModulationMap& map, const ModulatedRegion& region, double peak,
                     const std::array<double, n>& fractions, std::array<LitArea, n>& areas) {
  for (const auto& [step, begin, end] : region.spans) {
    const double line = map.middle_of_step(step);
    for (int x = begin; x < end; x += kCellWidth_px) {
      const double amplitude = map.amplitude[map.cell_index(step, (x - map.box.x) / kCellWidth_px)];
      for (std::size_t i = 0; i < n; ++i) {
        if (amplitude < fractions[i] * peak) continue;
        areas[i].sum += Eigen::Vector2d(x + (kCellWidth_px - 1) / 2.0, line);
        areas[i].energy += amplitude;
        ++areas[i].cells;
      }
    }
  }
}

Stripes measure_candidate(const RegionCandidate& candidate) {
  Stripes stripes = measure_stripes_of_period(candidate.profile, candidate.fit.period_lines);
  stripes.periods = count_periods(candidate);
  stripes.coherence = candidate.phase_coherence;
  return stripes;
}

/// Returns the largest mean level in the columns of a span, at a step.
float get_largest_mean(const ModulationMap& map, const ModulatedRegion::Span& span, int step) {
  float largest = 0;
  for (int x = span.begin; x < span.end; x += kCellWidth_px) {
    const int cell = (x - map.box.x) / kCellWidth_px;
    largest = std::max(largest, map.mean[map.cell_index(step, cell)]);
  }
  return largest;
}

/// Returns the box of a region, extended to the first and last scanline of the searched box if the
/// region continues there. A region may end within a period of them, because the half of the
/// filter's window that is outside counts as dark. The other half contains a quarter of the mean
/// level if a dark stripe is at the border.
PixelBox extend_box(const ModulationMap& map, const ModulatedRegion& region, double period_lines) {
  PixelBox box = region.box;
  float peak = 0;
  for (const auto& span : region.spans) {
    peak = std::max(peak, get_largest_mean(map, span, span.step));
  }
  for (const auto& span : region.spans) {
    for (const int border : {0, map.steps - 1}) {
      const bool is_near = std::abs(span.step - border) * map.lines_per_step < period_lines;
      if (!is_near || 4 * get_largest_mean(map, span, border) < kBorderFraction * peak) continue;
      box = enclosing_box(box, {span.begin, map.box.y + border * map.lines_per_step,
                                span.end - span.begin, map.lines_per_step});
    }
  }
  return box;
}

ModulatedLight make_light(const ModulationMap& map,
                          const std::vector<const RegionCandidate*>& parts) {
  // The whole area, and the areas above a quarter and a half of the brightest level.
  constexpr std::array<double, 3> fractions{0, 0.25, 0.5};
  const RegionCandidate& brightest = **std::max_element(
      parts.begin(), parts.end(),
      [](auto* a, auto* b) { return a->region.peak_amplitude < b->region.peak_amplitude; });
  ModulatedLight light{brightest.region.box,
                       {},
                       0,
                       0,
                       brightest.fit,
                       brightest.lamp,
                       measure_candidate(brightest),
                       0,
                       0,
                       brightest.is_split_off};
  constexpr double min_duty = 0.1;
  const double duty = std::clamp(light.stripes.duty, min_duty, 1 - min_duty);
  light.peak_level =
      std::numbers::pi / 2 / std::sin(std::numbers::pi * duty) * brightest.region.peak_amplitude;
  std::array<LitArea, fractions.size()> areas;
  for (const RegionCandidate* part : parts) {
    // Darker parts are light that the lamp casts on its surroundings.
    if (part->region.peak_amplitude < double(kBorderFraction) * brightest.region.peak_amplitude)
      continue;
    light.box = enclosing_box(light.box, extend_box(map, part->region, brightest.fit.period_lines));
    add_region_area(map, part->region, brightest.region.peak_amplitude, fractions, areas);
  }
  light.energy = areas[0].energy;
  light.center = areas[0].center();
  const double cell_px2 = double(kCellWidth_px) * map.lines_per_step;
  light.radius_px = std::sqrt(areas[0].cells * cell_px2 / std::numbers::pi);
  double asymmetry_px = 0;
  for (std::size_t i = 1; i < areas.size(); ++i) {
    const double apart_px = (areas[i].center() - light.center).norm() / std::numbers::sqrt2;
    asymmetry_px = std::max(asymmetry_px, apart_px);
  }
  light.center_sd_px = std::hypot(asymmetry_px, light.radius_px / std::numbers::sqrt2);
  return light;
}

/// Joins candidates that belong together to lights.
std::vector<ModulatedLight> join_candidates(const ModulationMap& map,
                                            std::vector<RegionCandidate>& candidates) {
  std::erase_if(candidates, [](const RegionCandidate& c) { return !c.is_modulated; });
  std::vector<ModulatedLight> lights;
  std::vector<bool> used(candidates.size(), false);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (used[i]) continue;
    std::vector<const RegionCandidate*> parts{&candidates[i]};
    used[i] = true;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      for (std::size_t j = i + 1; j < candidates.size(); ++j) {
        if (used[j] || !are_one_light(*parts[k], candidates[j])) continue;
        used[j] = true;
        parts.push_back(&candidates[j]);
      }
    }
    lights.push_back(make_light(map, parts));
  }
  // Near a lamp, lights without a lamp are light that the lamp casts on its surroundings.
  std::erase_if(lights, [&](const ModulatedLight& light) {
    return !light.lamp &&
           std::any_of(lights.begin(), lights.end(), [&](const ModulatedLight& other) {
             return other.lamp && other.energy > light.energy &&
                    compute_box_gap_px(light.box, other.box) <
                        std::max(other.box.width, other.box.height) / 2;
           });
  });
  return lights;
}

/// Returns the periods for demodulation: those of the lamps, or a bank of overlapping filters if
/// these are unknown.
std::vector<double> choose_search_periods(std::span<const double> lamp_periods_lines, int lines) {
  constexpr double bank_ratio = 1.15, min_bank_lines = 4;
  std::vector<double> periods;
  for (const double period : lamp_periods_lines) {
    if (period >= kMinPeriod_lines) periods.push_back(period);
  }
  if (!lamp_periods_lines.empty()) return periods;
  for (double period = min_bank_lines; period < lines / kMinPeriods; period *= bank_ratio) {
    periods.push_back(period);
  }
  return periods;
}

/// Searched part of the image.
struct BoxSearch {
  ModulationMap map;
  std::vector<RegionCandidate> candidates;
};

std::optional<BoxSearch> search_box(const ImageView& lines, const PixelBox& box,
                                    const Background& background,
                                    std::span<const double> lamp_periods_lines) {
  // Noise of at least one gray level is assumed.
  constexpr double min_noise = 1;
  const auto periods = choose_search_periods(lamp_periods_lines, box.height);
  if (periods.empty()) return std::nullopt;
  const double shortest = *std::min_element(periods.begin(), periods.end());
  const int lines_per_bin = std::max(1, static_cast<int>(shortest / kBinsPerPeriod));
  const CellLevels cells = average_over_cells(lines, box, background.level, lines_per_bin);
  const bool splits_by_phase = !lamp_periods_lines.empty();
  BoxSearch result{make_modulation_map(cells, periods, splits_by_phase), {}};
  const double noise = std::max(min_noise, background.noise);
  const double min_amplitude = compute_min_amplitude(noise, shortest);
  const auto examine = [&](ModulatedRegion region) {
    return examine_region(cells, result.map, std::move(region), lamp_periods_lines,
                          std::max(kMinPeriod_lines, shortest / 2));
  };
  for (ModulatedRegion& region : list_modulated_regions(result.map, min_amplitude)) {
    if (region.cells >= kMinCells) result.candidates.push_back(examine(std::move(region)));
  }
  const auto contains = [](const RegionCandidate& candidate, const PixelBox& box) {
    return 2 * intersect_boxes(candidate.region.box, box).area_px() > box.area_px();
  };
  const auto is_out_of_phase = [](const RegionCandidate& candidate) {
    return candidate.phase_coherence < kMinPhaseCoherence;
  };
  if (!splits_by_phase || std::ranges::none_of(result.candidates, is_out_of_phase)) return result;
  std::vector<RegionCandidate> parts;
  for (ModulatedRegion& region : list_modulated_regions(result.map, min_amplitude, true)) {
    if (region.cells < kMinCells ||
        std::ranges::none_of(result.candidates, [&](const RegionCandidate& candidate) {
          return is_out_of_phase(candidate) && contains(candidate, region.box);
        }))
      continue;
    parts.push_back(examine(std::move(region)));
    parts.back().is_split_off = true;
  }
  std::ranges::move(parts, std::back_inserter(result.candidates));
  return result;
}

}  // namespace

std::vector<ModulatedLight> detect_modulated_lights(const ImageView& lines,
                                                    std::span<const PixelBox> boxes,
                                                    const Background& background,
                                                    std::span<const double> lamp_periods_lines) {
  std::vector<BoxSearch> searches;
  for (const PixelBox& box : boxes) {
    if (auto found = search_box(lines, box, background, lamp_periods_lines)) {
      searches.push_back(std::move(*found));
    }
  }
  const Claims none(lamp_periods_lines.size(), nullptr);
  Claims claims = none;
  for (BoxSearch& each : searches) {
    for (RegionCandidate& candidate : each.candidates) assign_lamp(none, candidate);
  }
  for (const BoxSearch& each : searches) {
    for (const RegionCandidate& candidate : each.candidates) {
      if (!candidate.lamp) continue;
      const RegionCandidate*& claim = claims[*candidate.lamp];
      if (claim == nullptr || claim->region.peak_amplitude < candidate.region.peak_amplitude)
        claim = &candidate;
    }
  }
  for (BoxSearch& each : searches) {
    for (RegionCandidate& candidate : each.candidates) {
      if (!candidate.lamp) assign_lamp(claims, candidate);
    }
  }
  std::vector<ModulatedLight> lights;
  for (BoxSearch& each : searches) {
    for (ModulatedLight& light : join_candidates(each.map, each.candidates)) {
      lights.push_back(std::move(light));
    }
  }
  return lights;
}

std::optional<std::size_t> identify_lamp_period(const LineProfile& profile,
                                                std::span<const double> lamp_periods_lines) {
  if (lamp_periods_lines.empty() || profile.levels.empty()) return std::nullopt;
  const std::vector<PeriodFit> fits = fit_lamp_periods(profile, lamp_periods_lines);
  const auto lamp = choose_lamp(fits, [](std::size_t) { return true; });
  if (!lamp || fits[*lamp].depth <= kMinLightDepth || fits[*lamp].periods < kMinPeriods)
    return std::nullopt;
  const double shortest = *std::ranges::min_element(lamp_periods_lines);
  const PeriodFit any = fit_best_period(profile, std::max(kMinPeriod_lines, shortest / 2));
  return compute_log_ratio(any, fits[*lamp]) > kMinLogRatio ? std::nullopt : lamp;
}

Stripes measure_stripes_of_period(const LineProfile& profile, double period_lines) {
  const PeriodFit fit = fit_period_near(profile, period_lines, 2 * kLampDrift);
  Stripes stripes = measure_stripes(divide_by_envelope(profile, fit.period_lines));
  stripes.period_lines = fit.period_lines;
  stripes.periods = fit.periods;
  stripes.periodicity_r2 = 1 - fit.unexplained_fraction;
  stripes.is_regular = true;
  return stripes;
}

}  // namespace vlp
