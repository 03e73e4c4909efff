// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lens_fault.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/adjustment/adjustment.h"
#include "rig/calibration_error.h"

namespace vlp {
namespace {

constexpr Eigen::Index kFocalAndCenter = 4;

/// The lens as it is, and beyond that any other of its kind: what else bends rays, the type of
/// camera has in common.
Calibration with_free_focus(Calibration calibration) {
  constexpr double share = 0.05;
  const double sd_px =
      share * (calibration.camera.intrinsics[0] + calibration.camera.intrinsics[1]) / 2;
  auto& report = calibration.intrinsics_report;
  if (!report) report.emplace();
  auto& covariance = report->covariance;
  if (!covariance) {
    const Eigen::Index n = stated_intrinsics(calibration.camera);
    covariance = Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, n));
  }
  for (Eigen::Index i = 0; i < kFocalAndCenter; ++i) (*covariance)(i, i) += sd_px * sd_px;
  return calibration;
}

AdjustmentResult adjusted(std::span<const Frame> frames, const LampMap& map,
                          Calibration calibration) {
  AdjustmentInput input{{}, map, std::move(calibration)};
  for (Lamp& lamp : input.lamps.lamps) lamp.sd_m = 0;
  for (const Frame& frame : frames) input.captures.push_back({frame.image, frame.detections});
  return adjust_captures(input);
}

/// By how much a corner of the image is elsewhere, the worst.
double corner_shift_px(const Camera& a, const Camera& b) {
  double worst_px = 0;
  for (const double u : {0., double(a.imager_px[0])}) {
    for (const double v : {0., double(a.imager_px[1])}) {
      // Of the ray that is seen there; distortion is the same in both.
      const Eigen::Vector2d corner(u, v);
      const Eigen::Vector2d ray = (corner - a.center_px()).cwiseQuotient(a.focal_px());
      worst_px =
          std::max(worst_px, (b.focal_px().cwiseProduct(ray) + b.center_px() - corner).norm());
    }
  }
  return worst_px;
}

}  // namespace

std::string lens_fault(std::span<const Frame> frames, const LampMap& map,
                       const Calibration& calibration) {
  constexpr std::size_t least_captures =
      10;  // of fewer a free lens takes up what other faults leave
  if (frames.size() < least_captures) return "";
  const AdjustmentResult as_stated = adjusted(frames, map, calibration);
  const AdjustmentResult freed = adjusted(frames, map, with_free_focus(calibration));
  if (!as_stated.ok() || !freed.ok()) return "";
  constexpr double far_better = 1.0 / 3, least_px = 1;
  if (freed.residual_px >= far_better * as_stated.residual_px) return "";
  if (corner_shift_px(calibration.camera, freed.camera) < least_px) return "";
  const auto words = [](const Camera& camera) {
    return fmt::format("a focal length of {:.1f} px and the centre ({:.1f}, {:.1f})",
                       std::sqrt(camera.focal_px().prod()), camera.center_px().x(),
                       camera.center_px().y());
  };
  return fmt::format(
      "the lamps are seen through another lens than the boards: they show {}, the boards {}; are "
      "all images of this unit, or has its lens moved?",
      words(freed.camera), words(calibration.camera));
}

}  // namespace vlp
