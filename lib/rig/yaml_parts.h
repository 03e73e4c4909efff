// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <unordered_set>

#include "board.h"
#include "calibration.h"
#include "lamp_map.h"
#include "yaml_reader.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Descriptions of the parts that several kinds of documents contain. A disc without diameter_m
/// has no size.
template <typename Io>
void describe(Io& io, Described<Io, Lamp> lamp);
template <typename Io>
void describe(Io& io, Described<Io, LampShape> shape);
template <typename Io>
void describe(Io& io, Described<Io, Board> board);
template <typename Io>
void describe(Io& io, Described<Io, Camera> camera);

/// Index of the lamps that were already read from a file, to find duplicates by id and position.
class UniqueLamps {
 public:
  /// Throws InputError at the lamp's mapping if an added lamp has the same id or is within 1 mm.
  void check_unique(const Lamp& lamp, const YamlMap& map) const;
  void add(const Lamp& lamp);

 private:
  std::unordered_set<int> ids_;
  /// Lamps by x in meters.
  std::multimap<double, Lamp> lamps_;
};

}  // namespace vlp
#pragma GCC visibility pop
