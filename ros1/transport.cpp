#include "ros1/transport.hpp"

#include <XmlRpcClient.h>
#include <ros/network.h>
#include <ros/ros.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "ros1/raw_message.hpp"

namespace pointflight {
namespace {

/// A roscpp node. roscpp has queues and threads of its own: a slow subscriber costs nobody but
/// itself.
class Ros1Transport : public Transport {
 public:
  explicit Ros1Transport(const TransportOptions& options) : options_(options) {
    // no master yet is no error: it is looked for until it is there
    ros::init(ros::M_string{}, options_.node, ros::init_options::NoSigintHandler);
  }

  ~Ros1Transport() override {
    stop_ = true;
    if (connecting_.joinable()) connecting_.join();
    if (spinner_) spinner_->stop();
    publishers_.clear();
    subscribers_.clear();
    node_.reset();
    if (ros::isStarted()) ros::shutdown();
  }

  Wire wire() const override { return Wire::kRos1; }

  int advertise(const Topic& topic) override {
    topics_.push_back(std::make_unique<Topic>(topic));
    counts_.push_back(std::make_shared<SentCount>());
    counts_.back()->depth = topic.depth;
    return static_cast<int>(topics_.size()) - 1;
  }

  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message) override {
    inputs_.push_back({topic, std::move(on_message)});
  }

  void start() override {
    connecting_ = std::thread([this] { connect(); });
  }

  bool is_connected() const override { return connected_; }

  bool has_senders() const override {
    if (!connected_) return false;
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::any_of(subscribers_.begin(), subscribers_.end(), [](const ros::Subscriber& s) {
      return s.getNumPublishers() > 0;
    });
  }

  bool has_readers(int topic) const override {
    return connected_ && publishers_[static_cast<std::size_t>(topic)].getNumSubscribers() > 0;
  }

