// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// thin_trials [SETS]: calibrates lenses from weak sets of views with known truth, and checks that
/// the default gates pass no lens with an underestimated error. Such an error is above three times
/// the largest reported uncertainty, anywhere in the covered region.
///
/// Each set has another lens; boards are plain, plain and shrunk by a tone curve, or Kalibr's. Exit
/// code 1 if such a lens passed, or if no accurate lens did.
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "session/thin_sets.h"

namespace vlp {
namespace {

struct Counts {
  int sets = 0, passed = 0, worse = 0;
  double max_ratio = 0;
};

bool try_sets(int sets) {
  constexpr double sigmas = 3;
  const std::vector<Thin>& kinds = thin_kinds();
  std::vector<Counts> counts_by_kind(kinds.size());
  for (int set = 0; set < sets; ++set) {
    const auto index = static_cast<std::size_t>(set);
    const std::size_t kind = index % kinds.size(), board = index / kinds.size() % 3;
    Random random(2000 + index);
    Counts& counts = counts_by_kind[kind];
    ++counts.sets;
    const auto ratio = error_over_stated(thin_set(kinds[kind], board == 1, board == 2, random));
    if (!ratio) continue;
    ++counts.passed;
    counts.max_ratio = std::max(counts.max_ratio, *ratio);
    if (*ratio <= sigmas) continue;
    ++counts.worse;
    fmt::print("set {}: {}, {:.2f} times what is stated\n", set, kinds[kind].name, *ratio);
  }
  Counts all;
  fmt::print("{:30} {:>5} {:>7} {:>6} {:>24}\n", "", "sets", "passed", "worse",
             "largest error over stated");
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
    const Counts& counts = counts_by_kind[kind];
    fmt::print("{:30} {:5} {:7} {:6} {:24.2f}\n", kinds[kind].name, counts.sets, counts.passed,
               counts.worse, counts.max_ratio);
    all.sets += counts.sets;
    all.passed += counts.passed;
    all.worse += counts.worse;
    all.max_ratio = std::max(all.max_ratio, counts.max_ratio);
  }
  fmt::print("{:30} {:5} {:7} {:6} {:24.2f}\n", "all", all.sets, all.passed, all.worse,
             all.max_ratio);
  return all.worse == 0 && (counts_by_kind.back().sets == 0 || counts_by_kind.back().passed > 0);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  constexpr int default_sets = 400;
  return vlp::try_sets(argc > 1 ? std::atoi(argv[1]) : default_sets) ? 0 : 1;
}
