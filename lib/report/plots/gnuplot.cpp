// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/gnuplot.h"

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

/// `picture` is for the messages.
std::string drawn(const std::string& terminal, const Drawing& drawing, const fs::path& picture) {
  const Script script("set terminal " + terminal + " size " + std::to_string(drawing.width_px) +
                          "," + std::to_string(drawing.height_px) + "\n" + drawing.commands,
                      picture);
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
  return image;
}

/// The font has two stand-ins, for machines that look at the picture and lack it.
std::string svg_terminal(const Drawing& drawing) {
  return "svg background 'white' name '" + drawing.name +
         "' font 'DejaVu Sans,Verdana,sans-serif,13'";
}

}  // namespace

void draw(const fs::path& picture, const Drawing& drawing) {
  if (picture.extension() == ".png") {
    write_file(picture, drawn("pngcairo font 'DejaVu Sans,13'", drawing, picture));
  } else if (picture.extension() == ".svg") {
    write_file(picture, drawn(svg_terminal(drawing), drawing, picture));
  } else {
    throw InputError(picture, "a picture's name should end in .png or .svg");
  }
}

std::string svg_of(const Drawing& drawing) {
  return drawn(svg_terminal(drawing), drawing, drawing.name);
}

}  // namespace vlp
