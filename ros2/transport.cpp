#include "ros2/transport.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/flowcontrol/FlowControllerDescriptor.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "ros2/discovery.hpp"
#include "ros2/graph_message.hpp"
#include "ros2/raw_type.hpp"

namespace pointflight {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace transports = eprosima::fastdds::rtps;

constexpr const char* kPacing = "pointflight_large";
// a fragment of 64 kB each millisecond, 59 MB/s: stock receive buffers of 208 kB lose nothing
constexpr std::int32_t kBytesAPeriod = 65536;
constexpr double kOneFragmentRate = 45e6;  // bytes a second up to which that is enough
constexpr double kTwoFragmentsRate = 90e6;
constexpr std::uint32_t kReceiveBuffer = 4u << 20;
constexpr std::uint32_t kSharedSegment = 16u << 20;
constexpr std::size_t kQueueMax = 2000;  // messages that wait to be written
const eprosima::fastrtps::Duration_t kHeartbeat{0, 200'000'000};

RawGid raw_gid(const rtps::GUID_t& guid) {
  RawGid raw{};
  std::copy(guid.guidPrefix.value, guid.guidPrefix.value + 12, raw.begin());
  std::copy(guid.entityId.value, guid.entityId.value + 4, raw.begin() + 12);
  return raw;
}

/// The DDS name of "sensor_msgs/msg/Imu".
std::string dds_type_name(const MessageType& type) {
  return type.ros2_package + "::msg::dds_::" + type.name + "_";
}

std::vector<std::uint8_t> octets(const std::string& text) {
  return {text.begin(), text.end()};
}

std::optional<std::string> environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

/// A participant that other ROS 2 nodes see as a node of its name.
class Node {
 public:
  Node(const std::string& name, const DiscoverySettings& discovery, const TransportOptions& options)
      : name_(name),
        discovery_(discovery),
        shared_memory_(options.shared_memory),
        fragments_(options.large_rate > kOneFragmentRate ? 2 : 1) {
    auto* factory = dds::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant(discovery_.domain, participant_qos());
    if (participant_ == nullptr) {
      throw std::runtime_error("ROS 2: no DDS participant could be made in domain " +
                               std::to_string(discovery_.domain) +
                               "; are there network interfaces, and free ports from " +
                               std::to_string(7400 + 250 * discovery_.domain) + " on?");
    }
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    graph_ = make_writer("ros_discovery_info",
                         "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
                         kGraphTypeHash,
                         1,
                         true,
                         false,
                         nullptr);
    writers_.clear();  // the graph's own endpoint is no node's
  }
  ~Node() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Fast DDS has one type for a topic's name in a participant.
  [[nodiscard]] bool can_have(const std::string& name, const std::string& type) const {
    const auto known = types_.find(name);
    return known == types_.end() || known->second == type;
  }
  [[nodiscard]] rtps::GuidPrefix_t prefix() const { return participant_->guid().guidPrefix; }

  dds::DataWriter* make_writer(const std::string& name,
                               const std::string& type,
                               const std::string& hash,
                               std::size_t depth,
                               bool latched,
                               bool large,
                               dds::DataWriterListener* listener) {
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    // a reliable writer serves both kinds of readers
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind =
        latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = static_cast<std::int32_t>(depth);
    qos.resource_limits().max_samples = static_cast<std::int32_t>(depth);
    qos.resource_limits().max_instances = 1;
    qos.resource_limits().max_samples_per_instance = static_cast<std::int32_t>(depth);
    qos.resource_limits().allocated_samples = 1;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.reliable_writer_qos().times.heartbeatPeriod = kHeartbeat;
    qos.data_sharing().off();
    if (large) {
      qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
      qos.publish_mode().flow_controller_name = kPacing;
    }
    if (!hash.empty()) qos.user_data().setValue(octets("typehash=" + hash + ";"));
    dds::DataWriter* writer = publisher_->create_datawriter(topic_of(name, type), qos, listener);
    if (writer == nullptr) throw std::runtime_error("ROS 2: cannot write " + name);
    writers_.push_back(raw_gid(writer->guid()));
    return writer;
  }

