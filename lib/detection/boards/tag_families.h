// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <apriltag/apriltag.h>

#include <memory>
#include <string>

namespace vlp {

using TagFamily = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

/// Creates libapriltag's family with a name of Board::family. Detectors must not share it.
/// @throws std::invalid_argument if there is no such family
TagFamily make_tag_family(const std::string& name);

/// Returns the width of a tag in bits if its border is `border_bits` wide, instead of one bit as in
/// the family.
int width_in_bits(const apriltag_family_t& family, int border_bits);

/// Returns true if bit `bit` (below family.nbits) of the tag `id` is white.
bool is_white(const apriltag_family_t& family, int id, uint32_t bit);

}  // namespace vlp
