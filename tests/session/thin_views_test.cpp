// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Sets of board views that do not tell enough, as people take them: no gate may be met where the
/// lens is worse than it says.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "session/lens_step.h"

namespace vlp {
namespace {

/// How a set is thin.
struct Thin {
  const char* name;
  int least_views, most_views;
  /// Where the board's middle is, as shares of the image from its middle.
  double from, to;
  double tilt_deg;
  /// Over what fills the image with the board.
  double nearest, farthest;
  /// Views around each place: its shake in degrees and shares of the image.
  int copies;
};

constexpr Thin kKinds[] = {{"one corner", 10, 30, 0.25, 0.45, 30, 1.8, 2.5, 1},
                           {"the middle", 10, 30, -0.1, 0.1, 40, 1.5, 3, 1},
                           {"hardly tilted", 8, 30, -0.5, 0.5, 6, 0.8, 1.8, 1},
                           {"one distance, hardly tilted", 8, 20, -0.4, 0.4, 12, 1.2, 1.25, 1},
                           {"copies", 3, 5, -0.4, 0.4, 40, 0.9, 1.8, 6},
                           {"few", 3, 7, -0.5, 0.5, 45, 0.8, 1.8, 1},
                           {"half of the image", 6, 20, -0.5, 0, 40, 1.2, 2, 1},
                           {"good", 16, 36, -0.5, 0.5, 45, 0.8, 1.8, 1}};

Lens lens_of(Random& random) {
  std::array<double, 12> parameters{};
  const double focal_px = random.uniform(400, 900), bent = random.uniform(0, 1);
  parameters = {focal_px, focal_px,     400 + 20 * bent, 295,         -0.25 * bent, 0.08 * bent,
                2e-4,     -3e-4 * bent, -0.012 * bent,   0.01 * bent, 0.002 * bent, 1e-4 * bent};
  return {LensModel::opencv8, parameters};
}

LensInput thin_set(const Thin& thin, SyntheticViews& views, Random& random) {
  constexpr double noise_px = 0.05, rad = std::numbers::pi / 180;
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::automatic};
  input.camera.lens_model = LensModel::opencv8;
  const auto places =
      static_cast<std::size_t>(thin.least_views) +
      random.index(static_cast<std::size_t>(thin.most_views - thin.least_views + 1));
  const double fill_m = views.lens.focal_px().x() * tag_field_m(views.board).x() / 800;
  const BoardLattice lattice(views.board);
  for (std::size_t place = 0; place < places;) {
    const double u = random.uniform(thin.from, thin.to), v = random.uniform(thin.from, thin.to);
    const double z_m = fill_m * random.uniform(thin.nearest, thin.farthest);
    const double azimuth = random.uniform(-3.2, 3.2);
    const double tilt = random.uniform(0, thin.tilt_deg), roll = random.uniform(-3.2, 3.2);
    bool any = false;
    for (int copy = 0; copy < thin.copies; ++copy) {
      const double shake = thin.copies > 1 ? 1 : 0;
      const double du = 0.03 * shake * random.uniform(-1, 1);
      const double dv = 0.03 * shake * random.uniform(-1, 1);
      const double dt = 2 * shake * random.uniform(-1, 1);
      const Eigen::Matrix3d rotation =
          Eigen::AngleAxisd((tilt + dt) * rad,
                            Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      const Eigen::Vector3d middle((u + du) * 800, (v + dv) * 600, views.lens.focal_px().x());
      const SeenBoard seen = views.view(rotation, middle * (z_m / middle.z()), random, noise_px);
      if (!lattice.enough(seen)) continue;
      any = true;
      std::string name = std::to_string(place);
      name.append("-").append(std::to_string(copy)).append(".png");
      input.views.push_back({name, views.imager_px, seen});
    }
    if (any) ++place;
  }
  return input;
}

TEST(ThinViews, AreNotCalledGoodWhereTheyAreNot) {
  constexpr int sets = 24;
  constexpr double sigmas = 3;
  int good = 0;
  for (int set = 0; set < sets; ++set) {
    Random random(500 + static_cast<std::uint64_t>(set));
    const Thin& thin = kKinds[static_cast<std::size_t>(set) % std::size(kKinds)];
    const Lens lens = lens_of(random);
    SyntheticViews views{synthetic_board(set / 8 % 2 == 1), lens};
    const LensResult result = solve_lens(thin_set(thin, views, random), {});
    if (!result.ok()) continue;
    const auto missed = words_of_missed(check_gates(lens_gates(), result.metrics));
    const auto difference = projection_difference(
        lens, result.solution.lens(), views.imager_px, [&](const Eigen::Vector2d& pixel) {
          return lies_in(result.report.region, pixel) ? 1.0 : INFINITY;
        });
    const double worst_px = difference ? difference->worst_px : INFINITY;
    if (!missed.empty()) continue;
    if (thin.name == std::string("good")) ++good;
    EXPECT_LE(worst_px, sigmas * result.report.uncertainty_worst_px)
        << "set " << set << ", " << thin.name;
  }
  EXPECT_GT(good, sets / 10) << "sets that are not thin pass";
}

}  // namespace
}  // namespace vlp
