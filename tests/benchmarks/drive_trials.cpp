// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// drive_trials [CAPTURES]: measures fixes of rendered cameras that drive in all directions and
/// rotate by up to 90 degrees per second, under the lamps of datasets/paper-rig. Lamps are detected
/// and located as by users:
/// - as if the camera stood,
/// - with only the maximum speed known (2.5 m/s, 180 degrees per second),
/// - with odometry accurate to 1 %.
///
/// All speeds use the same positions, including a standing camera for comparison. Prints RMS errors
/// divided by those of the standing camera, and for the velocity its RMS error and its chi-square
/// per degree of freedom. Skips captures of fewer than four lamps.
///
/// Each capture is also located by two of its lamps: with odometry, and with those two in a capture
/// 50 ms before, with only the maximum speed known. Then follow standing cameras with an unknown
/// tilt of up to 15 and 30 degrees. The chi-square of the pose is its squared error relative to the
/// bound for pixels of that noise.
///
/// "possible" is the bound of exact centers with the noise of the standing camera
/// (compute_pose_crlb()), divided by that of a camera known to stand. For centers, prints the mean
/// error along and across the motion of the lamps in the image, and the standard deviation per
/// axis.
#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <array>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "frontend/mat_view.h"
#include "geometry/angles.h"
#include "lamps/light_detector.h"
#include "positioning/error_budget.h"
#include "positioning/positioner.h"
#include "rig/find_lamp.h"
#include "simulation/exposure.h"
#include "simulation/truth.h"
#include "support/random.h"

namespace vlp {
namespace {

struct Errors {
  double horizontal = 0, height = 0, yaw = 0, velocity = 0, chi_squared = 0, pose_chi_squared = 0;
  /// Velocity error along the velocity.
  double along = 0;
  int fixes = 0, refused = 0;

  void add(const Fix& fix, const BaseMotion& truth) {
    if (!fix.has_succeeded()) {
      ++refused;
      return;
    }
    ++fixes;
    const Pose pose = truth.camera_pose_at(0);
    Eigen::Vector4d error;
    error << fix.state.pose.position_m - pose.position_m,
        wrap_angle_rad(fix.state.pose.yaw_rad - pose.yaw_rad);
    horizontal += error.head<2>().squaredNorm();
    height += error[2] * error[2];
    yaw += error[3] * error[3];
    const Eigen::Matrix4d covariance = fix.pose_covariance();
    pose_chi_squared += error.dot(covariance.ldlt().solve(error)) / 4;
    if (fix.covariance(kBodyVelocity, kBodyVelocity) == 0) return;
    const Eigen::Vector2d true_velocity =
        Eigen::Rotation2Dd(-pose.yaw_rad) * truth.camera_velocity_m_per_s();
    const Eigen::Vector2d off = fix.state.motion.velocity_m_per_s - true_velocity;
    const Eigen::Matrix2d velocity_covariance =
        fix.covariance.block<2, 2>(kBodyVelocity, kBodyVelocity);
    velocity += off.squaredNorm() / 2;
    along += off.dot(true_velocity.normalized());
    chi_squared += off.dot(velocity_covariance.ldlt().solve(off)) / 2;
  }
  double rms(double sum) const { return std::sqrt(sum / fixes); }
};

/// Capture for the computation of a bound.
struct DrivenCapture {
  std::vector<Eigen::Vector3d> lamps_m;
  Pose pose;
  double speed_m_per_s, turn_rate_rad_per_s;
};

/// Mean squares at the bound for exact centers with that noise.
struct Possible {
  double horizontal = 0, height = 0, yaw = 0, velocity = 0;

  void add(const BodyCovariance& covariance) {
    horizontal += covariance(0, 0) + covariance(1, 1);
    height += covariance(2, 2);
    yaw += covariance(kBodyYaw, kBodyYaw);
    velocity += covariance.block<2, 2>(kBodyVelocity, kBodyVelocity).trace() / 2;
  }
};

/// Errors of lamp centers along and across the motion in the image.
struct CenterErrors {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0;
  int count = 0;

