// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/camera_imports.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/spline_fit.h"
#include "camera/spline_grid.h"
#include "geometry/symmetric.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/yaml_reader.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Maximum size of a camera file; that of mrcal contains the corners of its solve.
constexpr std::size_t kMaxCameraBytes = std::size_t{64} << 20;
/// Largest width and height of an image, as in a calibration.
constexpr int kMaxImager_px = 1 << 20;

/// Returns a Python literal without comments, which begin with a # outside strings.
std::string strip_comments(const std::string& text) {
  std::string result;
  char quote = 0;  // that ends the string; 0 outside
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quote == 0 && text[i] == '#') {
      i = text.find('\n', i);
      if (i == std::string::npos) break;
    }
    const char here = text[i];
    result += here;
    if (quote != 0 && here == '\\' && i + 1 < text.size()) {
      result += text[++i];
    } else if (here == quote) {
      quote = 0;
    } else if (quote == 0 && (here == '\'' || here == '"')) {
      quote = here;
    }
  }
  return result;
}

/// Returns the value of `key` in a Python literal, a list, tuple or string, without its delimiters;
/// std::nullopt if the key is missing.
std::optional<std::string> find_python_value(const std::string& text, const std::string& key) {
  constexpr const char* blanks = " \t\r\n";
  for (const char quote : {'\'', '"'}) {
    const std::string quoted = quote + key + quote;
    const std::size_t found = text.find(quoted);
    if (found == std::string::npos) continue;
    const std::size_t colon = text.find_first_not_of(blanks, found + quoted.size());
    if (colon == std::string::npos || text[colon] != ':') continue;
    const std::size_t first = text.find_first_not_of(blanks, colon + 1);
    if (first == std::string::npos) continue;
    const bool in_quotes = text[first] == '\'' || text[first] == '"';
    if (!in_quotes && text[first] != '[' && text[first] != '(') continue;
    int depth = 1;
    for (std::size_t last = first + 1; last < text.size(); ++last) {
      const char here = text[last];
      if (in_quotes ? here == text[first] : here == ']' || here == ')') {
        --depth;
      } else if (!in_quotes && (here == '[' || here == '(')) {
        ++depth;
      }
      if (depth == 0) return text.substr(first + 1, last - first - 1);
    }
  }
  return std::nullopt;
}

std::string get_required_value(const fs::path& file, const std::string& text,
                               const std::string& key) {
  const auto value = find_python_value(text, key);
  if (!value) throw InputError(file, "lacks '" + key + "'");
  return *value;
}

/// Parses the numbers of a list, or of a list of lists.
std::vector<double> parse_numbers(const fs::path& file, std::string list, const std::string& key) {
  std::vector<double> numbers;
  constexpr std::string_view between = ",[]()";
  std::ranges::replace_if(
      list, [&](char c) { return between.find(c) != between.npos; }, ' ');
  std::istringstream stream(list);
  stream.imbue(std::locale::classic());
  for (double number = 0; stream >> number;) numbers.push_back(number);
  if (!stream.eof()) throw InputError(file, "'" + key + "' should be numbers");
  return numbers;
}

std::vector<double> parse_python_numbers(const fs::path& file, const std::string& text,
                                         const std::string& key) {
  return parse_numbers(file, get_required_value(file, text, key), key);
}

/// Reads the valid region. mrcal closes the contour; an empty contour means that the lens is
/// calibrated nowhere.
ImageRegion parse_mrcal_region(const fs::path& file, const std::string& text) {
  const std::string key = "valid_intrinsics_region";
  const auto value = find_python_value(text, key);
  if (!value) return {};
  const auto numbers = parse_numbers(file, *value, key);
  if (numbers.empty())
    throw InputError(file, "'" + key +
                               "' is empty, so the lens has no valid region; leave the key out if "
                               "it is valid in the whole image");
  ImageRegion region;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
    region.emplace_back(numbers[i], numbers[i + 1]);
  }
  if (region.size() > 1 && region.front() == region.back()) region.pop_back();
  if (numbers.size() % 2 != 0 || region.size() < 3) {
    throw InputError(file, "'" + key + "' should be three pixels or more");
  }
  return region;
}

