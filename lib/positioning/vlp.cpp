// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/vlp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "lamps/lamp_detector.h"
#include "lamps/signal/lamp_map_check.h"
#include "positioning/positioner.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"

struct vlp_positioner {
  vlp::Positioner positioner;
  /// Empty if the calibration has no row time.
  std::optional<vlp::LampDetector> detector;
  /// Reason why lamps of different rooms cannot be identified; empty if they can.
  std::string room_error;
};

namespace vlp {
namespace {

static_assert(VLP_MAX_LAMPS == Positioner::max_lamps);

/// An array without a destructor, since a thread may read it while it ends.
thread_local std::array<char, 1024> last_error;

std::int32_t set_error_and_return_code(std::int32_t code, std::string_view message) {
  const auto length = std::min(message.size(), last_error.size() - 1);
  std::copy_n(message.begin(), length, last_error.begin());
  last_error[length] = '\0';
  return code;
}

PositionerOptions convert_options(const vlp_options& options) {
  PositionerOptions result;
  if (options.has_mount != 0) {
    result.mount = CameraMount{Eigen::Vector3d(options.mount_position_m), options.mount_yaw_rad};
  }
  if (options.max_residual_fraction != 0)
    result.max_residual_fraction = options.max_residual_fraction;
  if (options.unstated_sigma_px != 0) result.unstated_sigma_px = options.unstated_sigma_px;
  return result;
}

Sensors convert_sensors(const vlp_sensors& sensors) {
  Sensors result;
  if (sensors.has_inclination != 0) {
    result.inclination = Inclination{sensors.roll_rad, sensors.pitch_rad};
  }
  result.inclination_sigma_rad = sensors.inclination_sigma_rad;
  if (sensors.has_height_and_yaw != 0) {
    result.height_and_yaw = HeightAndYaw{sensors.camera_z_m, sensors.camera_yaw_rad,
                                         sensors.camera_z_sd_m, sensors.camera_yaw_sd_rad};
  }
  if (sensors.has_motion != 0) {
    result.motion =
        KnownMotion{Eigen::Vector2d(sensors.velocity_m_per_s), sensors.yaw_rate_rad_per_s,
                    sensors.velocity_sd_m_per_s, sensors.yaw_rate_sd_rad_per_s};
  }
  if (sensors.has_height != 0) result.height = KnownHeight{sensors.z_m, sensors.z_sd_m};
  return result;
}

using Covariance6 = Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>;

/// Combines (X, Y, Z, yaw) of the pose's covariance with roll and pitch of the body's covariance.
void fill_covariance(const Matrix4& of_pose, const BodyCovariance& of_body, double* rows) {
  constexpr std::array<int, 6> body = {0, 1, 2, kBodyRoll, kBodyPitch, kBodyYaw};
  Covariance6 covariance(rows);
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) {
      const int from_i = body[static_cast<std::size_t>(i)];
      const int from_k = body[static_cast<std::size_t>(k)];
      const bool pose = from_i <= kBodyYaw && from_k <= kBodyYaw;
      covariance(i, k) = pose ? of_pose(from_i, from_k) : of_body(from_i, from_k);
    }
  }
}

/// Returns the given motion, roll and pitch of a body that was not estimated.
BodyEstimate get_given_body_estimate(const Sensors& sensors, double yaw_rad) {
  BodyEstimate body;
  if (sensors.inclination) body.inclination = *sensors.inclination;
  const double variance = sensors.inclination_sigma_rad * sensors.inclination_sigma_rad;
  body.covariance(kBodyRoll, kBodyRoll) = body.covariance(kBodyPitch, kBodyPitch) = variance;
  if (sensors.motion) {
    const Eigen::Vector2d& velocity = sensors.motion->velocity_m_per_s;
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    body.velocity_m_per_s = {c * velocity.x() - s * velocity.y(),
                             s * velocity.x() + c * velocity.y()};
    body.yaw_rate_rad_per_s = sensors.motion->yaw_rate_rad_per_s;
    const double velocity_variance =
        sensors.motion->velocity_sd_m_per_s * sensors.motion->velocity_sd_m_per_s;
    body.covariance.block<2, 2>(kBodyVelocity, kBodyVelocity)
        .diagonal()
        .setConstant(velocity_variance);
    body.covariance(kBodyYawRate, kBodyYawRate) =
        sensors.motion->yaw_rate_sd_rad_per_s * sensors.motion->yaw_rate_sd_rad_per_s;
  }
  body.noise_covariance = body.covariance;
  return body;
}

