// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/verify_station.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "support/datasets.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::SizeIs;

TEST(VerifyFromImages, RecordStartsAtTimeOfRunId) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "check");
  folder.file("check/0000.png", "no image");
  StationConfig config = read_station_config(VLP_SOURCE_DIR "/datasets/station/station.yaml");
  config.golden_unit = {.camera_id = "golden",
                        .calibration = read_calibration(kExample + "calibration.yaml"),
                        .gates = {{"check_fix_fraction", 0.9}}};
  const std::string run = "20200102T030405Z-0123456789abcdef", before = get_current_utc();
  const RunRecord record = verify_from_images(config, folder / "", run, {"test", "0"}, 1).record;
  EXPECT_EQ(record.run, run);
  EXPECT_EQ(record.begun_utc, "2020-01-02T03:04:05Z");
  EXPECT_GE(record.ended_utc, before);
  EXPECT_EQ(record.kind, "golden");
  EXPECT_EQ(record.camera, "golden");
  EXPECT_EQ(record.program, "test 0");
  EXPECT_EQ(record.verdict, "INVALID") << "nothing was measured";
  EXPECT_EQ(record.config_sha256, config.sha256);
  EXPECT_THAT(record.images, SizeIs(1));
}

}  // namespace
}  // namespace vlp
