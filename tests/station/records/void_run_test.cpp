// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/void_run.h"

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
class VoidRecordedRun : public testing::Test {
 protected:
  VoidRecordedRun() {
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
  Spool open_spool() const { return {config.spool, config.records}; }
  /// Voids a run by the records alone, without the station.
  VoidedRun void_by_records(const std::string& run) const {
    Spool records({}, config.records);
    return void_recorded_run(records, nullptr, run, "Ann", "wrong serial");
  }
  VoidedRun void_at_station(const std::string& run,
                            const std::string& operator_name = "Ann") const {
    Spool runs = open_spool();
    return void_recorded_run(runs, &config, run, operator_name, "wrong serial");
  }
  std::vector<RunEvent> events_of(const std::string& run) const {
    const auto record = Records(config.records).find_run_by_id(run);
    EXPECT_TRUE(record);
    return record ? record->events : std::vector<RunEvent>();
  }

  TemporaryFolder folder;
  StationConfig config{};
};

TEST_F(VoidRecordedRun, ThrowsForOperatorNotInVoidOperators) {
  const std::string run = keep(1);
  config.void_operators = {"Bea"};
  EXPECT_THAT([&] { void_at_station(run); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr(
                  "operator Ann may not void runs of station station-1: void_operators")));
  EXPECT_THAT(events_of(run), IsEmpty());
  EXPECT_THAT(void_at_station(run, "Bea").run.events, SizeIs(1));
}

TEST_F(VoidRecordedRun, RecordsOperatorAndReasonAndThrowsSecondTime) {
  const std::string run = keep(1);
  void_by_records(run);
  EXPECT_THAT(Records(config.records).list_run_summaries({}),
              ElementsAre(Field(&RunSummary::voided, "wrong serial")));
  EXPECT_THROW(void_by_records(run), std::invalid_argument);
  EXPECT_THROW(void_by_records("none"), std::invalid_argument);
  ASSERT_THAT(events_of(run), SizeIs(1));
  EXPECT_THAT(events_of(run)[0].author, testing::StartsWith("Ann ("));
}

TEST_F(VoidRecordedRun, RenamesCalibrationOfPassedRun) {
  const RunRecord run = make_sample_record(numbered_run_id(1), "a", 0.1);
  ASSERT_TRUE(run.has_run_passed());
  Records(config.records).store_run(run);
  const auto results = config.results / "a" / run.run;
  std::filesystem::create_directories(results);
  folder.file((results / "calibration.yaml").string(), run.calibration);
  config.hook = Hook{{"sh", "-c", "cat >told.json"}, folder / ".", 20};
  EXPECT_EQ(void_at_station(run.run).files_problem, "");
  EXPECT_FALSE(std::filesystem::exists(results / "calibration.yaml"));
  EXPECT_EQ(TemporaryFolder::read_content(results / "voided-calibration.yaml"), run.calibration);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "told.json"),
              testing::StartsWith("{\n \"event\": \"voided\",\n"));
  // Only the station has the location of the files.
  EXPECT_THAT(void_by_records(keep(2)).files_problem,
              HasSubstr("keep their names: use the same command with --station of station-1"));
}

TEST_F(VoidRecordedRun, CallsHookWhenRepeatedIfRunWasVoidedWithoutStation) {
  config.hook = Hook{{"sh", "-c", "cat >told.json"}, folder / ".", 20};
  const std::string run = keep(1);
  void_by_records(run);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "told.json"), "");
  const VoidedRun finished = void_at_station(run, "Ben");
  EXPECT_EQ(finished.problem, "");
  EXPECT_EQ(finished.run.events.back().kind, kHookDone);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "told.json"), HasSubstr("wrong serial"));
  EXPECT_THROW(void_at_station(run, "Ben"), std::invalid_argument) << "nothing is left";
}

/// Labels and the factory's system are informed of it.
TEST_F(VoidRecordedRun, CallsHookWithVoidedEvent) {
  config.hook = Hook{{"sh", "-c", "cat >told.json; echo taken back"}, folder / ".", 20};
  const std::string run = keep(1);
  const auto [record, problem, files_problem] = void_at_station(run);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(files_problem, "");
  EXPECT_EQ(record.events.back().kind, kHookDone);
  Spool spool = open_spool();
  EXPECT_THAT(list_open_hooks(spool, config.station), IsEmpty());
  EXPECT_THAT(TemporaryFolder::read_content(folder / "told.json"),
              AllOf(HasSubstr(run), HasSubstr("\"voided\""), HasSubstr("wrong serial")));
  ASSERT_THAT(events_of(run), SizeIs(3));
  EXPECT_EQ(events_of(run)[2].text, "taken back");
  // A hook that succeeded at the verdict is open again if it fails now.
  config.hook = Hook{{"false"}, folder / ".", 20};
  RunRecord second = make_sample_record(numbered_run_id(2), "a", 0.1);
  second.events = {make_run_event_now(kHookRequested, "label"), make_run_event_now(kHookDone, "")};
  Records(config.records).store_run(second);
  EXPECT_THAT(list_open_hooks(spool, config.station), IsEmpty());
  EXPECT_EQ(describe_pending_hook(void_at_station(second.run).run), "failed: exit code 1");
  EXPECT_THAT(list_open_hooks(spool, config.station), ElementsAre(second.run));
}

TEST_F(VoidRecordedRun, CallsNoHookOfAnotherStation) {
  const std::string run = keep(1);
  config.station = "station-2";
  config.hook = Hook{{"touch", "told"}, folder / ".", 20};
  EXPECT_THAT(void_at_station(run).run.events, SizeIs(1));
  EXPECT_FALSE(std::filesystem::exists(folder / "told"));
}

TEST_F(VoidRecordedRun, ThrowsWhileHookOfRunIsLocked) {
  config.hook = Hook{{"true"}, folder / ".", 20};
  const std::string run = keep(1);
  std::filesystem::create_directory(config.spool);
  const HookLock lock(config.spool, run);
  EXPECT_THROW(void_at_station(run), InputError);
  EXPECT_THAT(events_of(run), IsEmpty());
}

}  // namespace
}  // namespace vlp
