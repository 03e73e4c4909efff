// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_results.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <set>
#include <utility>

#include "captures/digest.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "session/step_file.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// What a run may have written, but for the fixes of drives.
constexpr std::array kResults{
    "lens.yaml",    "lens.cameramodel", "lens.svg",       "camera.yaml",     "rotated.yaml",
    "rotation.svg", "calibration.yaml", "dispersion.svg", "check-fixes.csv", "evaluation.json",
    "junit.xml",    "report.html",      "session.json"};

/// Fixes of drives, but for those that are wanted.
void forget_drives(const fs::path& results, const std::set<std::string>& wanted) {
  for (const auto& entry : fs::directory_iterator(results)) {
    const std::string name = entry.path().filename().string();
    const bool drive = name.starts_with("line-") && name.ends_with("-fixes.csv");
    if (drive && !wanted.contains(name)) fs::remove(entry.path());
  }
}

/// Says whose results they are.
fs::path mark_of(const fs::path& results) { return results / "steps/session"; }

std::string mark_text(const fs::path& session) {
  return fs::weakly_canonical(session / "").string() + "\n";
}

/// That neither another session's results are there, nor what is not of this procedure.
void check_owner(const fs::path& results, const fs::path& session) {
  const fs::path mark = mark_of(results);
  constexpr std::size_t most_bytes = 1 << 16;
  if (fs::exists(mark)) {
    if (read_text_file(mark, most_bytes) == mark_text(session)) return;
    throw InputError(results,
                     "holds the results of another session; give this one a folder of its own");
  }
  std::vector<const char*> others(kResults.begin(), kResults.end());
  others.insert(others.end(), {"lamps.yaml", "board.yaml", "boards", "rotation"});
  for (const char* other : others) {
    if (!fs::exists(results / other)) continue;
    throw InputError(results, fmt::format("holds {}, which is not of vlp-calibrate; give the "
                                          "results a folder of their own",
                                          other));
  }
}

int lock_of(const fs::path& results) {
  const int lock = ::open((results / "steps/lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock < 0) throw InputError(results, "cannot be written to");
  if (::flock(lock, LOCK_EX | LOCK_NB) == 0) return lock;
  ::close(lock);
  throw InputError(results, "another run is at work there");
}

}  // namespace

SessionResults::SessionResults(fs::path folder, const fs::path& session)
    : folder_(std::move(folder)) {
  check_owner(folder_, session);
  std::error_code not_made;
  fs::create_directories(folder_ / "steps", not_made);
  if (not_made) throw InputError(folder_, "cannot be made: " + not_made.message());
  lock_ = lock_of(folder_);
  if (!fs::exists(mark_of(folder_))) write_file(mark_of(folder_), mark_text(session));
}

SessionResults::~SessionResults() { ::close(lock_); }

fs::path SessionResults::record_of(const std::string& step) const {
  return folder_ / "steps" / (step + ".json");
}

void SessionResults::plan(std::vector<StepOutputs> steps) {
  steps_ = std::move(steps);
  std::set<std::string> wanted, names;
  for (const auto& [step, files] : steps_) {
    wanted.insert(files.begin(), files.end());
    names.insert(step);
  }
  for (const char* name : kResults) {
    std::error_code ignored;
    if (!wanted.contains(name)) fs::remove(file(name), ignored);
  }
  forget_drives(folder_, wanted);
  for (const auto& entry : fs::directory_iterator(folder_ / "steps")) {
    const bool step = entry.path().extension() == ".json";
    if (step && !names.contains(entry.path().stem().string())) fs::remove(entry.path());
  }
}

std::optional<StepResult> SessionResults::kept(const std::string& step,
                                               const std::string& key) const {
  auto kept = read_step(record_of(step));
  if (!kept || kept->result.failure == StepFailure::bad_input) return std::nullopt;
  if (kept->key != key || kept->outputs != digest_of_outputs(step)) return std::nullopt;
  return std::move(kept->result);
}

void SessionResults::keep(const std::string& step, const std::string& key,
                          const StepResult& result) const {
  write_step(record_of(step), {key, digest_of_outputs(step), result});
}

std::string SessionResults::digest_of_outputs(const std::string& step) const {
  std::string digests;
  for (const auto& [name, files] : steps_) {
    if (name != step) continue;
    for (const std::string& output : files) {
      const bool there = fs::exists(file(output));
      digests.append(output).append(" ");
      digests.append(there ? sha256_of_file(file(output)) : "").append("\n");
    }
  }
  return sha256_of_text(digests);
}

void SessionResults::forget(const std::string& step) const {
  std::error_code ignored;
  fs::remove(record_of(step), ignored);
  for (const auto& [name, files] : steps_) {
    if (name != step) continue;
    for (const std::string& output : files) fs::remove(file(output), ignored);
  }
}

void SessionResults::forget_behind(const std::string& step) const {
  bool behind = false;
  for (const auto& [name, files] : steps_) {
    if (behind) forget(name);
    behind = behind || name == step;
  }
}

void SessionResults::forget_evaluation() const {
  for (const char* name : {"evaluation.json", "report.html"}) fs::remove(file(name));
  fs::remove(record_of("evaluate"));
}

void SessionResults::forget_all() const {
  for (const char* name : kResults) fs::remove(file(name));
  forget_drives(folder_, {});
  for (const auto& entry : fs::directory_iterator(folder_ / "steps")) {
    if (entry.path().extension() == ".json") fs::remove(entry.path());
  }
}

}  // namespace vlp
