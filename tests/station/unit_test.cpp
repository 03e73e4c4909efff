// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit.h"

#include <gmock/gmock.h>

#include "station/station_screen.h"
#include "station/unit_report.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// A unit of the station in datasets/station, without images at first.
struct UnitTest : testing::Test {
  StationConfig config = read_station(VLP_SOURCE_DIR "/datasets/station/station.yaml");
  TemporaryFolder folder;
  Unit unit{config, std::string(64, 'x'), {"test", "0"}, 1};

  void add_bad(int number) {
    const auto file = folder.file(std::to_string(100 + number) + ".png", "no image");
    unit.add(StationStep::boards, {file});
  }
};

TEST_F(UnitTest, BeginsWithTheBoards) {
  EXPECT_EQ(unit.current(), StationStep::boards);
  EXPECT_FALSE(unit.calibration());
  EXPECT_THAT(unit.causes(), ElementsAre(HasSubstr("boards: not enough images")));
}

TEST_F(UnitTest, IsHopelessAfterSoManyBadImagesInARow) {
  for (int i = 0; i < config.refuse.in_a_row; ++i) {
    EXPECT_FALSE(unit.hopeless()) << i;
    add_bad(i);
  }
  EXPECT_TRUE(unit.hopeless());
  EXPECT_EQ(unit.step(StationStep::boards).used(), 0);
  unit.advance(true);
  EXPECT_THAT(unit.causes(), ElementsAre(HasSubstr("12 of 12 images refused: 12 cannot be read")));
  unit.remove(StationStep::boards, "100.png");
  EXPECT_FALSE(unit.hopeless());
}

TEST_F(UnitTest, KeepsLaterImagesUntilTheStepBeforeIsDone) {
  const auto file = folder.file("0.png", "no image");
  unit.add(StationStep::check, {file});
  unit.advance(false);
  EXPECT_EQ(unit.step(StationStep::check).waiting.size(), 1u);
  unit.remove(StationStep::check, "0.png");
  EXPECT_TRUE(unit.step(StationStep::check).waiting.empty());
}

TEST_F(UnitTest, IsShownIn80Columns) {
  add_bad(1);
  add_bad(2);
  for (const ScreenLine& line : station_screen(unit)) EXPECT_LE(line.text.size(), 80u) << line.text;
  const RunRecord record = record_of(unit, new_run(), {"test", "0"});
  EXPECT_FALSE(record.passed());
  for (const ScreenLine& line : verdict_screen(record)) {
    EXPECT_LE(line.text.size(), 80u) << line.text;
  }
}

TEST_F(UnitTest, HasAReportOfItsVerdict) {
  RunRecord record = record_of(unit, new_run(), {"test", "0"});
  EXPECT_THAT(unit_report(record, "", {}),
              AllOf(HasSubstr("<strong>FAIL"), HasSubstr("Cause: boards")));
  record.figures =
      check_gates({{"coverage", 0.7}, {"rms_px", 0.3}}, {{"coverage", 0.75}, {"rms_px", 0.1}});
  record.causes.clear();
  record.verdict = "PASS";
  EXPECT_THAT(unit_report(record, "", {}),
              AllOf(HasSubstr("<strong>PASS"), HasSubstr("at least\u00a00.7"), HasSubstr("0.75"),
                    Not(HasSubstr("Cause"))));
}

}  // namespace
}  // namespace vlp
