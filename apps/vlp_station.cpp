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

void add_operator(CLI::App& command, StationRunOptions& options) {
  command.add_option("--operator", options.operator_name,
                     "Who measures, for the record (a shift asks when it is not said)");
  command.add_option("--shift", options.shift, "In which shift, for the record");
}

void add_run(CLI::App& app, StationRunOptions& options) {
  CLI::App* run = app.add_subcommand(
      "run", "Take a unit to its verdict, or, without --camera-id, unit after unit");
  run->add_option("--station", options.station, "The station, station.yaml")->required();
  auto* camera =
      run->add_option("--camera-id", options.camera_id,
                      "The unit's camera (default: those that a scanner or the operator types, a "
                      "line each, until q)")
          ->check([](const std::string& id) { return camera_id_problem(id); });
  auto* batch =
      run->add_option("--batch", options.batch,
                      "A folder whose folders boards, rotation, dispersion and check are full: no "
                      "questions asked (default: the images that arrive in the station's folder)")
          ->needs(camera);
  run->add_option("--source", options.sources,
                  "A V4L2 camera or a video file whose frames are taken for the present step, or "
                  "STEP=SOURCE for one step; frames that are refused are not kept")
      ->excludes(batch)
      ->option_text("[STEP=]SOURCE ...");
  run->add_option("--idle-s", options.idle_s,
                  "Give the verdict when no image came for so long, of a source none that could be "
                  "used")
      ->check(make_finite_positive_validator());
  add_operator(*run, options);
  add_threads_option(*run, options.threads);
}

void add_verify(CLI::App& app, StationRunOptions& options) {
  CLI::App* verify =
      app.add_subcommand("verify", "Measure the golden unit: has the station itself moved?");
  verify->add_option("--station", options.station, "The station, station.yaml")->required();
  verify->add_option("--batch", options.batch,
                     "Its images: a folder with check and, maybe, dispersion and boards (default: "
                     "those that are in the station's folder, which are put away)");
  add_operator(*verify, options);
  add_threads_option(*verify, options.threads);
}

void add_hook(CLI::App& app, StationRunOptions& options) {
  CLI::App* hook = app.add_subcommand(
      "hook", "Run the hook again for runs whose hook failed or was not run to its end");
  hook->add_option("--station", options.station, "The station, station.yaml")->required();
}

/// Refuses a password: all users of the machine see command lines.
std::string find_password(const std::string& where) {
  return contains_password(where) ? "a password on the command line is shown to all users of the "
                                    "machine: give it in the "
                                    "variable PGPASSWORD, or in the file that PGPASSFILE names"
                                  : "";
}

/// Adds a command with the options for the location of records.
CLI::App* add_records_location(CLI::App& app, const char* name, const char* what,
                               StationRecordsOptions& options) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("--station", options.station, "The station, station.yaml");
  command
      ->add_option("--records", options.records,
                   "Or its records: a file of SQLite, or postgresql://USER@HOST/NAME")
      ->check(find_password);
  return command;
}

/// Adds a command with the options common to all commands on records.
CLI::App* add_records_command(CLI::App& app, const char* name, const char* what,
                              StationRecordsOptions& options) {
  CLI::App* command = add_records_location(app, name, what, options);
  command->add_option("--camera-id", options.filter.camera, "Only of this camera");
  command->add_option(
      "--of-station", options.filter.station,
      "Only of the station of this name, or any (default: that of --station; of a study "
      "any)");
  command->add_option("--verdict", options.filter.verdict, "Only with this verdict")
      ->check(CLI::IsMember({"PASS", "FAIL", "INVALID", "any"}));
  command->add_option("--kind", options.filter.kind, "Only units, or only golden units")
      ->check(CLI::IsMember({"unit", "golden", "any"}));
  command->add_option("--operator", options.filter.operator_name, "Only of this operator");
  command->add_option("--shift", options.filter.shift, "Only of this shift");
  command
      ->add_option("--since", options.filter.since,
                   "Only those that ended at this UTC or later, 2026-11-21 or 2026-11-21T13:45")
      ->check(utc_problem);
  command->add_option("--until", options.filter.until, "Only those that ended before this UTC")
      ->check(utc_problem);
  command->add_option("--last", options.filter.last, "Only the last so many")
      ->check(CLI::Range(1, 1'000'000));
  return command;
}

