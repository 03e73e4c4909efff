// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_intrinsics.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "camera/spline_grid.h"
#include "geometry/angles.h"
#include "geometry/median.h"

namespace vlp {

void print_summary(const IntrinsicsSolution& solution, const CalibrationReport& report,
                   const ViewCoverage& coverage, const HeldOut& held_out) {
  const auto& parameters = solution.problem.intrinsics;
  fmt::print("views         {} used, {} dropped\n", solution.views.size(), solution.dropped.size());
  fmt::print("corners       {}, {} outliers\n", solution.corners, solution.outliers);
  fmt::print("rms           {:.3f} px per axis\n", solution.rms_px);
  if (std::any_of(solution.edge_shifts_px.begin(), solution.edge_shifts_px.end(),
                  [](double shift_px) { return shift_px != 0; })) {
    const double shift_px = upper_median(solution.edge_shifts_px);
    fmt::print("edges         {:.3f} px towards the {}, taken out\n", std::abs(shift_px),
               shift_px < 0 ? "light" : "dark");
  }
  fmt::print("focal length  {:.2f}, {:.2f} px", parameters[0], parameters[1]);
  if (is_splined(solution.problem.lens_model)) {
    fmt::print(", which {} control points make up for\n",
               grid_of(solution.problem.lens_model).control_points());
  } else {
    fmt::print(", sd {:.2f} by noise, {:.2f} by views\n", report.focal_sd_px,
               report.focal_sd_by_views_px);
  }
  fmt::print("center        {:.2f}, {:.2f} px\n", parameters[2], parameters[3]);
  fmt::print("uncertainty   {:.3f} px mean, {:.3f} px worst\n", report.uncertainty_mean_px,
             report.uncertainty_worst_px);
  if (report.region_fraction > 0.999) {
    fmt::print("board seen    all over the image\n");
  } else {
    fmt::print(
        "board seen    in {:.0f} % of the image, for which the figures are; beyond, uncertainty "
        "is up to {:.3g} px\n",
        100 * report.region_fraction, report.uncertainty_beyond_px);
  }
  fmt::print("true lens     {:.3f} px rms apart per axis, expected by noise, {:.3f} by views\n",
             report.expected_rms_px, report.expected_by_views_rms_px);
  if (report.halves) {
    fmt::print("halves        {:.3f} px rms apart per axis, {:.3f} px worst\n",
               report.halves->rms_px, report.halves->worst_px);
  }
  if (held_out.views > 0) {
    fmt::print("held out      {} views, {} corners, {:.3f} px rms per axis\n", held_out.views,
               held_out.corners, held_out.rms_px);
  }
  const auto& [left, right, upper, lower] = coverage.tilts_rad;
  fmt::print("coverage      {:.0f} % of the image\n", 100 * coverage.covered_fraction);
  fmt::print("tilts         left {:.0f}, right {:.0f}, upper {:.0f}, lower {:.0f} degrees\n",
             deg_from_rad(left), deg_from_rad(right), deg_from_rad(upper), deg_from_rad(lower));
  fmt::print("next view     {}\n", recommend_next_view(coverage));
}

}  // namespace vlp
