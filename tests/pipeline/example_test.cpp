// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The committed example: what its generator makes, and what vlp-locate makes of it.
#include <gtest/gtest.h>

#include <cmath>

#include "support/csv_cells.h"
#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

const std::string kLocate = "vlp-locate " + kExample + "detections.csv --lamps " + kExample +
                            "lamps.yaml --calibration " + kExample + "calibration.yaml -o ";

/// Horizontal errors of fixes.csv against truth.csv, in its order.
std::vector<double> horizontal_errors_m(const std::filesystem::path& fixes_file) {
  const CsvTable fixes(fixes_file), truth(kExample + "truth.csv");
  EXPECT_EQ(fixes.num_rows(), truth.num_rows());
  std::vector<double> errors_m;
  for (std::size_t row = 0; row < truth.num_rows(); ++row) {
    EXPECT_EQ(read_text(fixes, row, "image"), read_text(truth, row, "image"));
    EXPECT_EQ(read_text(fixes, row, "status"), "ok");
    errors_m.push_back(std::hypot(read_number(fixes, row, "x_m") - read_number(truth, row, "x_m"),
                                  read_number(fixes, row, "y_m") - read_number(truth, row, "y_m")));
  }
  return errors_m;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST(MakeExample, ReproducesCommittedFiles) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_program(VLP_MAKE_EXAMPLE " '" + (folder / "example").string() + "'").exit_code, 0);
  for (const std::string name : {"lamps.yaml", "calibration.yaml", "detections.csv", "truth.csv",
                                 "turning.csv", "station.csv"}) {
    EXPECT_EQ(TemporaryFolder::read_content(folder / ("example/" + name)),
              TemporaryFolder::read_content(kExample + name))
        << name;
  }
}

TEST(VlpLocateOnExample, MeanErrorIsBetween20And200MicrometersWithTiltCorrectionOnly) {
  const TemporaryFolder folder;
  const auto fixes = (folder / "fixes.csv").string();
  const auto result = run_program(kLocate + fixes);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto errors_m = horizontal_errors_m(fixes);
  ASSERT_EQ(errors_m.size(), 36);
  // 0.05 px at f / H = 325 px/m and five lamps: about 0.1 mm.
  EXPECT_LT(mean(errors_m), 0.2e-3);
  EXPECT_GT(mean(errors_m), 0.02e-3);
  ASSERT_EQ(run_program(kLocate + fixes + " --correction none").exit_code, 0);
  EXPECT_GT(mean(horizontal_errors_m(fixes)), 20e-3);  // 1.3 degrees at 1.3 to 1.6 m
}

}  // namespace
}  // namespace vlp