ImportedCamera parse_mrcal_camera(const fs::path& file, const std::string& text) {
  // The inputs of the optimization are long and not needed.
  const std::string literal = strip_comments(text);
  const std::string head = literal.substr(0, literal.find("'optimization_inputs'"));
  const std::string name = get_required_value(file, head, "lensmodel");
  const auto model = lens_model_from_name(name);
  if (!model) {
    throw InputError(file,
                     "has lens model " + name + "; the models are: " + list_lens_model_names());
  }
  const auto imager = parse_python_numbers(file, head, "imagersize");
  const auto is_size = [](double value) { return value >= 1 && value <= kMaxImager_px; };
  if (imager.size() != 2 || !std::ranges::all_of(imager, is_size)) {
    throw InputError(file, "'imagersize' should be the image's width and height in pixels");
  }
  Camera camera;
  camera.lens_model = *model;
  camera.imager_px = {static_cast<int>(imager[0]), static_cast<int>(imager[1])};
  camera.intrinsics = parse_python_numbers(file, head, "intrinsics");
  return {camera, parse_mrcal_region(file, head)};
}

std::vector<double> parse_yaml_numbers(const YAML::Node& node) {
  const YAML::Node list = node && node.IsMap() ? node["data"] : node;
  if (!list || !list.IsSequence()) throw std::invalid_argument("a list of numbers is missing");
  return list.as<std::vector<double>>();
}

/// Returns the lens model and removes trailing coefficients of zero. The last two of OpenCV's 14
/// coefficients tilt the sensor and must be 0. If all are zero, the model is a pinhole.
LensModel require_lens_model(const std::string& name, std::vector<double>& distortions) {
  constexpr std::size_t with_tilt = 14, without = 12;
  if (name == "fisheye" || name == "equidistant") {
    if (distortions.size() != 4) throw std::invalid_argument(name + " has four coefficients");
    return LensModel::fisheye;
  }
  if (!name.empty() && name != "plumb_bob" && name != "rational_polynomial" && name != "radtan" &&
      name != "none") {
    throw std::invalid_argument("there is no distortion model like " + name + " here");
  }
  if (distortions.size() == with_tilt && distortions[12] == 0 && distortions[13] == 0) {
    distortions.resize(without);
  }
  if (std::all_of(distortions.begin(), distortions.end(), [](double k) { return k == 0; })) {
    distortions.clear();
  }
  switch (distortions.size()) {
    case 0:
      return LensModel::pinhole;
    case 4:
      return LensModel::opencv4;
    case 5:
      return LensModel::opencv5;
    case 8:
      return LensModel::opencv8;
    case without:
      return LensModel::opencv12;
    default:
      throw std::invalid_argument(
          "distortions should be 0, 4, 5, 8 or 12 numbers, the sensor not tilted");
  }
}

Camera parse_yaml_camera(const YAML::Node& document) {
  const YAML::Node kalibr = document["cam0"];
  Camera camera;
  std::vector<double> distortions;
  if (kalibr) {
    if (const auto model = kalibr["camera_model"].as<std::string>(); model != "pinhole") {
      throw std::invalid_argument("camera_model " + model + " is not supported; use pinhole");
    }
    camera.intrinsics = parse_yaml_numbers(kalibr["intrinsics"]);
    const auto model = kalibr["distortion_model"].as<std::string>("none");
    if (model != "none") distortions = parse_yaml_numbers(kalibr["distortion_coeffs"]);
    camera.lens_model = require_lens_model(model, distortions);
    camera.imager_px = kalibr["resolution"].as<std::array<int, 2>>();
  } else {
    const auto matrix = parse_yaml_numbers(document["camera_matrix"]);
    if (matrix.size() != 9) throw std::invalid_argument("camera_matrix should be 3 x 3");
    // [LENS-7] `is skewed`
    if (matrix[1] != 0) throw std::invalid_argument("camera_matrix is skewed");
    camera.intrinsics = {matrix[0], matrix[4], matrix[2], matrix[5]};
    distortions = parse_yaml_numbers(document["distortion_coefficients"]);
    std::string model = document["distortion_model"].as<std::string>("");
    if (model.empty() && document["fisheye_model"].as<int>(0) != 0) model = "fisheye";
    camera.lens_model = require_lens_model(model, distortions);
    camera.imager_px = {document["image_width"].as<int>(), document["image_height"].as<int>()};
    if (const YAML::Node name = document["camera_name"]) camera.id = name.as<std::string>();
  }
  camera.intrinsics.insert(camera.intrinsics.end(), distortions.begin(), distortions.end());
  return camera;
}