  /// Best effort: takes what both kinds of writers send.
  dds::DataReader* make_reader(const std::string& name,
                               const std::string& type,
                               const std::string& hash,
                               std::size_t depth,
                               dds::DataReaderListener* listener) {
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = static_cast<std::int32_t>(depth);
    qos.resource_limits().max_samples = static_cast<std::int32_t>(depth);
    qos.resource_limits().max_instances = 1;
    qos.resource_limits().max_samples_per_instance = static_cast<std::int32_t>(depth);
    qos.resource_limits().allocated_samples = 1;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.data_sharing().off();
    qos.user_data().setValue(octets("typehash=" + hash + ";"));
    dds::DataReader* reader = subscriber_->create_datareader(topic_of(name, type), qos, listener);
    if (reader == nullptr) throw std::runtime_error("ROS 2: cannot read " + name);
    readers_.push_back(raw_gid(reader->guid()));
    return reader;
  }

  /// Says which endpoints belong to the node.
  void send_graph() {
    const RawGid own = raw_gid(participant_->guid());
    const auto bytes = discovery_.old_gids ? graph_message<24>(own, name_, readers_, writers_)
                                           : graph_message<16>(own, name_, readers_, writers_);
    RawSample sample;
    sample.out = &bytes;
    graph_->write(&sample);
  }

 private:
  dds::Topic* topic_of(const std::string& name, const std::string& type) {
    auto& known = topics_[name];
    if (known != nullptr) return known;
    dds::TypeSupport support(new RawType(type));
    support.register_type(participant_);
    known = participant_->create_topic(name, type, dds::TOPIC_QOS_DEFAULT);
    if (known == nullptr) throw std::runtime_error("ROS 2: topic " + name + " cannot be made");
    types_[name] = type;
    return known;
  }

  dds::DomainParticipantQos participant_qos() const {
    dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
    qos.name("/");
    qos.user_data().setValue(octets("enclave=/;"));
    // Debian's Fast DDS 2.9 aborts when it sends to a multicast locator of somebody's reader: its
    // statistics know only the locators of its own. None are kept: all is sent to unicast ones.
    qos.allocation().locators.max_multicast_locators = 0;
    auto& builtin = qos.wire_protocol().builtin;
    builtin.readerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    // found at once by who is there, and within a second by who comes
    builtin.discovery_config.initial_announcements = {30, {0, 100'000'000}};
    builtin.discovery_config.leaseDuration_announcementperiod = {1, 0};
    auto udp = std::make_shared<transports::UDPv4TransportDescriptor>();
    udp->receiveBufferSize = kReceiveBuffer;
    udp->maxInitialPeersRange = 32;
    const auto peer = [&](const std::string& address) {
      rtps::Locator_t locator;
      rtps::IPLocator::setIPv4(locator, address);
      builtin.initialPeersList.push_back(locator);
    };
    switch (discovery_.range) {
      case DiscoverySettings::Range::kOff:
        builtin.discovery_config.discoveryProtocol = rtps::DiscoveryProtocol_t::NONE;
        break;
      case DiscoverySettings::Range::kLocalhost: {
        udp->interfaceWhiteList = {"127.0.0.1"};
        builtin.metatrafficMulticastLocatorList.clear();
        builtin.avoid_builtin_multicast = true;
        builtin.metatrafficUnicastLocatorList.push_back(rtps::Locator_t());  // no multicast
        peer("127.0.0.1");
        break;
      }
      case DiscoverySettings::Range::kSubnet:
        if (discovery_.static_peers.empty()) break;  // the built-in behaviour
        rtps::Locator_t multicast;
        rtps::IPLocator::setIPv4(multicast, "239.255.0.1");
        multicast.port = 7400 + 250 * discovery_.domain;
        builtin.initialPeersList.push_back(multicast);
        break;
    }
    if (discovery_.range != DiscoverySettings::Range::kOff) {
      for (const std::string& address : discovery_.static_peers) peer(address);
    }
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    if (shared_memory_) {
      auto shared = std::make_shared<transports::SharedMemTransportDescriptor>();
      shared->segment_size(kSharedSegment);
      qos.transport().user_transports.push_back(shared);
    }
    auto pacing = std::make_shared<transports::FlowControllerDescriptor>();
    pacing->name = kPacing;
    pacing->scheduler = transports::FlowControllerSchedulerPolicy::FIFO;
    pacing->max_bytes_per_period = fragments_ * kBytesAPeriod;
    pacing->period_ms = 1;
    qos.flow_controllers().push_back(pacing);
    return qos;
  }

