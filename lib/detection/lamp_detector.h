// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "camera/lens.h"
#include "detection/lamp_classifier.h"
#include "detection/outline.h"
#include "detection/stripes.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// What became of a light in an image.
enum class LightKind {
  lamp,     ///< wholly in the image and identified: fit for a fix
  cut,      ///< identified, but the image's edge cuts it
  unknown,  ///< flickers, but like no lamp of the map, like two, or like one seen better elsewhere
  steady,   ///< does not flicker
};

struct Light {
  LightKind kind;
  /// Of a lamp, and of one that is cut.
  std::optional<int> lamp;
  /// Image of the centre of its outline, (u, v).
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis, from the scatter of the outline.
  double sigma_px;
  double radius_px;
  /// The corners of the box around the outline, top left and bottom right.
  Eigen::Vector2d low, high;
  Stripes stripes;
  /// How soft the outline is: from a quarter to three quarters of the level.
  double rise_px;
  /// The share of the blob's edge that lies on the circle.
  double roundness;
  /// As (column, row) of the lines that the shutter reads: (v, u) for a read-out along columns.
  std::vector<EdgePoint> outline;
};

/// Whether the image's edge cuts no part of the light.
bool wholly_in_view(const Light& light, const cv::Size& size);

/// What a detector knows of the camera. The row time is needed for identities, unless there is a
/// classifier.
struct DetectorCamera {
  Readout readout;
  std::optional<double> row_time_s;
  /// Without it circles are fitted in the image itself.
  std::optional<Lens> lens;
  /// level_from_camera, for discs that a tilted camera sees.
  Eigen::Matrix3d level_from_camera = Eigen::Matrix3d::Identity();
};

/// Of a calibration; rows are taken for the read-out when it is not stated.
DetectorCamera detector_camera(const Calibration& calibration);

/// Finds and identifies the lamps of a map in images of a rolling shutter. Const and safe to share
/// between threads.
///
/// Centre: from the outline of the lit lines, never from brightness. Edge points go through the
/// lens into the level plane; a circle is fitted there robustly, and its centre is projected back,
/// because the centre of an outline in the image is not the image of the centre (theory, "Lamp
/// centroid"). Identity: a lamp of frequency f has stripes of 1 / (f row_time) lines (Chen and
/// Guan, section 2.1), or what a trained classifier says.
class LampDetector {
 public:
  LampDetector(const LampMap& lamps, const DetectorCamera& camera,
               std::optional<LampClassifier> classifier = {});

  /// The lights of an image, from the top. It has one channel of 8 or 16 bits and is not empty.
  std::vector<Light> detect(const cv::Mat& image) const;

 private:
  /// A blob: the light that it is, if it is round, and all of its outline.
  struct Part {
    std::optional<Light> light;
    std::vector<EdgePoint> outline;
    cv::Rect box;
  };

  std::optional<Eigen::Vector2d> plane_of(const Eigen::Vector2d& pixel) const;
  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector2d& plane) const;
  /// (column, row) of the lines from (u, v) of the image and back.
  Eigen::Vector2d turned(const Eigen::Vector2d& at) const;
  /// The light with that outline, or most of it; nothing when it is not round.
  std::optional<Light> round_light(std::vector<EdgePoint> outline,
                                   const Background& background) const;
  /// Parts of one lamp made one.
  std::vector<Light> merged(std::vector<Part> parts, const Background& background) const;
  /// The outline once more, exactly, and the stripes.
  void measure(const cv::Mat& lines, const Background& background, Light& light) const;
  void identify(std::vector<Light>& lights, const cv::Size& size) const;
  /// The lamp whose stripes these are; nothing when none or two may be.
  std::optional<int> lamp_of(const Stripes& stripes) const;

  LampMap lamps_;
  DetectorCamera camera_;
  std::optional<LampClassifier> classifier_;
  int most_dark_rows_;
};

}  // namespace vlp
