// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <apriltag/apriltag.h>

#include <memory>
#include <string>

namespace vlp {

using TagFamily = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

/// libapriltag's family of that name, one of those of Board::family; not to be shared between
/// detectors. Throws std::invalid_argument.
TagFamily tag_family(const std::string& name);

/// How many bits wide a tag is whose border is printed border_bits wide, for the family's one.
int width_in_bits(const apriltag_family_t& family, int border_bits);

/// Whether a bit of a tag, one of family.nbits, is white.
bool is_white(const apriltag_family_t& family, int id, uint32_t bit);

}  // namespace vlp
