// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lamp_detector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "detection/background.h"
#include "detection/robust_circle.h"
#include "detection/runs.h"
#include "geometry/frames.h"
#include "rig/detection.h"

namespace vlp {
namespace {

/// How many lines without light a lamp may show between two stripes.
int most_dark_rows_of(const LampMap& lamps, const std::optional<double>& row_time_s) {
  constexpr int unknown = 24, spare = 3;
  if (!row_time_s) return unknown;
  double most = 0;
  for (const Lamp& lamp : lamps.lamps) {
    if (!lamp.frequency_hz) return unknown;
    most = std::max(most, (1 - lamp.duty.value_or(0.5)) / (*lamp.frequency_hz * *row_time_s));
  }
  return static_cast<int>(std::ceil(most)) + spare;
}

cv::Rect box_of(const Blob& blob) {
  int begin = blob.runs[0].begin, end = blob.runs[0].end;
  for (const Run& run : blob.runs) {
    begin = std::min(begin, run.begin);
    end = std::max(end, run.end);
  }
  return {begin, blob.top(), end - begin, blob.bottom() + 1 - blob.top()};
}

/// The diagonal of the box around the points.
double extent(const std::vector<Eigen::Vector2d>& points) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : points) box.extend(point);
  return box.diagonal().norm();
}

/// Whether two blobs may be parts of one light.
bool near(const cv::Rect& a, const cv::Rect& b) {
  const int gap_across = std::max(a.x, b.x) - std::min(a.x + a.width, b.x + b.width);
  const int gap_along = std::max(a.y, b.y) - std::min(a.y + a.height, b.y + b.height);
  const int size = std::max({a.width, a.height, b.width, b.height});
  return 2 * gap_across < size && 2 * gap_along < size && std::max(gap_across, gap_along) < size;
}

}  // namespace

DetectorCamera detector_camera(const Calibration& calibration) {
  const Camera& camera = calibration.camera;
  DetectorCamera result{camera.readout.value_or(Readout::rows), camera.row_time_s,
                        Lens(camera.lens_model, camera.intrinsics)};
  if (calibration.rotation_center) {
    result.level_from_camera = level_from_zenith(calibration.rotation_center->zenith_in_camera);
  }
  return result;
}

LampDetector::LampDetector(const LampMap& lamps, const DetectorCamera& camera,
                           std::optional<LampClassifier> classifier)
    : lamps_(lamps),
      camera_(camera),
      classifier_(std::move(classifier)),
      most_dark_rows_(most_dark_rows_of(lamps, camera.row_time_s)) {}

