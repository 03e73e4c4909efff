// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tests of the spool with killed programs, and with records that are locked, full, offline or
/// shared by many stations.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <set>
#include <sstream>
#include <thread>

#include "numbered_runs.h"
#include "station/records/spool.h"
#include "support/child_process.h"
#include "support/postgres_server.h"
#include "support/random.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

TEST(Spool, DeliverWaitingReturnsWithin15SecondsForLockedDatabase) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  { const Records made(where); }
  const auto locked = folder / "locked", done = folder / "done";
  const auto client = folder.file("lock.py",
                                  "import os, sqlite3, sys, time\n"
                                  "database = sqlite3.connect(sys.argv[1], isolation_level=None)\n"
                                  "database.execute('BEGIN EXCLUSIVE')\n"
                                  "open(sys.argv[2], 'w')\n"
                                  "for i in range(600):\n"
                                  "    if os.path.exists(sys.argv[3]): break\n"
                                  "    time.sleep(0.05)\n");
  const std::string command =
      "python3 " + client.string() + " " + where + " " + locked.string() + " " + done.string();
  std::thread other([&] { EXPECT_EQ(std::system(command.c_str()), 0); });
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!fs::exists(locked) && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(fs::exists(locked));
  Spool spool(folder / "spool", where);
  spool.store_run(numbered_run(1));
  EXPECT_LT(measure_seconds([&] { spool.deliver_waiting(); }), 15);
  EXPECT_THAT(spool.describe_state(),
              AllOf(StartsWith("runs are queued in the spool, 1 waiting"), HasSubstr("locked")));
  folder.file("done", "");
  other.join();
  Spool(folder / "spool", where).deliver_waiting();
  EXPECT_THAT(whole_runs(where), SizeIs(1));
}

/// Unmounts the disk in any case.
struct SmallDisk {
  fs::path folder;
  ~SmallDisk() { ::umount2(folder.c_str(), MNT_DETACH); }
};

TEST(Spool, LosesNoRunWhenDiskOfRecordsIsFull) {
  const TemporaryFolder folder;
  const auto small = folder / "small";
  fs::create_directory(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=128k") != 0) {
    GTEST_SKIP() << "no small file system can be mounted here";
  }
  const SmallDisk disk{small};
  const std::string where = (small / "records.db").string();
  {
    Spool spool(folder / "spool", where);
    spool.check_can_store();
    for (int i = 0; i < 40; ++i) spool.store_run(numbered_run(i));
    spool.deliver_waiting();
    const std::size_t num_stored = whole_runs(where).size();
    EXPECT_LT(num_stored, 40u);
    EXPECT_THAT(spool.list_waiting_runs(), SizeIs(40 - num_stored));
    EXPECT_THAT(spool.describe_state(), HasSubstr("full"));
    // Full records are readable.
    EXPECT_EQ(spool.find_other_user("digest-0-1", "b"),
              (ImageUser{"camera-0", numbered_run(0).run}));
  }
  ASSERT_EQ(::mount("none", small.c_str(), "tmpfs", MS_REMOUNT, "size=8m"), 0);
  Spool(folder / "spool", where).deliver_waiting();
  EXPECT_THAT(whole_runs(where), SizeIs(40));
}

TEST(Spool, LosesNoRunWhenDiskOfSpoolIsFull) {
  const TemporaryFolder folder;
  const auto small = folder / "small";
  fs::create_directory(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=512k") != 0) {
    GTEST_SKIP() << "no small file system can be mounted here";
  }
  const SmallDisk disk{small};
  const std::string where = (folder / "records.db").string();
  Spool offline(small, where);
  std::size_t num_waiting = 0;
  std::string refused;
  for (; refused.empty() && num_waiting < 1000; ++num_waiting) {
    refused = rejection_message([&] { offline.store_run(numbered_run(int(num_waiting))); });
  }
  --num_waiting;  // without the refused run
  EXPECT_THAT(refused, AllOf(HasSubstr("can be stored neither in the spool"), HasSubstr("full")));
  ASSERT_GT(num_waiting, 0u);
  EXPECT_THAT(offline.list_waiting_runs(), SizeIs(num_waiting));
  EXPECT_NE(rejection_message([&] { offline.check_can_store(); }), "");
  // The records take the next run. Those that wait are delivered, too, but not removed.
  { const Records made(where); }
  Spool full(small, where);
  full.store_run(numbered_run(1000));
  EXPECT_EQ(whole_runs(where), std::set<std::string>{numbered_run(1000).run});
  full.deliver_waiting();
  EXPECT_THAT(whole_runs(where), SizeIs(num_waiting + 1));
  ASSERT_EQ(::mount("none", small.c_str(), "tmpfs", MS_REMOUNT, "size=8m"), 0);
  full.check_can_store();
  EXPECT_EQ(full.describe_state(), "");
  EXPECT_THAT(whole_runs(where), SizeIs(num_waiting + 1));
}

