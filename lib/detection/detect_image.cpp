// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_image.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "detection/mat_view.h"
#include "lamps/readout.h"
#include "rig/input_error.h"

namespace vlp {

ImageLights detect_image(const LightDetector& detector, const SourceImage& source,
                         const std::optional<std::array<int, 2>>& imager_px, double max_mpx,
                         bool any_readout) {
  ImageLights result{source.file, {}, {}, {}, {}, detector.readout()};
  try {
    result.image = source.read(max_mpx);
    check_imager(source.file, result.image.size(), imager_px);
    result.size = result.image.size();
    if (any_readout) {
      auto [readout, lights] = detect_either_way(detector, image_view(result.image));
      result.readout = readout;
      result.lights = std::move(lights);
    } else {
      result.lights = detector.detect(image_view(result.image));
    }
  } catch (const InputError& error) {
    result.refused = error.what();
  } catch (const std::exception& error) {
    result.refused = source.file.string() + ": cannot be used: " + error.what();
    std::replace(result.refused.begin(), result.refused.end(), '\n', ' ');
  }
  return result;
}

}  // namespace vlp
