// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/fix.h"

#include <array>

namespace vlp {
namespace {

struct Entry {
  FixStatus status;
  std::string_view name;
  std::string_view explanation;
};

// In the order of the enumeration.
constexpr std::array<Entry, 13> kStatuses{{
    {FixStatus::ok, "ok", "a fix"},
    // [FIX-1] `too_few_lamps` | fewer than two lamps of the map in view | Hang more lamps, take a
    //   wider lens, or give height and yaw (`--one-lamp`)
    {FixStatus::too_few_lamps, "too_few_lamps",
     "fewer than two lamps of the map are visible: one suffices only with known height and yaw"},
    // [FIX-9] `too_many_lamps`, `duplicate_lamp`, `not_finite` | unsuitable input of the library |
    //   correct it
    {FixStatus::too_many_lamps, "too_many_lamps", "more lamps in one frame than are supported"},
    {FixStatus::duplicate_lamp, "duplicate_lamp", "one lamp occurs twice in the frame"},
    {FixStatus::not_finite, "not_finite",
     "a pixel or sensor reading is not finite, a sigma is outside 0.0001 to 1000 px, the standard "
     "deviation of a sensor is negative, that of a known height is not positive, an earlier "
     "frame is not earlier or is simultaneous with another, or a prior is not positive definite or "
     "has other readings beside it"},
    // [FIX-8] `outside_lens` | calibration of another camera | give the right one
    {FixStatus::outside_lens, "outside_lens",
     "no ray through this lens reaches the pixel: is it the calibration of this camera?"},
    // [FIX-4] `lamp_below_camera` | wrong heights in the map, or camera strongly tilted | check
    //   heights and tilt
    {FixStatus::lamp_below_camera, "lamp_below_camera",
     "a lamp would have to hang at or below the camera: check heights and tilt"},
    // [FIX-5] `degenerate` | lamps too close to each other, or too far away, for their noise | hang
    //   them farther apart
    {FixStatus::degenerate, "degenerate",
     "the lamps are too close together in the image for their noise, or no pose explains them"},
    // [FIX-6] `ambiguous` | two poses fit | third lamp, or known height or inclination
    {FixStatus::ambiguous, "ambiguous",
     "two poses fit the lamps: add another lamp, or give a known height or inclination"},
    // [FIX-2] `inconsistent` | lamp misidentified, map of another room, or camera tilted | check
    //   map and tilt (`--roll-pitch-sd-deg`)
    {FixStatus::inconsistent, "inconsistent",
     "the lamps contradict each other or the known state: misidentified lamp, lamp map of another "
     "room, wrong height, or tilted camera, for which roll and pitch can be estimated "
     "(--roll-pitch-sd-deg)"},
    // [FIX-3] `mirrored_map` | map drawn from below, or ids swapped | negate x or y of every lamp
    {FixStatus::mirrored_map, "mirrored_map",
     "the lamps fit the mirror image of the map: the map is drawn from below, or ids are swapped"},
    // [FIX-7] `undetermined` | two lamps, or three in one line, with free tilt or speed | more
    //   lamps, or better known inclination or velocity
    {FixStatus::undetermined, "undetermined",
     "the lamps do not determine tilt or motion of the camera, and therefore not its position: use "
     "three lamps that are not in one line, or a better known inclination or velocity"},
    // [FIX-9] `row_time_unknown`
    {FixStatus::row_time_unknown, "row_time_unknown",
     "a camera that moves needs row_time_s and readout in its calibration"},
}};

const Entry& get_status_entry(FixStatus status) {
  return kStatuses[static_cast<std::size_t>(status)];
}

}  // namespace

std::string_view fix_status_name(FixStatus status) { return get_status_entry(status).name; }
std::string_view describe_fix_status(FixStatus status) {
  return get_status_entry(status).explanation;
}

}  // namespace vlp
