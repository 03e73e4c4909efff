// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lamps/signal/row_time.h"
#include "rig/calibration.h"
#include "session/train_step.h"

namespace vlp {

/// Prints the training data of a classifier and its cross-validated answers to stdout.
void print_training(const TrainStepResult& result);

/// Prints the estimated row time and its standard deviation, in us, to stdout. Also prints the
/// number of lights and lamps that determine it, and the readout direction.
void print_row_time(const RowTime& row_time, Readout readout);

}  // namespace vlp
