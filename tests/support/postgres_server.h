// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace vlp {

/// A PostgreSQL server of a test's own, of the newest version that Debian's packages have
/// installed, as user postgres when the test runs as root; it listens to a socket in its own folder
/// only.
class PostgresServer {
 public:
  enum class Tls { none, required };
  /// With a password it also listens to a port of 127.0.0.1, where user vlp needs it, without TLS,
  /// or with nothing else, by a certificate of its own for localhost.
  explicit PostgresServer(const std::string& password = "", Tls tls = Tls::none);
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  static bool installed();
  /// postgresql://...; empty when it did not start.
  const std::string& uri() const { return uri_; }
  /// The same without a parameter: the socket's folder stands for the host.
  std::string plain_uri() const;

  /// 127.0.0.1:PORT, if it listens there.
  std::string address() const { return "127.0.0.1:" + port(); }
  std::string port() const { return std::to_string(port_); }
  /// That by which it shows who it is.
  std::filesystem::path certificate() const { return folder_ / "server.crt"; }
  /// What it has said.
  std::string log() const;

  /// At once, as by a power cut; and again.
  void stop() const;
  void start() const;
  /// Its processes stand still (SIGSTOP), or go on.
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