  std::string name_;
  DiscoverySettings discovery_;
  bool shared_memory_;
  std::int32_t fragments_;  ///< Of 64 kB that leave in a millisecond.
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::DataWriter* graph_ = nullptr;
  std::map<std::string, dds::Topic*> topics_;
  std::map<std::string, std::string> types_;  ///< Of each topic.
  std::vector<RawGid> readers_, writers_;
};

class Ros2Transport : public Transport {
 public:
  explicit Ros2Transport(const TransportOptions& options)
      : options_(options), discovery_(discovery_from(environment)) {
    if (options.localhost_only) discovery_.range = DiscoverySettings::Range::kLocalhost;
    if (options.log && options.large_rate > kOneFragmentRate) {
      const std::string rate = std::to_string(static_cast<int>(1e-6 * options.large_rate));
      options.log(options.large_rate > kTwoFragmentsRate
                      ? "ROS 2: clouds of up to " + rate + " MB/s if all are read: more than UDP " +
                            "carries here; read fewer, or lower their rates (ros.outputs)"
                      : "ROS 2: clouds of up to " + rate + " MB/s if all are read: receive " +
                            "buffers of stock size may lose some (net.core.rmem_max)");
    }
    add_node();
    own_ = nodes_.front()->prefix();
  }

  ~Ros2Transport() override {
    close();
    nodes_.clear();  // before the listeners that they call
  }

  Wire wire() const override { return Wire::kCdr; }

  int advertise(const Topic& topic) override {
    auto out = std::make_unique<Output>(*this, topic);
    out->writer = nodes_.front()->make_writer("rt" + topic.name,
                                              dds_type_name(topic.type),
                                              topic.type.hash,
                                              topic.depth,
                                              topic.latched,
                                              topic.large,
                                              out.get());
    outputs_.push_back(std::move(out));
    return static_cast<int>(outputs_.size()) - 1;
  }

  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message) override {
    auto in = std::make_unique<Input>(*this, topic, std::move(on_message));
    const std::string name = "rt" + topic.name;
    const std::string type = dds_type_name(topic.type);
    // a second type of one topic needs a second participant
    auto node = std::find_if(
        nodes_.begin(), nodes_.end(), [&](const auto& n) { return n->can_have(name, type); });
    if (node == nodes_.end()) {
      add_node();
      node = nodes_.end() - 1;
    }
    in->reader = (*node)->make_reader(name, type, topic.type.hash, topic.depth, in.get());
    inputs_.push_back(std::move(in));
  }

  void start() override {
    for (const auto& node : nodes_) node->send_graph();
    worker_ = std::thread([this] { work(); });
  }

  bool is_connected() const override { return true; }

  bool has_senders() const override {
    return std::any_of(
        inputs_.begin(), inputs_.end(), [](const auto& in) { return in->senders > 0; });
  }

  bool has_readers(int topic) const override {
    return outputs_[static_cast<std::size_t>(topic)]->readers > 0;
  }

  void send(int topic, const Bytes& bytes, std::int64_t /*time*/) override {
    const std::lock_guard lock(mutex_);
    queue_.emplace_back(topic, bytes);
    if (queue_.size() > kQueueMax) {
      // the oldest that is not all that a latecomer would ever get
      const auto oldest = std::find_if(queue_.begin(), queue_.end(), [&](const auto& entry) {
        return !outputs_[static_cast<std::size_t>(entry.first)]->topic.latched;
      });
      if (oldest != queue_.end()) queue_.erase(oldest);
      ++dropped_;
    }
  }

