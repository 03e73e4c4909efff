// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The Python module vlp: functions of the toolbox for notebooks, with numpy arrays.
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "camera/lens.h"
#include "captures/detections_table.h"
#include "captures/fixes_table.h"
#include "captures/truth_table.h"
#include "lamps/light_detector.h"
#include "lamps/signal/lamp_classifier.h"
#include "lamps/signal/lamp_map_check.h"
#include "positioning/image_fix.h"
#include "positioning/positioner.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"

namespace py = pybind11;

namespace vlp {
namespace {

using namespace pybind11::literals;

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int, py::array::c_style | py::array::forcecast>;
using Pair = std::array<double, 2>;
/// Rows of two or three numbers, which become arrays (n, 2) and (n, 3).
using Rows2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kStatuses = static_cast<int>(FixStatus::row_time_unknown) + 1;

/// Returns the number of rows of an array with `columns` columns.
py::ssize_t count_rows(const Doubles& array, py::ssize_t columns, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != columns) {
    throw std::invalid_argument(std::string(name) + " should have the shape (n, " +
                                std::to_string(columns) + ")");
  }
  return array.shape(0);
}

template <typename Wide>
bool do_all_fit_int32(const py::array& array) {
  const auto wide = py::array_t<Wide, py::array::c_style | py::array::forcecast>::ensure(array);
  return wide && std::all_of(wide.data(), wide.data() + wide.size(),
                             [](Wide value) { return std::in_range<int>(value); });
}

/// Converts to integers with checks: numpy would truncate 1.7 to 1 and wrap larger numbers.
Integers to_integers(const py::object& given, const char* name) {
  const auto array = py::array::ensure(given);
  const char kind = array ? array.dtype().kind() : '?';
  // numpy converts an empty list to an array of floats.
  const bool whole = (kind == 'i' && do_all_fit_int32<std::int64_t>(array)) ||
                     (kind == 'u' && do_all_fit_int32<std::uint64_t>(array)) ||
                     (kind == 'f' && array.size() == 0);
  if (!whole) throw std::invalid_argument(std::string(name) + " should be integers, of 32 bits");
  return Integers::ensure(array);
}

void check_length(const py::array& array, std::size_t length, const char* name) {
  if (array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != length) {
    throw std::invalid_argument(std::string(name) + " should be one for each detection, " +
                                std::to_string(length));
  }
}

/// Position and covariance of a frame without a fix.
const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(kNone);
const BodyCovariance kUnknown = BodyCovariance::Constant(kNone);

// Lamp map, calibration, lens

LampMapFile make_lamp_map_file(const std::filesystem::path& file,
                               const std::optional<std::string>& room) {
  return read_lamps_and_rooms(file, room.value_or(""));
}

Rows3 get_lamp_positions(const LampMapFile& lamps) {
  Rows3 positions(std::ssize(lamps.map.lamps), 3);
  Eigen::Index row = 0;
  for (const Lamp& lamp : lamps.map.lamps) positions.row(row++) = lamp.position_m;
  return positions;
}

Eigen::VectorXi get_lamp_ids(const LampMapFile& lamps) {
  Eigen::VectorXi ids(std::ssize(lamps.map.lamps));
  std::ranges::transform(lamps.map.lamps, ids.begin(), &Lamp::id);
  return ids;
}

Lens make_lens(const std::string& model, const std::vector<double>& intrinsics) {
  const auto known = lens_model_from_name(model);
  if (!known) throw std::invalid_argument("there are " + list_lens_model_names());
  return Lens(*known, intrinsics);
}

Rows2 project(const Lens& lens, const Doubles& points) {
  Rows2 pixels(count_rows(points, 3, "points"), 2);
  for (Eigen::Index i = 0; i < pixels.rows(); ++i) {
    const auto pixel = lens.project_point(Eigen::Vector3d(points.data() + 3 * i));
    pixels.row(i) = pixel.value_or(Eigen::Vector2d::Constant(kNone));
  }
  return pixels;
}

Rows3 unproject(const Lens& lens, const Doubles& pixels) {
  Rows3 rays(count_rows(pixels, 2, "pixels"), 3);
  for (Eigen::Index i = 0; i < rays.rows(); ++i) {
    const auto ray = lens.unproject_pixel(Eigen::Vector2d(pixels.data() + 2 * i));
    rays.row(i) = ray ? ray->direction.normalized() : kNowhere;
  }
  return rays;
}

// Fixes

Correction parse_correction(const std::string& name) {
  const std::array<std::pair<const char*, Correction>, 4> all = {
      {{"none", Correction::none},
       {"rotation", Correction::rotation},
       {"dispersion", Correction::dispersion},
       {"all", Correction::all}}};
  for (const auto& [known, correction] : all) {
    if (name == known) return correction;
  }
  throw std::invalid_argument("correction should be none, rotation, dispersion or all");
}

Positioner make_positioner(const LampMapFile& lamps, const Calibration& calibration,
                           const std::string& correction,
                           const std::optional<std::array<double, 4>>& mount,
                           double unstated_sigma_px, double max_residual_fraction) {
  PositionerOptions options;
  options.correction = parse_correction(correction);
  if (mount) options.mount = CameraMount{{(*mount)[0], (*mount)[1], (*mount)[2]}, (*mount)[3]};
  options.unstated_sigma_px = unstated_sigma_px;
  options.max_residual_fraction = max_residual_fraction;
  return {lamps.map, calibration, options};
}

using StateVector = Eigen::Matrix<double, kBodyStates, 1>;

StateVector make_state_array(const BodyState& state) {
  const auto& [pose, motion] = state;
  StateVector array;
  array << pose.position_m, pose.yaw_rad, motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
      motion.inclination.roll_rad, motion.inclination.pitch_rad;
  return array;
}

BodyState make_state(const StateVector& array) {
  return {{array.head<3>(), array[kBodyYaw]},
          {array.segment<2>(kBodyVelocity),
           array[kBodyYawRate],
           {array[kBodyRoll], array[kBodyPitch]}}};
}

Sensors make_sensor_data(const std::optional<Pair>& inclination_rad, double inclination_sigma_rad,
                         const std::optional<Pair>& height_and_yaw, const Pair& height_and_yaw_sd,
                         const std::optional<Pair>& velocity_m_per_s, double velocity_sd_m_per_s,
                         double yaw_rate_rad_per_s, double yaw_rate_sd_rad_per_s,
                         const std::optional<Pair>& height_m, const std::optional<double>& time_s,
                         const std::optional<std::pair<StateVector, BodyCovariance>>& prior) {
  Sensors sensors;
  if (inclination_rad) sensors.inclination = {(*inclination_rad)[0], (*inclination_rad)[1]};
  sensors.inclination_sigma_rad = inclination_sigma_rad;
  if (height_and_yaw) {
    sensors.height_and_yaw = {(*height_and_yaw)[0], (*height_and_yaw)[1], height_and_yaw_sd[0],
                              height_and_yaw_sd[1]};
  }
  if (velocity_m_per_s || velocity_sd_m_per_s != 0 || yaw_rate_rad_per_s != 0 ||
      yaw_rate_sd_rad_per_s != 0) {
    const Pair velocity = velocity_m_per_s.value_or(Pair{0, 0});
    sensors.motion = KnownMotion{
        {velocity[0], velocity[1]}, yaw_rate_rad_per_s, velocity_sd_m_per_s, yaw_rate_sd_rad_per_s};
  }
  if (height_m) sensors.height = {(*height_m)[0], (*height_m)[1]};
  sensors.time_s = time_s;
  if (prior) sensors.prior = StatePrior{make_state(prior->first), prior->second};
  return sensors;
}

std::vector<Detection> make_detections(const Integers& lamps, const Doubles& pixels,
                                       const std::optional<Doubles>& sigma_px) {
  const auto n = static_cast<std::size_t>(count_rows(pixels, 2, "pixels"));
  check_length(lamps, n, "lamps");
  if (sigma_px) check_length(*sigma_px, n, "sigma_px");
  std::vector<Detection> detections(n);
  for (std::size_t i = 0; i < n; ++i) {
    detections[i] = {lamps.data()[i], Eigen::Vector2d(pixels.data() + 2 * i), {}};
    // Tables have NaN for an unknown sigma.
    if (sigma_px && !std::isnan(sigma_px->data()[i])) detections[i].sigma_px = sigma_px->data()[i];
  }
  return detections;
}

/// Lamps, pixels, sigma_px of an earlier frame, and the time from it to the frame of the fix.
using EarlierArrays = std::tuple<py::object, Doubles, std::optional<Doubles>, double>;

Fix locate(const Positioner& positioner, const py::object& lamps, const Doubles& pixels,
           const std::optional<Doubles>& sigma_px, const Sensors& sensors,
           const std::vector<EarlierArrays>& earlier) {
  const auto detections = make_detections(to_integers(lamps, "lamps"), pixels, sigma_px);
  if (earlier.empty()) return positioner.compute_position_fix(detections, sensors);
  std::vector<std::vector<Detection>> before;
  std::vector<EarlierFrame> frames;
  for (const auto& [ids, at, sigma, before_s] : earlier) {
    before.push_back(make_detections(to_integers(ids, "lamps"), at, sigma));
    frames.push_back({before.back(), before_s});  // a frame's detections keep their address
  }
  return positioner.compute_position_fix(detections, sensors, frames);
}

/// Returns the index at which each run of equal numbers begins, and the number of elements.
std::vector<std::size_t> list_frame_begins(const Integers& frames) {
  const auto n = static_cast<std::size_t>(frames.shape(0));
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < n; ++i) {
    if (i == 0 || frames.data()[i] != frames.data()[i - 1]) begins.push_back(i);
  }
  begins.push_back(n);
  return begins;
}

