// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/database_name.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// Defaults of libpq for missing parts of a connection string.
struct DeriveIdentity : testing::Test {
  DeriveIdentity() {
    for (const char* name : {"PGHOST", "PGHOSTADDR", "PGPORT", "PGDATABASE", "PGSERVICE"}) {
      ::unsetenv(name);
    }
    ::setenv("PGUSER", "operator", 1);
    std::array<char, 256> name{};
    EXPECT_EQ(::gethostname(name.data(), name.size() - 1), 0);
    here = std::string(name.data()) + ":";
  }
  ~DeriveIdentity() override { ::unsetenv("PGUSER"); }
  std::string here;
};

TEST(ContainsPassword, FindsEachSecretOfLibpqAndEncodedOnes) {
  for (const char* where :
       {"postgresql://u:secret@db/vlp", "postgresql://u:%73ecret@db/vlp",
        "postgresql://u%3Asecret@db/vlp", "postgresql://u@db/vlp?password=secret",
        "postgresql://u@db/vlp?p%61ssword=secret", "postgresql://u@db/vlp?sslpassword=secret",
        "postgresql://u@db/vlp?options=-c%20password%3Dsecret",
        "dbname=postgresql://u:secret@db/vlp"}) {
    EXPECT_TRUE(contains_password(where)) << where;
  }
  for (const char* where : {"postgresql://u@db/vlp", "postgresql://db:5433/vlp?sslmode=require",
                            "postgresql:///vlp?passfile=/etc/vlp/pass", "records.db"}) {
    EXPECT_FALSE(contains_password(where)) << where;
  }
}

TEST_F(DeriveIdentity, IsMachineAndNormalizedPathForFile) {
  EXPECT_EQ(derive_identity("/var/lib/vlp/records.db"), here + "/var/lib/vlp/records.db");
  EXPECT_EQ(derive_identity("/var/lib/../lib/records.db"), here + "/var/lib/records.db");
}

TEST_F(DeriveIdentity, DiffersForDifferentServersAndDatabasesOnly) {
  const auto of = [](const std::string& where) { return derive_identity(where); };
  EXPECT_EQ(of("postgresql://u@db/vlp"), "postgresql://db/vlp");
  EXPECT_EQ(of("postgres://other:secret@db:5432/vlp?connect_timeout=2"), of("postgresql://db/vlp"));
  EXPECT_NE(of("postgresql://db:5433/vlp"), of("postgresql://db/vlp"));
  EXPECT_NE(of("postgresql:///vlp?hostaddr=10.0.0.1"), of("postgresql:///vlp?hostaddr=10.0.0.2"));
  EXPECT_NE(of("postgresql:///vlp?service=a"), of("postgresql:///vlp?service=b"));
  // Without a name the database is that of the user.
  EXPECT_EQ(of("postgresql://a@db"), "postgresql://db/a");
  EXPECT_NE(of("postgresql://a@db"), of("postgresql://b@db"));
  EXPECT_EQ(of("postgresql://db"), "postgresql://db/operator");
  ::setenv("PGDATABASE", "vlp", 1);
  EXPECT_EQ(of("postgresql://db"), of("postgresql://db/vlp"));
}

/// Two machines that share a folder, each with its own server.
TEST_F(DeriveIdentity, IncludesMachineForLocalServer) {
  for (const char* where :
       {"postgresql:///vlp", "postgresql://localhost/vlp", "postgresql://127.0.0.1:5544/vlp",
        "postgresql:///vlp?host=/run/postgresql", "postgresql://db/vlp?hostaddr=127.0.0.1"}) {
    EXPECT_THAT(derive_identity(where), StartsWith(here + "postgresql://")) << where;
  }
  EXPECT_THAT(derive_identity("postgresql:///vlp?hostaddr=10.0.0.1"), Not(StartsWith(here)));
}

TEST_F(DeriveIdentity, ContainsNoPassword) {
  for (const char* where : {"postgresql://u:secret@db", "postgresql://u@db/vlp?password=secret"}) {
    EXPECT_THAT(derive_identity(where), Not(HasSubstr("secret")));
  }
  EXPECT_THAT(rejection_message([] { derive_identity("postgresql://u:a@secret@/db"); }),
              testing::AllOf(HasSubstr("is not of the form"), Not(HasSubstr("secret"))));
}

}  // namespace
}  // namespace vlp
