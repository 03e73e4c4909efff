// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "frontend/observation.h"
#include "geometry/polygon.h"
#include "session/lens_step.h"
#include "support/observed_view.h"

namespace vlp {

/// Places of a board, each anywhere in these ranges.
struct Places {
  struct Range {
    double from, to;
    double any(Random& random) const { return random.uniform(from, to); }
  };
  /// Center of the board relative to that of the image, as fractions of the image size.
  Range u{-0.5, 0.5}, v{-0.5, 0.5};
  Range tilt_deg{0, 45};
  /// Distance over what fills the image with the board.
  Range distance{0.8, 1.8};
  /// The direction of the axis about which the board tilts.
  Range axis_rad{-3.2, 3.2};
};

/// Kind of an insufficient set of views: its places, used cyclically, and views of each place.
struct Thin {
  const char* name;
  int min_places, max_places;
  std::vector<Places> places;
  int copies = 1;
  /// Variation of the views of a place, in degrees and in hundredths of the image.
  double shake = 0;
};

inline const std::vector<Thin>& thin_kinds() {
  static const std::vector<Thin> kinds{
      {"one corner", 10, 30, {{{0.25, 0.45}, {0.25, 0.45}, {0, 30}, {1.8, 2.5}}}},
      {"alike in one corner", 1, 2, {{{0.2, 0.3}, {0.2, 0.3}, {10, 40}, {1.6, 2}}}, 30, 0.5},
      {"the middle", 10, 30, {{{-0.1, 0.1}, {-0.1, 0.1}, {0, 40}, {1.5, 3}}}},
      {"hardly tilted", 8, 30, {{.tilt_deg = {0, 6}}}},
      {"one distance", 8, 30, {{.distance = {1.2, 1.22}}}},
      {"one distance, hardly tilted", 8, 20, {{.tilt_deg = {0, 12}, .distance = {1.2, 1.25}}}},
      {"near copies", 3, 5, {{.tilt_deg = {0, 40}, .distance = {0.9, 1.8}}}, 6, 3},
      {"copies but for the noise", 3, 7, {{}}, 6},
      {"few", 3, 7, {{}}},
      {"half of the image", 6, 20, {{{-0.5, 0}, {-0.5, 0}, {0, 40}, {1.2, 2}}}},
      {"a strip", 6, 20, {{.v = {0.2, 0.45}, .tilt_deg = {0, 40}, .distance = {1.5, 2.5}}}},
      {"hardly tilted, and one corner",
       8,
       30,
       {{.tilt_deg = {0, 5}}, {{0.25, 0.45}, {0.25, 0.45}, {20, 40}, {1.8, 2.5}}}},
      {"tilted about one axis", 6, 20, {{.tilt_deg = {0, 40}, .axis_rad = {0.4, 0.5}}}},
      {"far", 8, 30, {{.distance = {3, 5}}}},
      {"good", 16, 36, {{}}}};
  return kinds;
}

/// A set of views, and the lens through which they were seen.
struct ThinSet {
  LensInput input;
  Lens lens;
};

inline Lens lens_of_thin_set(Random& random) {
  const double focal_px = random.uniform(400, 900), bent = random.uniform(0, 1);
  return {LensModel::opencv8,
          std::array{focal_px, focal_px, 400 + 20 * bent, 295.0, -0.25 * bent, 0.08 * bent, 2e-4,
                     -3e-4 * bent, -0.012 * bent, 0.01 * bent, 0.002 * bent, 1e-4 * bent}};
}

/// Makes a set of views of a plain board, its tags shrunk if `shrinks`, or of a Kalibr board, whose
/// squares prevent shrinking.
inline ThinSet thin_set(const Thin& thin, bool kalibr, bool shrinks, Random& random) {
  constexpr double noise_px = 0.05, rad = std::numbers::pi / 180;
  const Lens lens = lens_of_thin_set(random);
  const SyntheticViews views{synthetic_board(kalibr), lens};
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::automatic};
  input.camera.lens_model = LensModel::opencv8;
  const BoardLattice lattice(views.board);
  const double fill_m =
      lens.focal_px().x() * compute_tag_field_size_m(views.board).x() / views.imager_px[0];
  const auto places = static_cast<std::size_t>(thin.min_places) +
                      random.index(static_cast<std::size_t>(thin.max_places - thin.min_places + 1));
  for (std::size_t place = 0; place < places;) {
    const Places& from = thin.places[place % thin.places.size()];
    const double u = from.u.any(random), v = from.v.any(random);
    const double z_m = fill_m * from.distance.any(random);
    const double axis_rad = from.axis_rad.any(random), tilt_deg = from.tilt_deg.any(random);
    const double roll_rad = random.uniform(-3.2, 3.2);
    const double shift_px = shrinks && !kalibr ? random.uniform(-0.1, 0.4) : 0;
    bool any = false;
    for (int copy = 0; copy < thin.copies; ++copy) {
      const auto shaken = [&] { return thin.shake * random.uniform(-1, 1); };
      const double du = 0.01 * shaken(), dv = 0.01 * shaken();
      const Eigen::Matrix3d rotation =
          Eigen::AngleAxisd((tilt_deg + shaken()) * rad,
                            Eigen::Vector3d(std::cos(axis_rad), std::sin(axis_rad), 0)) *
          Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      const Eigen::Vector3d middle((u + du) * views.imager_px[0], (v + dv) * views.imager_px[1],
                                   lens.focal_px().x());
      BoardDetection seen = views.view(rotation, middle * (z_m / middle.z()), random, noise_px);
      if (!lattice.can_determine_pose(seen)) continue;
      any = true;
      for (TagDetection& tag : seen.tags) tag = shrunk(tag, shift_px);
      std::string name = std::to_string(place);
      name.append("-").append(std::to_string(copy)).append(".png");
      input.observations.images.push_back(observed({name, views.imager_px, seen}));
    }
    if (any) ++place;
  }
  reject_repeated_images(input.observations.images, ImageUse::boards, {});
  return {std::move(input), lens};
}

/// Returns the largest error in the calibrated region divided by the largest reported one. Returns
/// std::nullopt if no lens is found or a gate fails.
inline std::optional<double> error_over_stated(const ThinSet& set) {
  const LensResult result = run_lens_step(set.input, {});
  if (!result.has_succeeded() ||
      !describe_failed_gates(check_gates(make_lens_gates(), result.metrics)).empty()) {
    return {};
  }
  const auto difference = compare_projections(
      set.lens, result.lens.solution.fitted_lens(), result.lens.solution.problem.imager_px,
      [&](const Eigen::Vector2d& pixel) {
        return polygon_contains(result.lens.report.region, pixel) ? 1.0 : INFINITY;
      });
  return difference ? difference->worst_px / result.lens.report.uncertainty_worst_px : INFINITY;
}

}  // namespace vlp
