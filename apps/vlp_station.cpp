// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station: calibrates units at the station of a factory, gives their verdicts and keeps
/// records.
#include <CLI/CLI.hpp>
#include <string>

#include "program/app.h"
#include "program/station/station_records.h"
#include "program/station/station_run.h"
#include "station/database_name.h"
#include "station/records/records.h"
#include "station/station_config.h"

namespace vlp {
namespace {

void add_operator_options(CLI::App& command, StationRunOptions& options) {
  command.add_option(
      "--operator", options.operator_name,
      "Name of the operator, for the record (default: asked at the beginning of a shift)");
  command.add_option("--shift", options.shift,
                     "Name of the work shift, for the record (default: asked at its beginning)");
}

void add_run_command(CLI::App& app, StationRunOptions& options) {
  CLI::App* run = app.add_subcommand(
      "run",
      "Measure a unit up to its verdict or, without --camera-id, one unit after another (a shift)");
  run->add_option("--station", options.station, "Station configuration, station.yaml")->required();
  auto* camera =
      run->add_option(
             "--camera-id", options.camera_id,
             "Camera id of the unit (default: scanned or typed ids, one per line, until q)")
          ->check([](const std::string& id) { return describe_camera_id_problem(id); });
  auto* batch =
      run->add_option("--batch", options.batch,
                      "Folder with complete folders boards, rotation, dispersion and check. Runs "
                      "without interaction (default: waits for images in the station's folder)")
          ->needs(camera);
  run->add_option("--source", options.sources,
                  "V4L2 camera or video file with the images of the current step; STEP=SOURCE for "
                  "one step only. Rejected frames are deleted")
      ->excludes(batch)
      ->option_text("[STEP=]SOURCE ...");
  run->add_option("--idle-s", options.idle_s,
                  "Time without a new image until the verdict, in s. With --source, rejected "
                  "frames do not count as new")
      ->check(make_positive_validator());
  add_operator_options(*run, options);
  add_threads_option(*run, options.threads);
}

void add_verify_command(CLI::App& app, StationRunOptions& options) {
  CLI::App* verify = app.add_subcommand("verify", "Measure the golden unit to check the station");
  verify->add_option("--station", options.station, "Station configuration, station.yaml")
      ->required();
  verify->add_option(
      "--batch", options.batch,
      "Folder with images of the golden unit: check and, optionally, dispersion and boards "
      "(default: images in the station's folder, which are moved away afterwards)");
  add_operator_options(*verify, options);
  add_threads_option(*verify, options.threads);
}

void add_hook_command(CLI::App& app, StationRunOptions& options) {
  CLI::App* hook =
      app.add_subcommand("hook", "Run the hook again for runs whose hook failed or did not finish");
  hook->add_option("--station", options.station, "Station configuration, station.yaml")->required();
}

/// Refuses a password: all users of the machine see command lines.
std::string describe_password_problem(const std::string& where) {
  return contains_password(where) ? "a password on the command line is visible to all users of the "
                                    "machine; set the variable PGPASSWORD, or PGPASSFILE to a file"
                                  : "";
}

/// Adds a command with the options for the location of records.
CLI::App* add_records_location(CLI::App& app, const char* name, const char* what,
                               StationRecordsOptions& options) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("--station", options.station, "Station configuration, station.yaml");
  command
      ->add_option(
          "--records", options.records,
          "Database of records, instead of --station: SQLite file, or postgresql://USER@HOST/NAME")
      ->check(describe_password_problem);
  return command;
}

/// Adds a command with the options common to all commands on records.
CLI::App* add_records_command(CLI::App& app, const char* name, const char* what,
                              StationRecordsOptions& options) {
  CLI::App* command = add_records_location(app, name, what, options);
  command->add_option("--camera-id", options.filter.camera, "Only runs of this camera");
  command->add_option("--of-station", options.filter.station,
                      "Only runs of the station with this name; any: all stations (default: name "
                      "of --station; study without --reference: any)");
  command->add_option("--verdict", options.filter.verdict, "Only runs with this verdict")
      ->check(CLI::IsMember({"PASS", "FAIL", "INVALID", "any"}));
  command->add_option("--kind", options.filter.kind, "Only runs of units, or of golden units")
      ->check(CLI::IsMember({"unit", "golden", "any"}));
  command->add_option("--operator", options.filter.operator_name, "Only runs of this operator");
  command->add_option("--shift", options.filter.shift, "Only runs of this work shift");
  command
      ->add_option(
          "--since", options.filter.since,
          "Only runs that ended at or after this time, in UTC, as 2026-11-21 or 2026-11-21T13:45")
      ->check(describe_utc_problem);
  command
      ->add_option("--until", options.filter.until, "Only runs that ended before this time, in UTC")
      ->check(describe_utc_problem);
  command->add_option("--last", options.filter.last, "Maximum number of runs, the latest ones")
      ->check(CLI::Range(1, 1'000'000));
  return command;
}

/// Adds the commands that print or write the record of a run.
void add_run_commands(CLI::App& app, StationRecordsOptions& options) {
  add_records_command(app, "list", "List runs, one per line", options);
  auto* show = add_records_command(app, "show", "Print all data of a run", options);
  show->add_option("run", options.run, "Id of the run (default: the last run)");
  auto* restore =
      add_records_command(app, "restore",
                          "Write the missing files of a run again, and replace its report, from "
                          "its record. An existing report is kept as replaced-report.html",
                          options);
  restore->add_option("run", options.run, "Id of the run")->required();
  restore->add_option("-o,--output", options.output,
                      "Output folder (default: results of the station). Files go to CAMERA/RUN/");
  auto* certificate = add_records_command(
      app, "certificate",
      "Write the certificate of a run, certificate.html: values with expanded uncertainty, "
      "conformity, traceability",
      options);
  certificate->add_option("run", options.run, "Id of the run")->required();
  certificate->add_option(
      "-o,--output", options.output,
      "Output folder (default: results of the station). Files go to CAMERA/RUN/");
}

/// Adds the commands that check or change records and results.
void add_upkeep_commands(CLI::App& app, StationRecordsOptions& options) {
  CLI::App* clean = app.add_subcommand("clean",
                                       "List or delete images and results of old runs ('retention' "
                                       "in station.yaml). Records are kept");
  clean->add_option("--station", options.station, "Station configuration, station.yaml")
      ->required();
  clean->add_flag("--delete", options.remove, "Delete the folders (default: only list them)");
  CLI::App* verify_command =
      add_records_location(app, "verify-records",
                           "Check that the records are unchanged. Lists runs that were changed, "
                           "removed or added by hand; exit code 1 if there are any",
                           options);
  verify_command->add_option(
      "--expected-digest", options.expected_digest,
      "Last digest printed by an earlier verify-records. The trail must still contain it");
  CLI::App* voided = add_records_location(
      app, "void",
      "Exclude a run from yield, trends and studies. The record stays, with operator and reason, "
      "and files of the run are renamed. Measure the unit again",
      options);
  voided->add_option("run", options.run, "Id of the run")->required();
  voided->add_option("--operator", options.operator_name, "Name of the operator")->required();
  voided->add_option("--reason", options.reason, "Reason for the exclusion")->required();
}

/// Adds the commands that move runs into and out of records.
void add_transfer_commands(CLI::App& app, StationRecordsOptions& options) {
  auto* exported = add_records_command(app, "export", "Write runs to a CSV or JSON file", options);
  exported->add_option("-o,--output", options.output, "Output file, .csv or .json")->required();
  CLI::App* imported = app.add_subcommand(
      "import",
      "Add the sessions of a reprocessed archive to records, for trend, capability and study. They "
      "become runs of a station with the name of the results folder. Existing runs stay unchanged");
  imported->add_option("results", options.archive, "Results folder of scripts/reprocess.sh")
      ->required();
  imported
      ->add_option(
          "--records", options.records,
          "Database of records: SQLite file, created if missing, or postgresql://USER@HOST/NAME")
      ->required()
      ->check(describe_password_problem);
}

constexpr const char* kMetricHelp = "Metric, such as rms_px or check_mean_mm";

/// Adds the statistics over runs: trend, capability, study.
void add_statistics_commands(CLI::App& app, StationRecordsOptions& options) {
  auto* trend = add_records_command(
      app, "trend",
      "Print the control chart of a metric over the runs; exit code 1 if there is an alarm in the "
      "last runs (--window). Uses units of the station that passed, unless --verdict, --kind or "
      "--of-station is given",
      options);
  trend->add_option("metric", options.metric, kMetricHelp)->required();
  trend->add_option("-o,--output", options.output, "Output file of a plot, .png or .svg");
  trend
      ->add_option("--rules", options.rules,
                   "Alarm rules: western-electric (four rules, default), nelson (eight rules), a "
                   "single rule as nelson-3, or ewma")
      ->option_text("RULE ...");
  trend
      ->add_option("--window", options.window,
                   "Number of last runs whose alarms give exit code 1: those since the last call")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  auto* capability = add_records_command(app, "capability",
                                         "Print Cpk and Ppk, with 95 % intervals, of metrics that "
                                         "have gates. Uses judged units of the station",
                                         options);
  capability->add_option("metric", options.metric,
                         "Metric, such as rms_px or check_mean_mm (default: all with gates)");
  auto* study = add_records_command(
      app, "study",
      "Print repeatability and reproducibility (%GRR, ndc) of a metric. Needs units with equally "
      "many runs on each station. With --reference, print bias and linearity",
      options);
  study->add_option("metric", options.metric, kMetricHelp)->required();
  study
      ->add_option("--units", options.units,
                   "Camera ids of the units (default: all with two runs or more)")
      ->option_text("ID ...");
  study
      ->add_option("--reference", options.references,
                   "Reference values of units, for bias and linearity of the station")
      ->option_text("UNIT=VALUE ...")
      ->excludes("--units");
  study
      ->add_option("-o,--output", options.output, "Output file of a plot of the bias, .png or .svg")
      ->needs("--reference");
}

/// Runs the given command.
void run_command(const CLI::App& app, const StationRunOptions& run,
                 const StationRecordsOptions& records) {
  if (app.got_subcommand("run")) {
    if (run.camera_id.empty()) {
      measure_scanned_units(run);
    } else {
      measure_unit(run);
    }
  }
  if (app.got_subcommand("verify")) verify_with_golden(run);
  if (app.got_subcommand("hook")) rerun_hooks(run);
  if (app.got_subcommand("list")) print_runs(records);
  if (app.got_subcommand("show")) print_run(records);
  if (app.got_subcommand("restore")) restore_run_files(records);
  if (app.got_subcommand("certificate")) write_certificate(records);
  if (app.got_subcommand("clean")) list_or_delete_expired(records);
  if (app.got_subcommand("void")) void_recorded_run(records);
  if (app.got_subcommand("verify-records")) verify_records(records);
  if (app.got_subcommand("import")) import_archive(records);
  if (app.got_subcommand("export")) export_runs(records);
  if (app.got_subcommand("trend")) print_metric_trend(records);
  if (app.got_subcommand("capability")) print_capability(records);
  if (app.got_subcommand("study")) print_gauge_study(records);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Calibrates cameras at a station of a factory, gives verdicts and keeps records. 'run' "
      "processes the images of boards, rotation, dispersion and check as they arrive, or from "
      "complete folders (--batch). The verdict is PASS, FAIL (exit code 1, camera fault) or "
      "INVALID (exit code 3, station fault, operator error or aborted run; repeat it). 'verify' "
      "measures a reference camera, the golden unit. Runs wait in the station's 'spool' while the "
      "records cannot be reached. vlp-station COMMAND --help describes a command.\n\n"
      "Example, from the project's folder:\n"
      "  mkdir -p out && cp -rT datasets/station out/station\n"
      "  build/bin/vlp-simulate datasets/station/scene.yaml -o out/station/unit\n"
      "  build/bin/vlp-station run --station out/station/station.yaml \\\n"
      "    --camera-id 0001 --batch out/station/unit\n"
      "  build/bin/vlp-station list --station out/station/station.yaml\n",
      "vlp-station");
  CLI::App& app = *parser;
  app.require_subcommand(1);
  app.fallthrough();
  vlp::StationRunOptions run;
  vlp::StationRecordsOptions records;
  run.threads = vlp::count_cpu_cores();
  vlp::add_run_command(app, run);
  vlp::add_verify_command(app, run);
  vlp::add_hook_command(app, run);
  vlp::add_run_commands(app, records);
  vlp::add_upkeep_commands(app, records);
  vlp::add_transfer_commands(app, records);
  vlp::add_statistics_commands(app, records);
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run_command(app, run, records); });
}
