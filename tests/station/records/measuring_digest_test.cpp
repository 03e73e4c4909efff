// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/measuring_digest.h"

#include <gtest/gtest.h>

#include <set>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// The station in datasets/station, with a golden unit.
class MeasuringDigest : public testing::Test {
 protected:
  MeasuringDigest() {
    for (const char* name : {"station.yaml", "camera_type.yaml", "board.yaml", "lamps.yaml"}) {
      fs::copy_file(fs::path(VLP_SOURCE_DIR) / "datasets/station" / name, folder / name);
    }
    fs::copy_file(fs::path(VLP_SOURCE_DIR) / "datasets/example/calibration.yaml",
                  folder / "golden.yaml");
    change("station.yaml", "captures: captures",
           "golden: {camera_id: golden, calibration: golden.yaml, gates: {check_mean_mm: 0.5}}\n"
           "captures: captures");
  }
  void change(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = TemporaryFolder::read_content(folder / file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder.file(file, text.replace(at, from.size(), to));
  }
  std::string digest() const { return measuring_digest(read_station(folder / "station.yaml")); }
  /// Returns the digest with a temporary change.
  std::string digest_with(const std::string& file, const std::string& from, const std::string& to) {
    const std::string before = TemporaryFolder::read_content(folder / file);
    change(file, from, to);
    std::string changed = digest();
    folder.file(file, before);
    return changed;
  }

  TemporaryFolder folder;
};

TEST_F(MeasuringDigest, ChangesWithMeasuringSetup) {
  std::set<std::string> digests{digest()};
  const auto is_new = [&](const char* file, const char* from, const char* to) {
    EXPECT_TRUE(digests.insert(digest_with(file, from, to)).second) << from << " -> " << to;
  };
  is_new("lamps.yaml", "[0, 0.28, 1.6]", "[0, 0.281, 1.6]");
  is_new("lamps.yaml", "frequency_hz: 1600", "frequency_hz: 1601");
  is_new("lamps.yaml", "diameter_m: 0.18", "diameter_m: 0.19");
  is_new("lamps.yaml", "duty: 0.5", "duty: 0.4");
  is_new("lamps.yaml", "lamps:", "sd_m: 0.001\nlamps:");
  is_new("board.yaml", "tag_size_m: 0.02", "tag_size_m: 0.0201");
  is_new("board.yaml", "first_id: 0", "first_id: 30");
  is_new("camera_type.yaml", "row_time_s: 3.0e-05", "row_time_s: 3.1e-05");
  is_new("camera_type.yaml", "-0.25", "-0.24");
  is_new("station.yaml", "board_views: 36", "board_views: 35");
  is_new("station.yaml", "check_captures: 36", "check_captures: 30");
  is_new("station.yaml", "rejection: {blur_px: 2", "rejection: {blur_px: 2.5");
  is_new("station.yaml", "check_worst_mm: 3", "check_worst_mm: 4");
  is_new("station.yaml", "gates: {check_mean_mm: 0.5}", "gates: {check_mean_mm: 0.6}");
  is_new("station.yaml", "camera_id: golden", "camera_id: other");
  is_new("station.yaml", "captures: captures",
         "captures: captures\ndispersion_station_m: [0, 0.001]");
  is_new("station.yaml", "captures: captures",
         "captures: captures\n"
         "guard_bands: {k: 2, standard_uncertainties: {check_mean_mm: 0.02}}");
  is_new("golden.yaml", "403, 296", "403, 297");
}

TEST_F(MeasuringDigest, IgnoresOtherSettings) {
  const std::string before = digest();
  const std::string config_sha256 = read_station(folder / "station.yaml").sha256;
  const auto is_same = [&](const char* file, const std::string& from, const std::string& to) {
    EXPECT_EQ(digest_with(file, from, to), before) << from << " -> " << to;
  };
  is_same("station.yaml", "station: station-1", "# as of today\nstation: station-1");
  is_same("station.yaml", "board_coverage: 0.7", "board_coverage: 0.70");
  is_same("station.yaml", "records: records.db",
          "records: others.db\nspool: elsewhere\nserial_pattern: '[0-9]{4}'\n"
          "hook: {command: [./label.sh]}\nretention: {images_days: 90}\n"
          "verify_due: {hours: 24}");
  is_same("station.yaml", "results: results", "results: other");
  is_same("lamps.yaml", "[0, 0.28, 1.6]", "[0.0, 0.280, 1.6e0]");
  is_same("lamps.yaml", "lamps:", "# surveyed again\nlamps:");
  const std::string second =
      "  - {id: 2, position_m: [0, -0.32, 1.6], diameter_m: 0.18, frequency_hz: 2000, duty: 0.5}\n";
  const std::string third =
      "  - {id: 3, position_m: [0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 2500, duty: "
      "0.5}\n";
  is_same("lamps.yaml", second + third, third + second);
  is_same("board.yaml", "tag_size_m: 0.02", "tag_size_m: 2.0e-2");
  is_same("camera_type.yaml", "3.0e-05", "0.00003");
  change("station.yaml", "captures: captures", "captures: captures  # a comment");
  EXPECT_EQ(digest(), before);
  EXPECT_NE(read_station(folder / "station.yaml").sha256, config_sha256)
      << "records have the files as they are";
  // Another name of a file with the same content.
  fs::rename(folder / "lamps.yaml", folder / "ceiling.yaml");
  change("station.yaml", "lamps: lamps.yaml", "lamps: ceiling.yaml");
  EXPECT_EQ(digest(), before);
}

}  // namespace
}  // namespace vlp
