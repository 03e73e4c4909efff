// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/spool.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
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

SpooledRun run_from(const Json& json) {
  if (json.at("format").get<std::string>() != kRunFormat)
    throw std::runtime_error("another format");
  SpooledRun spooled;
  json.at("records").get_to(spooled.records);
  RunRecord& run = spooled.run;
  for (const RunField& field : run_fields()) {
    run.*field.text = json.value(field.name, std::string());
  }
  if (run.run.empty() || run.verdict.empty()) throw std::runtime_error("no run, or no verdict");
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
  return spooled;
}

fs::path file_of_run(const fs::path& folder, const std::string& run) {
  return folder / (run + kRunEnding);
}

/// What the file of a run says of the records that it is for, wherever the program was started.
std::string name_of_records(const std::string& where) {
  const std::string name = name_of_database(where);  // refuses what is none
  return printable(is_server(where) ? name : fs::absolute(name).lexically_normal().string());
}

std::vector<fs::path> entries_of(const fs::path& folder, std::error_code& error) {
  std::vector<fs::path> entries;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    entries.push_back(entry->path());
  }
  return entries;
}

/// Temporary files of programs that were killed, a day ago or longer: nobody writes them any more.
void remove_left_over(const fs::path& folder) {
  constexpr std::chrono::hours a_day(24);
  std::error_code error;
  for (const fs::path& file : entries_of(folder, error)) {
    const std::string name = file.filename().string();
    if (!name.starts_with('.') || name.find(".json.tmp-") == std::string::npos) continue;
    const auto written = fs::last_write_time(file, error);
    if (!error && fs::file_time_type::clock::now() - written > a_day) fs::remove(file, error);
  }
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

std::string text_of_run(const SpooledRun& spooled) {
  const RunRecord& run = spooled.run;
  Json json;
  json["format"] = kRunFormat;
  json["records"] = printable(spooled.records);
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

SpooledRun read_run(const fs::path& file) {
  const std::string text = read_text_file(file, kMostRunBytes);
  try {
    return run_from(Json::parse(text));
  } catch (const std::exception& error) {
    throw InputError(file, std::string("is no run of a station: ") + error.what());
  }
}

Spool::Spool(fs::path folder, std::string records)
    : folder_(std::move(folder)), where_(std::move(records)), name_(name_of_records(where_)) {}

Spool::~Spool() = default;

void Spool::open() {
  if (records_) return;
  std::error_code none;
  if (!is_server(where_) && !fs::exists(where_, none)) {
    throw RecordsAway(where_, "there are no records");
  }
  records_ = std::make_unique<Records>(where_);
}

/// Why it was not done; empty when it was.
template <typename Action>
std::string Spool::ask(const Action& action) {
  try {
    open();
    action(*records_);
    away_.clear();
    return "";
  } catch (const RecordsAway& error) {
    put_off(error.what());
    return error.what();
  } catch (const InputError& error) {
    if (!records_) {
      put_off(error.what());
    } else {
      away_.clear();
    }
    return error.what();
  }
}

bool Spool::may_ask() const { return Clock::now() >= ask_again_; }

void Spool::put_off(const std::string& why) {
  constexpr std::chrono::minutes a_while(1);
  ask_again_ = Clock::now() + a_while;
  away_ = why;
}

void Spool::prepare() {
  check_room(folder_, kRoom_bytes);
  remove_left_over(folder_);
  try {
    if (!records_) records_ = std::make_unique<Records>(where_);
  } catch (const RecordsAway& error) {
    return put_off(error.what());
  }
  problem_ = ask([](Records& records) { records.check_writable(); });
  if (problem_.empty()) deliver();
}

void Spool::keep(const RunRecord& run) {
  try {
    make_folder(folder_);
    write_file(file_of_run(folder_, run.run), text_of_run({run, name_}));
  } catch (const InputError& error) {
    const std::string refused = ask([&](Records& records) { records.keep(run); });
    if (refused.empty()) return;
    throw InputError(folder_,
                     fmt::format("neither here can a run be kept ({}) nor in the records ({})",
                                 error.what(), refused));
  }
}

void Spool::deliver() {
  constexpr std::chrono::seconds long_enough(10);
  const auto begun = Clock::now();
  if (!may_ask()) return;
  problem_.clear();
  for (const fs::path& file : files()) {
    if (Clock::now() - begun > long_enough) {
      if (problem_.empty()) problem_ = "there are many, the rest goes with the next run";
      return;
    }
    std::error_code gone;
    SpooledRun spooled;
    try {
      spooled = read_run(file);
    } catch (const InputError& error) {
      // Another program may have brought it there.
      if (fs::exists(file, gone)) problem_ = error.what();
      continue;
    }
    if (spooled.records != name_) continue;
    const std::string refused = ask([&](Records& records) { records.keep(spooled.run); });
    if (!away_.empty()) return;
    if (refused.empty()) {
      fs::remove(file, gone);
      if (gone) problem_ = file.string() + ": cannot be removed: " + gone.message();
    } else {
      problem_ = refused;
    }
  }
}

std::string Spool::state() {
  read();
  const std::string& why = away_.empty() ? problem_ : away_;
  const std::size_t waiting = known_files_.size() - others_.size();
  std::vector<std::string> said;
  if (waiting > 0) {
    said.push_back(fmt::format("kept here, {} waiting{}{}", waiting, why.empty() ? "" : ": ", why));
  } else if (!why.empty()) {
    said.push_back("runs are kept here: " + why);
  }
  if (!others_.empty()) {
    said.push_back(
        fmt::format("{} here for other records, such as {}", others_.size(), other_records_));
  }
  if (not_asked_ > 0) {
    said.push_back(fmt::format("{} images were not looked up in the records", not_asked_));
  }
  return fmt::format("{}", fmt::join(said, "; "));
}

std::vector<fs::path> Spool::files() {
  std::error_code error;
  std::vector<fs::path> files = entries_of(folder_, error);
  if (error && error != std::errc::no_such_file_or_directory) {
    problem_ = folder_.string() + ": cannot be read: " + error.message();
  }
  std::erase_if(files, [](const fs::path& file) {
    // Not the temporary file of one that is being written.
    return file.extension() != kRunEnding || file.filename().string().starts_with('.');
  });
  std::sort(files.begin(), files.end());
  return files;
}

void Spool::read() {
  auto files = this->files();
  if (files == known_files_) return;
  known_.clear();
  others_.clear();
  for (const fs::path& file : files) {
    try {
      auto [run, records] = read_run(file);
      if (records != name_) other_records_ = records;
      (records == name_ ? known_ : others_).push_back(std::move(run));
    } catch (const InputError&) {  // state() tells of it
    }
  }
  known_files_ = std::move(files);
}

const std::vector<RunRecord>& Spool::waiting() {
  read();
  return known_;
}

std::optional<RunRecord> Spool::find(const std::string& run) {
  read();
  for (const auto* runs : {&known_, &others_}) {
    for (const RunRecord& waiting : *runs) {
      if (waiting.run == run) return waiting;
    }
  }
  std::optional<RunRecord> found;
  if (may_ask()) ask([&](Records& records) { found = records.find(run); });
  return found;
}

std::string Spool::owner_of(const std::string& sha256, const std::string& other_than_camera) {
  read();
  for (const auto* runs : {&known_, &others_}) {
    const std::string owner = owner_among(*runs, sha256, other_than_camera);
    if (!owner.empty()) return owner;
  }
  std::string owner;
  const auto look = [&](Records& records) { owner = records.owner_of(sha256, other_than_camera); };
  if (!may_ask() || !ask(look).empty()) ++not_asked_;
  return owner;
}

}  // namespace vlp
