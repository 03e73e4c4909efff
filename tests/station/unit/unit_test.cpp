// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit.h"

#include <gmock/gmock.h>

#include "station/records/publish_run.h"
#include "station/unit/station_screen.h"
#include "station/unit/unit_verdict.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;
constexpr const char* kView = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png";

/// Unit of the station in datasets/station, initially without images.
struct StationUnitTest : testing::Test {
  StationConfig config = read_station_config(VLP_SOURCE_DIR "/datasets/station/station.yaml");
  TemporaryFolder folder;
  Unit unit{config, std::string(64, 'x'), {"test", "0"}, 1};

  void add_bad(int number) {
    const auto file = folder.file(std::to_string(100 + number) + ".png", "no image");
    unit.add_step_images(StationStep::boards, {file});
  }
};

TEST_F(StationUnitTest, StartsWithBoardsStepAndInvalidVerdict) {
  EXPECT_EQ(unit.first_incomplete(), StationStep::boards);
  EXPECT_FALSE(unit.latest_calibration());
  EXPECT_THAT(list_failure_causes(unit),
              ElementsAre(Field(&Cause::text, HasSubstr("boards: too few images"))));
  EXPECT_EQ(decide_verdict(list_failure_causes(unit)), Verdict::invalid);
}

TEST_F(StationUnitTest, CanNoLongerPassAfterMaxConsecutiveRejections) {
  for (int i = 0; i < config.max_consecutive_rejections; ++i) {
    EXPECT_FALSE(unit.can_no_longer_pass()) << i;
    add_bad(i);
  }
  EXPECT_TRUE(unit.can_no_longer_pass());
  EXPECT_EQ(unit.step_state(StationStep::boards).count_used_images(), 0);
  unit.solve_completed(true);
  EXPECT_THAT(
      list_failure_causes(unit),
      ElementsAre(Field(&Cause::text, HasSubstr("12 of 12 images refused: 12 cannot be read"))));
  EXPECT_EQ(decide_verdict(list_failure_causes(unit)), Verdict::invalid)
      << "images that cannot be read are no fault";
  unit.remove_deleted(StationStep::boards, "100.png");
  EXPECT_FALSE(unit.can_no_longer_pass());
}

/// As after a restart of a killed program: all images arrive at once, by name.
TEST_F(StationUnitTest, CanStillPassWhenOneImageOfBatchIsUsed) {
  const auto valid_view = folder / "000.png";
  fs::copy_file(kView, valid_view);
  std::vector<fs::path> together{valid_view};
  for (int i = 0; i < config.max_consecutive_rejections + 1; ++i) {
    together.push_back(folder.file(std::to_string(100 + i) + ".png", "no image"));
  }
  // In two batches, as at the station.
  unit.add_step_images(StationStep::boards,
                       std::vector<fs::path>(together.begin(), together.end() - 1), true);
  EXPECT_FALSE(unit.can_no_longer_pass());
  unit.add_step_images(StationStep::boards, {together.back()});
  EXPECT_FALSE(unit.can_no_longer_pass());
  EXPECT_EQ(unit.step_state(StationStep::boards).num_consecutive_rejections, 0);
  // Added one by one, their order is known.
  for (int i = 0; i < config.max_consecutive_rejections; ++i) add_bad(100 + i);
  EXPECT_TRUE(unit.can_no_longer_pass());
}

TEST_F(StationUnitTest, VerdictIsInvalidWhenUnitIsEndedEarly) {
  unit.end_early("the operator ended the run");
  EXPECT_THAT(
      list_failure_causes(unit),
      ElementsAre(Field(&Cause::text,
                        "boards: the operator ended the run before there was enough (0/36)")));
  const RunRecord record = make_unit_record(unit, make_run_id(), {"test", "0"});
  EXPECT_EQ(record.verdict, "INVALID");
  EXPECT_TRUE(record.is_verdict_invalid());
  std::string screen;
  for (const ScreenLine& line : make_verdict_screen(record)) screen += line.text + "\n";
  EXPECT_THAT(screen,
              AllOf(HasSubstr("INVALID   camera"),
                    HasSubstr("Gates    not measured: 33 gates, because boards did not finish\n"),
                    HasSubstr("Cause    boards: the operator ended"), Not(HasSubstr("NOT MET"))));
}

