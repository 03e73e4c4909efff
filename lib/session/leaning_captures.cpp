// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/leaning_captures.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "geometry/angles.h"
#include "lamps/light_detector.h"
#include "positioning/correction.h"
#include "positioning/inclination_rotation.h"

namespace vlp {
namespace {

/// As a detector has it, which asks for no more than where the zenith is.
Eigen::Matrix3d level_of(const Inclination& inclination, double yaw_in_robot_rad,
                         const Eigen::Matrix3d& base_from_camera) {
  const Eigen::Matrix3d level_from_base =
      inclination_rotation(inclination, yaw_in_robot_rad).level_from_base;
  return level_from_zenith((level_from_base * base_from_camera).inverse().col(2));
}

/// A capture whose lean is to be found.
struct Leaning {
  std::size_t frame;
  std::vector<Detection> seen_first;
  /// What its detections are of now, unless they are those that were seen first.
  std::optional<std::optional<Eigen::Matrix3d>> level = std::nullopt;
  bool settled = false;
};

class Looks {
 public:
  Looks(LocateInput& input, const LookAgain& look)
      : input_(input),
        look_(look),
        base_from_camera_(level_from_camera(input.calibration, input.how.correction)) {
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
      const Frame& frame = input.frames[i];
      if (sensors_of(frame.image, input).inclination_sigma_rad > 0) {
        captures_.push_back({i, frame.detections});
      }
    }
  }

  LevelsOfImages settle() {
    if (captures_.empty()) return {};
    fixes_ = locate_frames(input_).fixes;
    start_from_ellipses();
    constexpr int most_rounds = 6;
    for (int round = 0; round < most_rounds && turn(); ++round) {
    }
    LevelsOfImages levels;
    for (const Leaning& capture : captures_) {
      if (capture.level) levels.emplace(name_of(capture), *capture.level);
    }
    return levels;
  }

 private:
  const std::string& name_of(const Leaning& capture) const {
    return input_.frames[capture.frame].image;
  }

  void see(const LevelsOfImages& levels) {
    if (levels.empty()) return;
    std::vector<Frame> seen = look_(levels);
    for (const Leaning& capture : captures_) {
      if (levels.find(name_of(capture)) == levels.end()) continue;
      const auto frame = std::find_if(seen.begin(), seen.end(), [&](const Frame& one) {
        return one.image == name_of(capture);
      });
      if (frame != seen.end()) {
        input_.frames[capture.frame].detections = std::move(frame->detections);
      }
    }
    fixes_ = locate_frames(input_).fixes;
  }

  void start_from_ellipses() {
    constexpr double gentle_rad = 0.05;
    const std::vector<Fix> first = fixes_;
    LevelsOfImages levels;
    for (Leaning& capture : captures_) {
      const double sd_rad = sensors_of(name_of(capture), input_).inclination_sigma_rad;
      if (sd_rad <= gentle_rad && fixes_[capture.frame].ok()) continue;
      capture.level.emplace();
      levels.emplace(name_of(capture), std::nullopt);
    }
    see(levels);
    for (Leaning& capture : captures_) {
      const Fix& fix = first[capture.frame];
      std::vector<Detection>& seen = input_.frames[capture.frame].detections;
      if (fixes_[capture.frame].ok()) continue;
      capture.settled = !fix.ok();
      if (!fix.ok() && seen.size() > capture.seen_first.size()) continue;
      capture.level.reset();
      seen = capture.seen_first;
      fixes_[capture.frame] = fix;
    }
  }

  /// Of those that are not settled; whether there were some.
  bool turn() {
    LevelsOfImages levels;
    for (Leaning& capture : captures_) {
      const Fix& fix = fixes_[capture.frame];
      capture.settled = capture.settled || !fix.ok() || !fix.body;
      if (capture.settled) continue;
      capture.level = level_of(fix);
      levels.emplace(name_of(capture), *capture.level);
    }
    const std::vector<Fix> before = fixes_;
    see(levels);
    for (Leaning& capture : captures_) {
      if (!capture.settled) capture.settled = stays(before[capture.frame], fixes_[capture.frame]);
    }
    return !levels.empty();
  }

  Eigen::Matrix3d level_of(const Fix& fix) const {
    const double yaw_in_robot_rad = input_.how.mount ? input_.how.mount->yaw_in_robot_rad : 0;
    return vlp::level_of(fix.body->inclination, yaw_in_robot_rad, base_from_camera_);
  }

  static bool stays(const Fix& before, const Fix& after) {
    constexpr double small = 0.1;
    if (!after.ok()) return true;
    Eigen::Vector4d moved;
    moved << after.estimate.pose.position_m - before.estimate.pose.position_m,
        wrapped_rad(after.estimate.pose.yaw_rad - before.estimate.pose.yaw_rad);
    const Eigen::Vector4d sd = after.noise_covariance.diagonal().cwiseSqrt();
    return (moved.cwiseAbs().array() <= small * sd.array()).all();
  }

  LocateInput& input_;
  const LookAgain& look_;
  Eigen::Matrix3d base_from_camera_;
  std::vector<Leaning> captures_;
  std::vector<Fix> fixes_;
};

}  // namespace

LevelsOfImages levels_told(const CapturesTable& captures, const Calibration& calibration,
                           double yaw_in_robot_rad) {
  const Eigen::Matrix3d base_from_camera = detector_camera(calibration).level_from_camera;
  LevelsOfImages levels;
  for (const auto& [image, known] : captures) {
    if (!known.inclination) continue;
    levels.emplace(image, level_of(*known.inclination, yaw_in_robot_rad, base_from_camera));
  }
  return levels;
}

LevelsOfImages look_at_leaning(LocateInput& input, const LookAgain& look) {
  return Looks(input, look).settle();
}

}  // namespace vlp
