// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/known_runs.h"

#include <gmock/gmock.h>

#include <stdexcept>

#include "rig/input_error.h"
#include "station/records/golden_unit_schedule.h"
#include "station/records/hook.h"
#include "station/sample_records.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// Station with a file of records.
class KnownRunsTest : public testing::Test {
 protected:
  KnownRunsTest() {
    config.station = "station-1";
    config.records = (folder / "records.db").string();
    config.spool = folder / "spool";
    config.results = folder / "results";
  }
  std::string keep(int number, double rms_px = 0.1) const {
    const RunRecord run = make_sample_record(numbered_run_id(number), "a", rms_px);
    Records(config.records).store_run(run);
    return run.run;
  }
  /// Makes the records unavailable.
  std::string keep_waiting(int number) const {
    const RunRecord run = make_sample_record(numbered_run_id(number), "b", 0.1);
    Spool(config.spool, config.records).store_run(run);
    return run.run;
  }
  static RunFilter only(std::string RunFilter::*text, const std::string& value) {
    RunFilter filter;
    filter.*text = value;
    return filter;
  }
  void make_records_unavailable() const {
    std::filesystem::rename(config.records, folder / "elsewhere.db");
  }

  TemporaryFolder folder;
  StationConfig config{};
};

TEST_F(KnownRunsTest, ListRunsReturnsStoredAndWaitingRuns) {
  const std::string kept = keep(1);
  EXPECT_THAT(KnownRuns(config.records).list_run_summaries({}),
              ElementsAre(Field(&RunSummary::run, kept)));
  const std::string waits = keep_waiting(2);
  {
    KnownRuns known(config);  // brings it there
    EXPECT_THAT(known.list_run_summaries({}),
                ElementsAre(Field(&RunSummary::run, kept),
                            AllOf(Field(&RunSummary::run, waits), Field(&RunSummary::causes, ""))));
    EXPECT_THAT(known.load_matching_runs({}), SizeIs(2));
    EXPECT_EQ(known.find_last_run({}).run, waits);
    EXPECT_EQ(known.find_last_run(only(&RunFilter::camera, "a")).run, kept);
    EXPECT_EQ(known.find_run_by_id(kept).camera, "a");
    EXPECT_THROW(known.find_run_by_id("none"), std::invalid_argument);
    EXPECT_THROW(known.find_last_run(only(&RunFilter::camera, "c")), std::invalid_argument);
  }
  make_records_unavailable();
  const std::string alone = keep_waiting(3);
  KnownRuns known(config);
  EXPECT_THAT(known.list_run_summaries({}),
              ElementsAre(AllOf(Field(&RunSummary::run, alone),
                                Field(&RunSummary::causes, "(waits here) "))));
  EXPECT_THAT(known.list_run_summaries(only(&RunFilter::verdict, "FAIL")), IsEmpty());
  EXPECT_THAT(known.list_run_summaries(only(&RunFilter::until, "2026")), IsEmpty());
  EXPECT_EQ(known.find_run_by_id(alone).camera, "b");
  EXPECT_THROW(known.records_or_throw(), std::runtime_error) << "these are not all";
  EXPECT_THROW(known.load_matching_runs({}), std::runtime_error);
}

TEST_F(KnownRunsTest, ConstructorThrowsWhenRecordsDoNotExist) {
  EXPECT_THROW(KnownRuns{config}, std::runtime_error);
  EXPECT_THROW(KnownRuns{config.records}, std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(config.records)) << "a station makes them";
}

TEST(CountRunsByVerdict, ExcludesVoidedRunsFromYield) {
  const std::vector<RunSummary> runs{{"1", "unit", "", "", "", "PASS", "", ""},
                                     {"2", "unit", "", "", "", "PASS", "", ""},
                                     {"3", "unit", "", "", "", "FAIL", "", ""},
                                     {"4", "unit", "", "", "", "FAIL", "", "wrong serial"},
                                     {"5", "unit", "", "", "", "INVALID", "", ""},
                                     {"6", "golden", "", "", "", "PASS", "", ""}};
  const RunCounts counts = count_runs_by_verdict(runs);
  EXPECT_EQ(counts.passed, 3U);
  EXPECT_EQ(counts.failed, 1U);
  EXPECT_EQ(counts.invalid, 1U);
  EXPECT_EQ(counts.voided, 1U);
  EXPECT_EQ(counts.units_judged, 3U);
  EXPECT_DOUBLE_EQ(counts.compute_yield().value(), 2.0 / 3);
  EXPECT_FALSE(count_runs_by_verdict({}).compute_yield());
}