void copy_fix_to_c_struct(const Fix& from, const Sensors& sensors, vlp_fix& fix) {
  fix.status = static_cast<std::int32_t>(from.status);
  fix.unknown_lamps = from.unknown_lamps;
  if (!from.has_succeeded()) return;
  const auto& [pose, covariance] = from.estimate;
  const BodyEstimate body = from.body ? *from.body : get_given_body_estimate(sensors, pose.yaw_rad);
  std::copy_n(pose.position_m.data(), 3, fix.position_m);
  fix.roll_rad = body.inclination.roll_rad;
  fix.pitch_rad = body.inclination.pitch_rad;
  fix.yaw_rad = pose.yaw_rad;
  fill_covariance(covariance, body.covariance, fix.covariance);
  fill_covariance(from.noise_covariance, body.noise_covariance, fix.noise_covariance);
  std::copy_n(body.velocity_m_per_s.data(), 2, fix.velocity_m_per_s);
  fix.yaw_rate_rad_per_s = body.yaw_rate_rad_per_s;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(fix.velocity_covariance) =
      body.covariance.block<3, 3>(kBodyVelocity, kBodyVelocity);
  fix.residual_px = from.residual_px;
  fix.lamps = from.lamps;
  fix.rejected_lamps = from.rejected_lamps;
  std::copy(from.rejected_ids.begin(), from.rejected_ids.end(), fix.rejected_ids);
}

/// Returns the code of the exception that is being handled, and keeps its message.
std::int32_t set_error_from_exception() {
  try {
    throw;
  } catch (const InputError& error) {
    return set_error_and_return_code(VLP_BAD_FILE, error.what());
  } catch (const std::invalid_argument& error) {
    return set_error_and_return_code(VLP_BAD_ARGUMENT, error.what());
  } catch (const std::bad_alloc&) {
    return set_error_and_return_code(VLP_NO_MEMORY, "there is not enough memory");
  } catch (const std::exception& error) {
    return set_error_and_return_code(VLP_FAILED, error.what());
  } catch (...) {
    return set_error_and_return_code(VLP_FAILED, "an unknown exception");
  }
}

ImageView make_image_view(const vlp_image& image) {
  const std::ptrdiff_t row_bytes = std::ptrdiff_t{image.width} * (image.bits / 8);
  return {image.data, image.width, image.height, image.stride != 0 ? image.stride : row_bytes,
          image.bits};
}

/// Detections of one or more frames, without memory from the heap.
class DetectionBuffer {
 public:
  DetectionBuffer() {}

  bool fits_in_buffer(std::size_t count) const { return count <= Positioner::max_lamps - size_; }

  /// Copies the detections of a frame.
  /// @pre fits_in_buffer(count)
  std::span<const Detection> add(const vlp_detection* from, std::size_t count) {
    Detection* const first = detections_.data() + size_;
    for (std::size_t i = 0; i < count; ++i) {
      Detection& to = *new (first + i) Detection{from[i].lamp, {from[i].u_px, from[i].v_px}, {}};
      if (from[i].sigma_px != 0) to.sigma_px = from[i].sigma_px;
    }
    size_ += count;
    return {first, count};
  }

 private:
  /// Elements are constructed when they are filled.
  union {
    std::array<Detection, Positioner::max_lamps> detections_;
  };
  std::size_t size_ = 0;
};

}  // namespace
}  // namespace vlp

const char* vlp_version(void) { return VLP_VERSION; }

int32_t vlp_open(const char* lamps_yaml, const char* calibration_yaml, const vlp_options* options,
                 vlp_positioner** positioner) {
  return vlp_open_room(lamps_yaml, nullptr, calibration_yaml, options, positioner);
}

int32_t vlp_open_room(const char* lamps_yaml, const char* room, const char* calibration_yaml,
                      const vlp_options* options, vlp_positioner** positioner) {
  using namespace vlp;
  if (positioner == nullptr)
    return set_error_and_return_code(VLP_BAD_ARGUMENT, "positioner is a null pointer");
  *positioner = nullptr;
  if (lamps_yaml == nullptr || calibration_yaml == nullptr) {
    return set_error_and_return_code(VLP_BAD_ARGUMENT, "the name of a file is a null pointer");
  }
  try {
    const LampMapFile lamps = read_lamps_and_room_names(lamps_yaml, room != nullptr ? room : "");
    const Calibration calibration = read_calibration(calibration_yaml);
    const PositionerOptions chosen =
        options != nullptr ? convert_options(*options) : PositionerOptions();
    std::optional<LampDetector> detector;
    if (calibration.camera.row_time_s) detector.emplace(lamps.map, calibration);
    std::string room_error =
        explain_why_room_must_be_chosen(lamps, "the argument room of vlp_open_room()");
    if (!room_error.empty()) room_error = InputError(lamps_yaml, room_error).what();
    *positioner = new vlp_positioner{Positioner(lamps.map, calibration, chosen),
                                     std::move(detector), std::move(room_error)};
    return VLP_OK;
  } catch (...) {
    return set_error_from_exception();
  }
}

