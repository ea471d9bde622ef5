#pragma once

#include <ros/ros.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "pointflight/ros/common/wire.hpp"
#include "pointflight/ros/ros1/raw_message.hpp"

namespace pointflight {

/// Lets messages in until it is shut. After that none is under way any more, whatever roscpp's
/// threads still do.
class Gate {
 public:
  template <class Pass>
  void pass(const Pass& let_in) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (open_) let_in();
  }
  void shut() {
    const std::lock_guard<std::mutex> lock(mutex_);
    open_ = false;
  }

 private:
  std::mutex mutex_;
  bool open_ = true;
};

/// A roscpp node. All that asks the master runs on a thread of its own: a master that has stopped
/// holds up whoever asks it, for as long as it likes.
class Ros1Node {
 public:
  using Log = std::function<void(const std::string&)>;

  /// Throws std::runtime_error with words for the user (ROS_MASTER_URI).
  Ros1Node(std::string name, Log log);

  // before `start`
  int advertise(const Topic& topic);
  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message);
  void serve(const Service& service, Transport::Answer answer);
  void start();

  bool is_connected() const { return connected_; }
  bool has_senders() const { return has_senders_; }
  int reader_count(int topic) const;
  void send(int topic, const Bytes& bytes);
  std::uint64_t dropped() const;
  /// True once somebody outside has ended the node, or the master was none.
  bool is_over() const { return over_; }
  std::string failure() const;

  /// No message comes in any more; what runs is told to end. Returns at once.
  void stop();
  /// Leaves the graph. May take as long as the master likes. False if roscpp was left half made
  /// by an answer of the master's: then neither it nor this may be taken down.
  bool leave();

 private:
  struct Input {
    Topic topic;
    std::function<void(const Received&)> on_message;
  };

  void log(const std::string& text) const;
  void connect();
  bool find_master();
  void make_node();
  void watch();
  void look_for_senders();
  void say_dropped();
  struct Served {
    Service service;
    Transport::Answer answer;
  };

  ros::Publisher advertised(const Topic& topic);
  ros::ServiceServer served(const Served& entry);
  ros::Subscriber subscribed(const Input& input);

  std::string name_;
  Log log_;
  Gate gate_;
  std::vector<std::unique_ptr<Topic>> topics_;
  std::vector<std::shared_ptr<SentCount>> counts_;
  bool said_dropped_ = false;
  std::vector<Input> inputs_;
  std::unique_ptr<ros::NodeHandle> node_;
  std::vector<ros::Publisher> publishers_;  ///< Complete once connected.
  std::vector<ros::Subscriber> subscribers_;
  std::vector<Served> services_;
  std::vector<ros::ServiceServer> servers_;
  std::vector<bool> had_sender_;  ///< Of each subscriber, when last looked at.
  std::unique_ptr<ros::AsyncSpinner> spinner_;
  std::thread thread_;
  mutable std::mutex mutex_;
  std::string failure_;
  std::atomic<bool> connected_{false};
  std::atomic<bool> has_senders_{false};
  std::atomic<bool> over_{false};
  std::atomic<bool> stop_{false};
};

}  // namespace pointflight
