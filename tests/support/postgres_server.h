// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace vlp {

/// A PostgreSQL server for a test, of the newest version installed from Debian's packages. Runs as
/// user postgres if the test runs as root. It listens only to a socket in its own folder.
class PostgresServer {
 public:
  enum class Tls { none, required };
  /// With a password the server also listens to a port of 127.0.0.1, where user vlp needs the
  /// password. `tls` selects connections without TLS, or only with TLS, by the server's own
  /// certificate for localhost.
  explicit PostgresServer(const std::string& password = "", Tls tls = Tls::none);
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  static bool installed();
  /// Returns postgresql://...; empty if the server did not start.
  const std::string& uri() const { return uri_; }
  /// Returns the same without a parameter, with the socket's folder as the host.
  std::string plain_uri() const;

  /// Returns 127.0.0.1:PORT, if the server listens there.
  std::string address() const { return "127.0.0.1:" + port(); }
  std::string port() const { return std::to_string(port_); }
  /// Returns the file of the server's certificate.
  std::filesystem::path certificate() const { return folder_ / "server.crt"; }
  /// Returns the server's log.
  std::string log() const;

  /// Stops the server immediately, as a power failure, and starts it again.
  void stop() const;
  void start() const;
  /// Suspends the server's processes (SIGSTOP), or resumes them.
  void freeze() const;
  void thaw() const;

 private:
  bool make_certificate() const;
  int as_owner(const std::string& command) const;
  void signal(int number) const;

  std::filesystem::path folder_;
  std::string uri_;
  int port_ = 0;
  Tls tls_ = Tls::none;
};

}  // namespace vlp