void vlp_close(vlp_positioner* positioner) { delete positioner; }

int32_t vlp_detect(const vlp_positioner* positioner, const vlp_image* image,
                   vlp_detection* detections, size_t capacity, size_t* count) {
  using namespace vlp;
  if (count != nullptr) *count = 0;
  if (positioner == nullptr || image == nullptr || count == nullptr ||
      (detections == nullptr && capacity > 0)) {
    return set_error_and_return_code(VLP_BAD_ARGUMENT, "a pointer is null");
  }
  if (!positioner->detector) {
    return set_error_and_return_code(
        VLP_ROW_TIME_UNKNOWN,
        "the calibration has no row_time_s, which is needed to identify lamps");
  }
  if (!positioner->room_error.empty())
    return set_error_and_return_code(VLP_BAD_FILE, positioner->room_error);
  try {
    const auto seen = positioner->detector->detect_lamps(make_image_view(*image));
    for (std::size_t i = 0; i < std::min(seen.size(), capacity); ++i) {
      detections[i] = {seen[i].lamp, seen[i].pixel.x(), seen[i].pixel.y(),
                       seen[i].sigma_px.value_or(0)};
    }
    *count = seen.size();
    if (seen.size() <= capacity) return VLP_OK;
    return set_error_and_return_code(VLP_TOO_SMALL,
                                     "the image shows " + std::to_string(seen.size()) + " lamps");
  } catch (...) {
    return set_error_from_exception();
  }
}

int32_t vlp_locate(const vlp_positioner* positioner, const vlp_detection* detections, size_t count,
                   const vlp_sensors* sensors, vlp_fix* fix) {
  return vlp_locate_with_earlier(positioner, detections, count, sensors, nullptr, 0, fix);
}

int32_t vlp_locate_with_earlier(const vlp_positioner* positioner, const vlp_detection* detections,
                                size_t count, const vlp_sensors* sensors,
                                const vlp_earlier_frame* earlier, size_t earlier_count,
                                vlp_fix* fix) {
  using namespace vlp;
  if (fix == nullptr) return VLP_BAD_ARGUMENT;
  *fix = {};
  if (sensors != nullptr) fix->stamp = sensors->stamp;
  if (positioner == nullptr || (detections == nullptr && count > 0) ||
      (earlier == nullptr && earlier_count > 0)) {
    return fix->status = VLP_BAD_ARGUMENT;
  }
  DetectionBuffer buffer;
  if (!buffer.fits_in_buffer(count)) return fix->status = VLP_TOO_MANY_LAMPS;
  const std::span<const Detection> frame = buffer.add(detections, count);
  std::array<EarlierFrame, Positioner::max_lamps> before;
  std::size_t frames = 0;
  for (std::size_t i = 0; i < earlier_count; ++i) {
    const vlp_earlier_frame& one = earlier[i];
    if (one.count == 0) continue;
    if (one.detections == nullptr) return fix->status = VLP_BAD_ARGUMENT;
    if (!buffer.fits_in_buffer(one.count)) return fix->status = VLP_TOO_MANY_LAMPS;
    before[frames++] = {buffer.add(one.detections, one.count), one.before_s};
  }
  const Sensors known = sensors != nullptr ? convert_sensors(*sensors) : Sensors();
  const Positioner& with = positioner->positioner;
  copy_fix_to_c_struct(frames > 0 ? with.compute_position_fix(frame, known, {before.data(), frames})
                                  : with.compute_position_fix(frame, known),
                       known, *fix);
  return fix->status;
}

const char* vlp_describe_status(int32_t code) {
  switch (code) {
    case VLP_BAD_FILE:
      return "a file cannot be read or has invalid content; see vlp_last_error()";
    case VLP_BAD_ARGUMENT:
      return "a pointer is null or a value is out of range";
    case VLP_NO_MEMORY:
      return "there is not enough memory";
    case VLP_TOO_SMALL:
      return "an array is too small; see the returned count";
    case VLP_FAILED:
      return "an internal error; see vlp_last_error()";
    default:
      break;
  }
  if (code < VLP_OK || code > VLP_ROW_TIME_UNKNOWN) return "no code of this library";
  return vlp::describe_fix_status(static_cast<vlp::FixStatus>(code)).data();
}

const char* vlp_last_error(void) { return vlp::last_error.data(); }
