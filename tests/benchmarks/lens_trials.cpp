// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// lens_trials [SETS]: calibrates lenses from random sets of views with known truth, and counts
/// wrong lenses that were accepted.
///
/// Each set has another lens and 8 to 36 views of a plain or Kalibr board with 0.05 px of corner
/// noise. The boards are tilted by up to 60 degrees and partly out of view. In every fourth set one
/// view is corrupted.
///
/// A lens is accepted if it is solved and passes the default gates. It is wrong if its RMS error
/// per axis exceeds both four times the error expected from noise and 0.02 px. Exit code 1 if a
/// wrong lens was accepted.
#include <fmt/core.h>

#include <cstdlib>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "session/lens_step.h"

namespace vlp {
namespace {

struct Counts {
  int num_accepted = 0, wrong = 0, refused = 0, unsolved = 0;
  double max_ratio = 0;
};

Lens random_lens(Random& random) {
  const double focal_px = random.uniform(350, 1200), bent = random.uniform(0, 1);
  const std::array parameters{focal_px,
                              focal_px * random.uniform(0.995, 1.005),
                              399.5 + random.uniform(-20, 20),
                              299.5 + random.uniform(-20, 20),
                              -0.25 * bent,
                              0.08 * bent,
                              random.uniform(-5e-4, 5e-4),
                              random.uniform(-5e-4, 5e-4),
                              -0.012 * bent,
                              0.01 * bent,
                              0.002 * bent,
                              0.0001 * bent};
  return Lens(LensModel::opencv8, parameters);
}

void spoil(std::vector<BoardLattice::Corner>& view) {
  for (auto& corner : view) corner.pixel.x() += 40 * std::sin(corner.pixel.y() / 15);
}

void try_set(int set, Counts& counts) {
  constexpr double noise_px = 0.05, steep_rad = 1.05, apart = 4, small_px = 0.02;
  Random random(1000 + static_cast<std::uint64_t>(set));
  SyntheticViews views{synthetic_board(set % 2 == 1), random_lens(random)};
  views.tilt_rad = steep_rad;
  IntrinsicsInput input = views.input(8 + static_cast<int>(random.index(29)), random, noise_px);
  if (set % 4 == 3) spoil(input.views[random.index(input.views.size())]);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  if (!solution.has_succeeded()) {
    ++counts.unsolved;
    return;
  }
  const CalibrationReport report = make_lens_report(solution, input);
  LensEstimate lens;
  lens.solution = solution;
  lens.report = report;
  lens.coverage = measure_view_coverage(solution, input);
  const auto metrics = collect_lens_metrics(lens);
  if (!describe_failed_gates(check_gates(make_lens_gates(), metrics)).empty()) {
    ++counts.refused;
    return;
  }
  ++counts.num_accepted;
  const auto difference = compare_projections(views.lens, solution.fitted_lens(), views.imager_px,
                                              [](const auto&) { return 1; });
  const double ratio = difference ? difference->rms_px / report.expected_rms_px : INFINITY;
  counts.max_ratio = std::max(counts.max_ratio, ratio);
  if (!difference || (ratio > apart && difference->rms_px > small_px)) {
    ++counts.wrong;
    fmt::print("set {}: {} views, {:.3f} px apart, expected {:.3f}\n", set, input.views.size(),
               difference ? difference->rms_px : INFINITY, report.expected_rms_px);
  }
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  constexpr int default_sets = 200;
  const int sets = argc > 1 ? std::atoi(argv[1]) : default_sets;
  vlp::Counts counts;
  for (int set = 0; set < sets; ++set) vlp::try_set(set, counts);
  fmt::print("{} sets: {} called good, of which {} wrong; {} refused by a gate, {} not solved\n",
             sets, counts.num_accepted, counts.wrong, counts.refused, counts.unsolved);
  fmt::print("largest error of a good one over what was expected: {:.2f}\n", counts.max_ratio);
  return counts.wrong == 0 && counts.num_accepted > 0 ? 0 : 1;
}
