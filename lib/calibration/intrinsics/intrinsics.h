// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/board_problem.h"
#include "camera/lens.h"

namespace vlp {

/// Whether the board's warp is solved for. `automatic`: when it takes away more of the squared
/// residuals than 20 times their mean, which chance does once in 20,000.
enum class WarpChoice { automatic, on, off };

/// What is solved: the corners of each view, of one camera.
struct IntrinsicsInput {
  BoardLattice lattice;
  std::vector<std::vector<BoardLattice::Corner>> views;
  std::array<int, 2> imager_px;
  LensModel lens_model;
  WarpChoice warp = WarpChoice::automatic;
};

enum class IntrinsicsStatus {
  ok,
  too_few_views,  // fewer than three that can be used
  all_alike,      // every view shows the board at the same angle: any focal length fits
  no_solution,    // no lens of the model fits
};
/// One line, with what to add.
std::string_view explanation_of(IntrinsicsStatus status);

/// A solution and how it fits.
struct IntrinsicsSolution {
  IntrinsicsStatus status;
  /// At the solution; with status ok only, as is all below. Its poses are those of the parts of
  /// views[0], views[1], ... in turn, and have points for each.
  BoardProblem problem;
  /// The views that it rests on, by their index in the input.
  std::vector<std::size_t> views;
  /// Views that fit no pose while the others do, and what is left over there.
  struct Dropped {
    std::size_t view;
    double rms_px;
  };
  std::vector<Dropped> dropped;
  /// How far the edges of the tags had gone towards the dark in each of `views`, in the mean; it is
  /// taken out of the corners (edge_shifts()).
  std::vector<double> edge_shifts_px;
  /// Root of the sum of the squared, weighted residuals over 2 x corners, those that are no
  /// outliers: per axis.
  double rms_px;
  int corners, outliers;

  bool ok() const { return status == IntrinsicsStatus::ok; }
  /// What `problem` leaves: rms_px, corners, outliers.
  void set_fit();
  Lens lens() const { return Lens(problem.lens_model, problem.intrinsics); }
  /// Intrinsics (of a splined lens but for the core), and the warp or not.
  SolveFor solved_for{true, true, true, false};
  /// Another lens model fits the corners as well, so that they do not tell what is beyond them.
  bool another_fits = false;
};

/// Solves for lens, poses and the board's warp, with no guess of the focal length:
///  1. a focal length of a geometric series, STEREOGRAPHIC, that fits the views' poses best;
///  2. STEREOGRAPHIC with every pose, and the poses again with that lens, until they stay;
///  3. the model wanted, regularized as mrcal does it, and the poses again (of a splined lens from
///     OPENCV_FISHEYE, whose centre is its centre, and then regularized for the noise that is left,
///     instead of a pixel, which would draw it off by more than the noise does; without the tags of
///     which OPENCV_FISHEYE leaves a corner elsewhere than its neighbours, to which it would bend
///     near the rim); views that fit no pose are dropped;
///  4. the corners of the tags with edges that bow as this lens bows them (take_bows_of_lens());
///  5. the shift of the tags' edges, even over a view, taken out (edge_shifts()), and the model
///     again, at most twice;
///  6. the board's warp (WarpChoice);
///  7. corners weighted by what they are good for, where their images tell it (CornerWeights);
///     the bows again, as 4., what the shifts change over a view, as 5., and the weights again;
///  8. all of it without outliers;
///  9. a splined lens turned to its axis.
/// The control points of a splined lens make up for any turn of the camera, so that its frame is a
/// convention: that of the OPENCV_FISHEYE which fits the same corners best, so that +Z is the axis
/// of the lens, seen near (cx, cy), and +X the image's. Rays of that frame hold it in the solve
/// (BoardProblem::held). It is turned there until less than 0.006 degrees are left, four times at
/// most: after those, or when OPENCV_FISHEYE cannot be fitted again, it stays as it is, and nothing
/// tells so. Where OPENCV_FISHEYE was not solved for at all, it is the frame in which the control
/// points have least to do.
/// Planar flips cannot live: both poses of every view are tried with each lens (view_pose()).
/// Depends on the input only, not on threads.
IntrinsicsSolution solve_intrinsics(const IntrinsicsInput& input);

/// Of every other view of a solution, from that solution on: their lens, poses and warp are solved
/// for again, with the shifts of edges, the weights, the outliers and a warp or none as all views
/// told them.
/// Precondition: whole.ok().
IntrinsicsSolution solve_every_other(const IntrinsicsSolution& whole, std::size_t first);

/// Residuals of a problem's points, seen minus projected, outliers too; NaN where nothing was seen.
std::vector<Eigen::Vector2d> residuals_of(const BoardProblem& problem);

}  // namespace vlp
