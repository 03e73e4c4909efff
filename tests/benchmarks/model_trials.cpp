// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// model_trials CORNERS BOARD WIDTH HEIGHT [SETS [VIEWS]]: selects the lens model from random
/// subsets of the views of a corner file, and compares their lenses with that of all views.
///
/// SETS is the number of subsets (default 40) of VIEWS views each (default 7), in their order.
/// States the selected models and the differences over the region of the subset: median, 90 %
/// quantile, and the ratios to what is stated. Exit code 1 if a selected model has a larger
/// held-out residual than a model that is rejected.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "calibration/intrinsics/lens_estimate.h"
#include "calibration/intrinsics/projection_difference.h"
#include "frontend/board_intake.h"
#include "geometry/polygon.h"
#include "support/random.h"

namespace vlp {
namespace {

double quantile(std::vector<double> values, double fraction) {
  std::ranges::sort(values);
  return values.empty() ? NAN
                        : values[static_cast<std::size_t>(fraction * double(values.size() - 1))];
}

/// Returns true if no rejected model has a smaller held-out residual than the selected one.
bool is_selected_below_rejected(const LensChoice& choice) {
  const auto selected = std::ranges::find(choice.candidates, choice.model, &LensCandidate::model);
  return std::ranges::none_of(choice.candidates, [&](const LensCandidate& candidate) {
    return candidate.is_rejected() && candidate.rms_px < selected->rms_px;
  });
}

bool try_subsets(const std::vector<BoardView>& views, const Board& board, int sets,
                 std::size_t count) {
  const LensEstimate all =
      estimate_lens({.views = views, .board = board, .choose_lens_model = true});
  if (!all.has_succeeded() || !all.choice) {
    fmt::print("all views: no lens: {}\n", all.problem);
    return false;
  }
  fmt::print("all {} views: {}\n", views.size(), describe_lens_choice(*all.choice));
  std::map<std::string, int> selected;
  std::vector<double> errors_px, ratios;
  int inconsistent = 0;
  for (int set = 0; set < sets; ++set) {
    Random random(static_cast<std::uint64_t>(set));
    LensViews input{.views = views, .board = board, .choose_lens_model = true};
    while (input.views.size() > count)
      input.views.erase(input.views.begin() + static_cast<long>(random.index(input.views.size())));
    const LensEstimate result = estimate_lens(input);
    if (!result.has_succeeded() || !result.choice) {
      ++selected["none"];
      continue;
    }
    ++selected[std::string(lens_model_name(result.choice->model))];
    if (!is_selected_below_rejected(*result.choice)) ++inconsistent;
    const auto difference =
        compare_projections(all.solution.fitted_lens(), result.solution.fitted_lens(),
                            all.solution.problem.imager_px, [&](const Eigen::Vector2d& pixel) {
                              return polygon_contains(result.report.region, pixel) ? 1.0 : INFINITY;
                            });
    if (!difference) continue;
    errors_px.push_back(difference->worst_px);
    ratios.push_back(difference->worst_px / result.report.uncertainty_worst_px);
  }
  for (const auto& [model, times] : selected) fmt::print("  {:20} {}\n", model, times);
  fmt::print("largest difference: median {:.2f}, 90 % {:.2f} px; over stated {:.2f}, {:.2f}\n",
             quantile(errors_px, 0.5), quantile(errors_px, 0.9), quantile(ratios, 0.5),
             quantile(ratios, 0.9));
  fmt::print("selected above a rejected model: {}\n", inconsistent);
  return inconsistent == 0;
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  constexpr int default_sets = 40, default_views = 7;
  if (argc < 5) {
    fmt::print("model_trials CORNERS BOARD WIDTH HEIGHT [SETS [VIEWS]]\n");
    return 2;
  }
  const vlp::Board board = vlp::read_board(argv[2]);
  const auto observations =
      vlp::read_board_views(argv[1], board, argv[2], {std::atoi(argv[3]), std::atoi(argv[4])}, {});
  const int sets = argc > 5 ? std::atoi(argv[5]) : default_sets;
  const int views = argc > 6 ? std::atoi(argv[6]) : default_views;
  return vlp::try_subsets(vlp::collect_board_views(observations.images), board, sets,
                          static_cast<std::size_t>(views))
             ? 0
             : 1;
}
