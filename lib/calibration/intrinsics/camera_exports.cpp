// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/camera_exports.h"

#include <stdexcept>
#include <vector>

#include "calibration/intrinsics/board_problem.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

std::string format_list(const std::vector<double>& values) {
  std::string text = "[";
  for (const double value : values) {
    text.append(text.size() > 1 ? ", " : "").append(format_exact_number(value));
  }
  return text + "]";
}

std::vector<double> make_camera_matrix(const Camera& camera) {
  const auto& p = camera.intrinsics;
  return {p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1};
}

/// Returns the distortion coefficients in the order of OpenCV, which mrcal shares, padded with
/// zeros to at least `min_count`.
std::vector<double> pad_distortions(const Camera& camera, std::size_t min_count) {
  std::vector<double> values(camera.intrinsics.begin() + 4, camera.intrinsics.end());
  if (values.size() < min_count) values.resize(min_count, 0);
  return values;
}

[[noreturn]] void throw_unsupported(const Camera& camera, const char* format, const char* known) {
  throw std::invalid_argument(std::string(format) + " has no lens model like " +
                              std::string(lens_model_name(camera.lens_model)) + "; use --lens " +
                              known);
}

/// Returns ROS's name of the distortion model; nullptr if it has none.
const char* ros_distortion(LensModel model) {
  switch (model) {
    case LensModel::pinhole:
    case LensModel::opencv4:
    case LensModel::opencv5:
      return "plumb_bob";
    case LensModel::opencv8:
      return "rational_polynomial";
    case LensModel::fisheye:
      return "equidistant";
    default:
      return nullptr;
  }
}

/// Returns a camera's name as YAML. Throws std::invalid_argument if the name has control characters
/// or is not UTF-8, which not every reader accepts.
std::string quoted_name(const std::string& name) {
  constexpr unsigned char first_printable = 0x20, del = 0x7f;
  std::string quoted = "'";
  for (const char character : name) {
    const auto byte = static_cast<unsigned char>(character);
    if (byte < first_printable || byte == del || count_utf8_prefix(name) < name.size()) {
      throw std::invalid_argument(
          "the camera id contains control characters or is not UTF-8; give another one with "
          "--camera-id");
    }
    quoted += character == '\'' ? std::string("''") : std::string(1, character);
  }
  return quoted + "'";
}

std::string opencv_matrix(const char* name, int rows, const std::vector<double>& values) {
  const std::size_t cols = values.size() / static_cast<std::size_t>(rows);
  std::string text(name);
  text.append(": !!opencv-matrix\n   rows: ").append(std::to_string(rows));
  text.append("\n   cols: ").append(std::to_string(cols));
  text.append("\n   dt: d\n   data: ").append(format_list(values)).append("\n");
  return text;
}

}  // namespace

std::string format_ros(const Camera& camera) {
  const LensModel model = camera.lens_model;
  const char* const distortion = ros_distortion(model);
  if (distortion == nullptr)
    throw_unsupported(camera, "ROS", "LENSMODEL_OPENCV8 or OPENCV_FISHEYE");
  const std::size_t count = model == LensModel::opencv8 ? 8 : model == LensModel::fisheye ? 4 : 5;
  const auto& p = camera.intrinsics;
  std::string text = "image_width: " + std::to_string(camera.imager_px[0]);
  text.append("\nimage_height: ").append(std::to_string(camera.imager_px[1]));
  text.append("\ncamera_name: ").append(quoted_name(camera.id));
  text.append("\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: ")
      .append(format_list(make_camera_matrix(camera)));
  text.append("\ndistortion_model: ").append(distortion);
  text.append("\ndistortion_coefficients:\n  rows: 1\n  cols: ").append(std::to_string(count));
  text.append("\n  data: ").append(format_list(pad_distortions(camera, count)));
  text.append("\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: ");
  text.append("[1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: ");
  text.append(format_list({p[0], 0, p[2], 0, 0, p[1], p[3], 0, 0, 0, 1, 0}));
  return text + "\n";
}

std::string format_camchain(const Camera& camera) {
  const bool fisheye = camera.lens_model == LensModel::fisheye;
  if (!fisheye && camera.lens_model != LensModel::pinhole &&
      camera.lens_model != LensModel::opencv4) {
    throw_unsupported(camera, "Kalibr", "LENSMODEL_OPENCV4 or OPENCV_FISHEYE");
  }
  const std::vector<double> core(camera.intrinsics.begin(), camera.intrinsics.begin() + 4);
  std::string text = "cam0:\n  camera_model: pinhole\n  intrinsics: " + format_list(core);
  text.append("\n  distortion_model: ").append(fisheye ? "equidistant" : "radtan");
  text.append("\n  distortion_coeffs: ");
  text.append(format_list(pad_distortions(camera, 4)));
  text.append("\n  resolution: [").append(std::to_string(camera.imager_px[0])).append(", ");
  text.append(std::to_string(camera.imager_px[1])).append("]\n  rostopic: /cam0/image_raw\n");
  return text;
}

std::string format_opencv(const Camera& camera) {
  if (ros_distortion(camera.lens_model) == nullptr && camera.lens_model != LensModel::opencv12) {
    throw_unsupported(camera, "OpenCV", "LENSMODEL_OPENCV8 or OPENCV_FISHEYE");
  }
  std::string text = "%YAML:1.0\n---\nimage_width: " + std::to_string(camera.imager_px[0]);
  text.append("\nimage_height: ").append(std::to_string(camera.imager_px[1])).append("\n");
  if (camera.lens_model == LensModel::fisheye) text.append("distortion_model: fisheye\n");
  text.append(opencv_matrix("camera_matrix", 3, make_camera_matrix(camera)));
  text.append(opencv_matrix("distortion_coefficients", 1, pad_distortions(camera, 4)));
  return text;
}

std::string format_mrcal_region(const ImageRegion& region) {
  if (region.empty()) return "";
  std::string text = "    'valid_intrinsics_region': [";
  for (std::size_t i = 0; i <= region.size(); ++i) {  // closed
    const Eigen::Vector2d& corner = region[i % region.size()];
    text.append(i > 0 ? ", " : "").append(format_list({corner.x(), corner.y()}));
  }
  return text + "],\n";
}

std::string format_cameramodel(const Camera& camera, const ImageRegion& region) {
  if (!can_mrcal_solve(camera.lens_model)) throw_unsupported(camera, "mrcal", "LENSMODEL_OPENCV8");
  std::string text = "{\n    'lensmodel':  '";
  text.append(lens_model_name(camera.lens_model)).append("',\n    'intrinsics': ");
  text.append(format_list(camera.intrinsics)).append(",\n").append(format_mrcal_region(region));
  text.append("    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n    'imagersize': [ ");
  text.append(std::to_string(camera.imager_px[0])).append(", ");
  text.append(std::to_string(camera.imager_px[1])).append(" ]\n}\n");
  return text;
}

}  // namespace vlp
