// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "detection/identity/confusion.h"
#include "detection/identity/labelled_lights.h"

namespace vlp {

/// Throws Undetermined with the lamps of which there are too few lights, and how many more they
/// need; std::invalid_argument for a label that names no lamp of the map.
void check_examples(std::span<const LabelledLight> lights, const LampMap& lamps);

/// Throws Undetermined with the lamps whose lights have too little in common.
void check_kept(const LampClassifier& classifier);

void print_labelled(const Labelled& labelled, const LampClassifier& classifier);
void print_confusion(const Confusion& confusion);
void warn_of_inseparable(const LampClassifier& classifier);
void print_row_time(const RowTime& row_time, Readout readout);

}  // namespace vlp
