// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Uses every type of the installed headers and every exported function, so that the debug
/// information of this file contains the complete ABI; see abi_test.sh.
#include <vlp/vlp.h>

#include <vlp/lamps/lamp_detector.h>
#include <vlp/positioning/image_fix.h>
#include <vlp/positioning/positioner.h>
#include <vlp/rig/input_error.h>
#include <optional>
#include <vector>

using namespace vlp;
using Seen = std::span<const Detection>;
using FromName = std::optional<LensModel>(std::string_view);

struct Types {
  LampMap map;
  Lamp lamp;
  LampShape lamp_shape;
  ShapeTraits shape_traits;
  Calibration calibration;
  Camera camera;
  IntrinsicsReport report;
  RotationCenter rotation_center;
  Dispersion dispersion;
  Adjustment adjustment;
  JointCovariance covariance;
  JointCovariance::LampPosition place;
  HistoryEntry entry;
  HistoryEntry::Input input;
  Detection detection;
  EarlierFrame earlier;
  Sensors sensors;
  KnownMotion motion;
  HeightAndYaw height_and_yaw;
  KnownHeight height;
  CameraMount mount;
  PositionerOptions options;
  Correction correction;
  Positioner* positioner;
  LampDetector* detector;
  ImageView image;
  ImageSize image_size;
  PixelBox box;
  InputError* error;
  Fix fix;
  FixStatus status;
  BodyState body;
  ImageFix image_fix;
  StatePrior prior;
  BodyMotion body_motion;
  BodyIndex index;
  FixCandidate candidate;
  LampProjection projection;
  DetectionUse use;
  DetectionResidual residual;
  Pose pose;
  Inclination inclination;
  vlp_options c_options;
  vlp_image c_image;
  vlp_detection c_detection;
  vlp_sensors c_sensors;
  vlp_state c_state;
  vlp_prior c_prior;
  vlp_candidate c_candidate;
  vlp_fix c_fix;
  vlp_residual c_residual;
  vlp_earlier_frame c_earlier;
};

struct Functions {
  decltype(&rotation_about_z) rotation = &rotation_about_z;
  decltype(&level_rotation_from_inclination) from_inclination = &level_rotation_from_inclination;
  decltype(&level_rotation_from_zenith) from_zenith = &level_rotation_from_zenith;
  decltype(&level_point_from_world) from_world = &level_point_from_world;
  std::string_view (*name_of_lens)(LensModel) = &lens_model_name;
  FromName* lens_from_name = &lens_model_from_name;
  decltype(&list_lens_model_names) lens_names = &list_lens_model_names;
  decltype(&num_lens_parameters) parameters = &num_lens_parameters;
  decltype(&read_lamp_map) read_map = &read_lamp_map;
  decltype(&read_lamps_of_room) read_room = &read_lamps_of_room;
  decltype(&write_lamp_map) write_map = &write_lamp_map;
  decltype(&transform_shape_point_to_world) from_shape = &transform_shape_point_to_world;
  decltype(&compute_lamp_outline_points) outline = &compute_lamp_outline_points;
  decltype(&read_calibration) read = &read_calibration;
  decltype(&write_calibration) write = &write_calibration;
  decltype(&compute_level_from_camera_matrix) from_camera = &compute_level_from_camera_matrix;
  std::string_view (*name_of_status)(FixStatus) = &fix_status_name;
  decltype(&describe_fix_status) explanation = &describe_fix_status;
  Fix (Positioner::*locate)(Seen,
                            const Sensors&) const noexcept = &Positioner::compute_position_fix;
  Fix (Positioner::*locate_together)(Seen, const Sensors&, std::span<const EarlierFrame>)
      const noexcept = &Positioner::compute_position_fix;
  std::vector<Detection> (LampDetector::*detect)(const ImageView&) const =
      &LampDetector::detect_lamps;
  std::vector<Detection> (LampDetector::*detect_in_plane)(
      const ImageView&, const std::optional<Eigen::Matrix3d>&) const = &LampDetector::detect_lamps;
  decltype(&locate_with_repeated_detection) repeat = &locate_with_repeated_detection;
  decltype(&locate_camera_in_image) locate_image = &locate_camera_in_image;
  Eigen::Matrix3d (Positioner::*level)(const Inclination&) const =
      &Positioner::compute_level_from_camera;
  LampProjection (Positioner::*project)(int, const BodyState&) const noexcept =
      &Positioner::project_lamp;
  DetectionResidual (Positioner::*compare)(const Detection&, const Fix&) const noexcept =
      &Positioner::compute_detection_residual;
  int (Positioner::*elsewhere)() const noexcept = &Positioner::num_lamps_moved_since_calibration;
  decltype(&vlp_version) c_version = &vlp_version;
  decltype(&vlp_open) c_open = &vlp_open;
  decltype(&vlp_open_room) c_open_room = &vlp_open_room;
  decltype(&vlp_close) c_close = &vlp_close;
  decltype(&vlp_detect) c_detect = &vlp_detect;
  decltype(&vlp_locate_image) c_locate_image = &vlp_locate_image;
  decltype(&vlp_locate) c_locate = &vlp_locate;
  decltype(&vlp_locate_with_earlier) c_locate_with_earlier = &vlp_locate_with_earlier;
  decltype(&vlp_project) c_project = &vlp_project;
  decltype(&vlp_compute_residuals) c_compute_residuals = &vlp_compute_residuals;
  decltype(&vlp_describe_status) c_explanation = &vlp_describe_status;
  decltype(&vlp_last_error) c_last_error = &vlp_last_error;
};

Types* types;
Functions functions;
