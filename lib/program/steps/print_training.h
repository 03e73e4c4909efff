// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lamps/signal/row_time.h"
#include "rig/calibration.h"
#include "session/train_step.h"

namespace vlp {

/// What a classifier was trained on, and how it answers, on stdout.
void print_training(const TrainStepResult& result);

/// The row time that was found, and what it rests on, on stdout.
void print_row_time(const RowTime& row_time, Readout readout);

}  // namespace vlp