TEST(CountRunsByVerdict, CountsReworkedCamerasAndFirstPassYield) {
  const std::vector<RunSummary> runs{{"1", "unit", "", "a", "", "PASS", "", ""},
                                     {"2", "unit", "", "b", "", "FAIL", "", ""},
                                     {"3", "unit", "", "b", "", "PASS", "", ""},
                                     {"4", "unit", "", "c", "", "INVALID", "", ""},
                                     {"5", "unit", "", "c", "", "PASS", "", ""},
                                     {"6", "unit", "", "d", "", "FAIL", "", "wrong serial"},
                                     {"7", "golden", "", "g", "", "FAIL", "", ""}};
  const RunCounts counts = count_runs_by_verdict(runs);
  EXPECT_EQ(counts.cameras, 3U);
  EXPECT_EQ(counts.cameras_reworked, 1U);
  EXPECT_DOUBLE_EQ(counts.compute_first_pass_yield().value(), 2.0 / 3);
  EXPECT_FALSE(count_runs_by_verdict({}).compute_first_pass_yield());
}

TEST_F(KnownRunsTest, ListRunsFiltersByOperatorAndShift) {
  RunRecord night = make_sample_record(numbered_run_id(1), "a", 0.1),
            day = make_sample_record(numbered_run_id(2), "a", 0.1);
  night.operator_name = "Ann";
  night.shift = "night";
  day.operator_name = "Bea";
  for (const RunRecord* run : {&night, &day}) Records(config.records).store_run(*run);
  const auto expect_only_the_night = [&] {
    KnownRuns known(config);
    const auto is_night = ElementsAre(Field(&RunSummary::run, night.run));
    EXPECT_THAT(known.list_run_summaries({}), SizeIs(2));
    EXPECT_THAT(known.list_run_summaries(only(&RunFilter::operator_name, "Ann")), is_night);
    EXPECT_THAT(known.list_run_summaries(only(&RunFilter::shift, "night")), is_night);
    EXPECT_THAT(known.list_run_summaries(only(&RunFilter::operator_name, "Cat")), IsEmpty());
  };
  expect_only_the_night();
  make_records_unavailable();
  for (const RunRecord* run : {&night, &day}) Spool(config.spool, config.records).store_run(*run);
  expect_only_the_night();
}

TEST_F(KnownRunsTest, VoidRunThrowsForOperatorNotInVoidOperators) {
  const std::string run = keep(1);
  config.void_operators = {"Bea"};
  KnownRuns known(config);
  EXPECT_THAT([&] { void_recorded_run(known, run, "Ann", "wrong serial"); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr(
                  "operator Ann may not void runs of station station-1: void_operators")));
  EXPECT_THAT(known.find_run_by_id(run).events, IsEmpty());
  EXPECT_THAT(void_recorded_run(known, run, "Bea", "wrong serial").run.events, SizeIs(1));
}

TEST_F(KnownRunsTest, VoidRunRecordsOperatorAndReasonAndThrowsSecondTime) {
  const std::string run = keep(1);
  {
    KnownRuns known(config.records);
    void_recorded_run(known, run, "Ann", "wrong serial");
    EXPECT_THAT(known.list_run_summaries({}),
                ElementsAre(Field(&RunSummary::voided, "wrong serial")));
    EXPECT_THROW(void_recorded_run(known, run, "Ann", "again"), std::invalid_argument);
    EXPECT_THROW(void_recorded_run(known, "none", "Ann", "again"), std::invalid_argument);
  }
  const auto record = Records(config.records).find_run_by_id(run);
  ASSERT_THAT(record->events, SizeIs(1));
  EXPECT_THAT(record->events[0].author, testing::StartsWith("Ann ("));
}