  void add(const Eigen::Vector2d& error_px, const Eigen::Vector2d& motion) {
    const Eigen::Vector2d along = motion.normalized();
    const Eigen::Vector2d across(-along.y(), along.x());
    sum += Eigen::Vector2d(along.dot(error_px), across.dot(error_px));
    squares += error_px.squaredNorm();
    ++count;
  }
  Eigen::Vector2d mean() const { return sum / count; }
  double scatter_px() const { return std::sqrt((squares / count - mean().squaredNorm()) / 2); }
};

class Trials {
 public:
  explicit Trials(double row_time_s)
      : scene_(read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml")) {
    scene_.camera.row_time_s = row_time_s;
    scene_.sets.at(0).lamps->yaws_rad.assign(kShots, 0);  // the trials replace the yaws
  }

  /// The room is too low for a larger tilt: lamps would leave the image.
  void run_leaning(int captures) {
    const FrameRenderer renderer(scene_);
    const Calibration calibration = make_true_calibration(scene_);
    const LampMap lamps = make_lamp_map(scene_, false);
    const LightDetector detector(lamps, make_detector_camera(calibration));
    const Positioner positioner(lamps, calibration);
    Sensors in_hand;
    in_hand.inclination_sigma_rad = rad_from_deg(90);
    for (const double max_deg : {15.0, 30.0}) {
      Random random(72);
      Errors errors, again;
      for (int i = 0; i < captures; ++i) {
        LampShot shot =
            make_lamp_shot(scene_, scene_.sets.at(0), static_cast<std::size_t>(i) % kShots);
        BaseMotion& motion = shot.motion;
        motion.axis_m = {random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), 0};
        motion.yaw_rad = random.uniform(-3.1, 3.1);
        motion.velocity_m_per_s.setZero();
        motion.turn_rate_rad_per_s = 0;
        motion.inclination = {rad_from_deg(random.uniform(-max_deg, max_deg)),
                              rad_from_deg(random.uniform(-max_deg, max_deg))};
        const auto detections = detections_in(renderer, detector, shot);
        if (detections.size() < 4) continue;
        const Fix fix = positioner.compute_position_fix(detections, in_hand);
        errors.add(fix, motion);
        if (!fix.has_succeeded()) continue;
        // Discs are circles in the level plane: detected again with the estimated tilt.
        DetectorCamera leaning = make_detector_camera(calibration);
        leaning.level_from_camera = level_rotation_from_inclination(fix.state.motion.inclination) *
                                    leaning.level_from_camera;
        const auto seen_again = detections_in(renderer, LightDetector(lamps, leaning), shot);
        if (seen_again.size() >= 4)
          again.add(positioner.compute_position_fix(seen_again, in_hand), motion);
      }
      const std::string lean = fmt::format("lean to {:2.0f} deg", max_deg);
      print(lean, "lean unknown", errors, nullptr);
      print(lean, "looked at again", again, nullptr);
    }
  }

