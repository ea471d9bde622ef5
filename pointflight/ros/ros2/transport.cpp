#include "pointflight/ros/ros2/transport.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "pointflight/ros/common/ros_names.hpp"
#include "pointflight/ros/ros2/dds_log.hpp"
#include "pointflight/ros/ros2/node.hpp"
#include "pointflight/ros/ros2/write_queue.hpp"

namespace pointflight {
namespace {

// bytes per second that leave for readers with stock receive buffers, and where a message of 64 kB
// a millisecond is not enough any more
constexpr double kPace = 64e6;
constexpr double kFastPace = 128e6;
constexpr double kSlowRate = 45e6;
constexpr double kFastRate = 90e6;
constexpr std::size_t kRequests = 10;  // of a service that wait

/// The DDS name of "sensor_msgs/msg/Imu".
std::string dds_type_name(const MessageType& type) {
  return type.ros2_package + "::msg::dds_::" + type.name + "_";
}

std::optional<std::string> environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

EndpointSettings endpoint_of(const Topic& topic) {
  if (const std::string fault = topic_fault(topic.name, true); !fault.empty()) {
    throw std::runtime_error("ROS 2: topic " + topic.name + " " + fault);
  }
  EndpointSettings settings;
  settings.name = "rt" + topic.name;
  settings.type = dds_type_name(topic.type);
  settings.hash = topic.type.hash;
  settings.depth = topic.depth;
  settings.latched = topic.latched;
  return settings;
}

class Ros2Transport : public Transport {
 public:
  explicit Ros2Transport(const TransportOptions& options)
      : options_(options), dds_("ROS 2", options.log) {
    DiscoverySettings discovery = discovery_from(environment);
    if (options.localhost_only) discovery.range = DiscoverySettings::Range::kLocalhost;
    if (options.log && options.large_rate > kSlowRate) {
      const std::string rate = std::to_string(static_cast<int>(1e-6 * options.large_rate));
      options.log(options.large_rate > kFastRate
                      ? "ROS 2: clouds of up to " + rate + " MB/s if all are read: more than UDP " +
                            "carries here; read fewer, or lower their rates (ros.outputs)"
                      : "ROS 2: clouds of up to " + rate + " MB/s if all are read: receive " +
                            "buffers of stock size may lose some (net.core.rmem_max)");
    }
    node_ = std::make_unique<Node>(options_.node, discovery);
  }

  ~Ros2Transport() override { close(); }

  Wire wire() const override { return Wire::kCdr; }

  int advertise(const Topic& topic) override {
    auto out = std::make_unique<Output>(*this, topic);
    const Listener listener(dds_create_listener(out.get()));
    dds_lset_publication_matched(listener.get(), &Output::on_matched);
    dds_lset_offered_incompatible_qos(listener.get(), &Output::on_incompatible);
    out->writer = node_->make_writer(endpoint_of(topic), listener.get());
    outputs_.push_back(std::move(out));
    return static_cast<int>(outputs_.size()) - 1;
  }

  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message) override {
    // best effort takes what both kinds of writers send
    add_reader(topic, on_message, false);
    if (topic.reliable) add_reader(topic, on_message, true);
  }

  void serve(const Service& service, Answer answer) override {
    auto served = std::make_unique<Served>(*this, service, std::move(answer));
    const std::string type = service.package + "::srv::dds_::" + service.type;
    EndpointSettings reply;
    reply.name = "rr" + service.name + "Reply";
    reply.type = type + "_Response_";
    reply.hash = service.response_hash;
    reply.depth = kRequests;
    auto out = std::make_unique<Output>(*this, Topic{});
    out->topic.name = service.name;
    out->writer = node_->make_writer(reply, nullptr);
    served->output = outputs_.size();
    outputs_.push_back(std::move(out));
    EndpointSettings request;
    request.name = "rq" + service.name + "Request";
    request.type = type + "_Request_";
    request.hash = service.request_hash;
    request.depth = kRequests;
    const Listener listener(dds_create_listener(served.get()));
    dds_lset_data_available(listener.get(), &Served::on_request);
    served_.push_back(std::move(served));
    node_->make_reader(request, listener.get());
  }

  void start() override {
    node_->send_graph();
    const auto write = [this](std::size_t output, const Bytes& bytes) {
      const RawWriter& writer = outputs_[output]->writer;
      if (!write_raw(writer.entity, writer.type, bytes)) ++dropped_;
    };
    small_.start(write, 0.0, options_.run_rate);
    large_.start(write, options_.large_rate > kSlowRate ? kFastPace : kPace, 0.0);
  }

  bool is_connected() const override { return true; }

  bool has_senders() const override {
    return std::any_of(inputs_.begin(), inputs_.end(), [](const auto& in) {
      return in->answers && in->senders > 0;
    });
  }

  bool has_readers(int topic) const override { return reader_count(topic) > 0; }

  int reader_count(int topic) const override {
    return outputs_[static_cast<std::size_t>(topic)]->readers;
  }

  void send(int topic, const Bytes& bytes, std::int64_t time) override {
    const auto output = static_cast<std::size_t>(topic);
    const Topic& t = outputs_[output]->topic;
    dropped_ += t.large ? large_.push(output, bytes, t.latched, t.depth)
                        : small_.push(output, bytes, t.latched, WriteQueue::kQueueMax, time);
  }

  void flush() override {
    small_.wake();  // once for a step, not for each message
    large_.wake();
  }

  std::uint64_t dropped() const override { return dropped_; }

  void close() override {
    small_.close();
    large_.close();
    node_.reset();
  }

