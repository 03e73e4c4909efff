// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/records.h"
#include "station/records/spool.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "station/records/record_tables.h"
#include "station/records/run_record.h"
#include "station/sample_records.h"
#include "station/station_config.h"
#include "support/postgres_server.h"
#include "support/rejection_message.h"
#include "support/schema.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

/// Returns a record with a different text in each of its fields.
RunRecord with_all_texts() {
  RunRecord record = make_sample_record(numbered_run_id(7), "a", 0.5);
  for (const RunField& field : list_run_fields()) {
    record.*field.text = std::string("the '") + field.name + "' of \"it\"\n";
  }
  return record;
}

void check_all_texts(Records& records) {
  const RunRecord kept = escape_run(with_all_texts());
  records.store_run(kept);
  const auto found = records.find_run_by_id(kept.run);
  ASSERT_TRUE(found);
  for (const RunField& field : list_run_fields()) {
    EXPECT_EQ((*found).*field.text, kept.*field.text) << field.name;
  }
}

/// Checks that events are added to a stored run once and remain.
void check_events(Records& records) {
  RunRecord run = make_sample_record(numbered_run_id(8), "e", 0.5),
            other = make_sample_record(numbered_run_id(6), "e", 0.5);
  run.events = {make_run_event_now(kHookRequested, "label 'x'")};
  other.events = {make_run_event_now(kHookRequested, "label"), make_run_event_now(kHookDone, "")};
  for (const RunRecord& each : {run, other, run}) records.store_run(each);
  EXPECT_THAT(list_open_hooks(records, "station-1"), ElementsAre(run.run));
  EXPECT_THAT(list_open_hooks(records), ElementsAre(run.run));
  EXPECT_THAT(list_open_hooks(records, "another"), IsEmpty());
  const RunEvent wanted = run.events.front();
  run.events.push_back(make_run_event_now(kHookFailed, "exit code 3"));
  records.store_run(run);
  EXPECT_THAT(list_open_hooks(records, "station-1"), ElementsAre(run.run));
  run.events = {make_run_event_now(kHookDone, "")};  // by a program without the other events
  records.store_run(run);
  EXPECT_THAT(list_open_hooks(records, "station-1"), IsEmpty());
  const auto found = records.find_run_by_id(run.run);
  ASSERT_TRUE(found);
  ASSERT_THAT(found->events, SizeIs(3));
  EXPECT_EQ(found->events[0].event, wanted.event);
  EXPECT_EQ(found->events[0].text, "label 'x'");
  EXPECT_EQ(found->events[0].author, wanted.author);
  EXPECT_THAT(wanted.author, HasSubstr("@"));
  EXPECT_EQ(found->events[1].text, "exit code 3");
  EXPECT_EQ(found->events[2].kind, kHookDone);
}

/// Part of check_records(): a voided run remains, but is not counted.
void check_voided(Records& records) {
  const std::size_t before = records.load_metric_trend("rms_px", {}).size();
  RunRecord run = make_sample_record(numbered_run_id(0), "a", 0);
  run.events = {make_run_event_now(kVoided, "wrong serial", "Ann")};
  records.store_run(run);
  const auto found = records.find_run_by_id(run.run);
  ASSERT_TRUE(found);
  EXPECT_THAT(explain_void_verdict(*found),
              testing::MatchesRegex("was voided by Ann [(].*@.*: wrong serial"));
  EXPECT_THAT(records.load_metric_trend("rms_px", {}), SizeIs(before - 1));
  EXPECT_EQ(records.list_run_summaries({})[0].run, run.run);
  EXPECT_EQ(records.list_run_summaries({})[0].voided, "wrong serial");
  EXPECT_EQ(records.list_run_summaries({})[1].voided, "");
  EXPECT_EQ(records.list_run_summaries({.image_sha256 = std::string(64, 'b')})[0].voided,
            "wrong serial");
}

