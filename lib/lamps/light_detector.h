// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_parts.h"
#include "lamps/shape/light_shape.h"
#include "lamps/signal/lamp_classifier.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Returns whether no part of a light is cut by the image's edge.
bool wholly_in_view(const Light& light, const ImageSize& size);

/// Returns the camera of a calibration; the read-out is along rows if it is not stated.
DetectorCamera detector_camera(const Calibration& calibration);

/// Finds and identifies the lamps of a map in images of a rolling shutter. Const and safe to share
/// between threads.
///
/// Centre: from the outline of the lit lines, never from brightness, see LightShape. Other
/// shapes are searched if the map has them, see ShapeDetector. Where no light with a clear outline
/// is identified, lights are found by their modulation, whatever their shape, see
/// find_modulated_lights(). Their centre is that of their rim, see rim_of(), or, without a clear
/// one, of the area that they light.
///
/// Identity: a lamp of frequency f has stripes of 1 / (f row_time) lines (Chen and Guan, section
/// 2.1); with a trained classifier it is the classifier's answer.
class LightDetector {
 public:
  LightDetector(const LampMap& lamps, const DetectorCamera& camera,
                std::optional<LampClassifier> classifier = {});

  /// Detects the lights of an image, sorted from the top. @pre The image is not empty.
  std::vector<Light> detect(const ImageView& image) const;

  /// Returns the same detector for a camera with another tilt. If the tilt is unknown, ellipses are
  /// fitted in the image, as without a lens.
  LightDetector leaning(const std::optional<Eigen::Matrix3d>& level_from_camera) const;

  /// Returns the same detector for images that are read along rows, or along columns.
  LightDetector with_readout(Readout readout) const;

  Readout readout() const { return camera_.readout; }

 private:
  /// Fits outlines to a blob: one, or several where lights touch. Sets Light::is_doubtful.
  std::vector<LightPart> parts_of(const ImageView& lines, const Blob& blob,
                                  const Background& background) const;
  /// Searches blobs for modulated lights where no light with a clear outline is identified, and
  /// puts these in the place of others there.
  void add_by_modulation(const ImageView& lines, const std::vector<Blob>& blobs,
                         const Background& background, std::vector<Light>& lights) const;
  /// Refines the outline and measures the stripes.
  void measure(const ImageView& lines, const Background& background, Light& light) const;
  /// Corrects the centres of partly visible lights for the motion of the camera, see Shear.
  void correct_shear(std::vector<Light>& lights) const;
  void identify(std::vector<Light>& lights, const ImageSize& size) const;
  /// Returns the difference between the logarithms of the ratios of axes of a light and a lamp;
  /// std::nullopt if the light has another shape.
  std::optional<double> shape_off(const Light& light, int lamp) const;
  /// Returns the lamp with these stripes; std::nullopt if none or two agree.
  std::optional<int> lamp_of(const Stripes& stripes) const;

  LampMap lamps_;
  DetectorCamera camera_;
  LightShape shape_;
  std::optional<LampClassifier> classifier_;
  int max_dark_rows_;
  /// Sizes of the map's lamps of each shape.
  std::map<ShapeKind, std::vector<Eigen::Vector2d>> sizes_m_;
  /// Different periods of the map's lamps, in lines, and the lamp of each; std::nullopt where
  /// several lamps share it. Empty where the row time is not known or a classifier decides.
  std::vector<double> lamp_periods_;
  std::vector<std::optional<int>> lamps_by_period_;
};

}  // namespace vlp
