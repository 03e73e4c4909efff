// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/gnuplot.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// A temporary file that goes with its scope.
class Script {
 public:
  Script(const std::string& content, const fs::path& picture)
      : path_((fs::temp_directory_path() / "vlp-plot-XXXXXX").string()) {
    const int descriptor = ::mkstemp(path_.data());
    if (descriptor < 0) throw InputError(picture, "cannot be drawn: no room for temporary files");
    ::close(descriptor);
    write_file(path_, content);
  }
  ~Script() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string terminal_of(const fs::path& picture, int width_px, int height_px) {
  const std::string size =
      " size " + std::to_string(width_px) + "," + std::to_string(height_px) + "\n";
  if (picture.extension() == ".png") return "set terminal pngcairo font 'DejaVu Sans,11'" + size;
  if (picture.extension() == ".svg") return "set terminal svg font 'DejaVu Sans,11'" + size;
  throw InputError(picture, "a picture's name should end in .png or .svg");
}

}  // namespace

void draw(const fs::path& picture, int width_px, int height_px, const std::string& commands) {
  const Script script(terminal_of(picture, width_px, height_px) + commands, picture);
  FILE* pipe = ::popen(("LC_ALL=C.UTF-8 gnuplot " + shell_quoted(script.path())).c_str(), "r");
  if (pipe == nullptr) throw InputError(picture, "cannot be drawn: gnuplot cannot be started");
  std::string image;
  char block[65536];
  while (const std::size_t size = std::fread(block, 1, sizeof block, pipe)) {
    image.append(block, size);
  }
  if (::pclose(pipe) != 0 || image.empty()) {
    throw InputError(picture, "cannot be drawn: gnuplot failed; is it installed?");
  }
  write_file(picture, image);
}

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace vlp