/// Checks the properties of records in every database.
void check_records(const std::string& where) {
  Records records(where);
  for (int i = 0; i < 4; ++i) {
    records.store_run(
        make_sample_record(numbered_run_id(i), i == 2 ? "b" : "a", i == 3 ? 1.5 : 0.1 * i));
  }
  // Stored once; a different run of its id is rejected.
  records.store_run(make_sample_record(numbered_run_id(0), "a", 0));
  EXPECT_THAT(rejection_message(
                  [&] { records.store_run(make_sample_record(numbered_run_id(0), "other", 0.7)); }),
              HasSubstr("has another run " + numbered_run_id(0)));
  const auto all = records.list_run_summaries({});
  ASSERT_THAT(all, SizeIs(4));
  EXPECT_EQ(all[0].camera, "a");
  EXPECT_EQ(all[3].verdict, "FAIL");
  EXPECT_EQ(all[3].station, "station-1");
  EXPECT_THAT(all[3].causes, StartsWith("it's \"blurred\""));
  EXPECT_THAT(
      list_ids(records, {.image_sha256 = std::string(64, 'b')}),
      ElementsAre(numbered_run_id(0), numbered_run_id(1), numbered_run_id(2), numbered_run_id(3)));
  EXPECT_THAT(list_ids(records, {.camera = "b", .image_sha256 = std::string(64, 'b')}),
              ElementsAre(numbered_run_id(2)));
  EXPECT_THAT(list_ids(records, {.image_sha256 = std::string(64, 'c')}), IsEmpty())
      << "it was refused there";
  EXPECT_EQ(rejection_message([&] { records.check_writable(); }), "");
  RunFilter filter;
  filter.camera = "a";
  EXPECT_THAT(records.list_run_summaries(filter), SizeIs(3));
  filter.verdict = "PASS";
  filter.last = 1;
  ASSERT_THAT(records.list_run_summaries(filter), SizeIs(1));
  EXPECT_EQ(records.list_run_summaries(filter)[0].run, numbered_run_id(1));

  EXPECT_FALSE(records.find_run_by_id("another"));
  const auto found = records.find_run_by_id(numbered_run_id(3));
  ASSERT_TRUE(found);
  const RunRecord expected = make_sample_record(numbered_run_id(3), "a", 1.5);
  EXPECT_EQ(found->causes, expected.causes);
  EXPECT_EQ(found->calibration, expected.calibration);
  ASSERT_THAT(found->metrics, SizeIs(3));
  EXPECT_EQ(found->metrics[0].value, 1.5);
  EXPECT_FALSE(found->metrics[0].has_passed_gate());
  EXPECT_EQ(found->metrics[0].unit, "px");
  ASSERT_TRUE(found->metrics[0].guard_band);
  EXPECT_EQ(found->metrics[0].guard_band->standard_uncertainty, 0.1 + 0.2);  // to the last bit
  EXPECT_EQ(found->metrics[0].guard_band->k, 1.5);
  EXPECT_FALSE(found->metrics[1].guard_band);
  EXPECT_FALSE(found->metrics[1].limit);
  EXPECT_EQ(found->metrics[1].direction, Direction::at_least);
  EXPECT_FALSE(found->metrics[2].value);
  ASSERT_THAT(found->images, SizeIs(2));
  EXPECT_EQ(found->images[1].rejection, "too dark");

  RunFilter of_a;
  of_a.camera = "a";
  const auto trend = records.load_metric_trend("rms_px", of_a);
  ASSERT_THAT(trend, SizeIs(3));
  EXPECT_DOUBLE_EQ(trend[2].value, 1.5);
  EXPECT_THAT(records.load_metric_trend("tilt_deg", {}), IsEmpty());
  check_all_texts(records);
  check_events(records);
  check_voided(records);
  const TrailCheck trail = records.check_trail("");
  EXPECT_THAT(trail.problems, IsEmpty());
  EXPECT_EQ(trail.runs, 7U);
  EXPECT_EQ(trail.entries, 7U + 6U) << "runs and events";
}