py::dict locate_frames(const Positioner& positioner, const py::object& frame_of_each,
                       const py::object& lamps, const Doubles& pixels,
                       const std::optional<Doubles>& sigma_px, const Sensors& sensors) {
  const auto detections = make_detections(to_integers(lamps, "lamps"), pixels, sigma_px);
  const Integers frames = to_integers(frame_of_each, "frames");
  check_length(frames, detections.size(), "frames");
  const auto begins = list_frame_begins(frames);
  const auto n = static_cast<py::ssize_t>(begins.size()) - 1;
  Eigen::VectorXi frame(n), status(n), used(n);
  Rows3 position(n, 3);
  Eigen::VectorXd yaw(n), residual(n);
  Doubles covariance(std::vector<py::ssize_t>{n, kBodyStates, kBodyStates});
  double* const covariance_out = covariance.mutable_data();
  const int* const frame_in = frames.data();
  {
    const py::gil_scoped_release others_may_run;
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t begin = begins[static_cast<std::size_t>(i)];
      const std::size_t end = begins[static_cast<std::size_t>(i) + 1];
      const Fix fix =
          positioner.compute_position_fix({detections.data() + begin, end - begin}, sensors);
      const bool ok = fix.has_succeeded();
      frame[i] = frame_in[begin];
      status[i] = static_cast<int>(fix.status);
      used[i] = ok ? fix.lamps : 0;
      position.row(i) = ok ? fix.state.pose.position_m : kNowhere;
      yaw[i] = ok ? fix.state.pose.yaw_rad : kNone;
      residual[i] = ok ? fix.residual_px : kNone;
      Eigen::Map<BodyCovariance>(covariance_out + kUnknown.size() * i) =  // symmetric
          ok ? fix.covariance : kUnknown;
    }
  }
  return py::dict("frame"_a = frame, "status"_a = status, "position_m"_a = position,
                  "yaw_rad"_a = yaw, "covariance"_a = covariance, "residual_px"_a = residual,
                  "lamps"_a = used);
}

