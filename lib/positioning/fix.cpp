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
constexpr std::array<Entry, 11> kStatuses{{
    {FixStatus::ok, "ok", "a fix"},
    {FixStatus::too_few_lamps, "too_few_lamps",
     "fewer than two lamps of the map are seen: one is enough only with known height and yaw"},
    {FixStatus::too_many_lamps, "too_many_lamps", "more lamps in one frame than are supported"},
    {FixStatus::duplicate_lamp, "duplicate_lamp", "one lamp stands twice in the frame"},
    {FixStatus::not_finite, "not_finite",
     "a pixel or a sensor reading is not finite, or a sigma not within 0.0001 and 1000 px"},
    {FixStatus::outside_lens, "outside_lens",
     "no ray through this lens reaches the pixel: is the calibration this camera's?"},
    {FixStatus::lamp_below_camera, "lamp_below_camera",
     "a lamp would have to hang at or below the camera: check heights and tilt"},
    {FixStatus::degenerate, "degenerate",
     "the lamps are seen too close together for their noise, or no pose explains them"},
    {FixStatus::ambiguous, "ambiguous",
     "two lamps at different heights fit two poses: a third lamp would tell"},
    {FixStatus::inconsistent, "inconsistent",
     "the lamps contradict each other: a wrong identity, or another room's lamp map"},
    {FixStatus::mirrored_map, "mirrored_map",
     "the lamps fit the map's mirror image: it is drawn as seen from below, or identities are "
     "swapped"},
}};

const Entry& entry_of(FixStatus status) { return kStatuses[static_cast<std::size_t>(status)]; }

}  // namespace

std::string_view name_of(FixStatus status) { return entry_of(status).name; }
std::string_view explanation_of(FixStatus status) { return entry_of(status).explanation; }

}  // namespace vlp
