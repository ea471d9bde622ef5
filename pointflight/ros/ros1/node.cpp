#include "pointflight/ros/ros1/node.hpp"

#include <XmlRpcClient.h>
#include <XmlRpcException.h>
#include <ros/network.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "pointflight/ros/ros1/master_uri.hpp"

namespace pointflight {
namespace {

constexpr std::chrono::milliseconds kLook(50);

/// True if the master knows a living node of this name: it would be shut down by ours.
bool is_taken(const std::string& name) {
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

}  // namespace

Ros1Node::Ros1Node(std::string name, Log log) : name_(std::move(name)), log_(std::move(log)) {
  const std::string uri = checked_master_uri(std::getenv("ROS_MASTER_URI"));
  // no master yet is no error: it is looked for until it is there
  ros::init(ros::M_string{{"__master", uri}}, name_, ros::init_options::NoSigintHandler);
}

int Ros1Node::advertise(const Topic& topic) {
  topics_.push_back(std::make_unique<Topic>(topic));
  counts_.push_back(std::make_shared<SentCount>());
  counts_.back()->depth = topic.depth;
  return static_cast<int>(topics_.size()) - 1;
}

void Ros1Node::subscribe(const Topic& topic, std::function<void(const Received&)> on_message) {
  inputs_.push_back({topic, std::move(on_message)});
}

void Ros1Node::serve(const Service& service, Transport::Answer answer) {
  services_.push_back({service, std::move(answer)});
}

void Ros1Node::start() {
  thread_ = std::thread([this] { connect(); });
}

int Ros1Node::reader_count(int topic) const {
  if (!connected_) return 0;
  return static_cast<int>(publishers_[static_cast<std::size_t>(topic)].getNumSubscribers());
}

void Ros1Node::send(int topic, const Bytes& bytes) {
  if (!connected_) return;
  const auto i = static_cast<std::size_t>(topic);
  publishers_[i].publish(RawMessage{topics_[i].get(), bytes, counts_[i]});
}

std::uint64_t Ros1Node::dropped() const {
  std::uint64_t sum = 0;
  for (const auto& count : counts_) sum += count->dropped;
  return sum;
}

std::string Ros1Node::failure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_;
}

void Ros1Node::stop() {
  gate_.shut();
  stop_ = true;
}

bool Ros1Node::leave() {
  if (thread_.joinable()) thread_.join();
  if (!failure().empty()) return false;
  if (spinner_) spinner_->stop();
  publishers_.clear();
  subscribers_.clear();
  servers_.clear();
  node_.reset();
  if (ros::isStarted()) ros::shutdown();
  return true;
}

void Ros1Node::log(const std::string& text) const {
  if (log_ && !stop_) log_(text);
}

void Ros1Node::connect() {
  try {
    if (!find_master()) return;
    make_node();
    watch();
    return;
  } catch (const XmlRpc::XmlRpcException& error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = "ROS 1: " + ros::master::getURI() + " does not answer as a master does (" +
               error.getMessage() + "); is ROS_MASTER_URI right?";
  } catch (const std::exception& error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = std::string("ROS 1: ") + error.what();
  }
  over_ = true;
}

/// False if it is told to end before there is one.
bool Ros1Node::find_master() {
  bool said = false;
  while (!stop_ && !ros::master::check()) {
    if (!said) {
      log("ROS 1: no master at " + ros::master::getURI() +
          "; start roscore, or set ROS_MASTER_URI; still looking");
    }
    said = true;
    for (int i = 0; i < 10 && !stop_; ++i) std::this_thread::sleep_for(kLook);
  }
  if (said) log("ROS 1: found the master");
  return !stop_;
}

void Ros1Node::make_node() {
  if (is_taken("/" + name_)) {
    log("ROS 1: a node named /" + name_ +
        " runs already and is shut down by this one; give --node another name");
  }
  node_ = std::make_unique<ros::NodeHandle>();
  // roscpp asks for this at its first log line, which is when it is told to end because another
  // node has its name; the master would take that for a third node and end the other as well
  bool unused = false;
  ros::param::getCached("/rosout_disable_topics_generation", unused);
  for (const auto& topic : topics_) publishers_.push_back(advertised(*topic));
  for (const Input& input : inputs_) subscribers_.push_back(subscribed(input));
  for (const Served& entry : services_) servers_.push_back(served(entry));
  had_sender_.assign(inputs_.size(), false);
  spinner_ = std::make_unique<ros::AsyncSpinner>(1);
  spinner_->start();
  connected_ = true;
}

void Ros1Node::watch() {
  while (!stop_) {
    std::this_thread::sleep_for(kLook);
    if (!ros::ok()) {
      log("ROS 1: the node was ended from outside (rosnode kill, or another node of this name: " +
          ros::this_node::getName() + "); the flight ends");
      over_ = true;
      return;
    }
    look_for_senders();
    say_dropped();
  }
}

/// roscpp holds a topic to the md5 of its first sender. When all senders have gone it is read anew,
/// so that the next one may have another definition.
void Ros1Node::look_for_senders() {
  bool any = false;
  for (std::size_t i = 0; i < subscribers_.size(); ++i) {
    const bool has_sender = subscribers_[i].getNumPublishers() > 0;
    if (had_sender_[i] && !has_sender) {
      subscribers_[i].shutdown();
      subscribers_[i] = subscribed(inputs_[i]);
    }
    had_sender_[i] = has_sender;
    any = any || (has_sender && inputs_[i].topic.answers);
  }
  has_senders_ = any;
}

void Ros1Node::say_dropped() {
  if (said_dropped_) return;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (counts_[i]->dropped == 0) continue;
    log("ROS 1: a subscriber of " + topics_[i]->name +
        " is too slow and loses messages (said once, counted)");
    said_dropped_ = true;
    return;
  }
}

