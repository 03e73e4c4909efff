// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_image.h"

#include <algorithm>
#include <exception>

#include "detection/mat_view.h"
#include "rig/input_error.h"

namespace vlp {

ImageLights detect_image(const LightDetector& detector, const SourceImage& source,
                         const std::optional<std::array<int, 2>>& imager_px, double max_mpx) {
  ImageLights result{source.file, {}, {}, {}, {}};
  try {
    result.image = source.read(max_mpx);
    check_imager(source.file, result.image.size(), imager_px);
    result.size = result.image.size();
    result.lights = detector.detect(image_view(result.image));
  } catch (const InputError& error) {
    result.refused = error.what();
  } catch (const std::exception& error) {
    result.refused = source.file.string() + ": cannot be used: " + error.what();
    std::replace(result.refused.begin(), result.refused.end(), '\n', ' ');
  }
  return result;
}

}  // namespace vlp