TEST_F(KnownRunsTest, VoidRunRenamesCalibrationOfPassedRun) {
  const RunRecord run = make_sample_record(numbered_run_id(1), "a", 0.1);
  ASSERT_TRUE(run.has_run_passed());
  Records(config.records).store_run(run);
  const auto results = config.results / "a" / run.run;
  std::filesystem::create_directories(results);
  folder.file((results / "calibration.yaml").string(), run.calibration);
  config.hook = Hook{{"sh", "-c", "cat >told.json"}, folder / ".", 20};
  KnownRuns known(config);
  EXPECT_EQ(void_recorded_run(known, run.run, "Ann", "wrong serial").files_problem, "");
  EXPECT_FALSE(std::filesystem::exists(results / "calibration.yaml"));
  EXPECT_EQ(TemporaryFolder::read_content(results / "voided-calibration.yaml"), run.calibration);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "told.json"),
              testing::StartsWith("{\n \"event\": \"voided\",\n"));
  // Only the station has the location of the files.
  const std::string second = keep(2);
  KnownRuns records(config.records);
  EXPECT_THAT(void_recorded_run(records, second, "Ann", "wrong serial").files_problem,
              HasSubstr("keep their names: use the same command with --station of station-1"));
}

TEST_F(KnownRunsTest, RepeatedVoidCallsHookIfRunWasVoidedWithoutStation) {
  config.hook = Hook{{"sh", "-c", "cat >told.json"}, folder / ".", 20};
  const std::string run = keep(1);
  {
    KnownRuns records(config.records);
    void_recorded_run(records, run, "Ann", "wrong serial");
  }
  EXPECT_EQ(TemporaryFolder::read_content(folder / "told.json"), "");
  KnownRuns known(config);
  const VoidedRun finished = void_recorded_run(known, run, "Ben", "again");
  EXPECT_EQ(finished.problem, "");
  EXPECT_EQ(finished.run.events.back().kind, kHookDone);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "told.json"), HasSubstr("wrong serial"));
  EXPECT_THROW(void_recorded_run(known, run, "Ben", "again"), std::invalid_argument)
      << "nothing is left";
}

/// Labels and the factory's system are informed of it.
TEST_F(KnownRunsTest, VoidRunCallsHookWithVoidedEvent) {
  config.hook = Hook{{"sh", "-c", "cat >told.json; echo taken back"}, folder / ".", 20};
  const std::string run = keep(1);
  {
    KnownRuns known(config);
    const auto [record, problem, files_problem] =
        void_recorded_run(known, run, "Ann", "wrong serial");
    EXPECT_EQ(problem, "");
    EXPECT_EQ(files_problem, "");
    EXPECT_EQ(record.events.back().kind, kHookDone);
    EXPECT_THAT(list_open_hooks(known, config.station), IsEmpty());
  }
  EXPECT_THAT(TemporaryFolder::read_content(folder / "told.json"),
              AllOf(HasSubstr(run), HasSubstr("\"voided\""), HasSubstr("wrong serial")));
  const auto record = Records(config.records).find_run_by_id(run);
  ASSERT_THAT(record->events, SizeIs(3));
  EXPECT_EQ(record->events[2].text, "taken back");
  // A hook that succeeded at the verdict is open again if it fails now.
  config.hook = Hook{{"false"}, folder / ".", 20};
  RunRecord second = make_sample_record(numbered_run_id(2), "a", 0.1);
  second.events = {make_run_event_now(kHookRequested, "label"), make_run_event_now(kHookDone, "")};
  Records(config.records).store_run(second);
  KnownRuns known(config);
  EXPECT_THAT(list_open_hooks(known, config.station), IsEmpty());
  EXPECT_EQ(describe_pending_hook(void_recorded_run(known, second.run, "Ann", "again").run),
            "failed: exit code 1");
  EXPECT_THAT(list_open_hooks(known, config.station), ElementsAre(second.run));
}

TEST_F(KnownRunsTest, VoidRunCallsNoHookOfAnotherStation) {
  const std::string run = keep(1);
  config.station = "station-2";
  config.hook = Hook{{"touch", "told"}, folder / ".", 20};
  KnownRuns known(config);
  EXPECT_THAT(void_recorded_run(known, run, "Ann", "wrong serial").run.events, SizeIs(1));
  EXPECT_FALSE(std::filesystem::exists(folder / "told"));
}

TEST_F(KnownRunsTest, VoidRunThrowsWhileHookOfRunIsLocked) {
  config.hook = Hook{{"true"}, folder / ".", 20};
  const std::string run = keep(1);
  KnownRuns known(config);
  std::filesystem::create_directory(config.spool);
  const HookLock lock(config.spool, run);
  EXPECT_THROW(void_recorded_run(known, run, "Ann", "wrong serial"), InputError);
  EXPECT_THAT(known.find_run_by_id(run).events, IsEmpty());
}

}  // namespace
}  // namespace vlp