ros::Publisher Ros1Node::advertised(const Topic& topic) {
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

ros::ServiceServer Ros1Node::served(const Served& entry) {
  /// Bytes in, bytes out.
  class Helper : public ros::ServiceCallbackHelper {
   public:
    Helper(Gate& gate, const Transport::Answer& answer) : gate_(gate), answer_(answer) {}
    bool call(ros::ServiceCallbackHelperCallParams& params) override {
      Received request;
      request.data = reinterpret_cast<const std::byte*>(params.request.message_start);
      request.size =
          params.request.num_bytes -
          static_cast<std::size_t>(params.request.message_start - params.request.buf.get());
      std::vector<std::byte> answer;
      bool done = false;
      gate_.pass([&] {
        answer = answer_(request);
        done = true;
      });
      // one byte that says whether it was done, the length, the answer
      const auto size = static_cast<std::uint32_t>(answer.size());
      constexpr std::size_t kHead = 1 + sizeof(size);
      params.response.num_bytes = kHead + answer.size();
      params.response.buf.reset(new std::uint8_t[kHead + answer.size()]);
      std::uint8_t* out = params.response.buf.get();
      out[0] = done ? 1 : 0;
      std::memcpy(out + 1, &size, sizeof(size));
      if (size > 0) std::memcpy(out + kHead, answer.data(), size);
      return done;
    }

   private:
    Gate& gate_;
    const Transport::Answer& answer_;
  };
  ros::AdvertiseServiceOptions options;
  options.service = entry.service.name;
  options.md5sum = entry.service.md5;
  options.datatype = entry.service.package + "/" + entry.service.type;
  options.req_datatype = options.datatype + "Request";
  options.res_datatype = options.datatype + "Response";
  options.helper = boost::make_shared<Helper>(gate_, entry.answer);
  return node_->advertiseService(options);
}

ros::Subscriber Ros1Node::subscribed(const Input& input) {
  using Event = ros::MessageEvent<const RawReceived>;
  const std::string self = ros::this_node::getName();
  const auto callback = [this, on_message = input.on_message, self](const Event& event) {
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
    gate_.pass([&] { on_message(received); });
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

}  // namespace pointflight
