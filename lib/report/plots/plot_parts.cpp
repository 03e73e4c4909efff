// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/plot_parts.h"

#include "captures/number_text.h"

namespace vlp {

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') {
      quoted += "''";
    } else if (c == '\n') {
      quoted += "'.\"\\n\".'";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

std::string format_data_row(std::initializer_list<double> values) {
  std::string row;
  for (const double value : values) row.append(significant(value, kPlotDigits)).append(" ");
  return row + "\n";
}

std::string data_block(const std::string& name, const std::string& rows) {
  return "$" + name + " << END\n" + rows + "END\n";
}

std::string plot_settings() {
  return "set encoding utf8\n"
         "set tics out nomirror\n"
         "set key below Left reverse height 1\n"
         "set grid linecolor rgb '#e4e4e4'\n"
         "set style textbox opaque noborder margins 0.5,0.5\n"
         "set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#fde725')\n";
}

std::string plot_range(double from, double to) {
  return "[" + significant(from, kPlotDigits) + ":" + significant(to, kPlotDigits) + "]";
}

}  // namespace vlp