/// Returns tables, their columns, the version and the metrics.
std::string read_state(const std::string& where) {
  const bool is_server_address = where.starts_with("postgresql://");
  return run_database_client(
      where, std::string(is_server_address ? "SELECT table_name, column_name, data_type FROM "
                                             "information_schema.columns WHERE table_schema = "
                                             "'public' ORDER BY table_name, ordinal_position;"
                                           : "SELECT sql FROM sqlite_master ORDER BY name;") +
                 "\nSELECT * FROM vlp_schema;\nSELECT * FROM metrics ORDER BY name;\n");
}

/// Checks that a database of another version is rejected and unchanged.
void check_other_versions(const std::string& where) {
  { const Records created(where); }
  for (const char* version : {"1", "99"}) {
    run_database_client(where, std::string("UPDATE vlp_schema SET version = ") + version + ";\n");
    const std::string before = read_state(where);
    EXPECT_THAT(rejection_message([&] { Records records(where); }),
                HasSubstr(std::string(": contains records of version ") + version +
                          ", this program reads version " + std::to_string(kSchemaVersion) +
                          ": use the vlp-station that wrote them"));
    EXPECT_EQ(read_state(where), before);
  }
}

TEST(DescribeUtcProblem, ReturnsEmptyTextOnlyForExistingDaysAndTimes) {
  for (const char* valid_text : {"2026-11-21", "2024-02-29", "2026-11-21T13:45",
                                 "2026-11-21T13:45:01", "2026-11-21T13:45:01Z"}) {
    EXPECT_EQ(describe_utc_problem(valid_text), "");
  }
  for (const char* bad : {"", "2026", "2026-02-29", "2026-13-01", "2026-11-21T24:00",
                          "2026-11-21T13:60", "2026-11-21T13:45:60", "2026-11-21 13:45"}) {
    EXPECT_THAT(describe_utc_problem(bad), StartsWith("should be a UTC as ")) << bad;
  }
}

TEST(Records, CheckWritableThrowsWhenUpdateFails) {
  const TemporaryFolder folder;
  const std::string file = (folder / "records.db").string();
  { const Records made(file); }
  run_database_client(
      file,
      "CREATE TRIGGER stop BEFORE UPDATE ON vlp_schema BEGIN SELECT RAISE(ABORT, 'stopped'); "
      "END;\n");
  Records records(file);
  EXPECT_THAT(rejection_message([&] { records.check_writable(); }), HasSubstr("stopped"));
}

TEST(Records, RejectsDatabasesOfOtherVersions) {
  const TemporaryFolder folder;
  check_other_versions((folder / "records.db").string());
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  check_other_versions(server.uri());
}

TEST(Records, StoresAndFindsRunsInSqlite) {
  const TemporaryFolder folder;
  check_records((folder / "records.db").string());
}

TEST(Records, StoresAndFindsRunsInPostgres) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  check_records(server.uri());
  // A connection string without a parameter, as for psql.
  EXPECT_THAT(Records(server.plain_uri()).list_run_summaries({}), Not(IsEmpty()));

  // The server closes the connection, as at a restart.
  Records records(server.uri());
  run_database_client(server.uri(),
                      "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> "
                      "pg_backend_pid() AND backend_type = 'client backend';\n");
  records.store_run(make_sample_record(numbered_run_id(9), "c", 0.1));
  EXPECT_TRUE(records.find_run_by_id(numbered_run_id(9)));
}

TEST(Records, ErrorsOmitPasswordOfServerAddress) {
  for (const char* where : {"postgresql://vlp:secret@/postgres?host=/nowhere",
                            "postgresql://vlp@/postgres?password=secret&host=/nowhere",
                            "postgresql://vlp@/postgres?host=/nowhere&password=a@secret"}) {
    EXPECT_THAT(
        rejection_message([&] { Records records(where); }),
        testing::AllOf(
            StartsWith("postgresql:///nowhere/postgres: the server of the records cannot be "
                       "reached"),
            Not(HasSubstr("secret"))));
  }
  for (const char* where :
       {"postgresql://vlp@/postgres?secret", "mysql://vlp:secret@/records",
        // where libpq takes a part of the password for the host, the port or the database
        "postgresql://vlp:a@secret@/postgres", "postgresql://vlp:a/secret@nowhere/postgres",
        "postgresql://vlp:secret/postgres", "host=/nowhere user=vlp password=secret"}) {
    EXPECT_THAT(rejection_message([&] { Records records(where); }),
                testing::AllOf(HasSubstr("is not of the form postgresql://USER@HOST/NAME"),
                               Not(HasSubstr("secret"))));
  }
}