/// Residuals of a lens fit to rays, and the normal equations of the parameters (splined: of the
/// core).
struct LensFit {
  double squares = 0;
  int count = 0;
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
};

LensFit measure_lens_fit(const std::vector<double>& parameters, LensModel model,
                         const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector3d>>& rays) {
  const Lens lens(model, parameters);
  constexpr Eigen::Index core = 4;
  const Eigen::Index size = is_splined_lens_model(model) ? core : std::ssize(parameters);
  LensFit step;
  step.normal = Eigen::MatrixXd::Zero(size, size);
  step.right = Eigen::VectorXd::Zero(size);
  for (const auto& [pixel, ray] : rays) {
    const auto at = lens.project_with_jacobians(ray);
    if (!at) continue;
    const Eigen::Vector2d residual = pixel - at->pixel;
    step.squares += residual.squaredNorm();
    ++step.count;
    step.normal += at->d_pixel_d_parameters.transpose() * at->d_pixel_d_parameters;
    step.right += at->d_pixel_d_parameters.transpose() * residual;
  }
  return step;
}

/// Fits the parameters of a lens model to the rays of another lens by the method of Levenberg and
/// Marquardt. Parameters of a splined lens are kept. Throws std::invalid_argument if the model has
/// no lens close to the other one.
void fit_parameters(const Camera& camera, const Lens& from, LensModel model,
                    std::vector<double>& parameters) {
  constexpr int max_iterations = 200;
  constexpr double function_tolerance = 1e-12, min_damping = 1e-12, max_damping = 1e12;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector3d>> rays;
  for (const Eigen::Vector2d& pixel : make_pixel_grid(camera.imager_px)) {
    if (const auto ray = from.unproject_pixel(pixel)) rays.emplace_back(pixel, ray->direction);
  }
  double damping = 1e-3;
  LensFit fit = measure_lens_fit(parameters, model, rays);
  for (int i = 0; i < max_iterations && fit.count > 0 && !is_splined_lens_model(model); ++i) {
    Eigen::MatrixXd damped = fit.normal;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd change = solve_symmetric(damped, fit.right);
    std::vector<double> next = parameters;
    for (std::size_t k = 0; k < next.size(); ++k) next[k] += change[static_cast<Eigen::Index>(k)];
    const bool is_possible = change.allFinite() && next[0] > 0 && next[1] > 0;
    LensFit trial = is_possible ? measure_lens_fit(next, model, rays) : LensFit{};
    const bool is_better = trial.count > 0 && trial.count >= fit.count &&
                           (trial.count > fit.count || trial.squares < fit.squares);
    if (!is_better) {
      damping *= 10;
      if (damping > max_damping) break;
      continue;
    }
    const bool has_converged =
        trial.count == fit.count && fit.squares - trial.squares <= function_tolerance * fit.squares;
    parameters = next;
    fit = std::move(trial);
    damping = std::max(damping / 10, min_damping);
    if (has_converged) break;
  }
  if (fit.count == 0 || !std::isfinite(fit.squares)) {
    // [LENS-7] `has no lens near` | `vlp-convert`: unsupported model or value | fit another with
    //   `--lens`
    throw std::invalid_argument(std::string(lens_model_name(model)) + " has no lens near " +
                                std::string(lens_model_name(camera.lens_model)));
  }
}

