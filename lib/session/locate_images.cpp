// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_images.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "geometry/angles.h"
#include "positioning/correction.h"
#include "session/row_time_step.h"

namespace vlp {
namespace {

/// A capture whose tilt is estimated.
struct TiltedCapture {
  std::size_t frame;
  std::vector<Detection> first_detections;
  /// Plane of the current detections; std::nullopt: that of the first ones.
  std::optional<std::optional<Eigen::Matrix3d>> level = std::nullopt;
  bool has_converged = false;
};

class TiltedCaptures {
 public:
  TiltedCaptures(LocateInput& input, const Redetector& redetect)
      : input_(input),
        redetect_(redetect),
        base_from_camera_(level_from_camera(input.calibration, input.how.correction)) {
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
      const Frame& frame = input.frames[i];
      if (make_sensors(frame.image, input).inclination_sigma_rad > 0) {
        captures_.push_back({i, frame.detections});
      }
    }
  }

  LevelRotations iterate() {
    if (captures_.empty()) return {};
    fixes_ = locate_frames(input_).fixes;
    start_from_ellipses();
    constexpr int max_iterations = 6;
    for (int i = 0; i < max_iterations && redetect_in_level_planes(); ++i) {
    }
    LevelRotations levels;
    for (const TiltedCapture& capture : captures_) {
      if (capture.level) levels.emplace(image_name(capture), *capture.level);
    }
    return levels;
  }

 private:
  const std::string& image_name(const TiltedCapture& capture) const {
    return input_.frames[capture.frame].image;
  }

  void detect_in(const LevelRotations& levels) {
    if (levels.empty()) return;
    std::vector<Frame> seen = redetect_(levels);
    for (const TiltedCapture& capture : captures_) {
      if (levels.find(image_name(capture)) == levels.end()) continue;
      const auto frame = std::find_if(seen.begin(), seen.end(), [&](const Frame& candidate) {
        return candidate.image == image_name(capture);
      });
      if (frame != seen.end()) {
        input_.frames[capture.frame].detections = std::move(frame->detections);
      }
    }
    fixes_ = locate_frames(input_).fixes;
  }

  void start_from_ellipses() {
    constexpr double max_small_tilt_rad = 0.05;
    const std::vector<Fix> first = fixes_;
    LevelRotations levels;
    for (TiltedCapture& capture : captures_) {
      const double sd_rad = make_sensors(image_name(capture), input_).inclination_sigma_rad;
      if (sd_rad <= max_small_tilt_rad && fixes_[capture.frame].ok()) continue;
      capture.level.emplace();
      levels.emplace(image_name(capture), std::nullopt);
    }
    detect_in(levels);
    for (TiltedCapture& capture : captures_) {
      const Fix& fix = first[capture.frame];
      std::vector<Detection>& seen = input_.frames[capture.frame].detections;
      if (fixes_[capture.frame].ok()) continue;
      capture.has_converged = !fix.ok();
      if (!fix.ok() && seen.size() > capture.first_detections.size()) continue;
      capture.level.reset();
      seen = capture.first_detections;
      fixes_[capture.frame] = fix;
    }
  }

  /// Repeats the detections that have not converged. Returns false if there are none.
  bool redetect_in_level_planes() {
    LevelRotations levels;
    for (TiltedCapture& capture : captures_) {
      const Fix& fix = fixes_[capture.frame];
      capture.has_converged = capture.has_converged || !fix.ok() || !fix.body;
      if (capture.has_converged) continue;
      const double yaw_in_robot_rad = input_.how.mount ? input_.how.mount->yaw_in_robot_rad : 0;
      capture.level =
          compute_level_rotation(fix.body->inclination, yaw_in_robot_rad, base_from_camera_);
      levels.emplace(image_name(capture), *capture.level);
    }
    const std::vector<Fix> before = fixes_;
    detect_in(levels);
    for (TiltedCapture& capture : captures_) {
      if (capture.has_converged) continue;
      capture.has_converged = is_unchanged(before[capture.frame], fixes_[capture.frame]);
    }
    return !levels.empty();
  }

  static bool is_unchanged(const Fix& before, const Fix& after) {
    constexpr double tolerance_sd = 0.1;
    if (!after.ok()) return true;
    Eigen::Vector4d change;
    change << after.estimate.pose.position_m - before.estimate.pose.position_m,
        wrap_rad(after.estimate.pose.yaw_rad - before.estimate.pose.yaw_rad);
    const Eigen::Vector4d sd = after.noise_covariance.diagonal().cwiseSqrt();
    return (change.cwiseAbs().array() <= tolerance_sd * sd.array()).all();
  }

  LocateInput& input_;
  const Redetector& redetect_;
  Eigen::Matrix3d base_from_camera_;
  std::vector<TiltedCapture> captures_;
  std::vector<Fix> fixes_;
};

/// Applies an intake to the named images again.
Observations observe_again(const LampIntake& intake,
                           const std::vector<std::filesystem::path>& files,
                           const LevelRotations& levels) {
  std::vector<std::filesystem::path> named;
  std::copy_if(files.begin(), files.end(), std::back_inserter(named), [&](const auto& file) {
    return levels.find(file.filename().string()) != levels.end();
  });
  return intake.with_levels(levels).observe_all(named);
}

bool has_detections(const std::vector<Frame>& frames) {
  return std::any_of(frames.begin(), frames.end(),
                     [](const Frame& frame) { return !frame.detections.empty(); });
}

}  // namespace

LocateResult locate_images(const LampImages& images, ImageUse use, LocateInput input,
                           const FrontendOptions& options, const IntakeProgress& progress) {
  const LampIntake intake(images, use, options);
  if (!input.calibration.camera.readout) input.calibration.camera.readout = intake.readout();
  const auto files = list_lamp_images(images.images);
  Observations seen = intake.observe_all(files, progress);
  check_lamps_seen(images, seen);
  input.frames = collect_kept_frames(seen.images);
  const LampIntake without_pictures = intake.with_annotate({});
  std::map<std::string, Observation> latest;
  const LevelRotations levels = redetect_tilted_captures(input, [&](const LevelRotations& tilted) {
    const Observations repeated = observe_again(without_pictures, files, tilted);
    for (const Observation& image : repeated.images) {
      if (image.is_kept()) latest.insert_or_assign(image.name(), image);
    }
    return collect_kept_frames(repeated.images);
  });
  for (Observation& image : seen.images) {
    const auto repeated = latest.find(image.name());
    if (levels.contains(image.name()) && repeated != latest.end()) image = repeated->second;
  }
  if (!options.annotate.empty()) observe_again(intake, files, levels);
  LocateResult result;
  if (has_detections(input.frames)) {
    seen.failure.reset();
    result = locate_frames(input);
  }
  add_remarks(seen, result);
  // A classifier identifies lamps without the row time: it is no reason why there is no result.
  if (options.classifier.empty() || result.ok()) {
    explain_by_row_time(seen.images, input.lamps, make_detector_camera(input.calibration),
                        images.calibration_file.filename().string(), result);
  }
  result.seen = std::move(seen);
  return result;
}

LevelRotations redetect_tilted_captures(LocateInput& input, const Redetector& redetect) {
  return TiltedCaptures(input, redetect).iterate();
}

}  // namespace vlp
