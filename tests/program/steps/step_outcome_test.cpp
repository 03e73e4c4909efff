// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/step_outcome.h"

#include <gmock/gmock.h>

#include "program/app.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(ThrowIfStepFailed, ThrowsUndeterminedOnlyForUndeterminedStep) {
  StepResult result;
  throw_if_step_failed(result);
  result.set_step_failure(StepFailure::undetermined, "add captures");
  EXPECT_EQ(rejection_message<Undetermined>([&] { throw_if_step_failed(result); }), "add captures");
  result.set_step_failure(StepFailure::wrong_map, "contradicts the captures", "lamps.yaml");
  EXPECT_EQ(rejection_message<std::invalid_argument>([&] { throw_if_step_failed(result); }),
            "lamps.yaml: contradicts the captures");
}

}  // namespace
}  // namespace vlp
