#include "pointflight/ros/ros2/raw_type.hpp"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace pointflight {
namespace {

constexpr std::size_t kHeader = 4;  // of CDR: how it is encoded

thread_local Pacing* current_pacing = nullptr;

/// A sample. Those that carry no data stand for the one instance that a type without keys has.
struct Sample : ddsi_serdata {
  Sample(const ddsi_sertype* its_type, ddsi_serdata_kind its_kind) : ddsi_serdata{} {
    ddsi_serdata_init(this, its_type, its_kind);
  }
  Bytes bytes;
};

const Sample& sample_of(const ddsi_serdata* data) {
  return *static_cast<const Sample*>(data);
}

std::uint32_t size_of(const ddsi_serdata* data) {
  const Bytes& bytes = sample_of(data).bytes;
  return bytes ? static_cast<std::uint32_t>(bytes->size()) : 0;
}

ddsi_serdata* sample_from(const ddsi_sertype* type,
                          ddsi_serdata_kind kind,
                          std::vector<std::byte> bytes) {
  auto* sample = new Sample(type, kind);
  sample->bytes = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  return sample;
}

/// From fragments, which may overlap.
ddsi_serdata* from_fragments(const ddsi_sertype* type,
                             ddsi_serdata_kind kind,
                             const nn_rdata* fragment,
                             std::size_t size) {
  std::vector<std::byte> bytes(size);
  std::size_t filled = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= filled) continue;
    if (fragment->min > filled || fragment->maxp1 > size) return nullptr;
    const auto* payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)) + filled - fragment->min;
    std::memcpy(bytes.data() + filled, payload, fragment->maxp1 - filled);
    filled = fragment->maxp1;
  }
  if (filled != size || (kind == SDK_DATA && size < kHeader)) return nullptr;
  return sample_from(type, kind, std::move(bytes));
}

ddsi_serdata* from_pieces(const ddsi_sertype* type,
                          ddsi_serdata_kind kind,
                          ddsrt_msg_iovlen_t count,
                          const ddsrt_iovec_t* pieces,
                          std::size_t size) {
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  for (ddsrt_msg_iovlen_t i = 0; i < count; ++i) {
    const auto* first = static_cast<const std::byte*>(pieces[i].iov_base);
    bytes.insert(bytes.end(), first, first + pieces[i].iov_len);
  }
  bytes.resize(size);
  return sample_from(type, kind, std::move(bytes));
}

/// DDS asks for whole words, past the end of what there is.
void copy_padded(const ddsi_serdata* data, std::size_t offset, std::size_t count, void* to) {
  const std::size_t size = size_of(data);
  const std::size_t there = std::min(count, size - std::min(size, offset));
  if (there > 0) std::memcpy(to, sample_of(data).bytes->data() + offset, there);
  std::memset(static_cast<std::byte*>(to) + there, 0, count - there);
}

ddsi_serdata* lend(const ddsi_serdata* data,
                   std::size_t offset,
                   std::size_t count,
                   ddsrt_iovec_t* piece) {
  piece->iov_len = count;
  if (offset + count <= size_of(data)) {
    piece->iov_base = const_cast<std::byte*>(sample_of(data).bytes->data() + offset);
  } else {
    auto* padded = new std::byte[count];
    copy_padded(data, offset, count, padded);
    piece->iov_base = padded;
  }
  return ddsi_serdata_ref(data);
}

void give_back(ddsi_serdata* data, const ddsrt_iovec_t* piece) {
  const auto* base = static_cast<const std::byte*>(piece->iov_base);
  const std::byte* first = size_of(data) > 0 ? sample_of(data).bytes->data() : nullptr;
  const std::less<> before;
  const bool own = first != nullptr && !before(base, first) && before(base, first + size_of(data));
  if (!own) delete[] base;
  ddsi_serdata_unref(data);
  if (current_pacing != nullptr) current_pacing->sent(piece->iov_len);
}

const ddsi_serdata_ops kSampleOperations = [] {
  ddsi_serdata_ops ops{};
  ops.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  ops.get_size = size_of;
  ops.from_ser = from_fragments;
  ops.from_ser_iov = from_pieces;
  ops.from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
    return new Sample(type, SDK_KEY);
  };
  ops.from_sample = [](const ddsi_sertype* type, ddsi_serdata_kind, const void*) -> ddsi_serdata* {
    return new Sample(type, SDK_KEY);
  };
  ops.to_ser = copy_padded;
  ops.to_ser_ref = lend;
  ops.to_ser_unref = give_back;
  ops.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  ops.to_untyped = [](const ddsi_serdata* data) -> ddsi_serdata* {
    auto* key = new Sample(data->type, SDK_KEY);
    key->type = nullptr;
    return key;
  };
  ops.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
    return true;
  };
  ops.free = [](ddsi_serdata* data) { delete static_cast<Sample*>(data); };
  ops.print = [](const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t size) {
    text[0] = '\0';
    static_cast<void>(size);
    return std::size_t{0};
  };
  ops.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash, bool) {
    std::memset(hash, 0, sizeof(*hash));
  };
  return ops;
}();

const ddsi_sertype_ops kTypeOperations = [] {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete type;
  };
  // samples of the application's: there are none, all are read as they are
  ops.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  ops.realloc_samples = [](void** samples, const ddsi_sertype*, void*, std::size_t, std::size_t) {
    *samples = nullptr;
  };
  ops.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  ops.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };
  ops.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  return ops;
}();

}  // namespace

RawTopic make_raw_topic(dds_entity_t participant,
                        const std::string& name,
                        const std::string& type) {
  auto* sertype = new ddsi_sertype{};
  ddsi_sertype_init_flags(sertype,
                          type.c_str(),
                          &kTypeOperations,
                          &kSampleOperations,
                          DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  sertype->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  const dds_entity_t topic =
      dds_create_topic_sertype(participant, name.c_str(), &sertype, nullptr, nullptr, nullptr);
  if (topic < 0) {
    ddsi_sertype_unref(sertype);
    throw std::runtime_error("DDS: topic " + name + " of type " + type +
                             " cannot be made: " + dds_strretcode(-topic));
  }
  return {topic, sertype};
}

bool write_raw(dds_entity_t writer, const ddsi_sertype* type, const Bytes& bytes) {
  auto* sample = new Sample(type, SDK_DATA);
  sample->bytes = bytes;
  return dds_writecdr(writer, sample) == DDS_RETCODE_OK;
}

bool take_raw(dds_entity_t reader, RawSample& sample) {
  for (;;) {
    ddsi_serdata* data = nullptr;
    if (dds_takecdr(reader, &data, 1, &sample.info, DDS_ANY_STATE) <= 0) return false;
    const bool valid = sample.info.valid_data;
    if (valid) {
      sample.bytes.resize(ddsi_serdata_size(data));
      ddsi_serdata_to_ser(data, 0, sample.bytes.size(), sample.bytes.data());
    }
    ddsi_serdata_unref(data);
    if (valid) return true;
  }
}

Pacing::Pacing(double rate) : rate_(rate) {
  current_pacing = this;
}

Pacing::~Pacing() {
  current_pacing = nullptr;
}

void Pacing::sent(std::size_t bytes) {
  const auto now = Clock::now();
  const auto cost = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(static_cast<double>(bytes) / rate_));
  free_at_ = std::max(free_at_, now) + cost;
  if (free_at_ - now > std::chrono::microseconds(100)) std::this_thread::sleep_until(free_at_);
}

}  // namespace pointflight