/// Kills a program that stores runs, VLP_STATION_KILLS times at random moments. The longest wait
/// doubles while no run is stored: the first one takes long on a busy machine.
void kill_while_keeping(const TemporaryFolder& folder, const std::string& where, int kills) {
  const auto log = folder / "kept";
  if (const char* text = std::getenv("VLP_STATION_KILLS")) kills = std::atoi(text);
  Random random(7);
  double max_wait_s = 0.25;
  for (int i = 0; i < kills; ++i) {
    const pid_t child = start_child([&] {
      Spool spool(folder / "spool", where);
      spool.check_can_store();
      const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
      for (int run = 1000 * i; run < 1000 * i + 1000; ++run) {
        spool.store_run(numbered_run(run));
        const std::string line = numbered_run(run).run + "\n";  // reported as kept
        if (::write(file, line.data(), line.size()) < 0) std::abort();
        spool.deliver_waiting();
      }
    });
    const int wait_us = static_cast<int>(1e6 * random.uniform(0, max_wait_s));
    std::this_thread::sleep_for(std::chrono::microseconds(wait_us));
    kill_child(child);
    if (!fs::exists(log) || fs::is_empty(log)) max_wait_s *= 2;
  }
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  EXPECT_EQ(spool.describe_state(), "");
  const auto runs = whole_runs(where);
  std::istringstream kept(TemporaryFolder::read_content(log));
  int count = 0;
  for (std::string run; std::getline(kept, run); ++count) EXPECT_TRUE(runs.contains(run)) << run;
  EXPECT_GT(count, 0);
  // Runs whose program was killed between storing and reporting can exist, too.
  EXPECT_LE(runs.size(), static_cast<std::size_t>(count + kills));
}

TEST(Spool, LosesNoRunWhenKilledRepeatedly) {
  const TemporaryFolder folder;
  kill_while_keeping(folder, (folder / "records.db").string(), 15);
}

/// A server that refuses access is not offline: somebody has to correct it; runs are kept.
TEST(Spool, StateDistinguishesServerRefusalFromUnreachableServer) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const TemporaryFolder folder;
  const PostgresServer server("right");
  ASSERT_NE(server.uri(), "");
  const auto state_with = [&](const std::string& password, const std::string& database, int run) {
    Spool spool(folder / "spool",
                "postgresql://vlp:" + password + "@" + server.address() + "/" + database);
    spool.check_can_store();
    spool.store_run(numbered_run(run));
    spool.deliver_waiting();
    return spool.describe_state();
  };
  const std::string refuses =
      "the server of the records answers, but refuses 'records' of station.yaml: ";
  const std::string wrong_password = state_with("wrong", "postgres", 1);
  EXPECT_THAT(wrong_password,
              AllOf(StartsWith("runs are queued in the spool, 1 waiting: "), HasSubstr(refuses),
                    HasSubstr("password authentication failed for user \"vlp\""),
                    Not(HasSubstr("wrong")), Not(HasSubstr("\n"))));
  EXPECT_THAT(state_with("right", "nowhere", 2),
              AllOf(StartsWith("runs are queued in the spool, 1 waiting: "), HasSubstr(refuses),
                    HasSubstr("database \"nowhere\" does not exist")));
  EXPECT_THAT(state_with("right", "postgres?sslmode=require", 3),
              AllOf(StartsWith("runs are queued in the spool, 2 waiting: "), HasSubstr(refuses),
                    HasSubstr("server does not support SSL, but SSL was required")));
  // Waiting runs are delivered with the right password.
  EXPECT_THAT(state_with("right", "postgres", 4), StartsWith("1 queued for another database"));
  EXPECT_THAT(whole_runs(server.uri()), SizeIs(3));
  server.stop();
  EXPECT_THAT(state_with("right", "postgres", 5),
              AllOf(StartsWith("runs are queued in the spool, 1 waiting: "),
                    HasSubstr("cannot be reached")));
}

