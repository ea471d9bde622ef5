// Messages of any type as Fast DDS takes them: bytes.
#pragma once

#include <cstring>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <string>
#include <vector>

namespace pointflight::testing {

/// A sample of any type: CDR with its header of four bytes.
struct FastSample {
  const std::vector<std::byte>* out = nullptr;  ///< To be written.
  std::vector<std::byte> in;                    ///< That was read.
};

/// A type by its DDS name; bytes go through as they are. Fast DDS 3 has other names and signatures
/// than 2.
class FastType : public eprosima::fastdds::dds::TopicDataType {
 public:
#if POINTFLIGHT_FAST_DDS >= 3
  using Payload = eprosima::fastdds::rtps::SerializedPayload_t;
  using Key = eprosima::fastdds::rtps::InstanceHandle_t;
  using Representation = eprosima::fastdds::dds::DataRepresentationId_t;

  explicit FastType(const std::string& name) {
    set_name(name);
    max_serialized_type_size = 1024;  // grows with what is written
    is_compute_key_provided = false;
  }

  bool serialize(const void* data, Payload& payload, Representation /*way*/) override {
    return write(*static_cast<const FastSample*>(data), payload);
  }
  bool deserialize(Payload& payload, void* data) override {
    read(payload, *static_cast<FastSample*>(data));
    return true;
  }
  std::uint32_t calculate_serialized_size(const void* data, Representation /*way*/) override {
    return static_cast<std::uint32_t>(static_cast<const FastSample*>(data)->out->size());
  }
  void* create_data() override {
    return new FastSample;
  }
  void delete_data(void* data) override {
    delete static_cast<FastSample*>(data);
  }
  bool compute_key(Payload& /*payload*/, Key& /*key*/, bool /*force_md5*/) override {
    return false;
  }
  bool compute_key(const void* /*data*/, Key& /*key*/, bool /*force_md5*/) override {
    return false;
  }
#else
  using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
  using Key = eprosima::fastrtps::rtps::InstanceHandle_t;

  explicit FastType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1024;  // grows with what is written
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }

  bool serialize(void* data, Payload* payload) override {
    return write(*static_cast<FastSample*>(data), *payload);
  }
  bool deserialize(Payload* payload, void* data) override {
    read(*payload, *static_cast<FastSample*>(data));
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return
        [data] { return static_cast<std::uint32_t>(static_cast<FastSample*>(data)->out->size()); };
  }
  void* createData() override {
    return new FastSample;
  }
  void deleteData(void* data) override {
    delete static_cast<FastSample*>(data);
  }
  bool getKey(void* /*data*/, Key* /*key*/, bool /*force_md5*/) override {
    return false;
  }
#endif
  [[nodiscard]] bool is_bounded() const override {
    return false;
  }

 private:
  static bool write(const FastSample& sample, Payload& payload) {
    const auto& bytes = *sample.out;
    if (bytes.size() > payload.max_size) return false;
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.length = static_cast<std::uint32_t>(bytes.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  static void read(const Payload& payload, FastSample& sample) {
    const auto* first = reinterpret_cast<const std::byte*>(payload.data);
    sample.in.assign(first, first + payload.length);
  }
};

}  // namespace pointflight::testing