/// Measures the largest difference between two lenses on a finer grid than that of the fit, and the
/// fraction of the image that both project to.
void set_differences(const Lens& from, const Lens& to, const std::array<int, 2>& imager_px,
                     FittedCamera& fitted) {
  constexpr int points_per_row = 201;
  const auto pixels = make_pixel_grid(imager_px, points_per_row);
  std::size_t num_common = 0;
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto ray = from.unproject_pixel(pixel);
    const auto found = ray ? to.project_point(ray->direction) : std::nullopt;
    if (!found) continue;
    fitted.worst_px = std::max(fitted.worst_px, (*found - pixel).norm());
    ++num_common;
  }
  fitted.common_fraction = static_cast<double>(num_common) / static_cast<double>(pixels.size());
}

}  // namespace

ImportedCamera read_any_camera(const fs::path& file) {
  std::string text = read_file(file, kMaxCameraBytes);
  ImportedCamera found;
  Camera& camera = found.camera;
  if (text.find("'lensmodel'") != std::string::npos ||
      text.find("\"lensmodel\"") != std::string::npos) {
    found = parse_mrcal_camera(file, text);
  } else {
    if (text.starts_with("<?xml")) {
      throw InputError(file, "is XML, which is not supported; save it as .yaml with OpenCV");
    }
    // "%YAML:1.0" of OpenCV is no directive of YAML.
    if (text.starts_with("%YAML:")) text.erase(0, text.find('\n'));
    if (text.size() > kMaxYamlBytes) {
      throw InputError(file, "contains no camera: a YAML file of a camera is shorter than 1 MiB");
    }
    try {
      const YAML::Node document = parse_yaml_text(file, text);
      if (!document.IsMap()) throw InputError(file, "contains no camera");
      if (document["format"]) {
        const Calibration calibration = read_calibration(file);
        const auto& report = calibration.intrinsics_report;
        return {calibration.camera, report ? report->region_px : ImageRegion()};
      }
      camera = parse_yaml_camera(document);
    } catch (const YAML::Exception& error) {
      throw InputError(file, "contains no supported camera: " + error.msg);
    } catch (const std::invalid_argument& error) {
      throw InputError(file, error.what());
    }
  }
  if (camera.id.empty()) camera.id = "camera";
  for (const int size_px : camera.imager_px) {
    if (size_px >= 1 && size_px <= kMaxImager_px) continue;
    throw InputError(file, "the image should be 1 to " + std::to_string(kMaxImager_px) +
                               " px wide and high, not " + std::to_string(size_px));
  }
  try {
    const Lens lens(camera.lens_model, camera.intrinsics);
  } catch (const std::invalid_argument& error) {
    throw InputError(file, error.what());
  }
  return found;
}

FittedCamera convert_lens_model(const Camera& camera, LensModel model) {
  if (camera.lens_model == model) return {camera, 0, 1};
  const Lens from(camera.lens_model, camera.intrinsics);
  FittedCamera fitted{camera, 0, 0};
  fitted.camera.lens_model = model;
  auto& parameters = fitted.camera.intrinsics;
  parameters.resize(4);
  parameters.resize(
      num_lens_parameters(is_splined_lens_model(model) ? LensModel::stereographic : model), 0);
  if (is_splined_lens_model(model)) {
    if (camera.lens_model != LensModel::stereographic) {
      parameters = convert_lens_model(camera, LensModel::stereographic).camera.intrinsics;
    }
    const auto splined = fit_splined_lens(from, camera.imager_px, model, parameters);
    if (!splined) {
      throw std::invalid_argument(explain_coarse_grid(from, camera.imager_px, model, parameters));
    }
    parameters = *splined;
  }
  fit_parameters(camera, from, model, parameters);
  set_differences(from, Lens(model, parameters), camera.imager_px, fitted);
  return fitted;
}

}  // namespace vlp
