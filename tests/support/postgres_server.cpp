// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "support/postgres_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Returns the folder of initdb and pg_ctl; empty if there is none.
fs::path programs() {
  std::vector<fs::path> versions;
  std::error_code none;
  for (const auto& version : fs::directory_iterator("/usr/lib/postgresql", none)) {
    if (fs::exists(version.path() / "bin/initdb")) versions.push_back(version.path() / "bin");
  }
  return versions.empty() ? fs::path() : *std::max_element(versions.begin(), versions.end());
}

/// Returns a free port.
int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ::bind(socket, reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(socket);
  return ntohs(address.sin_port);
}

}  // namespace

bool PostgresServer::installed() { return !programs().empty(); }

int PostgresServer::as_owner(const std::string& command) const {
  const std::string user = ::geteuid() == 0 ? "setpriv --reuid=postgres --regid=postgres "
                                              "--clear-groups "
                                            : "";
  return std::system(("cd / && " + user + programs().string() + "/" + command + " >>'" +
                      folder_.string() + "/log' 2>&1")
                         .c_str());
}

PostgresServer::PostgresServer(const std::string& password, Tls tls) : tls_(tls) {
  std::string folder = (fs::temp_directory_path() / "vlp-postgres-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) return;
  folder_ = folder;
  if (::geteuid() == 0 && std::system(("chown postgres '" + folder + "'").c_str()) != 0) return;
  const std::string data = "-D '" + folder + "/data' ";
  std::string auth = "--auth=trust ";
  if (!password.empty()) {
    std::ofstream(folder_ / "password") << password << "\n";
    auth = "--auth-local=trust --auth-host=scram-sha-256 --pwfile='" + folder + "/password' ";
    port_ = free_port();
  }
  if (as_owner("initdb " + data + auth + "--username=vlp --no-sync --encoding=UTF8") != 0) return;
  if (tls == Tls::required && !make_certificate()) return;
  start();
  if (as_owner("pg_ctl " + data + "status") != 0) return;
  uri_ = "postgresql://vlp@/postgres?host=" + folder;
  if (port_ != 0) uri_ += "&port=" + std::to_string(port_);
}

bool PostgresServer::make_certificate() const {
  const std::string folder = folder_.string(), key = folder + "/server.key",
                    made = certificate().string();
  const std::string commands =
      "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext "
      "subjectAltName=DNS:localhost -keyout '" +
      key + "' -out '" + made + "' 2>>'" + folder + "/log' && chmod 600 '" + key + "' && " +
      (::geteuid() == 0 ? "chown postgres '" + key + "' '" + made + "' && " : "") +
      "sed -i 's/^host /hostssl /' '" + folder + "/data/pg_hba.conf'";
  return std::system(commands.c_str()) == 0;
}

std::string PostgresServer::log() const {
  std::ifstream file(folder_ / "log");
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string PostgresServer::plain_uri() const {
  std::string host;
  for (const char c : folder_.string()) host += c == '/' ? std::string("%2F") : std::string(1, c);
  return "postgresql://vlp@" + host + "/postgres";
}

void PostgresServer::stop() const {
  as_owner("pg_ctl -D '" + folder_.string() + "/data' -m immediate stop");
}

void PostgresServer::start() const {
  as_owner("pg_ctl -D '" + folder_.string() + "/data' -w -o \"-c listen_addresses=" +
           (port_ == 0 ? "" : "127.0.0.1 -p " + std::to_string(port_)) +
           (tls_ == Tls::none ? ""
                              : " -c ssl=on -c ssl_cert_file=" + certificate().string() +
                                    " -c ssl_key_file=" + (folder_ / "server.key").string()) +
           " -c fsync=off -k " + folder_.string() + "\" start");
}

void PostgresServer::signal(int number) const {
  long postmaster = 0;
  std::ifstream(folder_ / "data/postmaster.pid") >> postmaster;
  if (postmaster <= 1) return;
  const std::string process = "/proc/" + std::to_string(postmaster);
  std::ifstream children(process + "/task/" + std::to_string(postmaster) + "/children");
  ::kill(static_cast<pid_t>(postmaster), number);
  for (long child = 0; children >> child;) ::kill(static_cast<pid_t>(child), number);
}

void PostgresServer::freeze() const { signal(SIGSTOP); }
void PostgresServer::thaw() const { signal(SIGCONT); }

PostgresServer::~PostgresServer() {
  if (!uri_.empty()) {
    thaw();
    stop();
  }
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace vlp