  void flush() override {
    const std::lock_guard lock(mutex_);
    if (!queue_.empty()) ready_.notify_one();  // once for a step, not for each message
  }

  std::uint64_t dropped() const override { return dropped_; }

  /// Writes what waits, then ends the thread that writes.
  void close() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
      ready_.notify_one();
    }
    if (worker_.joinable()) worker_.join();
  }

 private:
  struct Output : dds::DataWriterListener {
    Output(Ros2Transport& t, Topic to) : transport(t), topic(std::move(to)) {}
    void on_publication_matched(dds::DataWriter* /*writer*/,
                                const dds::PublicationMatchedStatus& status) override {
      readers = status.current_count;
    }
    void on_offered_incompatible_qos(dds::DataWriter* /*writer*/,
                                     const dds::OfferedIncompatibleQosStatus& status) override {
      transport.say_incompatible(topic, status.last_policy_id);
    }
    Ros2Transport& transport;
    Topic topic;
    dds::DataWriter* writer = nullptr;
    std::atomic<int> readers{0};
  };

  struct Input : dds::DataReaderListener {
    Input(Ros2Transport& t, Topic from, std::function<void(const Received&)> call)
        : transport(t), topic(std::move(from)), on_message(std::move(call)) {}
    void on_subscription_matched(dds::DataReader* /*reader*/,
                                 const dds::SubscriptionMatchedStatus& status) override {
      senders = status.current_count;
    }
    void on_data_available(dds::DataReader* from) override {
      RawSample sample;
      dds::SampleInfo info;
      while (from->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
        rtps::GUID_t sender;
        rtps::iHandle2GUID(sender, info.publication_handle);
        if (!info.valid_data || sender.guidPrefix == transport.own_) {
          continue;
        }
        Received received;
        received.data = sample.in.data();
        received.size = sample.in.size();
        on_message(received);
      }
    }
    Ros2Transport& transport;
    Topic topic;
    std::function<void(const Received&)> on_message;
    dds::DataReader* reader = nullptr;
    std::atomic<int> senders{0};
  };

  void add_node() {
    const std::string number = nodes_.empty() ? "" : "_" + std::to_string(nodes_.size() + 1);
    nodes_.push_back(std::make_unique<Node>(options_.node + number, discovery_, options_));
  }

  void write(dds::DataWriter& writer, const std::vector<std::byte>& bytes) {
    RawSample sample;
    sample.out = &bytes;
    if (!writer.write(&sample)) ++dropped_;
  }

  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      ready_.wait(lock, [&] { return stop_ || !queue_.empty(); });
      if (queue_.empty()) return;
      const auto [topic, bytes] = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      write(*outputs_[static_cast<std::size_t>(topic)]->writer, *bytes);
      lock.lock();
    }
  }

  void say_incompatible(const Topic& topic, dds::QosPolicyId_t policy) const {
    if (!options_.log) return;
    const char* what = policy == dds::RELIABILITY_QOS_POLICY_ID  ? "another reliability"
                       : policy == dds::DURABILITY_QOS_POLICY_ID ? "transient-local durability"
                                                                 : "another quality of service";
    options_.log("ROS 2: a subscriber of " + topic.name + " asks for " + what +
                 " than is offered and gets nothing; make it volatile, reliable or best effort");
  }

  TransportOptions options_;
  DiscoverySettings discovery_;
  std::vector<std::unique_ptr<Node>> nodes_;
  rtps::GuidPrefix_t own_;  ///< Of the first node, whose are all writers.
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<std::unique_ptr<Input>> inputs_;
  std::thread worker_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<std::pair<int, Bytes>> queue_;
  bool stop_ = false;
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace

std::unique_ptr<Transport> make_ros2_transport(const TransportOptions& options) {
  return std::make_unique<Ros2Transport>(options);
}

}  // namespace pointflight