std::vector<std::pair<StateVector, double>> list_candidates(const Fix& fix) {
  std::vector<std::pair<StateVector, double>> candidates;
  for (const auto& [state, likelihood] :
       std::span(fix.candidates).first(static_cast<std::size_t>(fix.num_candidates))) {
    candidates.emplace_back(make_state_array(state), likelihood);
  }
  return candidates;
}

using JacobianByRows = Eigen::Matrix<double, 2, kBodyStates, Eigen::RowMajor>;

py::tuple project_lamp(const Positioner& positioner, int lamp, const StateVector& state) {
  const LampProjection projection = positioner.project_lamp(lamp, make_state(state));
  return py::make_tuple(projection.pixel, JacobianByRows(projection.jacobian));
}

py::dict compute_residuals(const Positioner& positioner, const py::object& lamps,
                           const Doubles& pixels, const Fix& fix) {
  if (!fix.has_succeeded()) {
    throw std::invalid_argument("the fix has no state: " +
                                std::string(fix_status_name(fix.status)));
  }
  const auto detections = make_detections(to_integers(lamps, "lamps"), pixels, std::nullopt);
  const auto n = std::ssize(detections);
  constexpr std::array uses{"used", "rejected", "not_in_map"};
  py::list use;
  Rows2 predicted(n, 2), residual(n, 2);
  Doubles jacobian(std::vector<py::ssize_t>{n, 2, kBodyStates});
  for (Eigen::Index i = 0; i < n; ++i) {
    const DetectionResidual of =
        positioner.compute_detection_residual(detections[static_cast<std::size_t>(i)], fix);
    use.append(uses[static_cast<std::size_t>(of.use)]);
    predicted.row(i) = of.predicted.pixel;
    residual.row(i) = of.residual_px;
    Eigen::Map<JacobianByRows>(jacobian.mutable_data(i)) = of.predicted.jacobian;
  }
  return py::dict("use"_a = use, "predicted_px"_a = predicted, "residual_px"_a = residual,
                  "jacobian"_a = jacobian);
}

