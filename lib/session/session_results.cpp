// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_results.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

#include "captures/digest.h"
#include "captures/id.h"
#include "captures/shared_folder.h"
#include "evaluation/junit.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "session/session_file.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Outputs that runs may have written, except the fixes of drives.
constexpr std::array kResults{
    "lens.yaml",    "lens.cameramodel", "lens.svg",       "camera.yaml",     "rotated.yaml",
    "rotation.svg", "calibration.yaml", "dispersion.svg", "check-fixes.csv", "evaluation.json",
    "junit.xml",    "report.html",      "session.json"};

/// Steps other than drives.
constexpr std::array kNamedSteps{"lens", "row-time", "rotation", "dispersion", "check", "evaluate"};

bool contains_name(std::span<const char* const> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the file with the path of the session of these results.
fs::path owner_mark_file(const fs::path& results) { return results / "steps/session"; }

constexpr const char* kNoOwner = "\n";
constexpr std::size_t kMaxMarkBytes = 1 << 16;

std::string owner_mark_text(const fs::path& session) {
  if (session.empty()) return kNoOwner;
  const fs::path path = fs::weakly_canonical(session / "");  // of a missing folder, with a slash
  return (path.has_filename() ? path : path.parent_path()).string() + "\n";
}

/// Throws InputError if the folder holds results of another session or files of other origin.
void check_owner(const fs::path& results, const fs::path& session) {
  const fs::path mark = owner_mark_file(results);
  if (fs::exists(mark)) {
    const std::string owner = read_text_file(mark, kMaxMarkBytes);
    if (session.empty() || owner == kNoOwner || owner == owner_mark_text(session)) return;
    throw InputError(results, "contains the results of another session; choose another folder");
  }
  std::vector<const char*> foreign_names(kResults.begin(), kResults.end());
  foreign_names.insert(foreign_names.end(), {"lamps.yaml", "board.yaml", "boards", "rotation"});
  for (const char* foreign_name : foreign_names) {
    if (!fs::exists(results / foreign_name)) continue;
    throw InputError(results, fmt::format("holds {}, which is not of vlp-calibrate; give the "
                                          "results a folder of their own",
                                          foreign_name));
  }
}

constexpr const char* kOutputs = "outputs";
constexpr std::string_view kSteps = "steps/", kRecordEnd = ".json", kFixesEnd = "-fixes.csv";

/// Returns the name of a step's record in the folder of results.
std::string step_file_name(const std::string& step) {
  return std::string(kSteps).append(step).append(kRecordEnd);
}

/// Returns true for the names of drives, which are folders of a session and steps.
bool is_drive_name(std::string_view step) {
  return step.starts_with("line-") && Id::is_valid(step);
}

SharedFolder make_steps_folder(const fs::path& results) {
  return SharedFolder(results).open_or_create({"steps", results, "step"});
}

int lock_folder(const SharedFolder& steps, const fs::path& results) {
  const int lock = steps.open_regular_file("lock", O_RDWR | O_CREAT);
  if (lock < 0) throw InputError(results, "cannot be written to");
  if (::flock(lock, LOCK_EX | LOCK_NB) == 0) return lock;
  ::close(lock);
  throw InputError(results, "another run is at work there");
}

bool is_existing(const fs::path& file) {
  std::error_code missing;
  return fs::symlink_status(file, missing).type() != fs::file_type::not_found;
}

/// Returns true for names that runs can have written: kResults, records of steps, and fixes of
/// drives. The list of outputs is in a folder that others may write to.
bool is_output_name(std::string_view name) {
  const auto remove_end = [&](std::string_view end) {
    const bool has_end = name.ends_with(end);
    if (has_end) name.remove_suffix(end.size());
    return has_end;
  };
  if (contains_name(kResults, name)) return true;
  if (!name.starts_with(kSteps)) return remove_end(kFixesEnd) && is_drive_name(name);
  name.remove_prefix(kSteps.size());
  return remove_end(kRecordEnd) && (contains_name(kNamedSteps, name) || is_drive_name(name));
}

}  // namespace

void write_refusal_junit(const fs::path& results, const fs::path& session,
                         const std::string& message) try {
  const bool is_free = !fs::exists(results) || (fs::is_directory(results) && fs::is_empty(results));
  if (results.empty() || !(is_free || fs::exists(owner_mark_file(results)))) return;
  const SessionResults locked(results, is_free ? session : fs::path());
  const JUnitTest test{"session", JUnitTest::Result::error, message,
                       std::string(step_failure_name(StepFailure::bad_input))};
  write_file(locked.results_file_path("junit.xml"),
             format_junit_xml("vlp-calibrate", std::span(&test, 1)));
} catch (const std::exception&) {  // the refusal is reported, not this
}

SessionResults::SessionResults(fs::path folder, const fs::path& session)
    : folder_(std::move(folder)) {
  check_owner(folder_, session);
  std::error_code not_made;
  fs::create_directories(folder_, not_made);
  // [FILE-1] `cannot be made`
  if (not_made) throw InputError(folder_, "cannot be made: " + not_made.message());
  const SharedFolder steps = make_steps_folder(folder_);
  lock_ = lock_folder(steps, folder_);
  steps.open_if_exists({"corners", folder_, "step"});  // throws if it is a link
  const auto owner = steps.read_if_exists("session", kMaxMarkBytes);
  if (owner && (session.empty() || *owner != kNoOwner)) return;
  // The list of files that do not require a plan, written before the mark: a folder without the
  // mark is free.
  steps.replace_file(kOutputs, "junit.xml\nsession.json\n");
  steps.replace_file("session", owner_mark_text(session));
}