  void send(int topic, const Bytes& bytes, std::int64_t /*time*/) override {
    const auto i = static_cast<std::size_t>(topic);
    if (!connected_) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!connected_) return;
    }
    publishers_[i].publish(RawMessage{topics_[i].get(), bytes, counts_[i]});
  }

  std::uint64_t dropped() const override {
    std::uint64_t sum = 0;
    for (const auto& count : counts_) sum += count->dropped;
    return sum;
  }

  bool is_over() const override { return over_; }

 private:
  struct Input {
    Topic topic;
    std::function<void(const Received&)> on_message;
  };

  void log(const std::string& text) const {
    if (options_.log) options_.log(text);
  }

  /// Looks for the master, then makes the node and everything on it.
  void connect() {
    bool said = false;
    while (!stop_ && !ros::master::check()) {
      if (!said) {
        log("ROS 1: no master at " + ros::master::getURI() +
            "; start roscore, or set ROS_MASTER_URI; still looking");
      }
      said = true;
      for (int i = 0; i < 10 && !stop_; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    if (stop_) return;
    if (said) log("ROS 1: found the master");
    if (is_taken("/" + options_.node)) {
      log("ROS 1: a node named /" + options_.node +
          " runs already and is shut down by this one; give --node another name");
    }
    node_ = std::make_unique<ros::NodeHandle>();
    // roscpp asks for this at its first log line, which is when it is told to end because another
    // node has its name; the master would take that for a third node and end the other as well
    bool unused = false;
    ros::param::getCached("/rosout_disable_topics_generation", unused);
    std::unique_lock<std::mutex> lock(mutex_);
    for (const auto& topic : topics_) publishers_.push_back(advertised(*topic));
    for (const Input& input : inputs_) subscribers_.push_back(subscribed(input));
    had_sender_.assign(inputs_.size(), false);
    spinner_ = std::make_unique<ros::AsyncSpinner>(1);
    spinner_->start();
    connected_ = true;
    lock.unlock();
    while (!stop_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (!ros::ok()) {
        log("ROS 1: the node was ended from outside (rosnode kill, or another node of this name: " +
            ros::this_node::getName() + "); the flight ends");
        over_ = true;
        return;
      }
      welcome_other_definitions();
      say_dropped();
    }
  }

  void say_dropped() {
    if (said_dropped_) return;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      if (counts_[i]->dropped == 0) continue;
      log("ROS 1: a subscriber of " + topics_[i]->name +
          " is too slow and loses messages (said once, counted)");
      said_dropped_ = true;
      return;
    }
  }

  /// roscpp holds a topic to the md5 of its first sender. When all senders have gone it is read
  /// anew, so that the next one may have another definition.
  void welcome_other_definitions() {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < subscribers_.size(); ++i) {
      const bool has_sender = subscribers_[i].getNumPublishers() > 0;
      if (had_sender_[i] && !has_sender) {
        subscribers_[i].shutdown();
        subscribers_[i] = subscribed(inputs_[i]);
      }
      had_sender_[i] = has_sender;
    }
  }

  /// True where the master knows a living node of this name: it would be shut down by ours.
  static bool is_taken(const std::string& name) {
    XmlRpc::XmlRpcValue request;
    XmlRpc::XmlRpcValue response;
    XmlRpc::XmlRpcValue payload;
    request[0] = "/pointflight_probe";
    request[1] = name;
    if (!ros::master::execute("lookupNode", request, response, payload, false)) return false;
    std::string host;
    std::uint32_t port = 0;
    if (!ros::network::splitURI(static_cast<std::string>(payload), host, port)) return false;
    XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
    XmlRpc::XmlRpcValue call;
    call[0] = "/pointflight_probe";
    return client.execute("getPid", call, response);
  }

  ros::Publisher advertised(const Topic& topic) {
    ros::AdvertiseOptions options;
    options.topic = topic.name;
    options.queue_size = static_cast<std::uint32_t>(topic.depth);
    options.md5sum = topic.type.md5;
    options.datatype = topic.type.ros1_name();
    options.message_definition = topic.type.definition;
    options.has_header = topic.type.definition.rfind("std_msgs/Header header", 0) == 0;
    options.latch = topic.latched;
    return node_->advertise(options);
  }

  ros::Subscriber subscribed(const Input& input) {
    using Event = ros::MessageEvent<const RawReceived>;
    const std::string self = ros::this_node::getName();
    const auto callback = [on_message = input.on_message, self](const Event& event) {
      if (event.getPublisherName() == self) return;
      Received received;
      const auto message = event.getConstMessage();
      received.data = message->bytes.data();
      received.size = message->bytes.size();
      const ros::M_string& header = event.getConnectionHeader();
      const auto entry = [&](const char* key) {
        const auto found = header.find(key);
        return found == header.end() ? std::string() : found->second;
      };
      received.md5 = entry("md5sum");
      received.definition = entry("message_definition");
      on_message(received);
    };
    ros::SubscribeOptions options;
    options.topic = input.topic.name;
    options.queue_size = static_cast<std::uint32_t>(input.topic.depth);
    // whatever definition the sender has: its own words are decoded
    options.md5sum = "*";
    options.datatype = input.topic.type.ros1_name();
    options.helper = boost::make_shared<ros::SubscriptionCallbackHelperT<const Event&>>(
        boost::function<void(const Event&)>(callback));
    options.transport_hints = ros::TransportHints().tcpNoDelay();
    return node_->subscribe(options);
  }

  TransportOptions options_;
  std::vector<std::unique_ptr<Topic>> topics_;
  std::vector<std::shared_ptr<SentCount>> counts_;
  bool said_dropped_ = false;
  std::vector<Input> inputs_;
  std::unique_ptr<ros::NodeHandle> node_;
  std::vector<ros::Publisher> publishers_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<bool> had_sender_;  ///< Of each subscriber, when last looked at.
  std::unique_ptr<ros::AsyncSpinner> spinner_;
  std::thread connecting_;
  mutable std::mutex mutex_;
  std::atomic<bool> connected_{false};
  std::atomic<bool> over_{false};
  std::atomic<bool> stop_{false};
};

}  // namespace

std::unique_ptr<Transport> make_ros1_transport(const TransportOptions& options) {
  return std::make_unique<Ros1Transport>(options);
}

}  // namespace pointflight
