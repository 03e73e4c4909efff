// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/image/pixel_runs.h"
#include "lamps/shape/inverse_height.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/outline_fit.h"
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
/// Search: lights are found by their modulation, whatever their shape, see
/// detect_modulated_lights(), and as lit areas with stripes.
///
/// Center: from a fit of the outline to the levels near it, see fit_rim_of_light() and
/// fit_rectangular_light(). Without an outline it is the centroid of the lit area.
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
  LightDetector copy_for_tilt(const std::optional<Eigen::Matrix3d>& level_from_camera) const;

  /// Returns a copy of the detector for images with another readout direction.
  LightDetector copy_with_readout(Readout readout) const;

  Readout readout_direction() const { return camera_.readout; }

 private:
  /// Outlines of modulated lights, and the inverse height from them.
  struct OutlineFits {
    std::vector<std::optional<MeasuredLight>> outlines;
    std::optional<InverseHeight> inverse_height;
  };
  /// Returns the parts of the image to be searched for lights.
  std::vector<PixelBox> list_search_boxes(const std::vector<Blob>& blobs,
                                          const ImageSize& size) const;
  /// Adds blobs with stripes in which no modulated light was found: lights with few periods, or
  /// that touch others.
  void add_striped_blobs(const ImageView& lines, const std::vector<Blob>& blobs,
                         const Background& background, std::vector<ModulatedLight>& found) const;
  /// Fits the outlines of modulated lights. Distances between identified lamps determine the height
  /// of the camera, and thereby the radii of the lamps. The distances between the centers of
  /// outlines determine the height more accurately; outlines of another radius are then searched
  /// again. The median of the radii is still more accurate: all discs are then fitted with it.
  OutlineFits fit_outlines(const ImageView& lines, const std::vector<ModulatedLight>& found,
                           const std::vector<Blob>& blobs, const Background& background) const;
  /// Fits a rectangle if the lamp may be one, or else a disc.
  std::optional<MeasuredLight> fit_outline(
      const ImageView& lines, const ModulatedLight& found, const std::vector<Blob>& blobs,
      const Background& background, const std::optional<InverseHeight>& inverse_height) const;
  /// Makes lights of modulated lights and their outlines, measures their stripes, and sets the lamp
  /// with these stripes.
  std::vector<MeasuredLight> measure_lights(const ImageView& lines,
                                            const std::vector<ModulatedLight>& found,
                                            OutlineFits fits, const Background& background) const;
  /// Adds the blobs in which no light was found: steady lights, and modulated ones that are not
  /// identified.
  void add_remaining_blobs(const ImageView& lines, const std::vector<Blob>& blobs,
                           const Background& background, std::vector<MeasuredLight>& lights) const;
  /// Returns the lamps of modulated lights, with the centers of their outlines if known.
  std::vector<LampInPlane> list_lamps_in_plane(const std::vector<ModulatedLight>& found,
                                               const OutlineFits& fits) const;
  /// Returns the radii of discs of known size.
  std::vector<LampRadius> list_disc_radii(const std::vector<ModulatedLight>& found,
                                          const OutlineFits& fits) const;
  /// Returns the radius of a lamp in the level plane. Without a lamp, returns the common radius of
  /// all lamps of the map. Returns std::nullopt if it is no disc of known size, if the lamps differ
  /// by more than 15 %, or if the height is unknown.
  std::optional<KnownRadius> predict_radius(
      const Lamp* lamp, const std::optional<InverseHeight>& inverse_height) const;
  /// Returns the lamp with the period of a modulated light; nullptr if there is none or several.
  const Lamp* find_lamp(const ModulatedLight& found) const;
  double compute_height_beyond_first_m(const Lamp& lamp) const;
  /// Measures the stripes in the ellipse in a box.
  Stripes measure_stripes_in_box(const ImageView& lines, const PixelBox& box,
                                 const Background& background) const;
  /// Measures the stripes of a light within its outline. Keeps those of the modulated light if they
  /// belong to a lamp and the outline is not clear.
  void measure_in_outline(const ImageView& lines, const Background& background,
                          MeasuredLight& light) const;
  /// Fits the outlines of discs again, twice, sheared by the camera motion that Shear estimates.
  void correct_for_motion(const ImageView& lines, const Background& background,
                          std::vector<MeasuredLight>& lights) const;
  void identify_lamps(const std::optional<InverseHeight>& inverse_height, const ImageSize& size,
                      std::vector<MeasuredLight>& lights) const;
  /// Rejects lights with few periods at a wrong position. The lights with more periods determine
  /// rotation and translation of the map. The tolerance is 10 % of the lamp's size and of its
  /// distance from their mean, plus half of its size without an outline. Has no effect if a light
  /// with more periods exceeds it.
  void reject_misplaced_lights(const std::optional<InverseHeight>& inverse_height,
                               std::vector<MeasuredLight>& lights) const;
  /// Rejects lights whose radius differs from that of their lamp, if at least three others agree.
  void reject_lights_of_other_size(const std::optional<InverseHeight>& inverse_height,
                                   std::vector<MeasuredLight>& lights) const;
  /// Returns the radius of a light in the level plane; std::nullopt for rectangles.
  std::optional<double> measure_radius(const MeasuredLight& light) const;
  /// Returns the absolute difference between the log aspect ratios of a light and a lamp. Returns
  /// std::nullopt if the light has another shape or the difference exceeds its limit.
  std::optional<double> compute_log_aspect_difference(const MeasuredLight& light, int lamp) const;
  /// Returns the id of the lamp with these stripes; std::nullopt if no lamp or several lamps agree.
  std::optional<int> identify_by_stripes(const Stripes& stripes) const;

  LampMap lamps_;
  DetectorCamera camera_;
  LightShape shape_;
  std::optional<LampClassifier> classifier_;
  int max_dark_rows_;
  /// Lengths of both axes of the map's rectangles.
  std::vector<Eigen::Vector2d> rectangle_sizes_m_;
  /// Distinct periods of the map's lamps, in scanlines, and the lamp of each period. The lamp is
  /// std::nullopt if several lamps share the period. Empty if the row time is unknown or a
  /// classifier decides.
  std::vector<double> lamp_periods_;
  std::vector<std::optional<int>> lamps_by_period_;
};

}  // namespace vlp
