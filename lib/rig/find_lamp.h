// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "lamp_map.h"

namespace vlp {

/// Returns a pointer to the lamp with this id in `lamps`; nullptr if there is none.
const Lamp* find_lamp_by_id(std::span<const Lamp> lamps, int id);

}  // namespace vlp