std::vector<int> list_rejected_ids(const Fix& fix) {
  const auto count =
      std::min(static_cast<std::size_t>(fix.rejected_lamps), fix.rejected_ids.size());
  return {fix.rejected_ids.begin(), fix.rejected_ids.begin() + static_cast<std::ptrdiff_t>(count)};
}

std::string to_repr(const Fix& fix) {
  if (!fix.has_succeeded()) return "<vlp.Fix: " + std::string(fix_status_name(fix.status)) + ">";
  const Pose& pose = fix.state.pose;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "<vlp.Fix: x %.4f m, y %.4f m, z %.4f m, yaw %.4f rad>",
                pose.position_m.x(), pose.position_m.y(), pose.position_m.z(), pose.yaw_rad);
  return text.data();
}

// Lamps in images

/// Returns a view of the array's memory, whose rows are in order.
ImageView make_image_view(const py::array& array) {
  const bool bytes = py::isinstance<py::array_t<std::uint8_t>>(array);
  if (array.ndim() != 2 || array.size() == 0 ||
      !(bytes || py::isinstance<py::array_t<std::uint16_t>>(array))) {
    throw std::invalid_argument("an image should have the shape (rows, columns), uint8 or uint16");
  }
  return {array.data(), static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
          array.strides(0), bytes ? 8 : 16};
}

py::tuple to_arrays(const std::vector<Detection>& detections) {
  const auto n = std::ssize(detections);
  Eigen::VectorXi lamps(n);
  Rows2 pixels(n, 2);
  Eigen::VectorXd sigma_px(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Detection& detection = detections[static_cast<std::size_t>(i)];
    lamps[i] = detection.lamp;
    pixels.row(i) = detection.pixel;
    sigma_px[i] = detection.sigma_px.value_or(kNone);
  }
  return py::make_tuple(lamps, pixels, sigma_px);
}

/// A detector and the image size for which it was made.
struct ImageDetector {
  LightDetector detector;
  std::array<int, 2> imager_px;
};

