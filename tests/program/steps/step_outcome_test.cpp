// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/step_outcome.h"

#include <gmock/gmock.h>

#include "program/app.h"
#include "support/refused.h"

namespace vlp {
namespace {

TEST(Require, ThrowsUndeterminedOnlyForUndeterminedStep) {
  StepResult result;
  require(result);
  result.fail(StepFailure::undetermined, "add captures");
  EXPECT_EQ(refusal_of<Undetermined>([&] { require(result); }), "add captures");
  result.fail(StepFailure::wrong_map, "contradicts the captures", "lamps.yaml");
  EXPECT_EQ(refusal_of<std::invalid_argument>([&] { require(result); }),
            "lamps.yaml: contradicts the captures");
}

}  // namespace
}  // namespace vlp
