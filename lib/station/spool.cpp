// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/spool.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "captures/printable.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kRunFormat = "vlp-run/1";
constexpr const char* kRunEnding = ".json";
constexpr std::size_t kMostRunBytes = 64 << 20;
/// Of a run of hundreds of images, several times over.
constexpr std::uintmax_t kRoom_bytes = 1'000'000;

Json number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}
std::optional<double> number_if_any(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

RunRecord run_from(const Json& json) {
  if (json.at("format").get<std::string>() != kRunFormat)
    throw std::runtime_error("another format");
  RunRecord run;
  for (const RunField& field : run_fields()) json.at(field.name).get_to(run.*field.text);
  for (const Json& figure : json.at("figures")) {
    run.figures.push_back(
        {figure.at("name").get<std::string>(), figure.at("unit").get<std::string>(),
         number_if_any(figure.at("value")), number_if_any(figure.at("gate")),
         figure.at("at_least").get<bool>() ? Direction::at_least : Direction::at_most});
  }
  for (const Json& image : json.at("images")) {
    run.images.push_back({image.at("step").get<std::string>(), image.at("image").get<std::string>(),
                          image.at("sha256").get<std::string>(),
                          image.at("refused").get<std::string>()});
  }
  return run;
}

fs::path file_of_run(const fs::path& folder, const std::string& run) {
  return folder / (run + kRunEnding);
}

/// "camera 0001: run RUN" as Records::owner_of() has it.
std::string owner_among(const std::vector<RunRecord>& runs, const std::string& sha256,
                        const std::string& other_than_camera) {
  for (const RunRecord& run : runs) {
    const bool uses =
        run.camera != other_than_camera &&
        std::any_of(run.images.begin(), run.images.end(), [&](const RunRecord::Image& image) {
          return image.sha256 == sha256 && image.refused.empty();
        });
    if (uses) return "camera " + run.camera + ": run " + run.run;
  }
  return "";
}

}  // namespace

std::string text_of_run(const RunRecord& run) {
  Json json;
  json["format"] = kRunFormat;
  for (const RunField& field : run_fields()) json[field.name] = printable(run.*field.text);
  json["figures"] = Json::array();
  for (const CheckedMetric& figure : run.figures) {
    json["figures"].push_back({{"name", figure.name},
                               {"unit", figure.unit},
                               {"value", number_or_null(figure.value)},
                               {"gate", number_or_null(figure.limit)},
                               {"at_least", figure.asked == Direction::at_least}});
  }
  json["images"] = Json::array();
  for (const auto& [step, name, sha256, refused] : run.images) {
    json["images"].push_back({{"step", step},
                              {"image", printable(name)},
                              {"sha256", sha256},
                              {"refused", printable(refused)}});
  }
  constexpr int indent = 1;
  return json.dump(indent) + "\n";
}

RunRecord read_run(const fs::path& file) {
  const std::string text = read_text_file(file, kMostRunBytes);
  try {
    return run_from(Json::parse(text));
  } catch (const std::exception& error) {
    throw InputError(file, std::string("is no run of a station: ") + error.what());
  }
}

Spool::Spool(fs::path folder, std::string records)
    : folder_(std::move(folder)), where_(std::move(records)) {
  name_of_database(where_);  // refuses what is none
}

Spool::~Spool() = default;

/// Whether the records answered.
template <typename Action>
bool Spool::ask(const Action& action) {
  try {
    if (!records_) records_ = std::make_unique<Records>(where_);
    action(*records_);
    return true;
  } catch (const InputError& error) {
    problem_ = error.what();
    return false;
  }
}

void Spool::prepare() {
  check_room(folder_, kRoom_bytes);
  if (!ask([](Records& records) { records.check_writable(); })) return put_off();
  deliver();
}

void Spool::put_off() {
  constexpr std::chrono::minutes a_while(1);
  ask_again_ = Clock::now() + a_while;
}

void Spool::keep(const RunRecord& run) {
  try {
    make_folder(folder_);
    write_file(file_of_run(folder_, run.run), text_of_run(run));
  } catch (const InputError& error) {
    if (ask([&](Records& records) { records.keep(run); })) return;
    throw InputError(folder_,
                     fmt::format("neither here can a run be kept ({}) nor in the records ({})",
                                 error.what(), problem_));
  }
}

void Spool::deliver() {
  constexpr std::chrono::seconds long_enough(10);
  const auto begun = Clock::now();
  if (begun < ask_again_) return;
  problem_.clear();
  for (const fs::path& file : files()) {
    if (Clock::now() - begun > long_enough) {
      if (problem_.empty()) problem_ = "there are many, the rest goes with the next run";
      return;
    }
    std::error_code gone;
    std::optional<RunRecord> run;
    try {
      run = read_run(file);
    } catch (const InputError& error) {
      // Another program may have brought it there.
      if (fs::exists(file, gone)) problem_ = error.what();
      continue;
    }
    if (ask([&](Records& records) { records.keep(*run); })) {
      fs::remove(file, gone);
    } else if (!records_) {
      return put_off();
    }
  }
}

std::string Spool::state() const {
  const std::size_t waiting = files().size();
  if (waiting > 0) return fmt::format("kept here, {} waiting: {}", waiting, problem_);
  return problem_.empty() ? "" : "runs are kept here: " + problem_;
}

std::vector<fs::path> Spool::files() const {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_, none)) {
    // Not the temporary file of one that is being written.
    const fs::path name = entry.path().filename();
    if (name.extension() == kRunEnding && !name.string().starts_with('.')) files.push_back(entry);
  }
  std::sort(files.begin(), files.end());
  return files;
}

const std::vector<RunRecord>& Spool::waiting() {
  auto files = this->files();
  if (files == known_files_) return known_;
  known_.clear();
  for (const fs::path& file : files) {
    try {
      known_.push_back(read_run(file));
    } catch (const InputError&) {  // state() tells of it
    }
  }
  known_files_ = std::move(files);
  return known_;
}

std::optional<RunRecord> Spool::find(const std::string& run) {
  for (const RunRecord& waiting : this->waiting()) {
    if (waiting.run == run) return waiting;
  }
  std::optional<RunRecord> found;
  if (Clock::now() < ask_again_) return found;
  if (!ask([&](Records& records) { found = records.find(run); })) put_off();
  return found;
}

std::string Spool::owner_of(const std::string& sha256, const std::string& other_than_camera) {
  std::string owner = owner_among(waiting(), sha256, other_than_camera);
  if (!owner.empty() || Clock::now() < ask_again_) return owner;
  if (!ask([&](Records& records) { owner = records.owner_of(sha256, other_than_camera); })) {
    put_off();
  }
  return owner;
}

}  // namespace vlp
