// A peer of another DDS (Cyclone) with the receive buffers of a stock Linux, and flights beside it.
#pragma once

#include <dds/dds.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "messages.h"
#include "pointflight/ros/common/description.hpp"
#include "services.h"
#include "tests/integration/program.hpp"
#include "tests/paths.hpp"

namespace pointflight::testing {

using Clock = std::chrono::steady_clock;

/// Waits until `condition` holds.
template <class Condition>
bool eventually(const Condition& condition, double seconds = 20.0) {
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (Clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

/// A participant of Cyclone DDS on this machine.
class Peer {
 public:
  /// `as_is`: with the defaults of its own, multicast among them.
  explicit Peer(bool as_is = false) {
    if (as_is) {
      unsetenv("CYCLONEDDS_URI");
    } else {
      setenv("CYCLONEDDS_URI", kConfiguration, 1);
    }
    participant_ = dds_create_participant(domain(), nullptr, nullptr);
    EXPECT_GT(participant_, 0) << dds_strretcode(-participant_);
  }
  ~Peer() { dds_delete(participant_); }

  /// One for each process of the tests on this machine, so that runs do not meet: held by a lock.
  static std::uint32_t domain() {
    static const std::uint32_t domain = [] {
      constexpr std::uint32_t kFirst = 20;
      constexpr std::uint32_t kCount = 80;
      const auto start = static_cast<std::uint32_t>(getpid());
      for (std::uint32_t i = 0; i < kCount; ++i) {
        const std::uint32_t number = kFirst + (start + i) % kCount;
        const std::string path = "/tmp/pointflight_domain_" + std::to_string(number);
        const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return number;  // to our end
        if (file >= 0) close(file);
      }
      return kFirst + start % kCount;
    }();
    return domain;
  }

  [[nodiscard]] dds_entity_t participant() const { return participant_; }

  dds_entity_t topic(const std::string& name, const dds_topic_descriptor_t& type) {
    const dds_entity_t topic =
        dds_create_topic(participant_, &type, name.c_str(), nullptr, nullptr);
    EXPECT_GT(topic, 0) << name << " " << dds_strretcode(-topic);
    return topic;
  }

 private:
  static constexpr const char* kConfiguration =
      "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
      "<AllowMulticast>false</AllowMulticast></General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>"
      "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
      "<Internal><SocketReceiveBufferSize max='212992 B'/></Internal>";
  dds_entity_t participant_ = 0;
};

/// True if this machine is on a network whose nodes can be asked all at once.
inline bool has_multicast() {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return false;
  bool found = false;
  for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
    const bool up = (i->ifa_flags & IFF_UP) != 0 && (i->ifa_flags & IFF_RUNNING) != 0;
    const bool outside = (i->ifa_flags & IFF_LOOPBACK) == 0;
    const bool v4 = i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET;
    found = found || (up && outside && v4 && (i->ifa_flags & IFF_MULTICAST) != 0);
  }
  freeifaddrs(all);
  return found;
}

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};

inline std::unique_ptr<dds_qos_t, QosDeleter> qos_of(bool reliable, bool latched, int depth = 200) {
  std::unique_ptr<dds_qos_t, QosDeleter> qos(dds_create_qos());
  dds_qset_reliability(
      qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_SECS(1));
  dds_qset_durability(qos.get(),
                      latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

/// Reads a topic; T as idlc made it.
template <class T>
class Reader {
 public:
  Reader(Peer& peer,
         const std::string& name,
         const dds_topic_descriptor_t& type,
         bool reliable,
         bool latched = false) {
    const auto qos = qos_of(reliable, latched);
    reader_ = dds_create_reader(peer.participant(), peer.topic(name, type), qos.get(), nullptr);
    EXPECT_GT(reader_, 0) << dds_strretcode(-reader_);
  }
  ~Reader() { dds_delete(reader_); }
  Reader(const Reader&) = delete;

  /// Takes what has come; calls `visit` for each.
  template <class Visit>
  int take(const Visit& visit) {
    int count = 0;
    for (;;) {
      void* samples[16] = {};
      dds_sample_info_t infos[16];
      const int n = dds_take(reader_, samples, infos, 16, 16);
      if (n <= 0) return count;
      for (int i = 0; i < n; ++i) {
        if (!infos[i].valid_data) continue;
        ++count;
        visit(*static_cast<T*>(samples[i]));
      }
      dds_return_loan(reader_, samples, n);
    }
  }

 private:
  dds_entity_t reader_ = 0;
};

/// Writes a topic.
template <class T>
class Writer {
 public:
  Writer(Peer& peer, const std::string& name, const dds_topic_descriptor_t& type, bool reliable) {
    const auto qos = qos_of(reliable, false, 10);
    writer_ = dds_create_writer(peer.participant(), peer.topic(name, type), qos.get(), nullptr);
    EXPECT_GT(writer_, 0);
  }
  ~Writer() { dds_delete(writer_); }
  Writer(const Writer&) = delete;

  [[nodiscard]] bool matched() const {
    dds_publication_matched_status_t status;
    return dds_get_publication_matched_status(writer_, &status) == 0 && status.current_count > 0;
  }
  void write(const T& message) { EXPECT_EQ(dds_write(writer_, &message), 0); }
  /// Whether somebody takes it or not.
  void try_write(const T& message) { dds_write(writer_, &message); }

 private:
  dds_entity_t writer_ = 0;
};

/// `pointflight fly ...` until it goes out of scope.
class Flight {
 public:
  Flight(const std::vector<std::string>& arguments, const std::string& log) : log_(log) {
    const std::string domain = std::to_string(Peer::domain());
    process_ = fork();
    if (process_ == 0) {
      setenv("ROS_DOMAIN_ID", domain.c_str(), 1);
      unsetenv("ROS_DISTRO");
      unsetenv("CYCLONEDDS_URI");  // is the peer's
      const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      dup2(out, 1);
      dup2(out, 2);
      std::vector<char*> argv = {const_cast<char*>(testing::kProgram), const_cast<char*>("fly")};
      for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
      argv.push_back(nullptr);
      execv(testing::kProgram, argv.data());
      _exit(127);
    }
  }
  ~Flight() { stop(); }

  /// Waits until it ends by itself; seconds of a processor that it took.
  double wait() {
    int status = 0;
    struct rusage usage {};
    wait4(process_, &status, 0, &usage);
    process_ = 0;
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }

  /// Ends it; what it said.
  std::string stop() {
    if (process_ > 0) {
      kill(process_, SIGINT);
      int status = 0;
      waitpid(process_, &status, 0);
      process_ = 0;
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
    return read_file(log_);
  }

  /// Once it was stopped; of a signal its negative number.
  [[nodiscard]] int exit_code() const { return exit_code_; }

 private:
  pid_t process_ = 0;
  int exit_code_ = -1;
  std::string log_;
};

}  // namespace pointflight::testing
