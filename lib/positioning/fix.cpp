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
     "fewer than two lamps of the map are seen: one is enough only with known height and yaw"},
    {FixStatus::too_many_lamps, "too_many_lamps", "more lamps in one frame than are supported"},
    {FixStatus::duplicate_lamp, "duplicate_lamp", "one lamp stands twice in the frame"},
    {FixStatus::not_finite, "not_finite",
     "a pixel or a sensor reading is not finite, a sigma not within 0.0001 and 1000 px, a sensor's "
     "standard deviation negative, or that of a known height not positive"},
    {FixStatus::outside_lens, "outside_lens",
     "no ray through this lens reaches the pixel: is the calibration this camera's?"},
    {FixStatus::lamp_below_camera, "lamp_below_camera",
     "a lamp would have to hang at or below the camera: check heights and tilt"},
    {FixStatus::degenerate, "degenerate",
     "the lamps are seen too close together for their noise, or no pose explains them"},
    {FixStatus::ambiguous, "ambiguous",
     "two poses fit the lamps: another lamp would tell, or a known height or inclination"},
    {FixStatus::inconsistent, "inconsistent",
     "the lamps contradict each other: a wrong identity, another room's lamp map, or a camera that "
     "leans, which a fix with the lean free would show (--roll-pitch-sd-deg)"},
    {FixStatus::mirrored_map, "mirrored_map",
     "the lamps fit the map's mirror image: it is drawn as seen from below, or identities are "
     "swapped"},
    {FixStatus::undetermined, "undetermined",
     "the lamps do not tell how the camera leans or moves, and so not where it is: it takes three "
     "that are not in one line, or an inclination or a velocity that is better known"},
    {FixStatus::row_time_unknown, "row_time_unknown",
     "a camera that moves needs row_time_s and readout in its calibration"},
}};

const Entry& entry_of(FixStatus status) { return kStatuses[static_cast<std::size_t>(status)]; }

}  // namespace

std::string_view to_string(FixStatus status) { return entry_of(status).name; }
std::string_view describe(FixStatus status) { return entry_of(status).explanation; }

}  // namespace vlp