 private:
  struct Output {
    Output(Ros2Transport& t, Topic to) : transport(t), topic(std::move(to)) {}
    static void on_matched(dds_entity_t /*writer*/,
                           const dds_publication_matched_status_t status,
                           void* self) {
      static_cast<Output*>(self)->readers = static_cast<int>(status.current_count);
    }
    static void on_incompatible(dds_entity_t /*writer*/,
                                const dds_offered_incompatible_qos_status_t status,
                                void* self) {
      const auto& output = *static_cast<Output*>(self);
      output.transport.say_incompatible(output.topic, status.last_policy_id);
    }
    Ros2Transport& transport;
    Topic topic;
    RawWriter writer;
    std::atomic<int> readers{0};
  };

  struct Input {
    explicit Input(std::function<void(const Received&)> call) : on_message(std::move(call)) {}
    static void on_matched(dds_entity_t /*reader*/,
                           const dds_subscription_matched_status_t status,
                           void* self) {
      static_cast<Input*>(self)->senders = static_cast<int>(status.current_count);
    }
    static void on_data(dds_entity_t reader, void* self) {
      auto& input = *static_cast<Input*>(self);
      RawSample sample;
      while (take_raw(reader, sample)) {
        if (input.has_reliable_twin && is_reliable(reader, sample.info.publication_handle)) {
          continue;
        }
        Received received;
        received.data = sample.bytes.data();
        received.size = sample.bytes.size();
        input.on_message(received);
      }
    }
    std::function<void(const Received&)> on_message;
    bool has_reliable_twin = false;  ///< Which takes what reliable writers send.
    bool answers = false;            ///< A planner's.
    std::atomic<int> senders{0};
  };

  /// A service. Requests of rmw_cyclonedds begin with 16 bytes (who asks, and the number of the
  /// question) that its reply has to begin with as well. rmw_fastrtps carries the same beside the
  /// bytes, in a form that Cyclone DDS does not have: ROS 2 has no common one.
  struct Served {
    Served(Ros2Transport& t, Service its_service, Answer its_answer)
        : transport(t), service(std::move(its_service)), answer(std::move(its_answer)) {}
    static void on_request(dds_entity_t reader, void* self) {
      auto& served = *static_cast<Served*>(self);
      RawSample sample;
      while (take_raw(reader, sample)) served.reply_to(std::move(sample.bytes));
    }
    void reply_to(std::vector<std::byte> bytes) {
      constexpr std::ptrdiff_t kCdrHeader = 4;
      constexpr std::ptrdiff_t kWho = 16;
      const bool has_header = bytes.size() > kCdrHeader + kWho;
      std::vector<std::byte> who;
      if (has_header) {
        const auto first = bytes.begin() + kCdrHeader;
        who.assign(first, first + kWho);
        bytes.erase(first, first + kWho);
      }
      Received request;
      request.data = bytes.data();
      request.size = bytes.size();
      std::vector<std::byte> reply = answer(request);
      if (!has_header) {
        transport.say_other_client(service);
        return;
      }
      reply.insert(reply.begin() + kCdrHeader, who.begin(), who.end());
      transport.small_.push(output,
                            std::make_shared<const std::vector<std::byte>>(std::move(reply)),
                            false,
                            WriteQueue::kQueueMax);
      transport.small_.wake();
    }
    Ros2Transport& transport;
    Service service;
    Answer answer;
    std::size_t output = 0;  ///< Where its replies leave.
  };

  void add_reader(const Topic& topic,
                  const std::function<void(const Received&)>& on_message,
                  bool reliable) {
    auto in = std::make_unique<Input>(on_message);
    in->has_reliable_twin = topic.reliable && !reliable;
    in->answers = topic.answers;
    EndpointSettings settings = endpoint_of(topic);
    settings.reliable = reliable;
    const Listener listener(dds_create_listener(in.get()));
    dds_lset_subscription_matched(listener.get(), &Input::on_matched);
    dds_lset_data_available(listener.get(), &Input::on_data);
    inputs_.push_back(std::move(in));
    node_->make_reader(settings, listener.get());
  }

  static bool is_reliable(dds_entity_t reader, dds_instance_handle_t writer) {
    auto* endpoint = dds_get_matched_publication_data(reader, writer);
    if (endpoint == nullptr) return false;  // has gone since
    dds_reliability_kind_t kind = DDS_RELIABILITY_BEST_EFFORT;
    dds_duration_t blocking = 0;
    dds_qget_reliability(endpoint->qos, &kind, &blocking);
    dds_builtintopic_free_endpoint(endpoint);
    return kind == DDS_RELIABILITY_RELIABLE;
  }

  void say_other_client(const Service& service) {
    if (options_.log && !said_other_client_.exchange(true)) {
      options_.log("ROS 2: " + service.name + " was called by a client whose DDS is not Cyclone; " +
                   "it is done, but the client gets no reply: with rmw_fastrtps use the topic of " +
                   "this name (said once)");
    }
  }

  void say_incompatible(const Topic& topic, std::uint32_t policy) const {
    if (!options_.log) return;
    const char* what = policy == DDS_RELIABILITY_QOS_POLICY_ID  ? "another reliability"
                       : policy == DDS_DURABILITY_QOS_POLICY_ID ? "transient-local durability"
                                                                : "another quality of service";
    options_.log("ROS 2: a subscriber of " + topic.name + " asks for " + what +
                 " than is offered and gets nothing; make it volatile, reliable or best effort");
  }

  TransportOptions options_;
  DdsLog dds_;
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<std::unique_ptr<Input>> inputs_;
  std::vector<std::unique_ptr<Served>> served_;
  WriteQueue small_, large_;    ///< Large messages are paced.
  std::unique_ptr<Node> node_;  ///< Goes before what its listeners use.
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> said_other_client_{false};
};

}  // namespace

std::unique_ptr<Transport> make_ros2_transport(const TransportOptions& options) {
  return std::make_unique<Ros2Transport>(options);
}

}  // namespace pointflight
