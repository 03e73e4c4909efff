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
    {FixStatus::too_few_lamps, "too_few_lamps",
     "fewer than two lamps of the map are visible: one suffices only with known height and yaw"},
    {FixStatus::too_many_lamps, "too_many_lamps", "more lamps in one frame than are supported"},
    {FixStatus::duplicate_lamp, "duplicate_lamp", "one lamp occurs twice in the frame"},
    {FixStatus::not_finite, "not_finite",
     "a pixel or sensor reading is not finite, a sigma is outside 0.0001 to 1000 px, the standard "
     "deviation of a sensor is negative, or that of a known height is not positive"},
    {FixStatus::outside_lens, "outside_lens",
     "no ray through this lens reaches the pixel: is it the calibration of this camera?"},
    {FixStatus::lamp_below_camera, "lamp_below_camera",
     "a lamp would have to hang at or below the camera: check heights and tilt"},
    {FixStatus::degenerate, "degenerate",
     "the lamps are too close together in the image for their noise, or no pose explains them"},
    {FixStatus::ambiguous, "ambiguous",
     "two poses fit the lamps: add another lamp, or give a known height or inclination"},
    {FixStatus::inconsistent, "inconsistent",
     "the lamps contradict each other: misidentified lamp, lamp map of another room, or tilted "
     "camera, for which roll and pitch can be estimated (--roll-pitch-sd-deg)"},
    {FixStatus::mirrored_map, "mirrored_map",
     "the lamps fit the mirror image of the map: the map is drawn from below, or ids are swapped"},
    {FixStatus::undetermined, "undetermined",
     "the lamps do not determine tilt or motion of the camera, and therefore not its position: use "
     "three lamps that are not in one line, or a better known inclination or velocity"},
    {FixStatus::row_time_unknown, "row_time_unknown",
     "a camera that moves needs row_time_s and readout in its calibration"},
}};

const Entry& find_status_entry(FixStatus status) {
  return kStatuses[static_cast<std::size_t>(status)];
}

}  // namespace

std::string_view to_string(FixStatus status) { return find_status_entry(status).name; }
std::string_view describe(FixStatus status) { return find_status_entry(status).explanation; }

}  // namespace vlp
