// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/shape/inverse_height.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/light_parts.h"
#include "lamps/shape/rim.h"
#include "lamps/signal/lamp_classifier.h"
#include "lamps/signal/modulated_lights.h"
#include "rig/calibration.h"
#include "rig/detection.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Returns true if the image border cuts no part of the light.
bool is_light_fully_in_view(const Light& light, const ImageSize& size);

/// Returns the detections of the lights that are lamps.
std::vector<Detection> select_lamps(std::span<const Light> lights);

/// Returns the camera parameters of a calibration for a detector: row time, lens, readout direction
/// (rows if unknown). level_from_camera is the calibrated tilt (level_rotation_from_zenith());
/// identity without a rotation center.
DetectorCamera make_detector_camera(const Calibration& calibration);

/// Detects and identifies the lamps of a map in images of a rolling-shutter camera. All methods are
/// const and thread-safe.
///
/// Center: from a fit of the outline to the levels near it, see fit_disc_outline(); LightShape
/// gives the first outline. Other shapes than discs are searched if the map has them, see
/// ShapeDetector. Where no light with a clear outline is identified, lights are detected by their
/// modulation, whatever their shape, see find_modulated_lights(). Their center is that of their
/// rim, see fit_rim_of_light(). Without a rim it is the centroid of the lit area.
///
/// Identity: a lamp of frequency f has stripes with a period of 1 / (f row_time) scanlines (Chen
/// and Guan, section 2.1). With a trained classifier the classifier decides.
class LightDetector {
 public:
  LightDetector(const LampMap& lamps, const DetectorCamera& camera,
                std::optional<LampClassifier> classifier = {});

  /// Detects the lights of an image, sorted from the top. @pre The image is not empty.
  std::vector<Light> detect_lights(const ImageView& image) const;

  /// Returns a copy of the detector for a camera with another tilt. If the tilt is unknown,
  /// ellipses are fitted in the image, as without a lens.
  LightDetector copy_detector_for_camera_tilt(
      const std::optional<Eigen::Matrix3d>& level_from_camera) const;

  /// Returns a copy of the detector for images with another readout direction.
  LightDetector copy_detector_with_readout_direction(Readout readout) const;

  Readout readout_direction() const { return camera_.readout; }

 private:
  /// Fits outlines to a blob: one, or several if lights touch. Sets Light::is_doubtful.
  std::vector<LightPart> find_light_parts(const ImageView& lines, const Blob& blob,
                                          const Background& background) const;
  /// Searches for modulated lights in blobs without an identified light that has a clear outline.
  /// Replaces the lights at the position of each modulated light.
  void add_lights_found_by_modulation(const ImageView& lines, const std::vector<Blob>& blobs,
                                      const Background& background,
                                      std::vector<Light>& lights) const;
  /// Rims of lights, and the inverse height from the distances between identified lamps.
  struct RimFits {
    std::vector<std::optional<Light>> rims;
    std::optional<InverseHeight> inverse_height;
  };
  /// Fits the rims of modulated lights. Distances between identified lamps determine the height of
  /// the camera, and thereby the radii of the rims. The distances between the centers of rims
  /// determine the height more accurately; rims of another radius are then searched again. The
  /// median of the radii is still more accurate: all rims are then fitted with this radius.
  /// @param lamps  identified lights with a clear outline
  RimFits fit_rims(const ImageView& lines, const std::vector<ModulatedLight>& found,
                   const std::vector<Blob>& blobs, const Background& background,
                   const std::vector<LampInPlane>& lamps) const;
  /// Adds the lamps of modulated lights to `lamps`, with the centers of their rims if known.
  std::vector<LampInPlane> find_lamps_in_plane(const std::vector<ModulatedLight>& found,
                                               const std::vector<std::optional<Light>>& rims,
                                               std::vector<LampInPlane> lamps) const;
  /// Returns the radii of the rims of lamps of known size.
  std::vector<LampRadius> find_radii(const std::vector<ModulatedLight>& found,
                                     const std::vector<std::optional<Light>>& rims) const;
  /// Returns the radius of a lamp in the level plane; std::nullopt if it is no disc of known size,
  /// or if the height is unknown.
  std::optional<KnownRadius> predict_radius(
      const Lamp* lamp, const std::optional<InverseHeight>& inverse_height) const;
  /// Returns a lamp whose light is at `pixel`; std::nullopt if its size or the lens is unknown.
  /// @param center_sd  standard deviation of the center per axis, in radii
  std::optional<LampInPlane> make_lamp_in_plane(const Lamp* lamp, const Eigen::Vector2d& pixel,
                                                double center_sd) const;
  /// Returns the lamp with the period of a modulated light; nullptr if there is none or several.
  const Lamp* find_lamp_of_period(const ModulatedLight& found) const;
  double compute_height_beyond_first_lamp_m(const Lamp& lamp) const;
  /// Measures the stripes of a light and fits its outline.
  void measure_stripes_and_fit_outline(const ImageView& lines, const Background& background,
                                       Light& light) const;
  /// Fits the outlines of discs again, twice, sheared by the camera motion that Shear estimates.
  void correct_light_centers_for_motion(const ImageView& lines, const Background& background,
                                        std::vector<Light>& lights) const;
  void identify_lamps_of_lights(std::vector<Light>& lights, const ImageSize& size) const;
  /// Returns the absolute difference between the log aspect ratios of a light and a lamp. Returns
  /// std::nullopt if the light has another shape or the difference exceeds its limit.
  std::optional<double> compute_log_aspect_ratio_difference(const Light& light, int lamp) const;
  /// Returns the id of the lamp with these stripes; std::nullopt if no lamp or several lamps agree.
  std::optional<int> identify_lamp_by_stripes(const Stripes& stripes) const;

  LampMap lamps_;
  DetectorCamera camera_;
  LightShape shape_;
  std::optional<LampClassifier> classifier_;
  int max_dark_rows_;
  /// Lengths of both axes of the map's lamps, by shape.
  std::map<ShapeKind, std::vector<Eigen::Vector2d>> sizes_m_;
  /// Distinct periods of the map's lamps, in scanlines, and the lamp of each period. The lamp is
  /// std::nullopt if several lamps share the period. Empty if the row time is unknown or a
  /// classifier decides.
  std::vector<double> lamp_periods_;
  std::vector<std::optional<int>> lamps_by_period_;
};

}  // namespace vlp