/// Returns the first line of a text.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

TEST(WriteRuns, WritesMetricsAndSelectedTextsAsCsv) {
  const TemporaryFolder folder;
  const auto file = folder / "runs.csv";
  write_runs(file, {make_sample_record(numbered_run_id(1), "a", 0.25),
                    make_sample_record(numbered_run_id(2), "b", 1.5), with_all_texts()});
  const std::string csv = TemporaryFolder::read_content(file);
  EXPECT_EQ(
      first_line(csv),
      "run,kind,station,camera,operator_name,shift,begun_utc,ended_utc,verdict,causes,program,"
      "config_sha256,board_white,lamp_white,dark_level,defective_pixels,lamp_blur_px,"
      "blur_px,focal_percent,principal_point_px,nominal_difference_px,board_warp_mm,mtf50_"
      "asymmetry,mtf50,"
      "local_loss,local_shadow,mtf50_worst_ratio,black_ratio,rms_px,board_print_px,expected_max_"
      "error_px,"
      "split_half_px,coverage,"
      "views,board_tilt_deg,rotation_px,rotation_spread_px,rotation_sd_px,tilt_deg,lever_arm_"
      "mm,row_time_us,row_time_sd_us,row_time_error_percent,dispersion_mm,"
      "dispersion_offset_px,world_offset_mm,check_fix_fraction,check_lamp_inlier_fraction,check_"
      "lamps_seen,check_mean_mm,"
      "check_worst_mm,check_offset_mm,check_height_mm,check_residual_px");
  EXPECT_THAT(csv, HasSubstr("2026-11-21T13:45:01Z,2026-11-21T13:45:01Z,PASS"));
  EXPECT_THAT(csv, HasSubstr("; second"));
  for (const RunField& field : list_run_fields()) {
    const std::string text = std::string("the '") + field.name + "' of ";
    EXPECT_EQ(csv.find(text) != std::string::npos, field.is_column) << field.name;
  }
  EXPECT_THAT(rejection_message([&] { write_runs(folder / "runs.txt", {}); }), HasSubstr(".csv"));
}

TEST(SerializeRun, DocumentsExportsAndHookMatchSchema) {
  const TemporaryFolder folder;
  RunRecord golden = make_sample_record(numbered_run_id(2), "b", 1.5);
  golden.kind = "golden";
  RunRecord invalid = make_sample_record(numbered_run_id(3), "c", 1.5);
  invalid.verdict = verdict_name(Verdict::invalid);
  invalid.events = {make_run_event_now(kVoided, "wrong serial", "Ann")};
  const std::vector<RunRecord> runs{make_sample_record(numbered_run_id(1), "a", 0.25), golden,
                                    invalid};
  write_runs(folder / "runs.json", runs);
  const auto exported = nlohmann::json::parse(TemporaryFolder::read_content(folder / "runs.json"));
  ASSERT_THAT(exported, SizeIs(runs.size()));
  std::vector<std::filesystem::path> files;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::string& name = runs[i].camera;
    files.push_back(folder.file(name + ".json", serialize_run(runs[i])));
    files.push_back(folder.file(name + "-hook.json", format_hook_json(runs[i])));
    files.push_back(folder.file(name + "-exported.json", exported[i].dump()));
  }
  EXPECT_EQ(problems_by_schema("run", files), "");
  const auto& metrics = exported[0]["metrics"];
  EXPECT_EQ(metrics["rms_px"]["value"], 0.25);
  EXPECT_NEAR(metrics["rms_px"]["conformance_probability"].get<double>(), 0.993775, 5e-6);
  EXPECT_TRUE(metrics["tilt_deg"]["value"].is_null());
  EXPECT_TRUE(metrics["coverage"]["gate"].is_null());
}

}  // namespace
}  // namespace vlp