  void run(int captures) {
    const FrameRenderer renderer(scene_);
    const Calibration calibration = make_true_calibration(scene_);
    const LampMap lamps = make_lamp_map(scene_, false);
    const LightDetector detector(lamps, make_detector_camera(calibration));
    const Positioner positioner(lamps, calibration);
    Errors standing;
    double noise_px = 0;
    for (const double speed_m_per_s : {0.0, 0.25, 0.5, 1.0, 2.0}) {
      Random random(71);
      std::array<Errors, 5> errors;
      CenterErrors centers;
      std::vector<DrivenCapture> captures_seen;
      for (int i = 0; i < captures; ++i) {
        LampShot shot =
            make_lamp_shot(scene_, scene_.sets.at(0), static_cast<std::size_t>(i) % kShots);
        BaseMotion& motion = shot.motion;
        motion.axis_m.x() = random.uniform(-0.3, 0.3);
        motion.axis_m.y() = random.uniform(-0.12, 0.12);
        motion.axis_m.z() = random.uniform(0, 0.3);
        motion.yaw_rad = random.uniform(-3.1, 3.1);
        const double direction_rad = random.uniform(-3.1, 3.1);
        const double rate_rad_per_s = rad_from_deg(random.uniform(-90, 90));
        std::array<double, 3> odometry{random.normal(), random.normal(), random.normal()};
        motion.velocity_m_per_s =
            speed_m_per_s * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
        motion.turn_rate_rad_per_s = speed_m_per_s > 0 ? rate_rad_per_s : 0;
        const auto detections = detections_in(renderer, detector, shot);
        if (detections.size() < 4) continue;
        const Eigen::Matrix3d camera_from_world = motion.world_from_camera(0).linear().transpose();
        const Eigen::Vector2d image_motion =  // of any direction where it stands
            -(camera_from_world *
              Eigen::Vector3d(std::cos(direction_rad), std::sin(direction_rad), 0))
                 .head<2>();
        DrivenCapture seen{
            {}, motion.camera_pose_at(0), speed_m_per_s, std::abs(motion.turn_rate_rad_per_s)};
        for (const Detection& detection : detections) {
          seen.lamps_m.push_back(find_lamp_by_id(lamps.lamps, detection.lamp)->position_m);
        }
        captures_seen.push_back(std::move(seen));
        for (const TrueLamp& lamp : list_true_lamps(scene_, renderer, shot)) {
          for (const Detection& detection : detections) {
            if (detection.lamp != lamp.id || lamp.visible_fraction < 1) continue;
            centers.add(detection.pixel - lamp.pixel, image_motion);
          }
        }
        Sensors known = {}, unknown = {};
        unknown.motion = KnownMotion::make_motion_prior_from_limits(2.5, rad_from_deg(180));
        const double sd_m_per_s = 0.01 * speed_m_per_s;
        const double sd_rad_per_s = 0.01 * std::abs(motion.turn_rate_rad_per_s);
        Eigen::Vector2d velocity =
            Eigen::Rotation2Dd(-motion.yaw_rad) * motion.camera_velocity_m_per_s();
        velocity += sd_m_per_s * Eigen::Vector2d(odometry[0], odometry[1]);
        known.motion = {velocity, motion.turn_rate_rad_per_s + sd_rad_per_s * odometry[2],
                        sd_m_per_s, sd_rad_per_s};
        errors[0].add(positioner.compute_position_fix(detections), motion);
        errors[1].add(positioner.compute_position_fix(detections, unknown), motion);
        errors[2].add(positioner.compute_position_fix(detections, known), motion);
        const auto two = farthest_two(detections, lamps);
        errors[3].add(positioner.compute_position_fix(two, known), motion);
        const double before_s = 0.05;
        LampShot earlier = shot;
        earlier.motion.axis_m.head<2>() -= before_s * motion.velocity_m_per_s;
        earlier.motion.yaw_rad -= before_s * motion.turn_rate_rad_per_s;
        auto before = detections_in(renderer, detector, earlier);
        std::erase_if(before, [&](const Detection& detection) {
          return detection.lamp != two[0].lamp && detection.lamp != two[1].lamp;
        });
        if (before.size() < 2) continue;
        const std::array frames{EarlierFrame{before, before_s}};
        errors[4].add(positioner.compute_position_fix(two, unknown, frames), motion);
      }
      if (speed_m_per_s == 0) {
        standing = errors[0];
        noise_px = centers.scatter_px();
      }
      constexpr std::array names{"as if standing", "speed unknown", "odometry 1 %", "two, odometry",
                                 "two, two frames"};
      const std::string speed = fmt::format("{:4.2f} m/s", speed_m_per_s);
      fmt::print(
          "{:.0f} us  {}  {} centers of lamps wholly in view: {:.4f} px, 2-D rms; mean along "
          "{:+.4f}, across {:+.4f}, scatter {:.4f} per axis\n",
          1e6 * *scene_.camera.row_time_s, speed, centers.count,
          std::sqrt(centers.squares / centers.count), centers.mean().x(), centers.mean().y(),
          centers.scatter_px());
      for (std::size_t i = 0; i < errors.size(); ++i) print(speed, names[i], errors[i], &standing);
      for (const bool odometry : {false, true}) {
        print_possible(speed, captures_seen, odometry, noise_px);
      }
    }
  }

