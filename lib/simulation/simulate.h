// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simulation/scene.h"

namespace vlp {

/// Options of render_scene().
struct SimulationOptions {
  /// Names of the folders of the scene to render. Empty: all folders of the scene.
  std::vector<std::string> folders;
  int threads = 1;
  /// Provenance of the output, written as its scene.yaml. It has to be identical when an
  /// interrupted simulation is resumed.
  std::string provenance;
};

/// Returns the provenance of a simulation: the scene file below a line with program and version, "#
/// vlp-simulate 0.1.0". An existing line of that kind is replaced. If `seed` is given, it replaces
/// the seed of the scene.
/// @throws InputError if the file cannot be read, or if its seed has no line of its own
std::string make_provenance(const std::filesystem::path& scene, std::optional<std::uint64_t> seed,
                            const std::string& program, const std::string& version);

/// Counts and warnings of a simulation.
struct SimulationSummary {
  /// Warnings about useless captures, one line each: list_scene_warnings() for each folder, and
  /// captures without a lamp or corner in view.
  std::vector<std::string> warnings;
  std::size_t rendered = 0;
  /// Number of complete images that existed from an earlier execution.
  std::size_t existing = 0;
};

/// Callback after each capture; may be empty. Calls do not overlap.
using SimulationProgress = std::function<void(const SimulationSummary& so_far, std::size_t total)>;

/// Renders a scene into `output`:
///   scene.yaml, lamps.yaml (as surveyed), board.yaml, true_calibration.yaml,
///   true_lamps.yaml
///   FOLDER/0000.png, 0001.png, ... (.jpg if the scene sets a JPEG quality)
///   FOLDER/ the tables of write_truth_tables()
/// Files are written atomically. Existing images are kept, so that an interrupted simulation can be
/// resumed. The bytes depend on the scene alone, not on the number of threads.
/// @throws InputError if a folder holds something else, or if files cannot be written
/// @throws std::invalid_argument if the scene lacks a folder, or if the board cannot be printed
SimulationSummary render_scene(const Scene& scene, const std::filesystem::path& output,
                               const SimulationOptions& options,
                               const SimulationProgress& progress);

/// Claims a folder for captures by writing `provenance` as its scene.yaml. Has no effect if the
/// folder is claimed by the same `provenance` already.
/// @throws InputError if the folder holds something else
void claim_output_folder(const std::filesystem::path& output, const std::string& provenance);

/// Returns warnings about conditions that make the captures of a set useless though the scene is
/// valid. Each is one line that begins with the folder.
///
/// Covers images that are nearly black or white, exposures that blur the stripes, and stripes that
/// are too fine.
std::vector<std::string> list_scene_warnings(const Scene& scene, const CaptureSet& set);

}  // namespace vlp
