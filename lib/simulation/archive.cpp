// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/archive.h"

#include <algorithm>
#include <mutex>
#include <stdexcept>

#include "captures/csv_writer.h"
#include "captures/parallel_for.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

void check(const Scene& scene) {
  const auto has = [&](const std::string& folder) {
    return std::any_of(scene.sets.begin(), scene.sets.end(),
                       [&](const CaptureSet& set) { return set.folder == folder; });
  };
  if (!scene.archive) throw std::invalid_argument("the scene has no key 'archive'");
  if (scene.lamps.empty() || !scene.board || !has("boards") || !has("rotation")) {
    throw std::invalid_argument(
        "an archive's scene has lamps, a board, and captures in folders boards and rotation");
  }
}

void write_table(const Scene& scene, std::size_t sessions, const fs::path& output) {
  CsvWriter table(output / "archive.csv", {"camera", "session", "fault", "damage", "damaged"});
  for (std::size_t i = 0; i < sessions; ++i) {
    const ArchiveSession session = make_archive_session(scene, i);
    table.row({session.camera, session.session, to_string(session.fault), to_string(session.damage),
               session.damaged});
  }
  table.save();
}

/// Renders a session into a temporary folder, then moves it into place. Returns false if the
/// session exists already.
bool render(const ArchiveSession& session, const fs::path& output, const std::string& provenance) {
  const fs::path place = output / session.camera / session.session;
  if (fs::exists(place)) return false;
  const fs::path unfinished = output / ".unfinished" / (session.camera + "-" + session.session);
  fs::create_directories(place.parent_path());
  fs::create_directories(unfinished);
  const std::string first_line = provenance.substr(0, provenance.find('\n'));
  simulate(session.scene, unfinished,
           {{}, 1, first_line + ": " + session.camera + "/" + session.session + " of an archive\n"},
           [](const SimulationSummary&, std::size_t) {});
  damage(session, unfinished);
  fs::rename(unfinished, place);
  return true;
}

}  // namespace

SimulationSummary simulate_archive(const Scene& scene, std::size_t sessions, const fs::path& output,
                                   const SimulationOptions& options,
                                   const SimulationProgress& progress) {
  check(scene);
  claim_output_folder(output, options.provenance);
  write_table(scene, sessions, output);
  SimulationSummary summary;
  std::mutex counting;
  try {
    parallel_for(sessions, options.threads, [&](std::size_t index) {
      const bool rendered = render(make_archive_session(scene, index), output, options.provenance);
      const std::lock_guard lock(counting);
      ++(rendered ? summary.rendered : summary.found);
      progress(summary, sessions);
    });
  } catch (const fs::filesystem_error& failure) {
    throw InputError(failure.path1(), "cannot be made: " + failure.code().message());
  }
  fs::remove(output / ".unfinished");  // empty, as all sessions have been moved
  return summary;
}

}  // namespace vlp
