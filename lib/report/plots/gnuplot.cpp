// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/gnuplot.h"

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "captures/child_process.h"
#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_without_image(const fs::path& file) {
  throw InputError(file, "cannot be drawn: gnuplot failed; is it installed?");
}

/// Returns the commands of a drawing for a gnuplot terminal.
std::string make_script(const std::string& terminal, const Drawing& drawing) {
  return "set terminal " + terminal + " size " + std::to_string(drawing.width_px) + "," +
         std::to_string(drawing.height_px) + "\n" + drawing.commands;
}

/// Runs a script and returns the output. `file` appears in messages only. The option -d skips
/// ~/.gnuplot, which may run commands and change the plot. The script is named as a file, because
/// gnuplot reads stdin itself byte by byte. Warnings of gnuplot are discarded.
std::string run_gnuplot(std::string script, const fs::path& file) {
  constexpr int time_limit_s = 120;
  constexpr std::size_t max_output_bytes = std::size_t{1} << 30;
  ChildResult child = run_child({.words = {"env", "LC_ALL=C.UTF-8", "gnuplot", "-d", "/dev/stdin"},
                                 .input = std::move(script),
                                 .time_limit_s = time_limit_s,
                                 .max_output_bytes = max_output_bytes});
  if (!child.start_error.empty())
    throw InputError(file, "cannot be drawn: gnuplot cannot be started: " + child.start_error);
  if (!child.status && child.status_error.empty())
    throw InputError(
        file, "cannot be drawn: gnuplot did not end within " + std::to_string(time_limit_s) + " s");
  if (!child.has_succeeded() || child.output.empty()) fail_without_image(file);
  return std::move(child.output);
}

/// Returns the SVG terminal. Two fallback fonts follow, for machines without the first.
std::string make_svg_terminal(const Drawing& drawing) {
  return "svg background 'white' name '" + drawing.name +
         "' font 'DejaVu Sans,Verdana,sans-serif,13'";
}

}  // namespace

void write_plot(const fs::path& file, const Drawing& drawing) {
  if (file.extension() == ".png") {
    write_file(file, run_gnuplot(make_script("pngcairo font 'DejaVu Sans,13'", drawing), file));
  } else if (file.extension() == ".svg") {
    write_file(file, run_gnuplot(make_script(make_svg_terminal(drawing), drawing), file));
  } else {
    throw InputError(file, "a picture's name should end in .png or .svg");
  }
}

std::vector<std::string> render_plots_as_svg(std::span<const Drawing> drawings) {
  constexpr std::string_view beginning = "<?xml";
  if (drawings.empty()) return {};
  std::string script, names;
  for (const Drawing& drawing : drawings) {
    script += "reset\n" + make_script(make_svg_terminal(drawing), drawing) + "\n";
    names += (names.empty() ? "" : ", ") + drawing.name;
  }
  const std::string output = run_gnuplot(script, names);
  std::vector<std::string> images;
  for (std::size_t begin = output.find(beginning); begin != std::string::npos;) {
    const std::size_t end = output.find(beginning, begin + 1);
    images.push_back(output.substr(begin, end - begin));
    begin = end;
  }
  if (images.size() != drawings.size()) fail_without_image(names);
  return images;
}

std::string render_plot_as_svg(const Drawing& drawing) {
  return render_plots_as_svg({&drawing, 1}).front();
}

}  // namespace vlp
