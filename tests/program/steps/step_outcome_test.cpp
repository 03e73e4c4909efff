// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/step_outcome.h"

#include <gmock/gmock.h>

#include "program/app.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(RequireSuccess, ThrowsUndeterminedOnlyForUndeterminedStep) {
  StepResult result;
  require_success(result);
  result.set_step_failure(StepFailure::undetermined, "add captures");
  EXPECT_EQ(rejection_message<Undetermined>([&] { require_success(result); }), "add captures");
  result.set_step_failure(StepFailure::wrong_map, "contradicts the captures", "lamps.yaml");
  EXPECT_EQ(rejection_message<std::invalid_argument>([&] { require_success(result); }),
            "lamps.yaml: contradicts the captures");
}

}  // namespace
}  // namespace vlp