/// Adds the commands that print or write the record of a run.
void add_commands_of_a_run(CLI::App& app, StationRecordsOptions& options) {
  add_records_command(app, "list", "A line for each run", options);
  auto* show =
      add_records_command(app, "show", "All of one run, the last unless it is named", options);
  show->add_option("run", options.run, "Name of the run");
  auto* restore = add_records_command(
      app, "restore", "Write the calibration and the report of a run again, from its record",
      options);
  restore->add_option("run", options.run, "Name of the run")->required();
  restore->add_option("-o,--output", options.output,
                      "The folder of results (default: the station's); in it CAMERA/RUN/");
  auto* certified = add_records_command(
      app, "certificate",
      "Write the certificate of a run, certificate.html: values with expanded uncertainty, "
      "conformity, traceability",
      options);
  certified->add_option("run", options.run, "Name of the run")->required();
  certified->add_option("-o,--output", options.output,
                        "The folder of results (default: the station's); in it CAMERA/RUN/");
}

/// Adds the commands that check or change records and results.
void add_upkeep(CLI::App& app, StationRecordsOptions& options) {
  CLI::App* clean = app.add_subcommand("clean",
                                       "Lists or deletes images and results of old runs "
                                       "('retention' in station.yaml); records stay");
  clean->add_option("--station", options.station, "The station, station.yaml")->required();
  clean->add_flag("--delete", options.remove, "Delete it (default: only tell)");
  CLI::App* verify_records = add_records_location(
      app, "verify-records",
      "Whether the records are as they were kept: what was changed, removed or added by hand, by "
      "name; exit code 1 when there is any",
      options);
  verify_records->add_option("--expected-digest", options.expected_digest,
                             "The last digest that an earlier verify-records told: the trail has "
                             "to have it still");
  CLI::App* voided = add_records_location(
      app, "void",
      "A run counts no more: in no yield, trend or study; it stays in the records, with who voided "
      "it and why, its files are renamed, and it is done again",
      options);
  voided->add_option("run", options.run, "Name of the run")->required();
  voided->add_option("--operator", options.operator_name, "Who")->required();
  voided->add_option("--reason", options.reason, "Why")->required();
}

/// Adds the commands that move runs into and out of records.
void add_transfer(CLI::App& app, StationRecordsOptions& options) {
  auto* exported = add_records_command(app, "export", "Write runs as CSV or JSON", options);
  exported->add_option("-o,--output", options.output, "Where to: .csv or .json")->required();
  CLI::App* imported = app.add_subcommand(
      "import",
      "Take the sessions of a reprocessed archive into records, as runs of a station that has the "
      "results' name: for trend, capability and study. Those that are there already stay");
  imported->add_option("results", options.archive, "RESULTS of scripts/reprocess.sh")->required();
  imported
      ->add_option("--records", options.records,
                   "A file of SQLite, made when it is not there, or postgresql://USER@HOST/NAME")
      ->required()
      ->check(find_password);
}

constexpr const char* kFigureHelp = "Which: rms_px, check_mean_mm, ...";

