// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Lamps whose LED chips shine through their diffusers, from a scene file to detections.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "captures/detections_table.h"
#include "support/csv_cells.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// The scene paper-rig with such chips in each of its lamps.
std::string scene_with_chips(const std::string& chips) {
  std::ifstream file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  std::string scene{std::istreambuf_iterator<char>(file), {}};
  const std::string end = "rim_to_center_ratio: 0.8}",
                    with = "rim_to_center_ratio: 0.8, chips: {" + chips + "}}";
  for (std::size_t at = scene.find(end); at != std::string::npos;
       at = scene.find(end, at + with.size())) {
    scene.replace(at, end.size(), with);
  }
  return scene;
}

TEST(VlpDetectWithLedChips, LocatesAllVisibleLampsWithinQuarterPixel) {
  const TemporaryFolder folder;
  const auto scene =
      folder.file("scene.yaml", scene_with_chips("fraction: 0.3, pitch_m: 0.03, width_m: 0.02"));
  const fs::path out = folder / "out", found_file = folder / "detections.csv";
  auto result =
      run_program("vlp-simulate -q " + scene.string() + " --only rotation -o " + out.string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  result = run_program("vlp-detect -q " + (out / "rotation").string() + " --lamps " +
                       (out / "lamps.yaml").string() + " --calibration " +
                       (out / "true_calibration.yaml").string() + " -o " + found_file.string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;

  std::map<std::pair<std::string, int>, Detection> found;
  for (const Frame& frame : read_detections(found_file)) {
    for (const Detection& lamp : frame.detections) found[{frame.image, lamp.lamp}] = lamp;
  }
  const CsvTable truth(out / "rotation" / "true_detections.csv");
  double squares = 0, chi_square = 0, worst_px = 0;
  int lamps = 0;
  for (std::size_t row = 0; row < truth.num_rows(); ++row) {
    const auto number = [&](const char* name) { return read_number(truth, row, name); };
    const std::string image(read_text(truth, row, "image"));
    const auto lamp =
        found.find({image, truth.get_cell_integer(row, truth.get_required_column("lamp"))});
    if (number("in_view") < 1) continue;
    ASSERT_NE(lamp, found.end()) << "row " << row;
    const Eigen::Vector2d off_px =
        lamp->second.pixel - Eigen::Vector2d(number("u_px"), number("v_px"));
    worst_px = std::max(worst_px, off_px.norm());
    squares += off_px.squaredNorm();
    chi_square += off_px.squaredNorm() / 2 / std::pow(lamp->second.sigma_px.value(), 2);
    ++lamps;
  }
  RecordProperty("lamps", lamps);
  RecordProperty("rms_px", testing::PrintToString(std::sqrt(squares / lamps)));
  RecordProperty("worst_px", testing::PrintToString(worst_px));
  RecordProperty("chi_square", testing::PrintToString(chi_square / lamps));
  EXPECT_GT(lamps, 100);
  EXPECT_LT(std::sqrt(squares / lamps), 0.045);
  EXPECT_LT(worst_px, 0.25);
  EXPECT_GT(chi_square / lamps, 0.5);
  EXPECT_LT(chi_square / lamps, 1.5);
}

}  // namespace
}  // namespace vlp