/// Missing gates are described by the unfinished step, or by their names.
TEST(MakeVerdictScreen, NamesUnfinishedStepOrUnmeasuredGates) {
  const auto gates_line = [](const RunRecord& record) {
    for (const ScreenLine& line : make_verdict_screen(record)) {
      if (line.text.starts_with("Gates")) return line.text;
    }
    return std::string();
  };
  RunRecord record;
  record.kind = "unit";
  const std::vector<Gate> gates{{"blur_px", 1},
                                {"rms_px", 1},
                                {"rotation_px", 1},
                                {"dispersion_mm", 1},
                                {"check_mean_mm", 1}};
  const auto measure = [&](const std::vector<Metric>& metrics) {
    record.metrics = check_gates(gates, metrics);
  };
  record.set_causes({{"boards: no image can be used"}});
  measure({{"blur_px", 0.5}});
  EXPECT_EQ(gates_line(record), "Gates    not measured: 4 gates, because boards did not finish");
  // A metric of a failed step, and one available before a step is solved.
  record.set_causes({{"boards (36/36): two halves"}});
  measure({{"blur_px", 0.5}, {"rms_px", 0.1}});
  EXPECT_EQ(gates_line(record), "Gates    not measured: 3 gates, because boards did not finish");
  record.set_causes({{"the golden unit failed"}, {"rotation: no image can be used"}});
  EXPECT_EQ(gates_line(record), "Gates    not measured: 3 gates, because rotation did not finish");
  record.set_causes({{"check: no image can be used"}});
  measure({{"blur_px", 0.5}, {"rms_px", 0.1}, {"rotation_px", 0.1}, {"dispersion_mm", 0.1}});
  EXPECT_EQ(gates_line(record), "Gates    not measured: 1 gate, because check did not finish");
  record.set_causes({{"the station has moved"}});
  measure({{"rms_px", 0.1}, {"rotation_px", 0.1}, {"dispersion_mm", 0.1}, {"check_mean_mm", 1}});
  EXPECT_EQ(gates_line(record), "Gates    not measured: blur_px");
  measure({{"blur_px", 0.5},
           {"rms_px", 0.1},
           {"rotation_px", 0.1},
           {"dispersion_mm", 0.1},
           {"check_mean_mm", 1}});
  EXPECT_EQ(gates_line(record), "");
  // The steps of a golden unit are optional.
  record.kind = "golden";
  measure({{"check_mean_mm", 1}});
  EXPECT_EQ(gates_line(record),
            "Gates    not measured: blur_px, rms_px, rotation_px, dispersion_mm");
}

TEST_F(StationUnitTest, RejectsImageUsedByAnotherCamera) {
  unit.set_image_lookup([](const std::string&) { return std::optional(ImageUser{"0001", "R"}); });
  fs::copy_file(kView, folder / "0.png");
  unit.add_step_images(StationStep::boards, {folder / "0.png"});
  EXPECT_EQ(
      unit.step_state(StationStep::boards).images.at("0.png").rejection_message(),
      "already of camera 0001, run R: if its serial was wrong, 'vlp-station void R --station " +
          config.file.string() + " --operator NAME --reason WHY' frees its images");
  unit.solve_completed(true);
  EXPECT_THAT(list_failure_causes(unit),
              ElementsAre(Field(&Cause::text,
                                HasSubstr("1 already of camera 0001, run R: if its serial was "
                                          "wrong, 'vlp-station void R --station "))));
  EXPECT_EQ(decide_verdict(list_failure_causes(unit)), Verdict::invalid);
}

