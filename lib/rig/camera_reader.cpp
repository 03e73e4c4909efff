// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_parts.h"

namespace vlp {
namespace {

LensModel read_lens_model(const YamlValue& value) {
  if (const auto model = lens_model_from_name(value.text())) return *model;
  throw value.unknown("the models are: " + lens_model_names());
}

Readout read_readout(const YamlValue& value) {
  if (value.text() == "rows") return Readout::rows;
  if (value.text() == "columns") return Readout::columns;
  throw value.unknown("the read-out is along rows or columns");
}

std::vector<double> read_intrinsics(const YamlValue& value, LensModel model) {
  std::vector<double> intrinsics = value.numbers(parameter_count(model));
  if (intrinsics[0] <= 0 || intrinsics[1] <= 0) {
    throw value.error("the focal lengths, the first two, should be positive");
  }
  return intrinsics;
}

}  // namespace

Camera read_camera(YamlMap& map) {
  Camera camera;
  camera.id = map.required("id").text();
  const YamlValue imager_px = map.required("imager_px");
  const auto imager = imager_px.list();
  if (imager.size() != 2) throw imager_px.error("should be [width, height]");
  camera.imager_px = {imager[0].integer_within(1, 1 << 20), imager[1].integer_within(1, 1 << 20)};
  camera.lens_model = read_lens_model(map.required("lens_model"));
  camera.intrinsics = read_intrinsics(map.required("intrinsics"), camera.lens_model);
  if (const auto value = map.optional("pixel_pitch_m")) {
    camera.pixel_pitch_m = value->number_within(1e-7, 1e-4, "m");
  }
  if (const auto value = map.optional("row_time_s")) {
    camera.row_time_s = value->number_within(1e-8, 1e-3, "s");
  }
  if (const auto value = map.optional("readout")) camera.readout = read_readout(*value);
  return camera;
}

}  // namespace vlp
