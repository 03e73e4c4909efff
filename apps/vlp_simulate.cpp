// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-simulate: renders the captures of a scene, with their ground truth.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <string>
#include <vector>

#include "program/app.h"
#include "program/progress.h"
#include "simulation/archive.h"
#include "simulation/simulate.h"

namespace vlp {
namespace {

struct Options {
  std::string scene, output;
  std::vector<std::string> folders;
  std::optional<int> seed, archive;
  int threads = count_cores();
};

void run(const Options& options) {
  check_output((std::filesystem::path(options.output) / "scene.yaml").string(), {options.scene});
  Scene scene = read_scene(options.scene);
  std::optional<std::uint64_t> seed;
  if (options.seed) {
    seed = scene.seed = static_cast<std::uint64_t>(*options.seed);
    draw_random_parts(scene);
  }
  cv::setNumThreads(1);  // captures are rendered in parallel
  const std::string what = options.archive ? "sessions" : "captures";
  const SimulationOptions how{options.folders, options.threads,
                              make_provenance(options.scene, seed, "vlp-simulate", VLP_VERSION)};
  SimulationSummary summary;
  {
    Progress progress(what);
    const auto show = [&](const SimulationSummary& so_far, std::size_t total) {
      progress.update(so_far.rendered + so_far.found, total, so_far.found);
    };
    summary = options.archive ? simulate_archive(scene, static_cast<std::size_t>(*options.archive),
                                                 options.output, how, show)
                              : simulate(scene, options.output, how, show);
  }
  for (const std::string& warning : summary.warnings) spdlog::warn("{}", warning);
  fmt::print("rendered {} {}, {} were there; in {}\n", summary.rendered, what, summary.found,
             options.output);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "Renders what a rolling-shutter camera sees of modulated lamps and of calibration boards, "
      "with\n"
      "the truth beside the images. An interrupted run goes on where it stopped.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-simulate datasets/paper-rig/scene.yaml --only sample \\\n"
      "    -o out/paper-rig\n",
      "vlp-simulate");
  vlp::Options options;
  app.add_option("scene", options.scene, "Scene file, .yaml")->required();
  app.add_option("-o,--output", options.output, "Folder for the captures")->required();
  auto* only = app.add_option("--only", options.folders,
                              "Render these folders of the scene alone (commas between, no spaces)")
                   ->delimiter(',')
                   ->allow_extra_args(false)
                   ->option_text("FOLDER[,FOLDER...]");
  app.add_option(
         "--archive", options.archive,
         "Render so many sessions of different cameras into OUTPUT/CAMERA/SESSION, some with\n"
         "faults or damaged; archive.csv tells which")
      ->check(CLI::Range(1, 10'000'000))
      ->excludes(only);
  app.add_option("--seed", options.seed, "Another seed than the scene's")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  vlp::add_threads_option(app, options.threads, "Captures at a time");
  return vlp::run_app(app, argc, argv, [&] { vlp::run(options); });
}
