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

struct SimulationOptions {
  /// Folders to render; all of the scene's when empty.
  std::vector<std::string> folders;
  int threads = 1;
  /// Says what the output is made from: written into its scene.yaml, which has to be the same when
  /// a run is taken up again.
  std::string origin;
};

/// What the output of a scene file is made from: the file, with `seed` where there is one, below a
/// line of the program that renders it, "# vlp-simulate 0.1.0", which takes the place of such a
/// line. Throws InputError when the file cannot be read, or its seed has no line of its own.
std::string origin_of(const std::filesystem::path& scene, std::optional<std::uint64_t> seed,
                      const std::string& program, const std::string& version);

struct SimulationSummary {
  /// What may make captures useless: warnings_about() each folder, and captures without a lamp in
  /// view.
  std::vector<std::string> warnings;
  std::size_t rendered = 0;
  /// Images that were there, whole, from an earlier run.
  std::size_t found = 0;
};

/// After each capture. Calls do not overlap.
using SimulationProgress = std::function<void(const SimulationSummary& so_far, std::size_t total)>;

/// Renders a scene into `output`:
///   scene.yaml, lamps.yaml (as surveyed), board.yaml, true_calibration.yaml, true_lamps.yaml
///   FOLDER/0000.png, 0001.png, ... (.jpg as the scene's picture has it) and the tables of
///   write_truth()
/// Each file appears whole; images that are there are kept, so that an interrupted run goes on
/// where it stopped. The bytes depend on the scene alone, not on the threads. Throws
/// InputError: a folder that holds something else, files that cannot be written;
/// std::invalid_argument: a folder the scene does not have, a board that cannot be printed.
SimulationSummary simulate(const Scene& scene, const std::filesystem::path& output,
                           const SimulationOptions& options, const SimulationProgress& progress);

/// Claims a folder for captures by writing `origin` as its scene.yaml, or finds that it is claimed.
/// Throws InputError: it holds something else.
void claim_for_simulation(const std::filesystem::path& output, const std::string& origin);

}  // namespace vlp