std::optional<Eigen::Vector2d> LampDetector::plane_of(const Eigen::Vector2d& pixel) const {
  if (!camera_.lens) return pixel;
  const auto ray = camera_.lens->unproject(pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d level = camera_.level_from_camera * ray->direction;
  if (!(level.z() > 0)) return std::nullopt;
  return level.head<2>() / level.z();
}

std::optional<Eigen::Vector2d> LampDetector::pixel_of(const Eigen::Vector2d& plane) const {
  if (!camera_.lens) return plane;
  return camera_.lens->project(camera_.level_from_camera.transpose() * plane.homogeneous());
}

Eigen::Vector2d LampDetector::turned(const Eigen::Vector2d& at) const {
  return camera_.readout == Readout::rows ? at : Eigen::Vector2d(at.reverse());
}

std::optional<Light> LampDetector::round_light(std::vector<EdgePoint> outline,
                                               const Background& background) const {
  constexpr std::size_t least_points = 5;
  std::vector<Eigen::Vector2d> points, pixels;
  std::vector<double> weights;
  double brightest = 0;
  std::erase_if(outline, [&](const EdgePoint& edge) {
    const auto plane = plane_of(turned(edge.pixel));
    if (plane) {
      points.push_back(*plane);
      pixels.push_back(edge.pixel);
    }
    brightest = std::max(brightest, edge.level);
    return !plane;
  });
  if (points.size() < least_points) return std::nullopt;
  weights.reserve(outline.size());
  for (const EdgePoint& edge : outline) weights.push_back(std::pow(edge.level / brightest, 2));
  const double per_px = extent(points) / extent(pixels);
  if (!(per_px > 0)) return std::nullopt;
  // Half a level is passed within half a pixel or so; noise blurs that.
  const double tolerance_px = std::max(0.35, 8 * background.noise / brightest);
  const auto circle = fit_robust_circle(points, weights, tolerance_px * per_px);
  constexpr int least_support = 10;
  if (!circle || circle->count < least_support) return std::nullopt;

  Light light{};
  const auto pixel = pixel_of(circle->circle.center);
  if (!pixel) return std::nullopt;
  light.pixel = light.low = light.high = *pixel;
  for (int i = 0; i < 16; ++i) {
    const double angle = std::numbers::pi / 8 * i;
    const auto rim =
        pixel_of(circle->circle.center +
                 circle->circle.radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    if (!rim) return std::nullopt;
    light.low = light.low.cwiseMin(*rim);
    light.high = light.high.cwiseMax(*rim);
  }
  light.radius_px = circle->circle.radius / per_px;
  const double sigma_px = std::sqrt(circle->center_covariance.trace() / 2) / per_px;
  if (!(sigma_px <= kMaxSigma_px)) return std::nullopt;
  light.sigma_px = std::max(kMinSigma_px, sigma_px);
  std::vector<double> rises;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    if (!circle->inliers[i]) continue;
    light.outline.push_back(outline[i]);
    rises.push_back(outline[i].rise_px);
  }
  light.roundness = double(light.outline.size()) / double(outline.size());
  std::nth_element(rises.begin(), rises.begin() + std::ptrdiff_t(rises.size() / 2), rises.end());
  light.rise_px = rises[rises.size() / 2];
  return light;
}

void LampDetector::measure(const cv::Mat& lines, const Background& background, Light& light) const {
  const Eigen::Vector2d low = turned(light.low), high = turned(light.high);
  auto better = round_light(refined(lines, light.outline, low, high, background), background);
  if (better && 2 * better->outline.size() > light.outline.size()) {
    better->roundness = light.roundness;
    light = std::move(*better);
  }
  light.stripes =
      stripes_of(line_signal(lines, turned(light.low), turned(light.high), background.level));
}

std::vector<Light> LampDetector::merged(std::vector<Part> parts,
                                        const Background& background) const {
  constexpr double round_share = 0.8;  // of the points on the circle
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t j = i + 1; j < parts.size(); ++j) {
      if (!near(parts[i].box, parts[j].box)) continue;
      // Things in the way split a lamp; its parts lie on one circle.
      std::vector<EdgePoint> both = parts[i].outline;
      both.insert(both.end(), parts[j].outline.begin(), parts[j].outline.end());
      both = outermost(std::move(both));
      auto joint = round_light(both, background);
      if (!joint || double(joint->outline.size()) < round_share * double(both.size())) continue;
      parts[i] = {std::move(joint), std::move(both), parts[i].box | parts[j].box};
      parts.erase(parts.begin() + std::ptrdiff_t(j));
      j = i;  // the whole may have more parts
    }
  }
  // No two lights overlap: the one with more of an outline stands, the other is a piece of it.
  std::vector<Light> found, lights;
  for (Part& part : parts) {
    if (part.light) found.push_back(std::move(*part.light));
  }
  std::stable_sort(found.begin(), found.end(), [](const Light& a, const Light& b) {
    return a.outline.size() > b.outline.size();
  });
  for (Light& light : found) {
    const bool piece = std::any_of(lights.begin(), lights.end(), [&](const Light& other) {
      return (light.pixel - other.pixel).norm() < std::max(light.radius_px, other.radius_px);
    });
    if (!piece) lights.push_back(std::move(light));
  }
  return lights;
}

std::vector<Light> LampDetector::detect(const cv::Mat& image) const {
  const cv::Mat lines = camera_.readout == Readout::rows ? image : cv::Mat(image.t());
  const Background background = background_of(lines);
  const auto blobs = group_runs(find_runs(lines, background.threshold), most_dark_rows_);
  std::vector<Part> parts;
  for (const Blob& blob : blobs) {
    auto outline = outline_of(lines, blob, background);
    auto light = round_light(outline, background);
    parts.push_back({std::move(light), std::move(outline), box_of(blob)});
  }
  std::vector<Light> lights = merged(std::move(parts), background);
  for (Light& light : lights) measure(lines, background, light);
  std::sort(lights.begin(), lights.end(), [](const Light& a, const Light& b) {
    return a.pixel.y() != b.pixel.y() ? a.pixel.y() < b.pixel.y() : a.pixel.x() < b.pixel.x();
  });
  identify(lights, image.size());
  return lights;
}

}  // namespace vlp