SessionResults::~SessionResults() { ::close(lock_); }

fs::path SessionResults::results_file_path(const std::string& name) const {
  const bool is_stale = !wanted_.empty() && !wanted_.contains(name);
  return (is_stale || new_outputs_.contains(name) ? new_outputs_folder() : folder_) / name;
}

fs::path SessionResults::step_record_file(const std::string& step) const {
  return folder_ / step_file_name(step);
}

std::set<std::string> SessionResults::list_recorded() const {
  constexpr std::size_t max_bytes = 1 << 20;
  const auto list = make_steps_folder(folder_).read_if_exists(kOutputs, max_bytes);
  // Foreign files could not be distinguished from outputs.
  if (!list) {
    throw InputError(folder_ / "steps" / kOutputs,
                     "was removed; choose another folder, or delete these results");
  }
  std::set<std::string> names;
  std::istringstream lines(*list);
  for (std::string name; std::getline(lines, name);) {
    if (is_output_name(name)) names.insert(name);
  }
  return names;
}

std::set<std::string> SessionResults::remove_unwanted(const std::set<std::string>& wanted) const {
  std::set<std::string> not_removed;
  for (const std::string& name : list_recorded()) {
    if (wanted.contains(name)) continue;
    std::error_code error;
    fs::remove(folder_ / name, error);
    if (error) not_removed.insert(name);
  }
  return not_removed;
}

void SessionResults::write_output_list(const std::set<std::string>& names) const {
  const SharedFolder records = make_steps_folder(folder_);
  if (names == list_recorded()) return;
  std::string list;
  for (const std::string& name : names) list.append(name).append("\n");
  records.replace_file(kOutputs, list);
}

void SessionResults::set_steps(std::vector<StepOutputs> steps) {
  steps_ = std::move(steps);
  wanted_ = {"session.json", "junit.xml"};
  for (const auto& [step, files] : steps_) {
    wanted_.insert(files.begin(), files.end());
    wanted_.insert(step_file_name(step));
    for (const std::string& file : files) {
      if (fs::is_regular_file(fs::symlink_status(new_outputs_folder() / file)))
        new_outputs_.insert(file);
    }
  }
  std::set<std::string> written = list_recorded();
  for (const std::string& name : wanted_) {
    if (is_existing(folder_ / name) &&
        (!written.contains(name) || fs::is_symlink(folder_ / name))) {
      throw InputError(folder_, fmt::format("holds {}, which is not of vlp-calibrate; give the "
                                            "results a folder of their own",
                                            name));
    }
  }
  written.insert(wanted_.begin(), wanted_.end());
  write_output_list(written);
}

void SessionResults::publish_outputs() {
  std::error_code missing;
  fs::remove(folder_ / "session.json", missing);  // until the outputs are complete
  for (const std::string& name : new_outputs_) {
    fs::rename(new_outputs_folder() / name, folder_ / name, missing);
    if (missing) fs::remove(folder_ / name, missing);
  }
  new_outputs_.clear();
  fs::remove_all(new_outputs_folder(), missing);
  std::set<std::string> names = remove_unwanted(wanted_);  // the next run tries again
  names.insert(wanted_.begin(), wanted_.end());
  write_output_list(names);
}

std::optional<StepResult> SessionResults::find_cached(const std::string& step,
                                                      const std::string& key) const {
  auto cached_result = read_step_record(step_record_file(step));
  if (!cached_result || cached_result->result.failure == StepFailure::bad_input)
    return std::nullopt;
  if (cached_result->key != key || cached_result->outputs != digest_outputs(step))
    return std::nullopt;
  return std::move(cached_result->result);
}

void SessionResults::store_step_result(const std::string& step, const std::string& key,
                                       const StepResult& result) const {
  write_step_record(step_record_file(step), {key, digest_outputs(step), result});
}

std::vector<std::string> SessionResults::list_planned(const std::string& step) const {
  const auto found = std::ranges::find(steps_, step, &StepOutputs::step);
  return found == steps_.end() ? std::vector<std::string>() : found->files;
}

std::string SessionResults::digest_outputs(const std::string& step) const {
  std::string digests;
  for (const std::string& output : list_planned(step)) {
    digests += output + " " +
               (fs::exists(results_file_path(output)) ? hash_file(results_file_path(output)) : "") +
               "\n";
  }
  return hash_text(digests);
}

void SessionResults::remove_outputs(const std::string& step) {
  std::error_code ignored;
  fs::remove(step_record_file(step), ignored);
  make_steps_folder(folder_).open_or_create({"new", folder_, "step"});
  for (const std::string& output : list_planned(step)) {
    new_outputs_.insert(output);
    fs::remove(results_file_path(output), ignored);
  }
}

void SessionResults::remove_later_outputs(const std::string& step) {
  bool is_later = false;
  for (const auto& [name, files] : steps_) {
    if (is_later) remove_outputs(name);
    is_later = is_later || name == step;
  }
}

void SessionResults::remove_evaluation() const {
  const std::set<std::string> written = list_recorded();
  for (const char* name : {"evaluation.json", "report.html", "steps/evaluate.json"}) {
    if (written.contains(name)) fs::remove(folder_ / name);
  }
}

void SessionResults::remove_all_outputs() const { remove_unwanted({}); }

}  // namespace vlp