std::string format_pixel_size(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// Returns the pixels of an image of the camera. @throws std::invalid_argument for another size
ImageView make_view_of_camera_image(const py::array& rows, const std::array<int, 2>& imager_px) {
  const ImageView image = make_image_view(rows);
  if (image.width != imager_px[0] || image.height != imager_px[1]) {
    throw std::invalid_argument("the image is " + format_pixel_size(image.width, image.height) +
                                ", the calibration's camera has " +
                                format_pixel_size(imager_px[0], imager_px[1]) + " px");
  }
  return image;
}

py::tuple detect(const ImageDetector& of_camera, const py::array& array) {
  const auto& [detector, imager_px] = of_camera;
  const auto rows = py::array::ensure(array, py::array::c_style);
  const ImageView image = make_view_of_camera_image(rows, imager_px);
  std::vector<Detection> detections;
  {
    const py::gil_scoped_release others_may_run;
    detections = select_lamps(detector.detect_lights(image));
  }
  return to_arrays(detections);
}

py::tuple locate_image(const Positioner& positioner, const ImageDetector& of_camera,
                       const py::array& array, const Sensors& sensors) {
  const LightDetector& detector = of_camera.detector;
  const auto rows = py::array::ensure(array, py::array::c_style);
  const ImageView image = make_view_of_camera_image(rows, of_camera.imager_px);
  const auto inclination = sensors.known_inclination();
  ImageFix found;
  {
    const py::gil_scoped_release others_may_run;
    const auto detect_in_plane = [&](const std::optional<Eigen::Matrix3d>& level_from_camera) {
      return select_lamps(detector.copy_for_tilt(level_from_camera).detect_lights(image));
    };
    found = locate_with_repeated_detection(
        positioner, sensors,
        inclination ? detect_in_plane(positioner.compute_level_from_camera(*inclination))
                    : select_lamps(detector.detect_lights(image)),
        detect_in_plane);
  }
  return py::make_tuple(found.fix, to_arrays(found.detections));
}

ImageDetector make_detector(const LampMapFile& lamps, const Calibration& calibration,
                            const std::optional<std::filesystem::path>& classifier) {
  if (!calibration.camera.row_time_s) {
    throw std::invalid_argument(
        "the calibration has no row_time_s, which is needed to identify lamps");
  }
  std::optional<LampClassifier> trained;
  if (classifier) {
    trained = read_lamp_classifier(*classifier);
  } else if (const auto error = explain_room_choice(lamps, "the argument room of LampMap");
             !error.empty()) {
    throw InputError(lamps.file, error);
  }
  return {{lamps.map, make_detector_camera(calibration), std::move(trained)},
          calibration.camera.imager_px};
}

// Tables

py::dict make_detections_dict(const std::filesystem::path& file) {
  const auto read = read_detections(file);
  std::vector<Detection> all;
  std::vector<int> frames;
  py::list images;
  for (const Frame& frame : read) {
    frames.insert(frames.end(), frame.detections.size(), static_cast<int>(images.size()));
    all.insert(all.end(), frame.detections.begin(), frame.detections.end());
    images.append(frame.image);
  }
  const py::tuple arrays = to_arrays(all);
  return py::dict("images"_a = images, "frames"_a = Integers(std::ssize(frames), frames.data()),
                  "lamps"_a = arrays[0], "pixels"_a = arrays[1], "sigma_px"_a = arrays[2]);
}

py::dict make_fixes_dict(const std::filesystem::path& file) {
  const auto rows = read_fixes(file);
  const auto n = std::ssize(rows);
  py::list images, statuses;
  Rows3 position(n, 3);
  Eigen::VectorXd yaw(n);
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> sd(n, 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const FixRow& row = rows[static_cast<std::size_t>(i)];
    images.append(row.image);
    statuses.append(row.status);
    position.row(i) = row.fix ? row.fix->pose.position_m : kNowhere;
    yaw[i] = row.fix ? row.fix->pose.yaw_rad : kNone;
    sd.row(i).setConstant(kNone);
    if (row.fix && row.fix->sd) sd.row(i) = *row.fix->sd;
  }
  return py::dict("images"_a = images, "statuses"_a = statuses, "position_m"_a = position,
                  "yaw_rad"_a = yaw, "sd"_a = sd);
}

py::dict make_truth_dict(const std::filesystem::path& file) {
  const auto rows = read_truth_table(file);
  const auto n = std::ssize(rows);
  py::list images;
  Rows3 position(n, 3);
  Eigen::VectorXd yaw(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TruthRow& row = rows[static_cast<std::size_t>(i)];
    images.append(row.image);
    position.row(i) << row.xy_m.x(), row.xy_m.y(), row.z_m.value_or(kNone);
    yaw[i] = row.yaw_rad.value_or(kNone);
  }
  return py::dict("images"_a = images, "position_m"_a = position, "yaw_rad"_a = yaw);
}

/// Throws ImportError if this module cannot read the arrays of the installed numpy: pybind11 before
/// 2.12 reads the size of an element from an offset that NumPy 2 does not use, and would return the
/// first element of an array for all.
void check_numpy() {
  constexpr unsigned first_with_numpy_2 = 0x020C0000;
  if (PYBIND11_VERSION_HEX >= first_with_numpy_2) return;
  const auto version = py::module_::import("numpy").attr("__version__").cast<std::string>();
  if (std::stoi(version) < 2) return;
  throw py::import_error("vlp was built with pybind11 " + std::to_string(PYBIND11_VERSION_MAJOR) +
                         "." + std::to_string(PYBIND11_VERSION_MINOR) +
                         ", which does not support NumPy " + version +
                         ": install \"numpy<2\", or build vlp with pybind11 2.12 or later");
}

/// Defines the statuses of fixes and their explanations.
void define_statuses(py::module_& m) {
  py::list statuses;
  for (int i = 0; i < kStatuses; ++i) statuses.append(fix_status_name(static_cast<FixStatus>(i)));
  m.attr("STATUSES") = py::tuple(statuses);
  m.def(
      "explanation",
      [](int status) {
        if (status < 0 || status >= kStatuses) throw std::invalid_argument("no such status");
        return describe_fix_status(static_cast<FixStatus>(status));
      },
      "status"_a, "Description of a status (index in STATUSES), with its remedy.");
}

/// Defines lamp map, lens and calibration.
void define_calibration(py::module_& m) {
  py::class_<LampMapFile>(m, "LampMap", "The lamps of a room, lamps.yaml.")
      .def(py::init(&make_lamp_map_file), "file"_a, "room"_a = py::none(),
           "room: only the lamps that state this room; None: all lamps.")
      .def_property_readonly("ids", &get_lamp_ids)
      .def_property_readonly("positions_m", &get_lamp_positions, "(n, 3), in the world.")
      .def("__len__", [](const LampMapFile& lamps) { return lamps.map.lamps.size(); });

  py::class_<Lens>(m, "Lens", "A lens: directions to pixels and back.")
      .def(py::init(&make_lens), "model"_a, "intrinsics"_a, "By mrcal's name, with its parameters.")
      .def("project", &project, "points"_a,
           "Pixels (n, 2) of points (n, 3) in the camera; NaN where the lens has none.")
      .def("unproject", &unproject, "pixels"_a,
           "Unit directions (n, 3) in the camera of pixels (n, 2); NaN where the lens has none.");

  py::class_<Calibration>(m, "Calibration", "Calibration of a camera, calibration.yaml.")
      .def(py::init(&read_calibration), "file"_a)
      .def_property_readonly("camera_id", [](const Calibration& c) { return c.camera.id; })
      .def_property_readonly(
          "imager_px", [](const Calibration& c) { return c.camera.imager_px; }, "Width and height.")
      .def_property_readonly(
          "lens_model", [](const Calibration& c) { return lens_model_name(c.camera.lens_model); })
      .def_property_readonly("intrinsics",
                             [](const Calibration& c) -> Eigen::VectorXd {
                               return Eigen::VectorXd::Map(c.camera.intrinsics.data(),
                                                           std::ssize(c.camera.intrinsics));
                             })
      .def_property_readonly("row_time_s", [](const Calibration& c) { return c.camera.row_time_s; })
      .def_property_readonly("lens", [](const Calibration& c) {
        return Lens(c.camera.lens_model, c.camera.intrinsics);
      });
}

/// Defines the fix of a frame.
void define_fix(py::module_& m) {
  py::class_<Fix>(m, "Fix", "Result for one frame; values are NaN if it is not ok.")
      .def_property_readonly("ok", &Fix::has_succeeded)
      .def_property_readonly("status", [](const Fix& fix) { return fix_status_name(fix.status); })
      .def_property_readonly("explanation",
                             [](const Fix& fix) { return describe_fix_status(fix.status); })
      .def_property_readonly(
          "position_m",
          [](const Fix& fix) { return fix.has_succeeded() ? fix.state.pose.position_m : kNowhere; })
      .def_property_readonly(
          "yaw_rad",
          [](const Fix& fix) { return fix.has_succeeded() ? fix.state.pose.yaw_rad : kNone; })
      .def_property_readonly(
          "state",
          [](const Fix& fix) -> StateVector {
            return fix.has_succeeded() ? make_state_array(fix.state) : StateVector(kUnknown.col(0));
          },
          "(9), x, y, z, yaw, velocity along the axes of the level frame (2), yaw rate, roll,\n"
          "pitch; as given where not estimated.")
      .def_property_readonly(
          "covariance",
          [](const Fix& fix) { return fix.has_succeeded() ? fix.covariance : kUnknown; },
          "(9, 9), covariance of `state` from all known error sources; 0 where given as exact.")
      .def_property_readonly(
          "noise_covariance",
          [](const Fix& fix) { return fix.has_succeeded() ? fix.noise_covariance : kUnknown; },
          "The part that is of this frame alone and averages out.")
      .def_property_readonly(
          "candidates", &list_candidates,
          "If the status is ambiguous: (state, likelihood) of each state that explains the frame.")
      .def_readonly("chi_squared", &Fix::chi_squared)
      .def_readonly("redundancy", &Fix::redundancy, "Degrees of freedom of chi_squared.")
      .def_property_readonly(
          "residual_px",
          [](const Fix& fix) { return fix.has_succeeded() ? fix.residual_px : kNone; })
      .def_readonly("lamps", &Fix::lamps, "Used for the fix.")
      .def_readonly("rejected_lamps", &Fix::rejected_lamps)
      .def_property_readonly(
          "rejected_ids", &list_rejected_ids,
          "Lamps that were left out because the others contradict them, the first 32.")
      .def_readonly("unknown_lamps", &Fix::unknown_lamps)
      .def_readonly("time_s", &Fix::time_s)
      .def("__repr__", &to_repr);
}

/// Defines sensors, positioner and lamp detector.
void define_positioner(py::module_& m) {
  py::class_<Sensors>(m, "Sensors", "Sensor readings of the robot for a frame.")
      .def(
          py::init(&make_sensor_data), py::kw_only(), "inclination_rad"_a = py::none(),
          "inclination_sigma_rad"_a = 0.0, "height_and_yaw"_a = py::none(),
          "height_and_yaw_sd"_a = Pair{0, 0}, "velocity_m_per_s"_a = py::none(),
          "velocity_sd_m_per_s"_a = 0.0, "yaw_rate_rad_per_s"_a = 0.0,
          "yaw_rate_sd_rad_per_s"_a = 0.0, "height_m"_a = py::none(), "time_s"_a = py::none(),
          "prior"_a = py::none(),
          "inclination_rad: (roll, pitch), and its standard deviation, with which they are\n"
          "estimated. height_and_yaw: (z, yaw) of the camera, for fixes of one lamp;\n"
          "height_and_yaw_sd: their standard deviations. velocity_m_per_s: in\n"
          "the level frame; with standard deviations it is estimated. height_m: (z, sd), with a\n"
          "standard deviation that is positive. prior: (state (9), covariance (9, 9)) in place of\n"
          "the others; infinite variance of x, y, z or yaw: unknown, 0: exact.");

  py::class_<Positioner>(m, "Positioner", "From identified lamps in an image to a position.")
      .def(py::init(&make_positioner), "lamp_map"_a, "calibration"_a, py::kw_only(),
           "correction"_a = "all", "mount"_a = py::none(), "unstated_sigma_px"_a = 1.0,
           "max_residual_fraction"_a = 0.1,
           "mount: (x, y, z, yaw) of the camera on the robot, whose fixes it then makes.")
      .def("locate", &locate, "lamps"_a, "pixels"_a, "sigma_px"_a = py::none(),
           "sensors"_a = Sensors(), py::kw_only(), "earlier"_a = std::vector<EarlierArrays>(),
           "The Fix of one frame, from ids (n), pixels (n, 2), their standard deviations (n).\n"
           "earlier: frames from shortly before, (lamps, pixels, sigma_px, before_s) each, which\n"
           "determine velocity, yaw rate, roll and pitch together with this one.")
      .def(
          "locate_frames", &locate_frames, "frames"_a, "lamps"_a, "pixels"_a,
          "sigma_px"_a = py::none(), "sensors"_a = Sensors(),
          "Fixes of many frames: the detections of one follow each other and have the same number\n"
          "in `frames`. A dict of arrays, a row for each frame: frame, status (an index of\n"
          "STATUSES, 0: ok), position_m, yaw_rad, covariance, residual_px, lamps.")
      .def("project", &project_lamp, "lamp"_a, "state"_a,
           "Pixel (2) of a lamp at a state (9), and its derivatives (2, 9); NaN if the map lacks "
           "it\n"
           "or the lens does not image it.")
      .def("locate_image", &locate_image, "detector"_a, "image"_a, "sensors"_a = Sensors(),
           "The Fix of an image, and its detections as LampDetector.detect returns them. If roll "
           "and\n"
           "pitch are estimated, lamps are detected again in the plane that is level by the fix.")
      .def("residuals", &compute_residuals, "lamps"_a, "pixels"_a, "fix"_a,
           "Detections of the frame of a fix compared with it. A dict, a row for each: use (used,\n"
           "rejected, not_in_map), predicted_px, residual_px, jacobian (2, 9) by the state.");

  py::class_<ImageDetector>(m, "LampDetector", "Finds and identifies the lamps of a map in images.")
      .def(py::init(&make_detector), "lamp_map"_a, "calibration"_a, "classifier"_a = py::none(),
           "classifier: the file of one that vlp-train made, instead of the map's frequencies.")
      .def("detect", &detect, "image"_a,
           "(lamps, pixels, sigma_px) of the lamps wholly in view, as Positioner.locate takes "
           "them;\n"
           "the image has the camera's shape (rows, columns), uint8 or uint16.");
}

/// Defines the readers of tables.
void define_tables(py::module_& m) {
  m.def("read_detections", &make_detections_dict, "file"_a,
        "detections.csv as a dict: images, and for each detection frames (an index of images),\n"
        "lamps, pixels, sigma_px.");
  m.def("read_fixes", &make_fixes_dict, "file"_a,
        "fixes.csv as a dict: images, statuses, position_m, yaw_rad, sd (n, 4).");
  m.def("read_truth", &make_truth_dict, "file"_a,
        "truth.csv as a dict: images, position_m, yaw_rad.");
}

}  // namespace
}  // namespace vlp

PYBIND11_MODULE(vlp, m) {
  using namespace vlp;
  check_numpy();
  m.doc() =
      "Positions from modulated ceiling lamps: lens, lamp map, calibration, lamps in images, "
      "fixes.\n\n"
      "Meters, radians, seconds, pixels; the world has z up, yaw is counter-clockwise seen from\n"
      "above, the center of an image's top left pixel is (0, 0). Nothing is None, or NaN in "
      "arrays.";
  m.attr("__version__") = VLP_VERSION;
  py::register_exception<InputError>(m, "InputError", PyExc_ValueError).doc() =
      "A file that is bad: file, line, key, and what to do.";
  define_statuses(m);
  define_calibration(m);
  define_fix(m);
  define_positioner(m);
  define_tables(m);
}
