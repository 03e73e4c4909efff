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
#include "positioning/image_fix.h"
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

std::int32_t set_error(std::int32_t code, std::string_view message) {
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

static_assert(VLP_STATES == kBodyStates && sizeof(vlp_state) == kBodyStates * sizeof(double));

vlp_state convert_state(const BodyState& state) {
  const auto& [pose, motion] = state;
  const Eigen::Vector3d& at = pose.position_m;
  const Eigen::Vector2d& velocity = motion.velocity_m_per_s;
  return {{at.x(), at.y(), at.z()},     pose.yaw_rad,
          {velocity.x(), velocity.y()}, motion.yaw_rate_rad_per_s,
          motion.inclination.roll_rad,  motion.inclination.pitch_rad};
}

BodyState convert_state(const vlp_state& state) {
  return {{Eigen::Vector3d(state.position_m), state.yaw_rad},
          {Eigen::Vector2d(state.velocity_m_per_s),
           state.yaw_rate_rad_per_s,
           {state.roll_rad, state.pitch_rad}}};
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
  if (sensors.prior != nullptr) {
    using Rows = Eigen::Matrix<double, kBodyStates, kBodyStates, Eigen::RowMajor>;
    result.prior = StatePrior{convert_state(sensors.prior->mean),
                              Eigen::Map<const Rows>(sensors.prior->covariance)};
  }
  return result;
}

template <typename Matrix>
void copy_by_rows(const Matrix& from, double* rows) {
  constexpr int num_rows = Matrix::RowsAtCompileTime;
  Eigen::Map<Eigen::Matrix<double, num_rows, kBodyStates, Eigen::RowMajor>>{rows} = from;
}

void copy_fix(const Fix& from, vlp_fix& fix) {
  fix.status = static_cast<std::int32_t>(from.status);
  fix.unknown_lamps = from.unknown_lamps;
  fix.num_candidates = from.num_candidates;
  for (std::size_t i = 0; std::cmp_less(i, from.num_candidates); ++i) {
    fix.candidates[i] = {convert_state(from.candidates[i].state), from.candidates[i].likelihood};
  }
  if (!from.has_succeeded()) return;
  fix.state = convert_state(from.state);
  copy_by_rows(from.covariance, fix.covariance);
  copy_by_rows(from.noise_covariance, fix.noise_covariance);
  fix.residual_px = from.residual_px;
  fix.chi_squared = from.chi_squared;
  fix.redundancy = from.redundancy;
  fix.lamps = from.lamps;
  fix.rejected_lamps = from.rejected_lamps;
  std::copy(from.rejected_ids.begin(), from.rejected_ids.end(), fix.rejected_ids);
}

/// Returns the code of the exception that is being handled, and keeps its message.
std::int32_t set_error_from_exception() {
  try {
    throw;
  } catch (const InputError& error) {
    return set_error(VLP_BAD_FILE, error.what());
  } catch (const std::invalid_argument& error) {
    return set_error(VLP_BAD_ARGUMENT, error.what());
  } catch (const std::bad_alloc&) {
    return set_error(VLP_NO_MEMORY, "there is not enough memory");
  } catch (const std::exception& error) {
    return set_error(VLP_FAILED, error.what());
  } catch (...) {
    return set_error(VLP_FAILED, "an unknown exception");
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

/// Writes the detections that `detect` returns. Returns an error if there are more than `capacity`.
template <typename Detect>
std::int32_t detect_in_image(const vlp_positioner* positioner, const vlp_image* image,
                             vlp_detection* detections, std::size_t capacity, std::size_t* count,
                             const Detect& detect) {
  if (count != nullptr) *count = 0;
  if (positioner == nullptr || image == nullptr || count == nullptr ||
      (detections == nullptr && capacity > 0)) {
    return set_error(VLP_BAD_ARGUMENT, "a pointer is null");
  }
  if (!positioner->detector) {
    return set_error(VLP_ROW_TIME_UNKNOWN,
                     "the calibration has no row_time_s, which is needed to identify lamps");
  }
  if (!positioner->room_error.empty()) return set_error(VLP_BAD_FILE, positioner->room_error);
  try {
    const std::vector<Detection> seen = detect(*positioner->detector, make_image_view(*image));
    for (std::size_t i = 0; i < std::min(seen.size(), capacity); ++i) {
      detections[i] = {seen[i].lamp, seen[i].pixel.x(), seen[i].pixel.y(),
                       seen[i].sigma_px.value_or(0)};
    }
    *count = seen.size();
    if (seen.size() <= capacity) return VLP_OK;
    return set_error(VLP_TOO_SMALL, "the image shows " + std::to_string(seen.size()) + " lamps");
  } catch (...) {
    return set_error_from_exception();
  }
}

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
  if (positioner == nullptr) return set_error(VLP_BAD_ARGUMENT, "positioner is a null pointer");
  *positioner = nullptr;
  if (lamps_yaml == nullptr || calibration_yaml == nullptr) {
    return set_error(VLP_BAD_ARGUMENT, "the name of a file is a null pointer");
  }
  try {
    const LampMapFile lamps = read_lamps_and_rooms(lamps_yaml, room != nullptr ? room : "");
    const Calibration calibration = read_calibration(calibration_yaml);
    const PositionerOptions chosen =
        options != nullptr ? convert_options(*options) : PositionerOptions();
    std::optional<LampDetector> detector;
    if (calibration.camera.row_time_s) detector.emplace(lamps.map, calibration);
    std::string room_error = explain_room_choice(lamps, "the argument room of vlp_open_room()");
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
  return detect_in_image(
      positioner, image, detections, capacity, count,
      [](const auto& detector, const ImageView& view) { return detector.detect_lamps(view); });
}

int32_t vlp_locate_image(const vlp_positioner* positioner, const vlp_image* image,
                         const vlp_sensors* sensors, vlp_detection* detections, size_t capacity,
                         size_t* count, vlp_fix* fix) {
  using namespace vlp;
  if (fix == nullptr) return set_error(VLP_BAD_ARGUMENT, "a pointer is null");
  *fix = {};
  if (sensors != nullptr) fix->stamp = sensors->stamp;
  const std::int32_t code = detect_in_image(
      positioner, image, detections, capacity, count,
      [&](const auto& detector, const ImageView& view) {
        const Sensors known = sensors != nullptr ? convert_sensors(*sensors) : Sensors();
        ImageFix found = locate_camera_in_image(positioner->positioner, detector, view, known);
        copy_fix(found.fix, *fix);
        return std::move(found.detections);
      });
  if (code != VLP_OK) {
    *fix = {};
    if (sensors != nullptr) fix->stamp = sensors->stamp;
    fix->status = code;
  }
  return fix->status;
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
  copy_fix(frames > 0 ? with.compute_position_fix(frame, known, {before.data(), frames})
                      : with.compute_position_fix(frame, known),
           *fix);
  return fix->status;
}

int32_t vlp_project(const vlp_positioner* positioner, int32_t lamp, const vlp_state* state,
                    double* pixel, double* jacobian) {
  using namespace vlp;
  if (positioner == nullptr || state == nullptr || pixel == nullptr) return VLP_BAD_ARGUMENT;
  Fix fix;
  fix.state = convert_state(*state);
  const auto seen = positioner->positioner.compute_detection_residual({lamp, {0, 0}, {}}, fix);
  if (seen.use == DetectionUse::not_in_map) return VLP_BAD_ARGUMENT;
  if (!seen.predicted.pixel.allFinite()) return VLP_OUTSIDE_LENS;
  std::copy_n(seen.predicted.pixel.data(), 2, pixel);
  if (jacobian != nullptr) copy_by_rows(seen.predicted.jacobian, jacobian);
  return VLP_OK;
}

int32_t vlp_compute_residuals(const vlp_positioner* positioner, const vlp_detection* detections,
                              size_t count, const vlp_fix* fix, vlp_residual* residuals) {
  using namespace vlp;
  if (positioner == nullptr || fix == nullptr || fix->status != VLP_OK ||
      ((detections == nullptr || residuals == nullptr) && count > 0)) {
    return VLP_BAD_ARGUMENT;
  }
  Fix of;
  of.state = convert_state(fix->state);
  of.rejected_lamps = fix->rejected_lamps;
  std::copy_n(fix->rejected_ids, of.rejected_ids.size(), of.rejected_ids.begin());
  for (std::size_t i = 0; i < count; ++i) {
    const vlp_detection& detection = detections[i];
    const auto [use, predicted, residual_px] = positioner->positioner.compute_detection_residual(
        {detection.lamp, {detection.u_px, detection.v_px}, {}}, of);
    vlp_residual& to = residuals[i];
    to.use = static_cast<std::int32_t>(use);
    std::copy_n(predicted.pixel.data(), 2, to.predicted_px);
    std::copy_n(residual_px.data(), 2, to.residual_px);
    copy_by_rows(predicted.jacobian, to.jacobian);
  }
  return VLP_OK;
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
