#include "pointflight/ros/ros1/bag.hpp"

#include <fcntl.h>
#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/query.h>
#include <rosbag/view.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <map>
#include <stdexcept>

#include "pointflight/ros/ros1/raw_message.hpp"

namespace pointflight {
namespace {

// bytes: what a kill can cost; more in long recordings, because rosbag keeps an index of each chunk
// in memory until the end
constexpr std::uint32_t kChunkSize = 1u << 20;
constexpr std::uint32_t kLongChunkSize = 4u << 20;
constexpr std::uint64_t kLong = 256u << 20;  // bytes of the file

class BagWriter : public Outlet {
 public:
  BagWriter(const std::string& path, const std::string& compression)
      : path_(path), active_(path + ".active"), replaces_(::access(path.c_str(), F_OK) == 0) {
    try {
      bag_->open(active_, rosbag::bagmode::Write);
    } catch (const rosbag::BagException& error) {
      give_up();
      ::unlink(active_.c_str());  // empty: it was made for this
      throw std::runtime_error(active_ + ": cannot be written: " + error.what());
    }
    bag_->setCompression(compression == "lz4"   ? rosbag::compression::LZ4
                         : compression == "bz2" ? rosbag::compression::BZ2
                                                : rosbag::compression::Uncompressed);
    bag_->setChunkThreshold(kChunkSize);
  }

  ~BagWriter() override {
    try {
      if (bag_) bag_->close();  // without `close` it keeps the name that says so
    } catch (const rosbag::BagException&) {
      give_up();  // the disk is full: what lies there is all there will be
    }
  }

  Wire wire() const override { return Wire::kRos1; }

  int advertise(const Topic& topic) override {
    topics_.push_back(std::make_unique<Topic>(topic));
    auto header = boost::make_shared<ros::M_string>();
    (*header)["topic"] = topic.name;
    (*header)["type"] = topic.type.ros1_name();
    (*header)["md5sum"] = topic.type.md5;
    (*header)["message_definition"] = topic.type.definition;
    if (topic.latched) (*header)["latching"] = "1";
    headers_.push_back(header);
    return static_cast<int>(topics_.size()) - 1;
  }

  bool has_readers(int /*topic*/) const override { return true; }

  void send(int topic, const Bytes& bytes, std::int64_t time) override {
    const auto i = static_cast<std::size_t>(topic);
    if (!bag_) return;
    constexpr std::int64_t kSecond = 1'000'000'000;
    const ros::Time stamp(static_cast<std::uint32_t>(time / kSecond),
                          static_cast<std::uint32_t>(time % kSecond));
    try {
      bag_->write(
          topics_[i]->name, stamp, RawMessage{topics_[i].get(), bytes, nullptr}, headers_[i]);
      if (!is_long_ && bag_->getSize() > kLong) {
        is_long_ = true;
        bag_->setChunkThreshold(kLongChunkSize);  // ends the chunk: once
      }
    } catch (const rosbag::BagException& error) {
      give_up();
      throw std::runtime_error(active_ + ": writing failed: " + error.what() +
                               "; what was recorded until then is in it (rosbag reindex)");
    }
  }

  void close() override {
    if (!bag_) return;
    try {
      bag_->close();
    } catch (const rosbag::BagException& error) {
      give_up();
      throw std::runtime_error(active_ + ": writing failed: " + error.what());
    }
    bag_.reset();
    // what has appeared there since stays; a file system that knows no such rename: as before it
    const bool is_taken =
        !replaces_ &&
        ::renameat2(AT_FDCWD, active_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) != 0;
    if (is_taken && errno == EEXIST) {
      throw std::runtime_error(path_ + ": somebody has put something there; the recording is " +
                               active_);
    }
    if ((replaces_ || is_taken) && std::rename(active_.c_str(), path_.c_str()) != 0) {
      throw std::runtime_error(active_ + ": cannot be renamed to " + path_);
    }
  }

 private:
  /// The destructor of a bag that cannot be written tries again and ends the program: it is never
  /// called then.
  void give_up() { static_cast<void>(bag_.release()); }

  std::string path_, active_;
  bool replaces_;  ///< A recording of that name was there.
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  bool is_long_ = false;  ///< The file is.
  std::vector<std::unique_ptr<Topic>> topics_;
  std::vector<boost::shared_ptr<ros::M_string>> headers_;
};

/// Runs `read`; rosbag's exceptions become words for the user.
template <class Read>
auto in_words(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const rosbag::BagUnindexedException&) {
    throw std::runtime_error(path + ": was cut short and has no index; run: rosbag reindex " +
                             path);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path + ": is not a readable bag: " + error.what());
  }
}

/// Messages by their times.
class BagMessages : public MessageReader {
 public:
  BagMessages(const std::string& path, const std::vector<std::string>& topics)
      : path_(path), bag_(path, rosbag::bagmode::Read) {
    if (topics.empty()) {
      view_.addQuery(bag_);
    } else {
      view_.addQuery(bag_, rosbag::TopicQuery(topics));
    }
    at_ = view_.begin();
    count_ = view_.size();
  }

  Wire wire() const override { return Wire::kRos1; }
  double share_read() const override {
    return count_ == 0 ? 1.0 : static_cast<double>(read_) / static_cast<double>(count_);
  }
  bool next(Recorded& message) override {
    return in_words(path_, [&] {
      if (read_ == count_) return false;
      if (read_ > 0) ++at_;
      ++read_;
      const rosbag::MessageInstance& found = *at_;
      bytes_.resize(found.size());
      ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(bytes_.data()),
                                         static_cast<std::uint32_t>(bytes_.size()));
      found.write(stream);
      topic_ = found.getTopic();
      type_ = found.getDataType();
      message.topic = topic_;
      message.type = type_;
      message.time = static_cast<std::int64_t>(found.getTime().toNSec());
      message.data = bytes_.data();
      message.size = bytes_.size();
      return true;
    });
  }

 private:
  std::string path_;
  rosbag::Bag bag_;
  rosbag::View view_;
  rosbag::View::iterator at_;
  std::size_t count_ = 0;
  std::size_t read_ = 0;
  std::string topic_, type_;
  std::vector<std::byte> bytes_;
};

}  // namespace

std::unique_ptr<MessageReader> read_bag_messages(const std::string& path,
                                                 const std::vector<std::string>& topics) {
  return in_words(path, [&] { return std::make_unique<BagMessages>(path, topics); });
}

std::unique_ptr<Outlet> make_bag_writer(const std::string& path, const std::string& compression) {
  return std::make_unique<BagWriter>(path, compression);
}

RecordingInfo read_bag(const std::string& path) {
  return in_words(path, [&] {
    const rosbag::Bag bag(path, rosbag::bagmode::Read);
    rosbag::View view(bag);
    RecordingInfo info;
    info.format = "ROS 1 bag " + std::to_string(bag.getMajorVersion()) + "." +
                  std::to_string(bag.getMinorVersion());
    std::map<std::string, RecordingInfo::Topic> topics;
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      topics[connection->topic] = {connection->topic, connection->datatype, 0};
    }
    for (const rosbag::MessageInstance& message : view) {
      ++topics[message.getTopic()].messages;
      ++info.messages;
    }
    for (const auto& entry : topics) info.topics.push_back(entry.second);
    if (info.messages > 0) {
      info.start = static_cast<std::int64_t>(view.getBeginTime().toNSec());
      info.end = static_cast<std::int64_t>(view.getEndTime().toNSec());
    }
    return info;
  });
}

}  // namespace pointflight