/// Adds the statistics over runs: trend, capability, study.
void add_statistics(CLI::App& app, StationRecordsOptions& options) {
  auto* trend = add_records_command(
      app, "trend",
      "A figure over the runs, with the limits of a control chart; exit code 1 for an alarm. Of "
      "units "
      "of the station that passed, unless --verdict, --kind or --of-station says otherwise",
      options);
  trend->add_option("figure", options.metric, kFigureHelp)->required();
  trend->add_option("-o,--output", options.output, "Draw it, .png or .svg");
  trend
      ->add_option(
          "--rules", options.rules,
          "What is an alarm: western-electric (four rules), nelson (eight), one of them as "
          "nelson-3, ewma (default: western-electric)")
      ->option_text("RULE ...");
  auto* capable =
      add_records_command(app, "capability",
                          "How figures scatter compared with their gates: Cpk, Ppk, with "
                          "95 % intervals. Of units of the "
                          "station that were judged",
                          options);
  capable->add_option("figure", options.metric, "Only this: rms_px, check_mean_mm, ...");
  auto* study = add_records_command(app, "study",
                                    "What measuring adds to a figure: repeatability and "
                                    "reproducibility (%GRR, ndc) of units that "
                                    "were run as often on each station; with --reference bias and "
                                    "linearity",
                                    options);
  study->add_option("figure", options.metric, kFigureHelp)->required();
  study->add_option("--units", options.units, "Its cameras (default: those with two runs or more)")
      ->option_text("ID ...");
  study
      ->add_option("--reference", options.references,
                   "Units whose figure is known from elsewhere, and what it is: bias and linearity "
                   "of the station")
      ->option_text("UNIT=VALUE ...")
      ->excludes("--units");
  study->add_option("-o,--output", options.output, "Draw the bias, .png or .svg")
      ->needs("--reference");
}

/// Runs the given command.
void run_command(const CLI::App& app, const StationRunOptions& run,
                 const StationRecordsOptions& records) {
  if (app.got_subcommand("run")) {
    if (run.camera_id.empty()) {
      run_shift(run);
    } else {
      run_unit(run);
    }
  }
  if (app.got_subcommand("verify")) run_verify(run);
  if (app.got_subcommand("hook")) run_hooks(run);
  if (app.got_subcommand("list")) print_runs(records);
  if (app.got_subcommand("show")) print_run(records);
  if (app.got_subcommand("restore")) restore_run(records);
  if (app.got_subcommand("certificate")) write_certificate(records);
  if (app.got_subcommand("clean")) clean_expired_folders(records);
  if (app.got_subcommand("void")) void_run(records);
  if (app.got_subcommand("verify-records")) verify_records(records);
  if (app.got_subcommand("import")) import_archive(records);
  if (app.got_subcommand("export")) export_runs(records);
  if (app.got_subcommand("trend")) print_trend(records);
  if (app.got_subcommand("capability")) print_capability(records);
  if (app.got_subcommand("study")) print_study(records);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "A factory's calibration station. 'run' takes a camera through boards, rotation, dispersion "
      "and\n"
      "check to PASS, FAIL (exit code 1: the camera) or INVALID (3: the station, the operator, an "
      "early\n"
      "end: do it again), as its images arrive or from full folders (--batch);\n"
      "'verify' measures a reference camera; 'list', 'show', 'export', 'trend', 'capability' and "
      "'study'\n"
      "tell of the records, 'restore' writes a run's files again, 'certificate' a page for who "
      "gets the\n"
      "unit; 'void' takes a run out of all that is counted, 'verify-records' finds what was "
      "changed in\n"
      "the records. Runs wait in the station's 'spool' while the records cannot be reached; 'hook' "
      "runs the\n"
      "station's hook again where it failed, 'clean' deletes what is kept no longer,\n"
      "'import' takes a reprocessed archive into records.\n"
      "vlp-station COMMAND --help tells more.\n\n"
      "Example, from the project's folder:\n"
      "  mkdir -p out && cp -rT datasets/station out/station\n"
      "  build/bin/vlp-simulate datasets/station/scene.yaml -o out/station/unit\n"
      "  build/bin/vlp-station run --station out/station/station.yaml \\\n"
      "    --camera-id 0001 --batch out/station/unit\n"
      "  build/bin/vlp-station list --station out/station/station.yaml\n",
      "vlp-station");
  app.require_subcommand(1);
  app.fallthrough();
  vlp::StationRunOptions run;
  vlp::StationRecordsOptions records;
  run.threads = vlp::count_cores();
  vlp::add_run(app, run);
  vlp::add_verify(app, run);
  vlp::add_hook(app, run);
  vlp::add_commands_of_a_run(app, records);
  vlp::add_upkeep(app, records);
  vlp::add_transfer(app, records);
  vlp::add_statistics(app, records);
  return vlp::run_app(app, argc, argv, [&] { vlp::run_command(app, run, records); });
}