/// Operators need not understand SQL.
TEST(Spool, MessagesForOperatorContainNoSql) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const TemporaryFolder folder;
  const PostgresServer server("right");
  ASSERT_NE(server.uri(), "");
  { const Records made(server.uri()); }
  const std::string set_up =
      "psql -X -q '" + server.uri() + "' -c \"CREATE ROLE guest LOGIN PASSWORD 'guest'\"";
  ASSERT_EQ(std::system(set_up.c_str()), 0);
  const auto open_spool = [&](const std::string& user, const std::string& name) {
    return Spool(folder / name,
                 "postgresql://" + user + "@" + server.address() + "/postgres?connect_timeout=2");
  };
  // Its user has no right to the tables.
  Spool guest = open_spool("guest:guest", "guest");
  guest.check_can_store();
  EXPECT_EQ(guest.make_operator_notice(),
            "records are offline (access refused); runs are kept, delivered automatically");
  guest.store_run(numbered_run(1));
  guest.deliver_waiting();
  EXPECT_EQ(guest.make_operator_notice(),
            "records are offline (access refused); 1 run kept, delivered automatically");
  EXPECT_THAT(guest.describe_state(),
              AllOf(HasSubstr("permission denied"), Not(HasSubstr("SELECT")),
                    Not(HasSubstr("UPDATE")), Not(HasSubstr("while"))));
  server.stop();
  Spool offline = open_spool("vlp:right", "offline");
  offline.check_can_store();
  for (int run = 1; run <= 2; ++run) offline.store_run(numbered_run(run));
  EXPECT_EQ(offline.make_operator_notice(),
            "records are offline; 2 runs kept, delivered automatically");
  EXPECT_THAT(offline.describe_state(), HasSubstr("cannot be reached"));
}

/// Server that accepts only TLS, with its own certificate.
TEST(Spool, DeliversToTlsServerUnlessTlsIsOffOrCertificateCheckFails) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const TemporaryFolder folder;
  const PostgresServer server("right", PostgresServer::Tls::required);
  ASSERT_NE(server.uri(), "");
  int run = 0;
  const auto state_with = [&](const std::string& options) {
    Spool spool(folder / "spool",
                "postgresql://vlp:right@localhost:" + server.port() + "/postgres?" + options);
    spool.check_can_store();
    spool.store_run(numbered_run(++run));
    spool.deliver_waiting();
    return spool.describe_state();
  };
  EXPECT_EQ(state_with("sslmode=require"), "");
  EXPECT_EQ(state_with("sslmode=verify-full&sslrootcert=" + server.certificate().string()), "");
  EXPECT_THAT(whole_runs(server.uri()), SizeIs(2));
  const std::string refuses = "answers, but refuses 'records' of station.yaml: ";
  EXPECT_THAT(state_with("sslmode=disable"),
              AllOf(StartsWith("runs are queued in the spool, 1 waiting: "), HasSubstr(refuses),
                    HasSubstr("no encryption")));
  // Certificate of another server.
  const PostgresServer other("right", PostgresServer::Tls::required);
  ASSERT_NE(other.uri(), "");
  EXPECT_THAT(state_with("sslmode=verify-full&sslrootcert=" + other.certificate().string()),
              AllOf(StartsWith("runs are queued in the spool, 2 waiting: "), HasSubstr(refuses),
                    HasSubstr("certificate verify failed")));
  EXPECT_EQ(state_with("sslmode=require"), "");
  EXPECT_THAT(whole_runs(server.uri()), SizeIs(5));
}

/// Concurrent stations, each with its own spool. The number of runs is VLP_STATION_RUNS, each with
/// a hook.
TEST(Spool, DeliversAllRunsOfEightStationsToOneServer) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  constexpr int stations = 8;
  int each = 5;
  if (const char* text = std::getenv("VLP_STATION_RUNS")) {
    each = (std::atoi(text) + stations - 1) / stations;
  }
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  const TemporaryFolder folder;
  const auto open_spool = [&](int station) {
    return Spool(folder / ("spool-" + std::to_string(station)), server.uri());
  };
  std::vector<pid_t> children;
  for (int station = 0; station < stations; ++station) {
    children.push_back(start_child([&, station] {
      Spool spool = open_spool(station);
      spool.check_can_store();  // one of them makes the tables
      for (int i = 0; i < each; ++i) {
        RunRecord run = numbered_run(1000 * station + i);
        run.station = "station-" + std::to_string(station);
        run.events = {make_run_event_now(kHookRequested, "label")};
        spool.store_run(run);
        spool.deliver_waiting();
        run.events.push_back(make_run_event_now(kHookDone, ""));
        spool.store_run(run);
        spool.deliver_waiting();
      }
    }));
  }
  EXPECT_TRUE(end_well(children));
  for (int station = 0; station < stations; ++station) {
    // No station waited longer than allowed, unless this machine is busy.
    Spool spool = open_spool(station);
    std::cout << "station-" << station << ": " << spool.list_waiting_runs().size() << " waited\n";
    spool.deliver_waiting();
    EXPECT_EQ(spool.describe_state(), "");
  }
  EXPECT_THAT(Records(server.uri()).list_run_summaries({.has_open_hook = true}), IsEmpty());
  const auto count = static_cast<std::size_t>(stations * each);
  EXPECT_THAT(whole_runs(server.uri()), SizeIs(count));
  const TrailCheck trail = Records(server.uri()).check_trail("");
  EXPECT_THAT(trail.problems, IsEmpty());
  EXPECT_EQ(trail.entries, 3 * count) << "of each run and its two events, once";
  EXPECT_THAT(server.log(), Not(HasSubstr("deadlock")));
}

