// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/database_name.h"

#include <libpq-fe.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string_view>

#include "rig/input_error.h"

namespace vlp {
namespace {

constexpr const char* kScheme = "://";
constexpr const char* kPatience = "connect_timeout";
constexpr int kPatience_s = 10, kPatienceWithFile_s = 5;

using Parts = std::map<std::string, std::string>;

/// Returns the options that have a value, and frees `option`.
Parts parse_parts(PQconninfoOption* options) {
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> owned(options, PQconninfoFree);
  Parts parts;
  for (; options != nullptr && options->keyword != nullptr; ++options) {
    if (options->val != nullptr) parts[options->keyword] = options->val;
  }
  return parts;
}

/// Parses a connection string by libpq; empty if it is invalid.
Parts parse_parts(const std::string& where) {
  return parse_parts(PQconninfoParse(where.c_str(), nullptr));
}

/// Returns true if a part of the password could be interpreted as host or database.
bool may_be_misread(const std::string& where, const Parts& parts) {
  const std::string without_parameters = where.substr(0, where.find('?'));
  const auto begin = without_parameters.find(kScheme) + std::string(kScheme).size();
  const auto slash = std::min(without_parameters.find('/', begin), without_parameters.size());
  const auto at = without_parameters.find('@', begin);
  if (at != std::string::npos &&
      (at > slash || without_parameters.find('@', at + 1) != std::string::npos)) {
    return true;
  }
  // postgresql://USER:PASSWORD/NAME, without the host.
  const auto port = parts.find("port");
  return port != parts.end() && port->second.find_first_not_of("0123456789,") != std::string::npos;
}

/// Returns true for a connection string of keywords, as of libpq's own tools.
bool is_keyword_string(const std::string& where) {
  return where.find("password=") != std::string::npos || where.find("host=") != std::string::npos ||
         where.find("dbname=") != std::string::npos;
}

/// Returns true if libpq reaches a host through a socket or the loopback interface.
bool is_local_host(const std::string& host) {
  return host.empty() || host.front() == '/' || host.front() == '@' || host == "localhost" ||
         host == "::1" || host.starts_with("127.");
}

}  // namespace

std::string get_host_name() {
  constexpr std::size_t longest = 256;
  std::array<char, longest> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

bool is_server_address(const std::string& where) {
  return where.find(kScheme) != std::string::npos;
}

bool contains_password(const std::string& where) {
  if (!is_server_address(where)) return false;
  PQconninfoOption* options = PQconninfoParse(where.c_str(), nullptr);
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> owned(options, PQconninfoFree);
  for (; options != nullptr && options->keyword != nullptr; ++options) {
    const std::string value = options->val == nullptr ? "" : options->val;
    // libpq marks passwords by "*". Encoded, a password can be part of another value.
    const bool is_secret = *options->dispchar == '*' && !value.empty();
    const bool is_user_with_password =
        std::string_view(options->keyword) == "user" && value.find(':') != std::string::npos;
    if (is_secret || is_user_with_password || value.find("password=") != std::string::npos ||
        value.find(kScheme) != std::string::npos)
      return true;
  }
  return false;
}

std::string describe_database(const std::string& where) {
  const std::string form = "is not of the form postgresql://USER@HOST/NAME";
  if (!is_server_address(where)) {
    if (is_keyword_string(where)) throw InputError("a connection string of keywords", form);
    return where;
  }
  const std::string hidden = where.substr(0, where.find(kScheme)) + kScheme + "...";
  auto parts = parse_parts(where);
  if (parts.empty()) throw InputError(hidden, form);
  if (may_be_misread(where, parts)) {
    throw InputError(hidden, form + "; in user and password '@' is %40, ':' is %3A, '/' is %2F");
  }
  const std::string port = parts.contains("port") ? ":" + parts["port"] : "";
  return "postgresql://" + parts["host"] + port + "/" + parts["dbname"];
}

std::string derive_identity(const std::string& where) {
  const std::string name = describe_database(where);
  if (!is_server_address(where)) {
    return get_host_name() + ":" + std::filesystem::absolute(name).lexically_normal().string();
  }
  Parts parts = parse_parts(where);
  parts.merge(parse_parts(PQconndefaults()));  // given options take precedence
  const auto stated = [&](const char* key, const char* before) {
    return parts[key].empty() ? "" : before + parts[key];
  };
  constexpr const char* default_port = "5432";
  const std::string &host = parts["host"], &address = parts["hostaddr"];
  return (is_local_host(address.empty() ? host : address) ? get_host_name() + ":" : "") +
         "postgresql://" + host + (parts["port"] == default_port ? "" : stated("port", ":")) + "/" +
         (parts["dbname"].empty() ? parts["user"] : parts["dbname"]) + stated("hostaddr", " at ") +
         stated("service", " of the service ");
}

std::string make_soci_string(const std::string& where) {
  std::string connection;
  for (const char c : where) {
    if (c == ' ') {
      connection += "%20";
    } else if (c == '"') {
      connection += "%22";
    } else {
      connection += c;
    }
  }
  if (parse_parts(where).contains(kPatience)) return connection;
  return connection.append(connection.find('?') == std::string::npos ? "?" : "&")
      .append(kPatience)
      .append("=")
      .append(std::to_string(kPatience_s));
}

bool is_server_responding(const std::string& where) {
  const std::string connection = make_soci_string(where);
  const std::array keywords{"dbname", "sslmode", kPatience, static_cast<const char*>(nullptr)};
  const std::array values{connection.c_str(), "prefer", "2", static_cast<const char*>(nullptr)};
  return PQpingParams(keywords.data(), values.data(), 1) == PQPING_OK;
}

int get_timeout_s(const std::string& where) {
  if (!is_server_address(where)) return kPatienceWithFile_s;
  const auto parts = parse_parts(where);
  const auto without_parameters = parts.find(kPatience);
  if (without_parameters == parts.end()) return kPatience_s;
  // libpq rejects other texts than numbers.
  constexpr long a_day_s = 86'400;
  constexpr int decimal = 10;
  return static_cast<int>(
      std::clamp(std::strtol(without_parameters->second.c_str(), nullptr, decimal), 0L, a_day_s));
}

}  // namespace vlp
