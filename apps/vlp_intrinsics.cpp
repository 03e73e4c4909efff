// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics: the lens of a camera from images of a board.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <string>

#include "app.h"
#include "board_images.h"
#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/plots/calibration_plots.h"
#include "history.h"
#include "intrinsics_options.h"
#include "print_intrinsics.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/stage.h"

namespace vlp {
namespace {

/// The views that can be used, apart from those that are held out.
struct Sorted {
  IntrinsicsInput solved, held_out;
  std::vector<std::string> names;  // of the solved
};

Sorted sorted(const IntrinsicsOptions& options, const Board& board,
              const std::vector<BoardView>& views) {
  const auto model = lens_model_from_name(options.lens);
  const IntrinsicsInput none{BoardLattice(board), {}, views.front().imager_px, *model};
  Sorted sorted{none, none, {}};
  int usable = 0;
  for (const BoardView& view : views) {
    if (!none.lattice.enough(view.seen)) {
      spdlog::warn("{}: only {} tags of the board can be used; skipped", view.image,
                   view.seen.tags.size());
      continue;
    }
    const bool held_out = options.held_out > 0 && ++usable % options.held_out == 0;
    auto& part = held_out ? sorted.held_out : sorted.solved;
    part.views.push_back(none.lattice.corners(view.seen));
    if (!held_out) sorted.names.push_back(view.image);
  }
  return sorted;
}

IntrinsicsSolution solved(const Sorted& views) {
  const IntrinsicsSolution solution = solve_intrinsics(views.solved);
  if (!solution.ok()) {
    throw Undetermined(fmt::format("{} views with the board: {}", views.solved.views.size(),
                                   explanation_of(solution.status)));
  }
  for (const auto& [view, rms_px] : solution.dropped) {
    spdlog::warn(
        "{}: fits no pose that goes with the other views ({:.1f} px are left over); dropped",
        views.names[view], rms_px);
  }
  return solution;
}

IntrinsicsReport report_of(const IntrinsicsSolution& solution, const IntrinsicsInput& input,
                           const CalibrationReport& report) {
  const Eigen::Vector2d warp_m =
      solution.problem.warp_m.cwiseProduct(input.lattice.warp_of_board());
  return {static_cast<int>(solution.views.size()),
          solution.corners,
          solution.outliers,
          solution.rms_px,
          std::array{warp_m.x(), warp_m.y()},
          report.uncertainty_worst_px};
}

Camera camera_of(const IntrinsicsOptions& options, const BoardProblem& problem) {
  Camera camera{options.camera_id,     problem.imager_px,  problem.lens_model, problem.intrinsics,
                options.pixel_pitch_m, options.row_time_s, options.readout};
  return camera;
}

/// camera.yaml and ".cameramodel" to camera.cameramodel.
std::string beside(const std::string& output, const char* ending) {
  return std::filesystem::path(output).replace_extension(ending).string();
}

void write_exports(const IntrinsicsOptions& options, const Camera& camera) {
  if (!options.ros.empty()) write_file(options.ros, ros_camera_info(camera));
  if (!options.kalibr.empty()) write_file(options.kalibr, kalibr_camchain(camera));
  if (!options.opencv.empty()) write_file(options.opencv, opencv_camera(camera));
}

void run(const CLI::App& app, const IntrinsicsOptions& options) {
  const auto images = image_files(options.images);
  std::vector<std::string> inputs{options.board};
  for (const auto& image : images) inputs.push_back(image.string());
  for (const std::string& output : {options.output, beside(options.output, ".cameramodel"),
                                    beside(options.output, ".corners.vnl"), options.ros,
                                    options.kalibr, options.opencv, options.plot}) {
    check_output(output, inputs);
  }
  const Board board = read_board(options.board);
  const auto views = board_views(images, board, options.board, options.threads, options.cache);
  const Sorted input = sorted(options, board, views);
  const IntrinsicsSolution solution = solved(input);
  const BoardCheck check = check_board(board, views, solution.lens());
  if (!check.problem.empty()) throw InputError(options.board, check.problem);

  const CalibrationReport report = report_on(solution, input.solved);
  const ViewCoverage coverage = coverage_of(solution, input.solved);
  write_calibration(options.output, with_camera(camera_of(options, solution.problem),
                                                report_of(solution, input.solved, report),
                                                history_entry(app, inputs)));
  write_exports(options, camera_of(options, solution.problem));
  write_cameramodel(beside(options.output, ".cameramodel"), solution);
  write_corners(beside(options.output, ".corners.vnl"), solution, input.names);
  if (!options.plot.empty()) {
    const std::string title = fmt::format("{}, {}", options.camera_id, options.lens);
    draw_intrinsics_plot(options.plot, plot_of(title, solution));
  }
  print_summary(solution, report, coverage, held_out_fit(solution, input.held_out));
  const auto failed = gates_not_met(options.gates, solution, report);
  std::string all;
  for (const std::string& gate : failed) all += (all.empty() ? "" : "; ") + gate;
  if (!failed.empty()) {
    throw GateNotMet(fmt::format("{}; add views, next {}", all, next_view(coverage)));
  }
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "Calibrates the lens of a camera from images of a board of AprilTags (see vlp-board), and "
      "says\n"
      "how far the result can be trusted. Exit code 1 when it is worse than the gates allow.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-simulate datasets/paper-rig/scene.yaml --only boards -o out/rig\n"
      "  build/bin/vlp-intrinsics out/rig/boards/*.png --board out/rig/board.yaml \\\n"
      "    --row-time-s 3e-5 --readout rows -o camera.yaml\n",
      "vlp-intrinsics");
  vlp::IntrinsicsOptions options;
  vlp::add_intrinsics_options(app, options);
  return vlp::run_app(app, argc, argv, [&] { vlp::run(app, options); });
}