TEST(InvalidateReuse, MakesRecordInvalidAndNamesEarlierRun) {
  RunRecord record;
  record.set_causes({});
  ASSERT_TRUE(record.has_run_passed());
  invalidate_reuse(record, "R1", "station.yaml");
  EXPECT_TRUE(record.is_verdict_invalid());
  EXPECT_EQ(record.first_cause(),
            "all images are those of run R1, which is no repetition: take new ones, or "
            "'vlp-station void R1 --station station.yaml --operator NAME --reason WHY' if that run "
            "should not count");
}

TEST(DecideVerdict, ReturnsVerdictOfFirstCause) {
  EXPECT_EQ(decide_verdict({}), Verdict::pass);
  EXPECT_EQ(decide_verdict({{"decentered", true}, {"the operator left"}}), Verdict::fail);
  EXPECT_EQ(decide_verdict({{"lamp 5 is loose"}, {"the fixes are off", true}}), Verdict::invalid);
}

TEST_F(StationUnitTest, QueuesImagesOfStepUntilPreviousStepIsComplete) {
  const auto file = folder.file("0.png", "no image");
  unit.add_step_images(StationStep::check, {file});
  unit.solve_completed(false);
  EXPECT_EQ(unit.step_state(StationStep::check).pending_images.size(), 1u);
  unit.remove_deleted(StationStep::check, "0.png");
  EXPECT_TRUE(unit.step_state(StationStep::check).pending_images.empty());
}

TEST_F(StationUnitTest, ScreenLinesHaveAtMost80Characters) {
  add_bad(1);
  add_bad(2);
  for (const ScreenLine& line : make_station_screen(unit))
    EXPECT_LE(line.text.size(), 80u) << line.text;
  const RunRecord record = make_unit_record(unit, make_run_id(), {"test", "0"});
  EXPECT_FALSE(record.has_run_passed());
  for (const ScreenLine& line : make_verdict_screen(record)) {
    EXPECT_LE(line.text.size(), 80u) << line.text;
  }
}

TEST_F(StationUnitTest, ReportStatesVerdictOrNoneForEditedRecord) {
  RunRecord record = make_unit_record(unit, make_run_id(), {"test", "0"});
  EXPECT_THAT(make_run_report(record, "", {}),
              AllOf(HasSubstr("<strong>INVALID</strong><p>boards: too few images"),
                    HasSubstr("not\u00a0reached"), Not(HasSubstr("NOT\u00a0MET"))));
  record.images = {{"boards", "7.png", "", "too dark"}};
  EXPECT_THAT(make_run_report(record, "", {}),
              AllOf(HasSubstr("boards/7.png"), HasSubstr("too dark")));
  record.metrics =
      check_gates({{"coverage", 0.7}, {"rms_px", 0.3}}, {{"coverage", 0.75}, {"rms_px", 0.1}});
  record.causes.clear();
  record.verdict = "PASS";
  EXPECT_THAT(make_run_report(record, "", {}),
              AllOf(HasSubstr("<strong>PASS"), HasSubstr("at least\u00a00.7"), HasSubstr("0.75"),
                    Not(HasSubstr("is not met")), Not(HasSubstr("confidence interval"))));
  // Once, with its meaning, among the gates.
  const std::string page = make_run_report(record, "", {});
  EXPECT_EQ(page.find("coverage: share"), page.rfind("coverage: share"));
  // Edited in the database.
  record.metrics[1].value = 0.5;
  EXPECT_THAT(explain_void_verdict(record),
              HasSubstr("rms_px is 0.5 px, at most 0.3 px is required"));
  EXPECT_THAT(make_run_report(record, "", {}),
              AllOf(HasSubstr("NO VERDICT</strong><p>the record has PASS, but rms_px"),
                    Not(HasSubstr("<strong>PASS"))));
  for (const ScreenLine& line : make_verdict_screen(record)) {
    EXPECT_THAT(line.text, Not(testing::StartsWith("PASS")));
  }
}

}  // namespace
}  // namespace vlp
