#include "pointflight/share/dds/share_transport.hpp"

#include <dds/dds.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <thread>
#include <utility>

#include "pointflight/ros/ros2/dds_log.hpp"
#include "pointflight/ros/ros2/discovery.hpp"
#include "pointflight/ros/ros2/raw_type.hpp"

namespace pointflight {
namespace {

constexpr const char* kNames[kShareChannels] = {"crew", "states", "clock", "past"};
constexpr const char* kTypes[kShareChannels] = {"pointflight_share::msg::dds_::Introduction_",
                                                "pointflight_share::msg::dds_::States_",
                                                "pointflight_share::msg::dds_::Clock_",
                                                "pointflight_share::msg::dds_::Past_"};
constexpr std::int32_t kStepsKept = 64;        // of a writer, in lockstep
constexpr std::int32_t kArrivalsKept = 256;    // in a reader, until the listener has read them
constexpr std::size_t kInboxMost = 20000;      // what the run has not taken yet: it stands still
constexpr std::size_t kMessageMost = 4 << 20;  // bytes; nobody says more

std::int64_t steady_now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::optional<std::string> environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

std::uint32_t domain_for(const DiscoverySettings& discovery) {
  const std::string own = environment("POINTFLIGHT_DOMAIN_ID").value_or("");
  if (own.empty()) return (discovery.domain + 50) % 100;
  char* end = nullptr;
  const unsigned long number = std::strtoul(own.c_str(), &end, 10);
  if (*end != '\0' || number > 232) {
    throw std::runtime_error("POINTFLIGHT_DOMAIN_ID: '" + own + "'; a number from 0 to 232");
  }
  return static_cast<std::uint32_t>(number);
}

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

/// Liveliness is the participant's: a process that is stopped or cut off is lost after the lease.
Qos qos_for(ShareChannel channel, const ShareTransportOptions& options) {
  Qos qos(dds_create_qos());
  const bool is_crew = channel == ShareChannel::kMembers;
  const bool all = is_crew || channel == ShareChannel::kPast ||
                   (channel == ShareChannel::kStates && options.lockstep);
  dds_qset_reliability(
      qos.get(), all ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(100));
  dds_qset_durability(qos.get(),
                      is_crew ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (is_crew) {
    dds_qset_durability_service(qos.get(),
                                0,
                                DDS_HISTORY_KEEP_LAST,
                                1,
                                DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  }
  const auto lease = static_cast<dds_duration_t>(options.lease * 1e9);
  if (is_crew) dds_qset_liveliness(qos.get(), DDS_LIVELINESS_AUTOMATIC, lease);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

/// A domain and all that is in it.
struct Domain {
  Domain() = default;
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;
  ~Domain() {
    if (entity > 0) dds_delete(entity);
  }
  dds_entity_t entity = 0;
};

class DdsShareTransport : public ShareTransport {
 public:
  explicit DdsShareTransport(const ShareTransportOptions& options)
      : log_("--share " + options.name, options.log),
        beat_period_(std::chrono::nanoseconds(std::llround(1e9 * options.beat))) {
    DiscoverySettings discovery = discovery_from(environment);
    if (options.localhost_only) discovery.range = DiscoverySettings::Range::kLocalhost;
    discovery.domain = domain_for(discovery);
    const std::string user = environment("CYCLONEDDS_URI").value_or("");
    domain_.entity = dds_create_domain(discovery.domain, configuration(discovery, user).c_str());
    if (domain_.entity < 0) refuse(domain_.entity, discovery.domain);
    participant_ = dds_create_participant(discovery.domain, nullptr, nullptr);
    if (participant_ < 0) refuse(participant_, discovery.domain);
    for (std::size_t i = 0; i < kShareChannels; ++i) add_channel(i, options);
  }

  DdsShareTransport(const DdsShareTransport&) = delete;
  DdsShareTransport& operator=(const DdsShareTransport&) = delete;

  void send(ShareChannel channel, const Bytes& bytes) override {
    const End& end = ends_[static_cast<std::size_t>(channel)];
    if (write_raw(end.writer, end.type, bytes)) bytes_sent_ += bytes->size();
  }

  void repeat(const Bytes& bytes) override {
    const std::lock_guard lock(beat_mutex_);
    beat_ = bytes;
    if (bytes && !beats_.joinable()) {
      beats_ = std::jthread([this](const std::stop_token& stop) { send_beats(stop); });
    }
  }

  std::vector<ShareArrival> take() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(inbox_, {});
  }

  void wait(std::int64_t at_most) override {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(lock, std::chrono::nanoseconds(at_most), [this] { return !inbox_.empty(); });
  }

  void ignore(std::uint64_t writer) override {
    const std::lock_guard lock(names_mutex_);
    ignored_.insert(writer);
  }

  std::uint64_t bytes_sent() const override { return bytes_sent_; }

 private:
  struct End {
    DdsShareTransport* transport = nullptr;
    ShareChannel channel = ShareChannel::kMembers;
    dds_entity_t reader = 0, writer = 0;
    const ddsi_sertype* type = nullptr;
  };

  /// As ROS' nodes have it; but a participant stays known through a partition of half a minute, so
  /// that what heals is there at once: who is lost is up to the lease of the introductions.
  static std::string configuration(const DiscoverySettings& discovery, const std::string& user) {
    const std::string lease =
        "<CycloneDDS><Domain Id=\"any\"><Discovery><LeaseDuration>30 s</LeaseDuration>"
        "</Discovery></Domain></CycloneDDS>";
    return lease + "," + cyclone_configuration(discovery, user);
  }

  [[noreturn]] static void refuse(dds_return_t code, std::uint32_t domain) {
    if (code == DDS_RETCODE_PRECONDITION_NOT_MET) {
      throw std::runtime_error("--share: domain " + std::to_string(domain) +
                               " is that of --ros2; set POINTFLIGHT_DOMAIN_ID to another");
    }
    throw std::runtime_error(
        "--share: no DDS participant could be made in domain " + std::to_string(domain) + " (" +
        dds_strretcode(-code) + "); is CYCLONEDDS_URI right, are there network interfaces," +
        " and free ports from " + std::to_string(7400 + 250 * domain) + " on?");
  }

  void add_channel(std::size_t index, const ShareTransportOptions& options) {
    End& end = ends_[index];
    end.transport = this;
    end.channel = static_cast<ShareChannel>(index);
    const std::string name = "pointflight/" + options.name + "/" + kNames[index];
    const RawTopic topic = make_raw_topic(participant_, name, kTypes[index]);
    end.type = topic.type;
    const Qos qos = qos_for(end.channel, options);
    const auto steps = std::max(kStepsKept, static_cast<std::int32_t>(options.ahead) + 16);
    const std::int32_t depth = end.channel == ShareChannel::kMembers ? 1 : steps;
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
    end.writer = dds_create_writer(participant_, topic.topic, qos.get(), nullptr);
    // of several writers: one's news must not push out another's
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, std::max(kArrivalsKept, steps));
    // each writer by its own lease, also one that has another: it is to be refused, not missed
    dds_qset_liveliness(qos.get(), DDS_LIVELINESS_AUTOMATIC, DDS_INFINITY);
    dds_listener_t* listener = dds_create_listener(&end);
    dds_lset_data_available(listener, &DdsShareTransport::on_data);
    if (end.channel == ShareChannel::kMembers) {
      dds_lset_liveliness_changed(listener, &DdsShareTransport::on_liveliness);
    }
    end.reader = dds_create_reader(participant_, topic.topic, qos.get(), listener);
    dds_delete_listener(listener);
    if (end.reader < 0 || end.writer < 0) {
      const dds_return_t code = std::min(end.reader, end.writer);
      throw std::runtime_error("--share: cannot make " + name + ": " + dds_strretcode(-code));
    }
  }

  void send_beats(const std::stop_token& stop) {
    std::unique_lock lock(beat_mutex_);
    while (!stop.stop_requested()) {
      const Bytes bytes = beat_;
      lock.unlock();
      if (bytes) send(ShareChannel::kClock, bytes);
      lock.lock();
      beat_changes_.wait_for(lock, stop, beat_period_, [] { return false; });
    }
  }

  static void on_data(dds_entity_t reader, void* self) {
    const End& end = *static_cast<End*>(self);
    const std::int64_t now = steady_now();
    RawSample sample;
    std::vector<ShareArrival> arrivals;
    while (take_raw(reader, sample)) {
      if (sample.bytes.empty() || sample.bytes.size() > kMessageMost) continue;
      const std::uint64_t writer =
          end.transport->participant_of(reader, sample.info.publication_handle);
      if (end.transport->is_ignored(writer)) continue;
      arrivals.push_back({end.channel, std::move(sample.bytes), writer, now});
    }
    end.transport->put(std::move(arrivals));
  }

  static void on_liveliness(dds_entity_t reader,
                            const dds_liveliness_changed_status_t status,
                            void* self) {
    if (status.alive_count_change >= 0) return;
    const End& end = *static_cast<End*>(self);
    DdsShareTransport& transport = *end.transport;
    const std::uint64_t writer = transport.participant_of(reader, status.last_publication_handle);
    transport.put({{end.channel, {}, writer, steady_now()}});
  }

  [[nodiscard]] bool is_ignored(std::uint64_t writer) {
    const std::lock_guard lock(names_mutex_);
    return ignored_.count(writer) != 0;
  }

  /// Who a writer belongs to: the same for all its topics, and by DDS, not by what it says.
  std::uint64_t participant_of(dds_entity_t reader, dds_instance_handle_t publication) {
    const std::lock_guard lock(names_mutex_);
    const auto known = participants_.find(publication);
    if (known != participants_.end()) return known->second;
    std::uint64_t name = publication;
    if (auto* endpoint = dds_get_matched_publication_data(reader, publication)) {
      std::uint64_t halves[2];
      static_assert(sizeof halves == sizeof endpoint->participant_key.v);
      std::memcpy(halves, endpoint->participant_key.v, sizeof halves);
      name = halves[0] * 0x9e3779b97f4a7c15ull ^ halves[1];
      dds_builtintopic_free_endpoint(endpoint);
      if (participants_.size() < kInboxMost) participants_.emplace(publication, name);
    }
    return name;
  }

  void put(std::vector<ShareArrival> arrivals) {
    const std::lock_guard lock(mutex_);
    for (ShareArrival& arrival : arrivals) {
      if (inbox_.size() >= kInboxMost) {
        // states and clocks are out of date by now; who takes part and who is lost is not
        std::erase_if(inbox_, [](const ShareArrival& a) {
          return a.channel == ShareChannel::kStates || a.channel == ShareChannel::kClock;
        });
        if (inbox_.size() >= kInboxMost) return;
      }
      inbox_.push_back(std::move(arrival));
    }
    arrived_.notify_all();
  }

  DdsLog log_;  ///< Ends last.
  std::array<End, kShareChannels> ends_;
  dds_entity_t participant_ = 0;
  std::atomic<std::uint64_t> bytes_sent_{0};
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<ShareArrival> inbox_;
  std::mutex names_mutex_;
  std::map<dds_instance_handle_t, std::uint64_t> participants_;  ///< By publication.
  std::set<std::uint64_t> ignored_;                              ///< Participants.
  std::chrono::nanoseconds beat_period_;
  std::mutex beat_mutex_;
  std::condition_variable_any beat_changes_;
  Bytes beat_;
  Domain domain_;       ///< Ends before all above, which its threads use.
  std::jthread beats_;  ///< Ends first.
};

}  // namespace

std::unique_ptr<ShareTransport> make_dds_share_transport(const ShareTransportOptions& options) {
  return std::make_unique<DdsShareTransport>(options);
}

}  // namespace pointflight
