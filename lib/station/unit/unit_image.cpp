// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_image.h"

#include "captures/digest.h"
#include "rig/input_error.h"

namespace vlp {

UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe) {
  UnitImage image;
  try {
    image.sha256 = sha256_of_file(file);
    image.seen = observe(SourceImage(file));
  } catch (const InputError&) {
    image.seen = {file};
    image.seen.reject(RejectionReason::unreadable, "cannot be read as an image");
  }
  return image;
}

}  // namespace vlp
