// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "session/lens_step.h"

namespace vlp {
namespace {

TEST(MakeLensGates, GatesPassAtLimitsAndFailBeyond) {
  const std::vector<Metric> good{{"rms_px", 1},        {"expected_max_error_px", 2},
                                 {"split_half_px", 1}, {"coverage", 0.4},
                                 {"views", 6},         {"board_tilt_deg", 20}};
  EXPECT_EQ(describe_failed_gates(check_gates(make_lens_gates(), good)), "");
  const std::vector<Metric> bad{{"rms_px", 1.01},
                                {"expected_max_error_px", 2.01},
                                {"split_half_px", 1.01},
                                {"coverage", 0.39},
                                {"views", 5},
                                {"board_tilt_deg", 19}};
  for (const CheckedMetric& gate : check_gates(make_lens_gates(), bad))
    EXPECT_FALSE(gate.has_passed_gate());
}

TEST(MakeLensGates, GatesFailWithoutSplitHalfDifference) {
  const std::vector<Metric> metrics{{"rms_px", 0.1},
                                    {"expected_max_error_px", 0.1},
                                    {"coverage", 1},
                                    {"views", 36},
                                    {"board_tilt_deg", 60}};
  EXPECT_EQ(describe_failed_gates(check_gates(make_lens_gates(), metrics)),
            "split_half_px is not known, at most 1 px is required");
}

}  // namespace
}  // namespace vlp