TEST(Spool, DeliversAllRunsAfterServerStoppedDuringDelivery) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  const TemporaryFolder folder;
  const std::string where = server.uri() + "&connect_timeout=2";
  const auto spool = [&] { return Spool(folder / "spool", where); };
  kill_while_keeping(folder, where, 5);
  const std::size_t before = whole_runs(where).size();
  const auto deliver_to = [&](std::size_t count) {
    Spool(spool()).deliver_waiting();
    EXPECT_THAT(whole_runs(where), SizeIs(before + count));
  };

  // Stopped before the record; new units begin.
  Spool running = spool();
  running.check_can_store();
  server.stop();
  running.store_run(numbered_run(-1));
  running.deliver_waiting();
  EXPECT_THAT(running.describe_state(),
              AllOf(StartsWith("runs are queued in the spool, 1 waiting: "),
                    HasSubstr("server of the records cannot be reached")));
  Spool begun = spool();
  begun.check_can_store();
  begun.store_run(numbered_run(-2));
  begun.deliver_waiting();
  EXPECT_THAT(begun.describe_state(), StartsWith("runs are queued in the spool, 2 waiting: "));
  server.start();
  deliver_to(2);

  // Frozen, with and without a connection: programs wait once, and report it.
  Spool connected = spool();
  connected.check_can_store();
  EXPECT_EQ(connected.describe_state(), "");
  server.freeze();
  EXPECT_LT(measure_seconds(
                [&] { EXPECT_EQ(connected.find_other_user("digest-1-1", "b"), std::nullopt); }),
            8);
  connected.store_run(numbered_run(-3));
  EXPECT_LT(measure_seconds([&] { connected.deliver_waiting(); }), 1);
  EXPECT_FALSE(connected.find_run_by_id("another"));
  EXPECT_THAT(connected.offline_reason(), HasSubstr("has not answered for 2 s"));
  EXPECT_THAT(connected.describe_state(),
              AllOf(StartsWith("runs are queued in the spool, 1 waiting: "),
                    HasSubstr("has not answered for 2 s")));
  Spool fresh = spool();
  EXPECT_LT(measure_seconds([&] { fresh.check_can_store(); }), 8);
  EXPECT_THAT(fresh.describe_state(), StartsWith("runs are queued in the spool, 1 waiting: "));
  server.thaw();
  deliver_to(3);
  // Once, even if several programs wait.
  Spool several = spool();
  several.check_can_store();
  server.freeze();
  for (int i = 4; i < 10; ++i) several.store_run(numbered_run(-i));
  EXPECT_LT(measure_seconds([&] { several.deliver_waiting(); }), 5);
  EXPECT_THAT(several.describe_state(),
              AllOf(StartsWith("runs are queued in the spool, 6 waiting: "),
                    HasSubstr("has not answered for 2 s")));
  server.thaw();
  deliver_to(9);

  // Killed in the middle of many.
  for (int i = 0; i < 200; ++i) fresh.store_run(numbered_run(1'000'000 + i));
  std::thread power([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    server.stop();
  });
  Spool(spool()).deliver_waiting();
  power.join();
  const std::size_t waiting = fresh.list_waiting_runs().size();
  server.start();
  EXPECT_GT(waiting, 0u) << "the server was stopped too late for this machine";
  for (int i = 0; i < 5 && !fresh.list_waiting_runs().empty(); ++i)
    Spool(spool()).deliver_waiting();
  EXPECT_THAT(whole_runs(where), SizeIs(before + 209));
}

}  // namespace
}  // namespace vlp
