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
  int threads = count_cpu_cores();
};

void run(const Options& options) {
  check_output_is_no_input((std::filesystem::path(options.output) / "scene.yaml").string(),
                           {options.scene});
  Scene scene = read_scene_file(options.scene);
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
      progress.update(so_far.rendered + so_far.existing, total, so_far.existing);
    };
    summary = options.archive ? simulate_archive(scene, static_cast<std::size_t>(*options.archive),
                                                 options.output, how, show)
                              : render_scene(scene, options.output, how, show);
  }
  for (const std::string& warning : summary.warnings) spdlog::warn("{}", warning);
  fmt::print("rendered {} {}, {} existed; in {}\n", summary.rendered, what, summary.existing,
             options.output);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Renders images of modulated lamps and calibration boards as a rolling-shutter camera "
      "records them, with ground truth. An interrupted run continues.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-simulate datasets/paper-rig/scene.yaml --only sample \\\n"
      "    -o out/rig\n",
      "vlp-simulate");
  CLI::App& app = *parser;
  vlp::Options options;
  app.add_option("scene", options.scene, "Scene file, .yaml")->required();
  app.add_option("-o,--output", options.output, "Output folder of the captures")->required();
  auto* only =
      app.add_option(
             "--only", options.folders,
             "Folders of the scene to render, separated by commas without spaces (default: all)")
          ->delimiter(',')
          ->allow_extra_args(false)
          ->option_text("FOLDER[,FOLDER...]");
  app.add_option("--archive", options.archive,
                 "Number of sessions of different cameras to render into OUTPUT/CAMERA/SESSION. "
                 "Some have faults or damage, which archive.csv lists")
      ->check(CLI::Range(1, 10'000'000))
      ->excludes(only);
  app.add_option("--seed", options.seed, "Random seed (default: that of the scene)")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  vlp::add_threads_option(app, options.threads, "Number of captures to render in parallel");
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(options); });
}