 private:
  /// Results with only the maximum speed known, or with odometry.
  void print_possible(const std::string& speed, const std::vector<DrivenCapture>& captures,
                      bool odometry, double noise_px) const {
    const Lens lens(scene_.camera.lens_model, scene_.camera.intrinsics);
    const Eigen::Matrix3d camera_from_level = scene_.mount.level_from_camera.transpose();
    const auto clock = make_readout_clock(scene_.camera);
    Possible moving, standing;
    int count = 0;
    for (const DrivenCapture& seen : captures) {
      const KnownMotion known = KnownMotion::make_motion_prior_from_limits(2.5, rad_from_deg(180));
      BodyPrior prior;
      prior.set_state_sd(kBodyVelocity,
                         odometry ? 0.01 * seen.speed_m_per_s : known.velocity_sd_m_per_s);
      prior.set_state_sd(kBodyYawRate,
                         odometry ? 0.01 * seen.turn_rate_rad_per_s : known.yaw_rate_sd_rad_per_s);
      const auto limit = compute_pose_crlb(seen.lamps_m, lens, camera_from_level, seen.pose,
                                           noise_px, prior, clock);
      if (!limit) continue;
      moving.add(limit->fix.covariance);
      BodyCovariance still = BodyCovariance::Zero();
      still.topLeftCorner<4, 4>() = limit->noise;
      standing.add(still);
      ++count;
    }
    const auto times = [&](double Possible::*sum) {
      return std::sqrt(moving.*sum / standing.*sum);
    };
    fmt::print(
        "{:.0f} us  {}  possible, {:14}  ({:5.2f})  height ({:5.2f})  yaw ({:5.2f})  v {:5.1f} "
        "mm/s\n",
        1e6 * *scene_.camera.row_time_s, speed, odometry ? "odometry 1 %" : "speed unknown",
        times(&Possible::horizontal), times(&Possible::height), times(&Possible::yaw),
        1e3 * std::sqrt(moving.velocity / count));
  }

  std::vector<Detection> detections_in(const FrameRenderer& renderer, const LightDetector& detector,
                                       const LampShot& shot) const {
    const cv::Mat image =
        simulate_sensor_image(scene_.sensor, renderer.render_lamps(shot), shot.noise_seed);
    std::vector<Detection> detections;
    for (const Light& light : detector.detect_lights(to_image_view(image))) {
      if (light.kind == LightKind::lamp) {
        detections.push_back({*light.lamp, light.pixel, light.sigma_px});
      }
    }
    return detections;
  }

  static std::vector<Detection> farthest_two(const std::vector<Detection>& seen,
                                             const LampMap& lamps) {
    const auto place = [&](const Detection& detection) -> Eigen::Vector3d {
      for (const Lamp& lamp : lamps.lamps) {
        if (lamp.id == detection.lamp) return lamp.position_m;
      }
      throw std::logic_error("no such lamp");
    };
    std::vector<Detection> two{seen[0], seen[1]};
    for (const Detection& a : seen) {
      for (const Detection& b : seen) {
        if ((place(a) - place(b)).norm() > (place(two[0]) - place(two[1])).norm()) two = {a, b};
      }
    }
    return two;
  }

  /// Prints errors as multiples of those of `standing`.
  void print(const std::string& what, const char* how, const Errors& e,
             const Errors* standing) const {
    const auto times = [&](double Errors::*sum) {
      return standing ? fmt::format(" ({:5.2f})", e.rms(e.*sum) / standing->rms(standing->*sum))
                      : std::string();
    };
    fmt::print(
        "{:.0f} us  {}  {:15}  {:3} fixes {:2} none  {:7.3f} mm{}  height {:7.3f} mm{}  yaw "
        "{:.4f} deg{}  pose chi2 {:.2f}",
        1e6 * *scene_.camera.row_time_s, what, how, e.fixes, e.refused, 1e3 * e.rms(e.horizontal),
        times(&Errors::horizontal), 1e3 * e.rms(e.height), times(&Errors::height),
        deg_from_rad(e.rms(e.yaw)), times(&Errors::yaw), e.pose_chi_squared / e.fixes);
    if (e.velocity > 0) {
      fmt::print("  v {:5.1f} mm/s (mean along it {:+.2f}) chi2 {:.2f}", 1e3 * e.rms(e.velocity),
                 1e3 * e.along / e.fixes, e.chi_squared / e.fixes);
    }
    fmt::print("\n");
  }

  /// Number of captures of the first set of the scene, whose motions are replaced.
  static constexpr std::size_t kShots = 12;

  Scene scene_;
};

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const int captures = argc > 1 ? std::atoi(argv[1]) : 100;
  vlp::Trials(3e-5).run_leaning(captures);
  for (const double row_time_s : {3e-5, 5.5e-5}) vlp::Trials(row_time_s).run(captures);
}
